"""A tree of rigid parts and joints, whatever file it came from, with poses and names; SI, plain numbers."""

import pathlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

import mujoco
import numpy as np

from afo_sim.common import InputError, Json, Mixed, Notice, refuse

JointKind = Literal["hinge", "slide", "ball", "free"]
# Of a part on a joint [kg], [kg·m²]: MuJoCo takes less than 1e-15 for none, and these move nothing else.
LEAST_MASS, LEAST_INERTIA = 1e-12, 1e-14
ShapeKind = Literal["box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh"]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between a part and its parent."""

    name: str
    kind: JointKind
    axis: np.ndarray  # in the part's axes, of length one (3,)
    position: np.ndarray  # in the part's axes [m] (3,)
    range: tuple[float, float] | None = None  # stops [rad] or [m]; None without stops
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    stiffness: float = 0.0
    spring_reference: float = 0.0  # where its spring rests
    zero: float = 0.0  # its coordinate in the posture that the tree stands in


@dataclass(frozen=True, eq=False)
class Shape:
    """What a part looks like."""

    name: str
    kind: ShapeKind
    pose: np.ndarray  # in the part's axes (4, 4)
    size: np.ndarray  # as MuJoCo's geom_size [m] (3,); of no meaning for a mesh
    vertices: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # [m] (n, 3)
    faces: np.ndarray = field(default_factory=lambda: np.empty((0, 3), dtype=int))  # (m, 3)
    rgba: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)
    touches: bool = False  # there for contact, beside those that are seen


@dataclass(frozen=True, eq=False)
class Part:
    """A rigid body, in its own axes."""

    name: str
    parent: str | None  # None of a root
    pose: np.ndarray  # in the parent's axes, or the world's, with each joint at its `zero` (4, 4)
    mass: float  # [kg]
    centre: np.ndarray  # of mass [m] (3,)
    inertia: np.ndarray  # about that centre [kg·m²] (3, 3)
    joints: tuple[Joint, ...] = ()  # between it and its parent; none where it is fixed
    shapes: tuple[Shape, ...] = ()
    points: dict[str, np.ndarray] = field(default_factory=dict)  # named places [m] (3,)


@dataclass(frozen=True, eq=False)
class Tree:
    """Parts, parents before children, and what else the file holds."""

    file: pathlib.Path | None  # it came from
    parts: dict[str, Part]  # by name
    beside: dict[str, tuple[str, ...]] = field(default_factory=dict)  # what else the file holds, in words
    notes: tuple[str, ...] = ()  # remarks on reading it, for the user
    couplings: tuple[tuple[str, str, float, float], ...] = ()  # joint, the other, offset, multiplier

    def children(self, name: str) -> list[Part]:
        """The direct children of a part."""
        return [part for part in self.parts.values() if part.parent == name]

    def below(self, name: str) -> list[Part]:
        """A part and all its descendants, parents first."""
        found = {name}
        for part in self.parts.values():
            if part.parent in found:
                found.add(part.name)
        return [part for part in self.parts.values() if part.name in found]

    def upward(self, name: str | None) -> Iterator[Part]:
        """A part and all its ancestors."""
        while name is not None:
            yield self.parts[name]
            name = self.parts[name].parent

    def way(self, above: str, name: str) -> list[Part]:
        """Parts from below one down to another; empty if that is no descendant."""
        chain = list(self.upward(name))[::-1]
        names = [part.name for part in chain]
        return chain[names.index(above) + 1 :] if above in names else []

    def split(self, shank: str, foot: str) -> tuple[list[Part], list[Part]]:
        """The shank's descendants without the foot, and the foot with its descendants."""
        of_foot = self.below(foot)
        return [part for part in self.below(shank) if part not in of_foot], of_foot

    def line(self, joint: str) -> tuple[np.ndarray, np.ndarray]:
        """Axis of a joint in the world (3,), and its place [m] (3,)."""
        part, found = self.joints()[joint]
        pose = self.world_pose(part.name)
        return pose[:3, :3] @ found.axis, moved(pose, found.position)

    def world_pose(self, name: str) -> np.ndarray:
        """Pose of a part in the world (4, 4)."""
        part = self.parts[name]
        return part.pose if part.parent is None else self.world_pose(part.parent) @ part.pose

    def joints(self) -> dict[str, tuple[Part, Joint]]:
        """Every joint by name, with the part that it moves."""
        return {joint.name: (part, joint) for part in self.parts.values() for joint in part.joints}


def pose_of(position: np.ndarray, turn: np.ndarray | None = None) -> np.ndarray:
    """A pose (4, 4) of a rotation (3, 3), or without a turn."""
    found = np.eye(4)
    found[:3, :3] = found[:3, :3] if turn is None else turn
    found[:3, 3] = position
    return found


def moved(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (n, 3), or one (3,), from the axes of a pose (4, 4) into those in which it is stated [m]."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def centre_of(tree: Tree, parts: list[Part]) -> np.ndarray | None:
    """Centre of mass of several parts in the world [m] (3,); None without mass."""
    mass = sum(part.mass for part in parts)
    if not mass > 0.0:
        return None
    moments = [part.mass * moved(tree.world_pose(part.name), part.centre) for part in parts]
    return np.asarray(np.sum(moments, axis=0) / mass)


def turn_of(quaternion: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) of a quaternion w, x, y, z (4,)."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.asarray(quaternion, dtype=float))
    return turn.reshape(3, 3)


def quaternion_of(turn: np.ndarray) -> np.ndarray:
    """A quaternion w, x, y, z (4,) of a rotation (3, 3)."""
    found = np.empty(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(turn, dtype=float).ravel())
    return found


def turned_about(axis: np.ndarray, centre: np.ndarray, angle: float) -> np.ndarray:
    """Pose of a turn [rad] about an axis of length one through a centre [m] (4, 4)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + (np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)
    return pose_of(centre - turn @ centre, turn)


def own_names(given: Iterable[str], fallback: Iterable[str]) -> list[str]:
    """Each given name, or its fallback where it is empty; no two are the same."""
    given = list(given)
    taken = set(filter(None, given))
    used: set[str] = set()
    found = []
    for name, other in zip(given, fallback, strict=True):
        chosen = name if name and name not in used else free_name(name or other, taken)
        used.add(chosen)
        taken.add(chosen)
        found.append(chosen)
    return found


def free_name(wanted: str, taken: Iterable[str]) -> str:
    """A name that is not taken: the wanted one, or that with a number."""
    taken = set(taken)
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted}_{number}"
    return name


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names in a sentence; of many the first ones and how many more there are."""
    names = list(names)
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def reading_note(code: str, text: str, names: Iterable[str], **data: Json) -> Notice:
    """A notice of reading or writing a file; {names} in the text is replaced by the names."""
    names = list(names)
    return Notice(code, text, subject=listed(names), names=listed(names), all=names, severity="note", **data)


def check_finite(tree: Tree) -> None:
    """Refuse a tree with a number that is not finite."""
    numbers: list[tuple[str, Mixed]] = []
    for part in tree.parts.values():
        name = f"part {part.name!r}"
        numbers += [(f"{name}: point {point!r}", at) for point, at in part.points.items()]
        owners = [(name, part), *((f"joint {joint.name!r}", joint) for joint in part.joints)]
        owners += [(f"{name}: shape {shape.name!r}", shape) for shape in part.shapes]
        numbers += [(f"{owner}: {key}", value) for owner, one in owners for key, value in vars(one).items()]
    refuse(
        InputError("is not finite", file=tree.file, field=field)
        for field, value in numbers
        if np.asarray(value).dtype.kind == "f" and not np.isfinite(value).all()
    )
