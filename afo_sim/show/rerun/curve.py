"""A plotted line: its place, name, colour and values."""

from dataclasses import dataclass, field

import numpy as np

from afo_sim.show.rerun.source import Columns

ANGLES = ("ankle/angle", "gait/ankle_angle")
USUAL, THIN = 1.6, 0.8  # widths of lines


@dataclass(frozen=True)
class Curve:
    """One plotted line: where, its name and colour, and its column × factor."""

    entity: str
    name: str
    colour: list[int]
    column: str
    factor: float = 1.0
    width: float = field(default=USUAL, kw_only=True)

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that it reads."""
        return (self.column,)

    def values(self, block: Columns) -> np.ndarray:
        """The plotted values. Angles go through `np.degrees`, so that they are its very bits."""
        values = block[self.column]
        return np.degrees(values) if self.column in ANGLES else values * self.factor
