"""The ground's force beside a drawn foot, and whether the drawn sole is where the force acts.

The recorded force acts whatever the simulated foot does. So the sole can be above the floor, where the
ankle's path was derived or the ankle is bent otherwise than in the recorded walk, or below it, where the foot
slaps. The floor of contact is laid where the recorded foot bears its force, so it can be above 0 as well. An
arrow without a sole at the floor is pale, and words state the sole's height.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.metrics import loaded, stance_force

ARROW = 0.5  # length of a force of one body weight [m]
SIDE = -0.055  # arrow and trails are drawn beside the foot, towards the camera [m]
EDGE = -0.05  # side of the floor, cut along the foot's as in a section: what sinks below it is seen [m]
AT_FLOOR = 0.008  # of the sole from the floor: to some 8 mm a derived ankle path is known [m]
COLUMNS = ("ground/force/x", "ground/force/z", "ground/position/x")
LOWEST = "sole/height"  # of the outsole; former recordings lack it


@dataclass(frozen=True)
class GroundForce:
    """Arrows from the centre of pressure [m] (n, 3)."""

    start: np.ndarray
    vector: np.ndarray
    stands: np.ndarray
    sole: np.ndarray
    kind: str

    @classmethod
    def of(cls, at: Callable[[str], Any], columns: Collection[str], body_mass: float) -> "GroundForce":
        """Of rows or of one instant, whose values of a column `at` gives; body_mass [kg]."""
        forward, upward, place = (np.asarray(at(name)) for name in COLUMNS)
        sole = np.asarray(at(LOWEST)) if LOWEST in columns else np.zeros_like(place)
        kind = "recorded" if stance_force(columns) in COLUMNS else "contact"
        start = np.stack([place, np.full_like(place, SIDE), np.zeros_like(place)], axis=-1)
        vector = np.stack([forward, np.zeros_like(place), upward], axis=-1) * ARROW / (body_mass * GRAVITY)
        return cls(start, vector, loaded(upward, body_mass), sole, kind)

    @property
    def borne(self) -> np.ndarray:
        """Where the drawn sole is at the floor (n,)."""
        return np.abs(self.sole) <= AT_FLOOR

    @property
    def words(self) -> list[str]:
        """What is to be read beside each arrow; "" where there is none, or the sole is at the floor."""
        silent = np.atleast_1d(self.borne | ~self.stands)
        soles = zip(silent, np.atleast_1d(self.sole), strict=True)
        return ["" if still else f"{self.kind} force; sole {above(sole)}" for still, sole in soles]


def above(height: float) -> str:
    """A height above the floor [m] in words."""
    return f"{abs(1e3 * height):.0f} mm {'below' if height < 0.0 else 'above'} the floor"
