"""One step of one parameter, and what it does to a walk."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Self

from afo_sim.common import JsonDict, JsonMapping

CLEARANCE, FIRST, LOWEST = "toe_clearance", "toe_clearance_stride_1", "lowest_toe_clearance"
HEIGHTS = (CLEARANCE, FIRST, LOWEST)
TORQUE, TORQUE_PER_MASS = "torque_against_push_off", "torque_against_push_off_per_mass"
WORK, PITCH, AIR = "work_against_push_off", "foot_pitch_at_contact", "air_per_stride"
# Below this a difference is none, in the metric's unit: below what can be built, felt or measured.
NOTICED = {
    CLEARANCE: 0.1, FIRST: 0.1, LOWEST: 0.1, TORQUE: 0.03, TORQUE_PER_MASS: 0.0005, WORK: 0.0001, PITCH: 0.1,
    AIR: 0.0005,
}  # fmt: skip
METRICS = tuple(NOTICED)
Run = Literal["run", "no air", "forbidden", "refused", "failed"]


@dataclass(frozen=True)
class Effect:
    """One step of one parameter to one side, and by how much the metrics differ from the walk as it is."""

    name: str  # of the parameter
    before: str  # its value, with a unit
    after: str  # its value with the step, with a unit
    sets: JsonDict = field(default_factory=dict)  # keys and values of the step
    status: Run = "run"  # "run", or why not: "no air", "forbidden", "refused", "failed"
    reason: str = ""  # why it was not run, in words
    differences: dict[str, float] = field(default_factory=dict)  # of metrics, by name [their units]
    assumed: bool = False  # the value before is assumed, not known
    beyond: tuple[str, ...] = ()  # parts that the step takes beyond what they are made for
    notes: tuple[str, ...] = ()  # what to mind
    helps: bool = False  # it serves the aim

    @property
    def noticed(self) -> bool:
        """Whether any metric differs by more than can be noticed, or is defined no more."""
        found = self.differences.items()
        return any(math.isnan(value) or abs(value) >= NOTICED[name] for name, value in found)

    def by(self, metric: str) -> float:
        """Difference of a metric; 0 where there is none, or it is not defined."""
        value = self.differences.get(metric, 0.0)
        return value if math.isfinite(value) else 0.0

    def after_it(self, base: Mapping[str, float]) -> dict[str, float]:
        """Metrics with the step; NaN where the step leaves one undefined."""
        return {name: value + self.differences.get(name, 0.0) for name, value in base.items()}

    def barred(self, status: Run, reason: str) -> Self:
        """The step, which is not run for this reason unless for another one."""
        return self if self.status != "run" else dataclasses.replace(self, status=status, reason=reason)

    def to_json(self) -> JsonDict:
        """As plain data; what is not defined is None."""
        table = dataclasses.asdict(self) | {key: list(getattr(self, key)) for key in ("beyond", "notes")}
        return table | {"differences": {name: defined(value) for name, value in self.differences.items()}}

    @classmethod
    def from_json(cls, row: JsonMapping) -> Self:
        """Of what `to_json` gave."""
        differences = {name: number(value) for name, value in row["differences"].items()}
        lists = {key: tuple(row[key]) for key in ("beyond", "notes")}
        return cls(**{**row, **lists, "differences": differences})


def defined(value: float) -> float | None:
    """A number as JSON has it."""
    return value if math.isfinite(value) else None


def number(value: float | None) -> float:
    """A number that JSON has had."""
    return math.nan if value is None else value
