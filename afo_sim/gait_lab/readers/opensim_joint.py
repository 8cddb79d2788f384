"""Kinematics of one OpenSim joint: its coordinates → where the child body stands in the parent body."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_function import Function


@dataclass(frozen=True, eq=False)
class Pose:
    """Places of one frame in another, over time; a single place has n = 1."""

    rotation: np.ndarray  # (n, 3, 3)
    position: np.ndarray  # of the frame's origin [m] (n, 3)

    def __matmul__(self, inner: "Pose") -> "Pose":
        """The place of `inner`'s frame, one frame further out."""
        return Pose(self.rotation @ inner.rotation, self.point(inner.position))

    def inverse(self) -> "Pose":
        """The outer frame's place in this one."""
        back = np.swapaxes(self.rotation, -1, -2)
        return Pose(back, -np.einsum("nij,nj->ni", back, self.position))

    def point(self, local: np.ndarray) -> np.ndarray:
        """A point of the frame (3,) or (n, 3) [m] → the same in the outer frame (n, 3) [m]."""
        turned = (self.rotation @ np.atleast_2d(local)[..., None])[..., 0]
        return np.asarray(turned + self.position)


@dataclass(frozen=True, eq=False)
class Coordinate:
    """A coordinate of a joint."""

    name: str
    default: float  # [rad] or [m]
    limits: tuple[float, float]  # that the model states [rad] or [m]
    rotational: bool
    locked: bool = False  # it keeps its default


@dataclass(frozen=True, eq=False)
class MotionAxis:
    """A rotation about, or a translation along, an axis of the joint's parent frame."""

    axis: np.ndarray  # of length 1, as OpenSim makes every axis (3,)
    coordinates: tuple[str, ...]
    amount: Function  # [rad] or [m]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between two bodies, in either of OpenSim's layouts."""

    name: str
    kind: str  # "CustomJoint", "PinJoint", …
    parent: str  # body
    child: str  # body
    in_parent: Pose  # the joint's frame on the parent body
    in_child: Pose  # the joint's frame on the child body
    coordinates: tuple[Coordinate, ...]
    rotations: tuple[MotionAxis, ...]  # one after the other, each about an axis that the last one turned
    translations: tuple[MotionAxis, ...]
    refused: str = ""  # why its kinematics are not known

    def pose(self, values: Mapping[str, np.ndarray]) -> Pose:
        """The child body in the parent body.

        Units: values [rad] (n,).
        """
        if self.refused:
            raise InputError(self.refused, field=f"joint {self.name}", value=self.kind)
        known = {c.name: np.atleast_1d(values.get(c.name, np.asarray(c.default))) for c in self.coordinates}
        try:
            return self.in_parent @ self._motion(known) @ self.in_child.inverse()
        except InputError as error:
            raise InputError(
                error.problem, field=f"joint {self.name}", value=error.value, allowed=error.allowed
            ) from None

    def _motion(self, values: Mapping[str, np.ndarray]) -> Pose:
        from scipy.spatial.transform import Rotation

        count = max((len(value) for value in values.values()), default=1)
        rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        for part in self.rotations:
            angle = part.amount([values[name] for name in part.coordinates])
            turn = np.broadcast_to(angle, count)[:, None] * part.axis
            rotation = rotation @ _matrix(Rotation.from_rotvec, turn)
        for part in self.translations:
            way = part.amount([values[name] for name in part.coordinates])
            position = position + np.broadcast_to(way, count)[:, None] * part.axis
        return Pose(rotation, position)


def offset_pose(translation: np.ndarray, orientation: np.ndarray) -> Pose:
    """A fixed frame: its origin [m] (3,), and its turns about its own x, y, z in this order [rad] (3,)."""
    from scipy.spatial.transform import Rotation

    return Pose(Rotation.from_euler("XYZ", orientation).as_matrix()[None], translation[None])


def _matrix(make: Callable, turn: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3), NaN where the angle is."""
    known = np.isfinite(turn).all(axis=1)
    found = np.full((len(turn), 3, 3), np.nan)
    if known.any():
        found[known] = make(turn[known]).as_matrix()
    return found
