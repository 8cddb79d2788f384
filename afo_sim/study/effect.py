"""What one step of one parameter does to a walk."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

CLEARANCE, FIRST, LOWEST = "toe_clearance", "toe_clearance_stride_1", "lowest_toe_clearance"
HEIGHTS = (CLEARANCE, FIRST, LOWEST)
TORQUE, TORQUE_PER_MASS = "torque_against_push_off", "torque_against_push_off_per_mass"
WORK, PITCH, AIR = "work_against_push_off", "foot_pitch_at_contact", "air_per_stride"
METRICS = (*HEIGHTS, TORQUE, TORQUE_PER_MASS, WORK, PITCH, AIR)
# Below this a difference is none, in the metric's unit: below what can be built, felt or measured.
NOTICED = {
    CLEARANCE: 0.1,
    FIRST: 0.1,
    LOWEST: 0.1,
    TORQUE: 0.03,
    TORQUE_PER_MASS: 0.0005,
    WORK: 0.0001,
    PITCH: 0.1,
    AIR: 0.0005,
}

# {metric: whose limit it is a share of}; beyond 100 % the limit is left
SHARES = {
    "muscle_share_of_pressure": "the muscles' limit of pressure",
    "muscle_share_of_force": "the muscles' limit of force",
    "muscle_share_of_contraction": "the muscles' limit of contraction",
    "muscle_share_of_stretch": "the muscles' limit of stretch",
    "cuff_share_of_pain": "the pressure at which the cuff hurts",
    "plate_share_of_pain": "the pressure at which the strap hurts",
}

Run = Literal["run", "no air", "forbidden", "refused", "failed"]


@dataclass(frozen=True)
class Effect:
    """One step of one parameter, and by how much the metrics differ from the walk as it is.

    name : of the parameter, as "dorsiflexor link_length"
    before, after : its value with its unit
    sets : what `--set` takes to make the step
    status : "run", or why it was not: no air enters the chamber, a limit forbids it, the description refuses
        it, the run failed
    reason : of that, in words
    differences : {metric: with the step less without, in the metric's unit}; only of what was run
    assumed : whether nobody has measured the value before: then it wants measuring first
    beyond : limits that the step leaves, where the walk as it is keeps them or leaves them by less
    notes : warnings that the walk as it is does not have
    helps : whether the ranking counts it as a help
    """

    name: str
    before: str
    after: str
    sets: dict[str, Any] = field(default_factory=dict)
    status: Run = "run"
    reason: str = ""
    differences: dict[str, float] = field(default_factory=dict)
    assumed: bool = False
    beyond: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    helps: bool = False

    @property
    def noticed(self) -> bool:
        """Whether any metric differs by more than can be noticed, or is defined no more."""
        found = self.differences.items()
        return any(math.isnan(value) or abs(value) >= NOTICED[name] for name, value in found)

    def by(self, metric: str) -> float:
        """Difference of a metric; 0 where there is none, or it is not defined."""
        value = self.differences.get(metric, 0.0)
        return value if math.isfinite(value) else 0.0
