"""Reading panels of figures back."""

import gc
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from afo_sim.common import InputError
from afo_sim.show import video
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording


def panel(draw: Any, recording: Recording) -> Any:
    axis = Figure().subplots()
    draw(axis, [alone(recording)])
    return axis


def lines(axis: Any) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in axis.lines}


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
