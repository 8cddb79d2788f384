"""An MjData for short calculations, kept: to make one takes as long as a hundred steps."""

import threading

import mujoco
import numpy as np

KEPT = 4  # layouts in a thread

_own = threading.local()


def scratch(model: mujoco.MjModel) -> mujoco.MjData:
    """An MjData in the state of a new one; it is good until this thread asks for the next of its layout."""
    kept: dict[bytes, mujoco.MjData] = _own.__dict__.setdefault("kept", {})
    sizes = model._sizes.tobytes()  # all of them: some are in no attribute of their own
    data = kept.pop(sizes, None)
    if data is None:
        data = mujoco.MjData(model)
        while len(kept) >= KEPT:
            del kept[next(iter(kept))]
    else:
        mujoco.mj_resetData(model, data)
    kept[sizes] = data  # the last used comes last
    return data


def jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """How fast each actuator's path grows with each joint's coordinate (n_actuator, n_dof)."""
    dense = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        dense, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    return dense
