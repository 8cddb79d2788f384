"""The ground force at a drawn foot."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, FloatOrArray
from afo_sim.metrics import loaded

ARROW = 0.5  # length of a force of one body weight [m]
SIDE = -0.055  # arrow and trails are drawn beside the foot, towards the camera [m]
EDGE = -0.05  # side of the floor, cut along the foot's as in a section: what sinks below it is seen [m]
COLUMNS = ("ground/force/x", "ground/force/z", "ground/position/x")


@dataclass(frozen=True)
class GroundForce:
    """Arrows from the centre of pressure [m] (n, 3), and where there is one (n,)."""

    start: np.ndarray
    vector: np.ndarray
    stands: np.ndarray

    @classmethod
    def of(cls, at: Callable[[str], FloatOrArray], body_mass: float) -> "GroundForce":
        """Of rows or of one instant, whose values of a column `at` gives; body_mass [kg]."""
        forward, upward, place = (np.asarray(at(name)) for name in COLUMNS)
        start = np.stack([place, np.full_like(place, SIDE), np.zeros_like(place)], axis=-1)
        vector = np.stack([forward, np.zeros_like(place), upward], axis=-1) * ARROW / (body_mass * GRAVITY)
        return cls(start, vector, loaded(upward, body_mass))


def above(height: float) -> str:
    """A height above the floor [m] in words."""
    return f"{abs(1e3 * height):.0f} mm {'below' if height < 0.0 else 'above'} the floor"
