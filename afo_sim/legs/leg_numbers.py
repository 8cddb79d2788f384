"""What a leg weighs and measures, and remarks on numbers that no leg has: another unit, as a rule."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from afo_sim.common import Notice
from afo_sim.legs.cutting import ANKLE, FOOT, SHANK
from afo_sim.legs.extent import outline
from afo_sim.legs.tree import Part, Tree, moved

# Share of a segment's reach that its radius of gyration has at least; feet and shanks have 0.3 to 0.6.
LEAST_GYRATION = 0.1
WIDEST_GYRATION = 0.3  # [m] radius of gyration of a segment without shapes; the longest shank has 0.15
NARROW_RANGE = np.radians(5.0)  # range of motion of an ankle


@dataclass(frozen=True, eq=False)
class Segment:
    """A rigid group: mass [kg], centre of mass from the ankle [m] (3,), inertia about it [kg·m²] (3, 3)."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, leg: Tree, parts: list[Part], root: str = SHANK) -> Self:
        """Of several parts of a leg whose `root` has its origin at the ankle, joints at zero."""
        mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
        ankle = leg.parts[root].pose[:3, 3]
        for part in parts:
            pose = leg.world_pose(part.name)
            at = moved(pose, part.centre) - ankle
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
        shank, foot = (Segment.of(leg, parts) for parts in leg.split(SHANK, FOOT))
        stops = leg.joints()[ANKLE][1].range
        assert stops is not None
        return cls(shank, foot, float(foot.inertia[1, 1]), stops)


def doubtful_notes(leg: Tree, numbers: LegNumbers) -> list[Notice]:
    """Remarks on inertias that do not go with the shapes, and on stops that lie close together."""
    found = []
    shank, foot = leg.split(SHANK, FOOT)
    ankle = leg.parts[SHANK].pose[:3, 3]
    for name, parts, segment in (("shank", shank, numbers.shank), ("foot", foot, numbers.foot)):
        points = outline(leg, parts, points=False) - ankle
        at, shaped = segment.centre, len(points) > 1
        reach = float(np.linalg.norm(points - at, axis=1).max()) if shaped else WIDEST_GYRATION
        central = segment.inertia - segment.mass * (at @ at * np.eye(3) - np.outer(at, at))
        gyration = float(np.sqrt(max(np.linalg.eigvalsh(central)[-1], 0.0) / segment.mass))
        if gyration > reach or (shaped and gyration < LEAST_GYRATION * reach):
            beside = (
                f"its shapes reach {1000 * reach:.4g} mm from there"
                if shaped
                else "no shank or foot has that"
            )
            words = f"the {{subject}}'s inertia gives a radius of gyration of {1000 * gyration:.4g} mm about "
            words += f"its centre of mass, and {beside}: is the inertia in kg m2, and about the centre of "
            words += "mass?"
            found.append(Notice("inertia-doubtful", words, subject=name, gyration=gyration, reach=reach))
    low, high = numbers.range
    if high - low < NARROW_RANGE:
        moves = f"the ankle moves by {np.degrees(high - low):.2g} deg only"
        words = f"{moves}: are its stops radians, and read as degrees?"
        found.append(Notice("range-narrow", words, subject="ankle", low=low, high=high))
    return found
