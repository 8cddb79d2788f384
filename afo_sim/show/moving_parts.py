"""Cuff and plate in space: as they give, they move along their segments towards the pull of the muscles."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from afo_sim.description import WORN, MuscleGroup


@dataclass(frozen=True)
class Carriage:
    """Motion of even speed over a stride: x = start + length · strides [m]."""

    start: float
    length: float
    ends: tuple[float, float]
    stride_time: float

    @classmethod
    def beside(cls, time: np.ndarray, walked: np.ndarray, x: np.ndarray) -> Self:
        """The carriage that stays nearest to an ankle."""
        basis = np.column_stack([np.ones_like(walked), walked])
        (start, length), *_ = np.linalg.lstsq(basis, x, rcond=None)
        took, count = float(np.ptp(time)), float(np.ptp(walked))
        ends = float(start + length * walked[0]), float(start + length * walked[-1])
        return cls(float(start), float(length), ends, took / count if count > 0.0 else 1.0)

    def at(self, walked: np.ndarray) -> np.ndarray:
        """Its x at strides (n,) [m]."""
        return self.start + self.length * walked


class Mountings:
    """The cuff and the plate of a model, and their displacements from a recording."""

    def __init__(
        self, model: mujoco.MjModel, groups: Mapping[str, MuscleGroup], columns: Collection[str]
    ) -> None:
        self.model = model
        self.columns = {a: f"cuff/{a}/displacement" for a in WORN if f"cuff/{a}/displacement" in columns}
        self._bodies: dict[str, list[int]] = {}
        for anchor in self.columns:  # what moves with it: the ends of the muscles, and the cuff or the plate
            ends = model.body(f"{anchor}_anchors")
            beside, part = np.flatnonzero(model.body_parentid == ends.parentid[0]), f"{WORN[anchor]}_"
            moved = [b for b in beside if b == ends.id or model.body(b).name.startswith(part)]
            self._bodies[anchor] = list(map(int, moved))
        self._home = model.body_pos.copy()
        self._address, self._joints = model.jnt_qposadr, joint_columns(model)
        self._towards = {anchor: _pull(model, groups, anchor) for anchor in self.columns}

    def place(self, given: Mapping[str, float]) -> None:
        """Put each anchor where it is when it has given so far [m]; those left out are at home."""
        for anchor, bodies in self._bodies.items():
            self.model.body_pos[bodies] = self._home[bodies]
            self.model.body_pos[bodies, 2] += self._towards[anchor] * given.get(anchor, 0.0)

    def pose(self, data: mujoco.MjData, at: Callable[[str], float]) -> None:
        """Put joints, anchors and tendons where the values of the columns have them."""
        data.qpos[self._address] = [at(name) for name in self._joints]
        self.place({anchor: at(name) for anchor, name in self.columns.items()})
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_tendon(self.model, data)


def joint_columns(model: mujoco.MjModel) -> list[str]:
    """The columns of a recording that have its joints' coordinates."""
    return [f"qpos/{model.joint(j).name}" for j in range(model.njnt)]


def padded(lines: list[np.ndarray]) -> np.ndarray:
    """Lines of different numbers of places as one array."""
    most = max(map(len, lines), default=0)
    return np.array([np.concatenate([x, np.repeat(x[-1:], most - len(x), axis=0)]) for x in lines])


def _pull(model: mujoco.MjModel, groups: Mapping[str, MuscleGroup], anchor: str) -> float:
    """+1 where the muscles pull an anchor up along its segment, −1 where they pull it down."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    body = model.body(f"{anchor}_anchors").id
    upward = data.xmat[body].reshape(3, 3)[:, 2]
    total = 0.0
    for name in [name for name, group in groups.items() if group.pulley is None]:
        ends = [model.site(f"{name}_{end}").id for end in ("origin", "insertion")]
        for here, there in (ends, ends[::-1]):
            if model.site_bodyid[here] == body:
                total += float(upward @ (data.site_xpos[there] - data.site_xpos[here]))
    return float(np.sign(total))
