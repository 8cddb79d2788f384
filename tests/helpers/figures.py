"""Reading panels of figures back."""

import gc
import itertools
import pathlib
from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.show import video
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording


def panel(draw: Any, recording: Recording) -> Any:
    from matplotlib.figure import Figure

    axis = Figure().subplots()
    draw(axis, [alone(recording)])
    return axis


def lines(axis: Any) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in axis.lines}


def leave_blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write pictures with nothing on them: for a test that asks only whether they are there."""
    from matplotlib.figure import Figure

    save = Figure.savefig

    def save_blank(figure: Figure, *place: object, **options: object) -> None:
        save(Figure(figsize=(1.0, 1.0)), *place, **options | {"dpi": 20})

    monkeypatch.setattr(Figure, "savefig", save_blank)


def lay_out(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures as they are laid out for their files from now on; the files stay empty."""
    from matplotlib.figure import Figure

    found: list[Any] = []

    def save(figure: Any, path: pathlib.Path, **_: object) -> None:
        figure.draw_without_rendering()
        path.touch()
        found.append(figure)

    monkeypatch.setattr(Figure, "savefig", save)
    return found


def opengl_missing() -> str:
    """Why no picture can be drawn here, or nothing."""
    xml = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    try:
        opengl, context = video.opengl_context(video.scenery(xml, 16, 16), 16, 16)
    except InputError as error:
        reason = str(error)
    else:
        reason = ""
        context.free()
        opengl.free()
    gc.collect()  # the half-made context of MuJoCo's GLFW backend complains when it goes
    return reason


def unreadable(figure: Any) -> list[str]:
    """Words beyond a figure's edge, words on each other, and legends on a curve of their own figure."""
    figure.draw_without_rendering()
    page, found = figure.bbox.padded(1.0), []
    texts = [(text.get_text(), text.get_window_extent().padded(-1.0)) for text in _seen(figure)]
    for words, box in texts:
        if not (page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1):
            found.append(f"{words!r} is beyond the edge")
    for (one, a), (other, b) in itertools.combinations(texts, 2):
        if min(a.width, a.height, b.width, b.height) > 0.0 and a.overlaps(b):
            found.append(f"{one!r} and {other!r} lie on each other")
    for legend in (axis.get_legend() for axis in figure.axes if axis.get_legend()):
        box = legend.get_window_extent().padded(-2.0)
        for line in (line for axis in figure.axes for line in axis.lines if len(line.get_xdata())):
            if _reaches(line, box):
                found.append(f"a legend lies on {line.get_label()!r}")
    return found


def _seen(figure: Any) -> list[Any]:
    """The texts that a figure shows: of ticks those within their axis."""
    from matplotlib.axis import Axis
    from matplotlib.text import Annotation, Text

    hidden: set[Any] = set()
    for axis in figure.findobj(Axis):
        shown = axis.get_visible() and axis.axes.get_visible() and axis.axes.axison
        ticks = [
            label for tick in (*axis.majorTicks, *axis.minorTicks) for label in (tick.label1, tick.label2)
        ]
        hidden |= {*ticks, axis.label, axis.offsetText} - ({axis.label, axis.offsetText} if shown else set())
        hidden -= {each for tick in axis._update_ticks() if shown for each in (tick.label1, tick.label2)}
    return [
        text
        for text in figure.findobj(Text)
        if text not in hidden
        and text.get_visible()
        and text.get_text().strip()
        and (text.axes is None or text.axes.get_visible())
        and not (isinstance(text, Annotation) and not text._check_xy(figure._get_renderer()))
    ]


def _reaches(line: Any, box: Any) -> bool:
    """Whether a curve or one of its marks lies in a box, and within its panel."""
    if line.get_transform() != line.axes.transData:  # across the whole panel: an event, no curve
        return False
    points = line.get_transform().transform(np.asarray(line.get_xydata(), float))
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) > 1 and line.get_linestyle() not in ("None", " ", ""):
        rows = np.linspace(0.0, len(points) - 1.0, max(len(points), 2000))
        points = np.column_stack([np.interp(rows, np.arange(len(points)), points[:, k]) for k in (0, 1)])
    panel = line.axes.bbox
    low = np.maximum((box.x0, box.y0), (panel.x0, panel.y0))
    high = np.minimum((box.x1, box.y1), (panel.x1, panel.y1))
    return bool(((points > low) & (points < high)).all(axis=1).any())
