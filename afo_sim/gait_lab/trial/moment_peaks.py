"""Peak ankle moments of a stride, with what the ankle centre's error does to them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from afo_sim.common.units import GRAVITY
from afo_sim.gait.checks import LATE_SWING, STANCE_FORCE

if TYPE_CHECKING:
    from afo_sim.gait_lab.trial.importing import Imported

ANKLE_ERROR = 0.01  # of an ankle centre whose error nobody tells, fore and aft; assumed [m]


@dataclass(frozen=True)
class MomentPeak:
    """The greatest moment of one direction in stance."""

    value: float  # [N·m/kg]; 0 if the moment never has this direction
    phase: float  # [-]
    error: float  # by the ankle centre's: its arm times the upward force at this phase [N·m/kg]
    sides: Mapping[str, float]  # each side's own peak where both legs were averaged, else empty [N·m/kg]

    def text(self, after: str = "") -> str:
        """The peak with its error in N·m/kg, then `after`, then both sides' own."""
        if self.value <= 0.0:
            return "none"
        own = ", ".join(f"{side} {value:.2f}" for side, value in self.sides.items())
        return f"{self.value:.2f} ±{self.error:.2f}{after}" + f" ({own})" * bool(own)


def moment_peaks(imported: "Imported") -> tuple[MomentPeak, MomentPeak]:
    """The plantarflexor's and the dorsiflexor's peak of the taken stride."""
    cycle = imported.cycle
    stance = (cycle.grf_z > STANCE_FORCE) & (cycle.phase < LATE_SWING)
    chosen: dict[str, list[np.ndarray]] = {}
    for index in imported.chosen:
        chosen.setdefault(imported.strides[index].side, []).append(imported.cycles[index].ankle_moment)
    means = {side: np.mean(moments, axis=0) for side, moments in chosen.items()} if len(chosen) > 1 else {}
    arm = ankle_error(imported)
    found = []
    for sign in (-1.0, 1.0):  # dorsiflexion is positive
        k = int(np.argmax(np.where(stance, sign * cycle.ankle_moment, -np.inf)))
        sides = {side: max(0.0, float((sign * moment)[stance].max())) for side, moment in means.items()}
        error = (ANKLE_ERROR if arm is None else arm) * GRAVITY * float(cycle.grf_z[k])
        found.append(
            MomentPeak(max(0.0, float(sign * cycle.ankle_moment[k])), float(cycle.phase[k]), error, sides)
        )
    return found[0], found[1]


def ankle_error(imported: "Imported") -> float | None:
    """The ankle centre's error, the larger of two averaged legs' [m]; None where it is not known."""
    sides = {imported.strides[index].side for index in imported.chosen}
    errors = [imported.legs[side].points["ankle"].error for side in sides if side in imported.legs]
    known = [error for error in errors if error is not None]
    return max(known) if known and len(known) == len(errors) else None
