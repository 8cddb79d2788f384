"""A tree of rigid parts and joints, whatever file it came from; SI, plain numbers."""

import pathlib
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

JointKind = Literal["hinge", "slide", "ball", "free"]
ShapeKind = Literal["box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh"]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between a part and its parent.

    axis : in the part's axes, of length one (3,)
    position : in the part's axes [m] (3,)
    range : stops [rad] or [m]; None without stops
    stiffness, spring_reference : about which its spring rests
    zero : its coordinate in the posture that the tree stands in
    """

    name: str
    kind: JointKind
    axis: np.ndarray
    position: np.ndarray
    range: tuple[float, float] | None = None
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    stiffness: float = 0.0
    spring_reference: float = 0.0
    zero: float = 0.0


@dataclass(frozen=True, eq=False)
class Shape:
    """What a part looks like.

    pose : in the part's axes (4, 4)
    size : as MuJoCo's geom_size [m] (3,); half lengths and radii; of no meaning for a mesh
    vertices, faces : of a mesh [m] (n, 3), (m, 3); empty otherwise
    """

    name: str
    kind: ShapeKind
    pose: np.ndarray
    size: np.ndarray
    vertices: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    faces: np.ndarray = field(default_factory=lambda: np.empty((0, 3), dtype=int))
    rgba: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)


@dataclass(frozen=True, eq=False)
class Part:
    """A rigid body.

    parent : name of the part that it hangs on; None of a root
    pose : in the parent's axes, or the world's, in the posture where each joint is at its `zero` (4, 4)
    mass [kg]; centre, of mass [m] (3,); inertia about that centre [kg·m²] (3, 3); in its own axes
    joints : between it and its parent; none where it is fixed
    points : named places in its axes [m] (3,)
    """

    name: str
    parent: str | None
    pose: np.ndarray
    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    joints: tuple[Joint, ...] = ()
    shapes: tuple[Shape, ...] = ()
    points: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Tree:
    """Parts, parents before children, and what else the file holds.

    file : it came from
    parts : by name
    beside : what else stands in the file, in words by kind: {"tendons": ("soleus_r", …), "actuators": …}
    notes : remarks on reading it, for the user
    """

    file: pathlib.Path | None
    parts: dict[str, Part]
    beside: dict[str, tuple[str, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def children(self, name: str) -> list[Part]:
        """The parts that hang on a part directly."""
        return [part for part in self.parts.values() if part.parent == name]

    def below(self, name: str) -> list[Part]:
        """A part and all that hangs on it, parents first."""
        found = {name}
        for part in self.parts.values():
            if part.parent in found:
                found.add(part.name)
        return [part for part in self.parts.values() if part.name in found]

    def world_pose(self, name: str) -> np.ndarray:
        """Pose of a part in the world (4, 4)."""
        part = self.parts[name]
        return part.pose if part.parent is None else self.world_pose(part.parent) @ part.pose

    def joints(self) -> dict[str, tuple[Part, Joint]]:
        """Every joint by name, with the part that it moves."""
        return {joint.name: (part, joint) for part in self.parts.values() for joint in part.joints}
