"""The film of a response: its undisturbed walks in real time."""

import pathlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from afo_sim.common import replacing
from afo_sim.show.style import ink, styled
from afo_sim.show.walker_figure import look_of
from afo_sim.show.walker_poses import Poses, poses
from afo_sim.walker import CASES, Case, Response, walk_in_words

_PICTURES, _EVERY = 75, 0.08  # of the film, and time between them [s]
_WIDE, _BEHIND, _TALL = 8.0, 0.6, 1.95  # walkway, its part behind the first place, height that is seen [m]
_INCHES, _DOTS, _SHADES = 8.0, 80, 32  # width of the film [inch], dots per inch, colours
_FAR, _NEAR, _MUSCLE = "0.72", "0.2", "#1054da"


def draw_film(response: Response, path: pathlib.Path) -> None:
    """Film the first seconds of each undisturbed walk, in real time, cases below each other, as a GIF."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    cases, tall = list(response.cases.values()), _INCHES * _TALL / _WIDE
    with styled():
        figure = Figure(figsize=(_INCHES, tall * len(cases)), dpi=_DOTS, facecolor="white")
        canvas = FigureCanvasAgg(figure)
        movers = []
        for k, case in enumerate(cases):
            axis = figure.add_axes((0.0, 1.0 - (k + 1) / len(cases), 1.0, 1.0 / len(cases)))
            movers.append(_filmed(axis, case))
        frames = []
        for number in range(_PICTURES):
            for move in movers:
                move(number)
            canvas.draw()
            frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    palette = frames[-1].quantize(_SHADES)
    few = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    many: dict[str, Any] = {"append_images": few[1:], "duration": round(1e3 * _EVERY), "loop": 0}
    with replacing(path) as temporary:
        few[0].save(temporary, format="GIF", save_all=True, optimize=True, **many)


def _filmed(axis: Any, case: Case) -> Callable[[int], None]:
    """A walker on its walkway; what moves it to the picture of a number."""
    time = case.walked["time"]
    last = len(time) - 1
    rows = [min(int(np.searchsorted(time, k * _EVERY)), last) for k in range(_PICTURES)]
    seen = poses(case, rows)
    axis.axhline(0.0, color="0.3", lw=1.2)
    axis.set(xlim=(-_BEHIND, _WIDE - _BEHIND), ylim=(-0.12, _TALL - 0.12))
    axis.vlines(np.arange(round(_WIDE)), -0.04, 0.0, color="0.3", lw=1.2)
    axis.set_axis_off()
    heading: dict[str, Any] = {"weight": "bold", "color": ink(look_of(case)["color"])}
    axis.text(0.01, 0.88, CASES[case.name], transform=axis.transAxes, **heading)
    words = axis.text(0.99, 0.88, "", transform=axis.transAxes, ha="right", color="#b3261e")
    look: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
    styles = [(_FAR, 4.0), (_FAR, 2.2), (_NEAR, 9.0), (_NEAR, 5.0), (_NEAR, 2.6)]
    lines = [axis.plot([], [], color=colour, lw=width, **look)[0] for colour, width in styles]
    lines += [axis.plot([], [], color=_MUSCLE, lw=1.6, **look)[0] for _ in seen.muscles]
    head = axis.plot([], [], "o", color=_NEAR, ms=13.0)[0]

    def move(number: int) -> None:
        for line, points in zip(lines, _lines(seen, number), strict=True):
            line.set_data(points[:, 0], points[:, 2])
        head.set_data(seen.trunk[number, 2:, 0], seen.trunk[number, 2:, 2])
        fallen = case.walked.fell is not None and number * _EVERY >= case.walked.fell
        words.set_text(walk_in_words(case) if fallen else "")

    return move


def _lines(seen: Poses, number: int) -> Iterator[np.ndarray]:
    """Other leg and foot, trunk, the device's leg and foot, its muscles, at a picture."""
    right, left = seen.legs["right"][number], seen.legs["left"][number]
    for leg, before in ((left, ()), (right, (seen.trunk[number, :2],))):
        yield from before
        yield leg[:3]
        yield leg[[2, 3, 4, 5, 6, 4, 2]]
    yield from (path[number] for path in seen.muscles.values())
