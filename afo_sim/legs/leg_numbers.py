"""What a leg weighs and measures, from its tree."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from afo_sim.legs.cutting import ANKLE, FOOT, SHANK
from afo_sim.legs.extent import moved
from afo_sim.legs.tree import Part, Tree


@dataclass(frozen=True, eq=False)
class Segment:
    """A rigid group: mass [kg], centre of mass from the ankle [m] (3,), inertia about it [kg·m²] (3, 3).

    It is about the ankle as well. Axes are x forward, y left, z up, at an ankle angle of zero.
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, leg: Tree, parts: list[Part], root: str = SHANK) -> Self:
        """Of several parts of a leg whose `root` has its origin at the ankle, joints at zero.

        I = Σ Rᵢ Iᵢ Rᵢᵀ + mᵢ (|cᵢ|² 1 − cᵢ cᵢᵀ)   about the ankle
        """
        mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
        ankle = leg.parts[root].pose[:3, 3]
        for part in parts:
            pose = leg.world_pose(part.name)
            at = moved(pose, part.centre[None])[0] - ankle
            mass += part.mass
            moment += part.mass * at
            inertia += pose[:3, :3] @ part.inertia @ pose[:3, :3].T
            inertia += part.mass * (at @ at * np.eye(3) - np.outer(at, at))
        return cls(mass, moment / mass if mass > 0.0 else moment, inertia)


@dataclass(frozen=True, eq=False)
class LegNumbers:
    """Of a leg: its two segments, inertia of the foot about the ankle's axis [kg·m²], stops [rad]."""

    shank: Segment
    foot: Segment
    about_ankle: float
    range: tuple[float, float]

    @classmethod
    def of(cls, leg: Tree) -> Self:
        """Of a leg as `cut` gives it."""
        foot = leg.below(FOOT)
        names = {part.name for part in foot}
        shank = [part for part in leg.below(SHANK) if part.name not in names]
        segment = Segment.of(leg, foot)
        stops = leg.joints()[ANKLE][1].range
        assert stops is not None
        return cls(Segment.of(leg, shank), segment, float(segment.inertia[1, 1]), stops)
