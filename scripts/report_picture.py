"""The report's picture in the README: a healthy walker, a drop foot, and that foot with two orthoses.

Clearance, ankle angle and ankle moment as `afo-sim report` draws them.

    python scripts/report_picture.py [--duration "13.2 s"] [--out models/scenarios/pictures/report.png]
"""

import argparse
import io
import pathlib
from typing import Any

import matplotlib
import small_png
from matplotlib.figure import Figure
from PIL import Image

import afo_sim
from afo_sim.show import RUN_STYLES, STYLE, RunView, panels, report_figures
from afo_sim.show import RUNS as COLOURS

RUNS = {
    "walk-healthy": "healthy",
    "walk-dropfoot": "drop foot",
    "walk-dropfoot-afo": "with S1's orthosis",
    "walk-dropfoot-afo-short": "on shorter links",
}
SIZE, DPI = (2.0 * report_figures.WIDTH, 6.8), 120  # [inch], [1/inch]


def draw(figure: Any, runs: list[RunView]) -> None:
    """The first two of the report's figures, one above the other."""
    first, second = figure.subfigures(2, 1)
    report_figures.draw_walk(first.subfigures(1, 2), runs)
    report_figures.draw_moment(second.subfigures(1, 2), runs)
    for part in (first, second):
        panels.legend(part, (axis for panel in part.subfigs for axis in panel.axes))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--duration", default="13.2 s", help="of each run; its settled stride is drawn")
    place = pathlib.Path(__file__).resolve().parents[1] / "models" / "scenarios" / "pictures"
    parser.add_argument("--out", type=pathlib.Path, default=place / "report.png")
    given = parser.parse_args()
    runs = [
        RunView(label, colour, afo_sim.run(name, {"duration": given.duration}), None, style)
        for (name, label), colour, style in zip(RUNS.items(), COLOURS, RUN_STYLES, strict=False)
    ]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, layout="constrained")
        draw(figure, runs)
        drawn = io.BytesIO()
        figure.savefig(drawn, dpi=DPI, format="png")
    small_png.save(Image.open(drawn), given.out)


if __name__ == "__main__":
    main()
