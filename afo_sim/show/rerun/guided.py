"""Paths that run through points and around surfaces, as lines in space."""

from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim.description.orthosis import MuscleGroup
from afo_sim.model.paths import path_points
from afo_sim.show.mountings import Mountings
from afo_sim.show.rerun.source import Columns


def guided_lines(
    model: mujoco.MjModel, block: Columns, groups: Mapping[str, MuscleGroup], mountings: Mountings
) -> dict[str, np.ndarray]:
    """Lines of the muscles whose path has points or surfaces, at the coordinates of a block of rows.

    Units: returns [m].
    """
    names = [name for name, group in groups.items() if group.path]
    if not names:
        return {}
    data = mujoco.MjData(model)
    qpos = np.column_stack([block[f"qpos/{model.joint(j).name}"] for j in range(model.njnt)])
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for k, row in enumerate(qpos):
        mountings.place({anchor: float(block[column][k]) for anchor, column in mountings.columns.items()})
        data.qpos[:] = row
        mujoco.mj_fwdPosition(model, data)
        for name in names:
            found[name].append(path_points(model, data, name))
    mountings.place({})
    return {name: _padded(lines) for name, lines in found.items()}


def _padded(lines: list[np.ndarray]) -> np.ndarray:
    """Lines of different numbers of places as one array."""
    most = max(map(len, lines), default=0)
    return np.array([np.concatenate([x, np.repeat(x[-1:], most - len(x), axis=0)]) for x in lines])
