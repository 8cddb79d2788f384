"""One side of a walk beside the other: numbers of both strides, with their symmetry index."""

from dataclasses import dataclass

import numpy as np

from afo_sim.gait.checks import LATE_SWING, stance
from afo_sim.gait.cycle import DEGREE, GaitCycle

STRIKE = "other_heel_strike"  # note of a stride: phase at which the other foot strikes
_FAST = 0.75  # quantile of the ankle's forward speed from which on the toe passes the floor [-]


@dataclass(frozen=True)
class TwoSides:
    """A number of both sides, in `unit`; None where it is not known."""

    name: str  # what it is, in words
    unit: str  # of both
    right: float | None  # number of the right side [unit]
    left: float | None  # number of the left side [unit]

    @property
    def index(self) -> float | None:
        """Symmetry index 2 (L − R)/(L + R) [-]; None where not both are positive.

        Source: Robinson, Herzog & Nigg 1987 (J. Manipulative Physiol. Ther. 10: 172).
        """
        right, left = self.right or 0.0, self.left or 0.0
        return 2.0 * (left - right) / (left + right) if min(right, left) > 0.0 else None

    @property
    def cells(self) -> list[str]:
        """Name with unit, right, left and index as people read them; "–" for what is not known."""
        formats = ((self.right, ".3g"), (self.left, ".3g"), (self.index, "+z.2f"))
        shown = ("–" if value is None else f"{value:{how}}" for value, how in formats)
        return [f"{self.name} [{self.unit}]", *shown]


def asymmetry(right: GaitCycle, left: GaitCycle) -> list[TwoSides]:
    """Numbers of a right and a left stride side by side."""
    reach = float(max(np.nanmax(cycle.cop_x) for cycle in (right, left)))
    found = zip(_numbers(right, reach), _numbers(left, reach), strict=True)
    return [TwoSides(name, unit, one, other) for (name, unit, one), (_, _, other) in found]


def _numbers(cycle: GaitCycle, reach: float) -> list[tuple[str, str, float | None]]:
    """Of one side: name, unit and number; `reach` is the toe's ahead of the ankle [m]."""
    share, time = stance(cycle), cycle.stride_time
    standing, strike = cycle.ankle_moment[cycle.phase <= share], cycle.notes.get(STRIKE)
    middle = np.interp(0.5 * (1.0 + share), cycle.phase, cycle.ankle_angle)
    speed, pitch = cycle.signal("ankle_x", cycle.phase, 1), cycle.foot_pitch()
    toe = cycle.ankle_z - cycle.ankle_height * np.cos(pitch) + reach * np.sin(pitch)
    fast = (speed >= np.quantile(speed, _FAST)) & (cycle.phase > share) & (cycle.phase < LATE_SWING)
    return [
        ("stance", "%", 100.0 * share),
        ("step time", "s", None if strike is None else (1.0 - float(strike)) * time),
        ("swing time", "s", (1.0 - share) * time),
        ("peak plantarflexor moment", "N·m/kg", max(0.0, -float(standing.min()))),
        ("peak dorsiflexor moment", "N·m/kg", max(0.0, float(standing.max()))),
        ("dorsiflexion in mid-swing", "deg", float(middle) / DEGREE),
        ("lowest toe height in swing", "mm", 1e3 * float(toe[fast].min()) if fast.any() else None),
    ]
