"""The film of a response: its undisturbed walks in real time."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from afo_sim.common import replacing
from afo_sim.show.style import BLUE, ink, styled
from afo_sim.show.walker_figure import look_of
from afo_sim.show.walker_poses import poses
from afo_sim.walker import CASES, Case, Response, walk_in_words

_PICTURES, _EVERY = 75, 0.08  # of the film, and time between them [s]
_WIDE, _BEHIND, _TALL = 8.0, 0.6, 1.95  # walkway, its part behind the first place, height that is seen [m]
_DOTS, _SHADES = 80, 32  # per metre, colours
_LIMBS = {"left": ("0.72", 3.5), "trunk": ("0.2", 9.0), "right": ("0.2", 4.0)}


def draw_film(response: Response, path: pathlib.Path) -> None:
    """Film the first seconds of each undisturbed walk, cases below each other, as a GIF."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    cases, frames = list(response.cases.values()), []
    with styled():
        figure = Figure(figsize=(_WIDE, _TALL * len(cases)), dpi=_DOTS, facecolor="white")
        canvas, share = FigureCanvasAgg(figure), 1.0 / len(cases)
        places = (figure.add_axes((0.0, 1.0 - (k + 1) * share, 1.0, share)) for k in range(len(cases)))
        movers = [_filmed(axis, case) for axis, case in zip(places, cases, strict=True)]
        for number in range(_PICTURES):
            for move in movers:
                move(number)
            canvas.draw()
            frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    palette = frames[-1].quantize(_SHADES)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    many: dict[str, Any] = {"append_images": others, "duration": round(1e3 * _EVERY), "loop": 0}
    with replacing(path) as temporary:
        first.save(temporary, format="GIF", save_all=True, optimize=True, **many)


def _filmed(axis: Any, case: Case) -> Callable[[int], None]:
    """A walker on its walkway; what moves it to the picture of a number."""
    time = case.walked["time"]
    seen = poses(case, np.searchsorted(time, _EVERY * np.arange(_PICTURES)).clip(max=len(time) - 1))
    axis.set(xlim=(-_BEHIND, _WIDE - _BEHIND), ylim=(-0.12, _TALL - 0.12))
    axis.axhline(0.0, color="0.3", lw=1.2)
    axis.vlines(np.arange(round(_WIDE)), -0.04, 0.0, color="0.3", lw=1.2)
    axis.set_axis_off()
    look: dict[str, Any] = {"transform": axis.transAxes, "weight": "bold", "va": "top"}
    axis.text(0.01, 0.97, CASES[case.name], color=ink(look_of(case)["color"]), **look)
    words = axis.text(0.99, 0.97, "", color="#b3261e", ha="right", **look)
    lines = {}
    for name in seen:
        colour, width = _LIMBS.get(name, (BLUE, 1.6))
        (lines[name],) = axis.plot([], [], color=colour, lw=width, solid_capstyle="round")
    (head,) = axis.plot([], [], "o", color="0.2", ms=13.0)

    def move(number: int) -> None:
        for name, line in lines.items():
            points = seen[name][number]
            line.set_data(*(points[:-1] if name == "trunk" else points)[:, [0, 2]].T)
        head.set_data(*seen["trunk"][number, -1:, [0, 2]])
        fell = case.walked.fell
        words.set_text("" if fell is None or number * _EVERY < fell else walk_in_words(case))

    return move
