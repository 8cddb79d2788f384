"""A parameter of a fit, and the number of ordinary size that is searched for it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from afo_sim.common import in_unit


@dataclass(frozen=True)
class FitParameter:
    """SI; `shown` is the unit for people's eyes, `neutral` the value at which it does nothing.

    `low` and `high` are usual values, `size` the unit of a coordinate, or its reference if that is a
    logarithm. `keys` are what it sets in a scenario, each with its share of the value.
    """

    name: str
    unit: str
    shown: str
    lower: float
    upper: float
    low: float
    high: float
    size: float
    neutral: float | None = None
    logarithmic: bool = False
    of_law: bool = False
    keys: Mapping[str, float] = field(default_factory=dict)

    def coordinate(self, value: float) -> float:
        """A value [SI] as it is searched."""
        return math.log(value / self.size) if self.logarithmic else value / self.size

    def value(self, coordinate: float) -> float:
        """The value [SI] of what is searched, within its bounds."""
        if self.logarithmic:  # an interval's end may overflow
            return self._inside(self.size * math.exp(min(max(coordinate, -700.0), 700.0)))
        return self._inside(self.size * coordinate)

    def _inside(self, value: float) -> float:
        return float(min(max(value, self.lower), self.upper))

    def number(self, value: float) -> float:
        """A value in the unit for people's eyes."""
        return in_unit(value, self.unit, self.shown) if self.shown else value

    def text(self, value: float) -> str:
        """A value [SI] for people."""
        return f"{self.number(value):.3g} {self.shown}".strip()
