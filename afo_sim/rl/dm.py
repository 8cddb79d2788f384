"""dm_control's modules, or one sentence where it is missing; and the present state's forces."""

import mujoco
import numpy as np

from afo_sim.common import missing_extra

try:
    from dm_control import mujoco as dm
    from dm_control.rl.control import PhysicsError
except ImportError as error:
    raise missing_extra(error) or error from None

__all__ = ["PhysicsError", "Present", "dm"]

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
INPUTS = int(mujoco.mjtState.mjSTATE_CTRL)


class Present:
    """A second MjData, in which the present state is solved; the first stays untouched."""

    def __init__(self, model: mujoco.MjModel):
        self.model, self.data = model, mujoco.MjData(model)
        self.row = np.full(mujoco.mj_stateSize(model, STATE), np.nan)
        self.next = np.empty_like(self.row)
        before = sum(mujoco.mj_stateSize(model, 1 << k) for k in range(INPUTS.bit_length() - 1))
        self.inputs = slice(before, before + model.nu)  # MuJoCo concatenates a state in the order of its bits

    def of(self, data: mujoco.MjData, inputs: np.ndarray | None = None) -> mujoco.MjData:
        """The solved state of `data`; good until the next call. The callbacks must be installed."""
        mujoco.mj_getState(self.model, data, self.next, STATE)
        if inputs is not None:
            self.next[self.inputs] = inputs
        if not np.array_equal(self.next, self.row):
            self.row[:] = np.nan  # should a kernel refuse it
            mujoco.mj_setState(self.model, self.data, self.next, STATE)
            mujoco.mj_forward(self.model, self.data)
            self.row[:] = self.next
        return self.data
