"""The README's film: a drop foot without and with S1's device, one settled stride in slow motion.

    python scripts/readme_film.py [--out docs/drop_foot.gif]

The first wears the shoe that the verdict compares with, the second the device's own outsole. There is no
floor: a toe that trips passes through. What is drawn as recorded: `afo_sim.show.walking_figure`.
"""

import argparse
import pathlib
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import afo_sim
from afo_sim.show import STYLE, RunView
from afo_sim.show.walking_figure import NEAR, WalkingFigure, draw_figure, reference_view

FRAMES, LASTS = 96, 8.0  # of the film, and its length [s]
COLOURS_OF_ALL = 32
MOST = 1_500_000  # [bytes]


def frame(walkers: list[WalkingFigure], phase: float) -> Image.Image:
    """The walkers side by side."""
    figure = Figure(figsize=(8.0, 5.0), dpi=100, facecolor="white")
    for place, walker in enumerate(walkers):
        axis = figure.add_axes((0.5 * place, 0.0, 0.5, 0.92))
        draw_figure(axis, walker, phase)
        axis.set_title(walker.view.label, fontsize=13, weight="bold", pad=2.0)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "docs" / "drop_foot.gif"
    parser.add_argument("--out", type=pathlib.Path, default=place)
    out = parser.parse_args().out
    run = afo_sim.run("walk-dropfoot-afo")
    without = reference_view(run, "in a trainer, without the device", NEAR)
    assert without is not None
    walkers = [WalkingFigure.of(view) for view in (without, RunView("with S1's device", NEAR, run))]
    with matplotlib.rc_context(STYLE):
        frames = [frame(walkers, phase) for phase in np.linspace(0.0, 1.0, FRAMES, endpoint=False)]
    palette = frames[int(0.86 * FRAMES)].quantize(COLOURS_OF_ALL)
    first, *others = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames)
    many: dict[str, Any] = {"append_images": others, "duration": 1e3 * LASTS / FRAMES, "loop": 0}
    first.save(out, save_all=True, optimize=True, **many)
    if out.stat().st_size > MOST:
        raise SystemExit(f"{out} is too large: {out.stat().st_size} bytes, allowed {MOST}")


if __name__ == "__main__":
    main()
