"""Reading panels of figures back."""

import gc
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
