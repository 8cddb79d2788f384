"""A compiled scenario as MJCF that begins in a state."""

import mujoco
import numpy as np

from afo_sim.model import Built, started_xml


def started_mjcf(built: Built, state: np.ndarray, *, plugin: bool = False) -> str:
    """The scenario's model, an mjSTATE_INTEGRATION row as its key."""
    data = mujoco.MjData(built.model)
    mujoco.mj_setState(built.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    return started_xml(built.xml, data, plugin=plugin)
