"""What a component is to meet, the components that are tried, and what came of each."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from afo_sim.common import InputError, Notice, parse_quantity, unknown
from afo_sim.description import USUAL_LIMITS, Scenario, load
from afo_sim.metrics import FILL, OTHER, UNITS, VENT, WORDS, instead, is_filling, number, told, words
from afo_sim.metrics.metric_words import METRICS

_FIRST_STRIDE = "toe_clearance_stride_1"
_EXAMPLE = "toe_clearance >= 10 mm"
EXAMPLES = '"peak_dorsiflexion_angle >= 5 deg", "peak_dorsiflexion_torque >= 2 N*m", "fill_time <= 3 s"'
_DIRECTIONS = ("dorsiflexion", "plantarflexion")
_OF_CHAMBER = {"fill_time": FILL, "vent_time": VENT}
_BY_CHAMBER = (FILL, VENT, "peak_pressure_{}", "lowest_pressure_{}", "air_per_cycle_{}", "air_per_stride_{}")
_SMALLER = {"s": (10.0, 1e3, "ms"), "h": (1.0, 60.0, "min")}  # {unit: (below, factor, unit)}
_TIMES = ("ms", "min", "h")
_SIGNS = {">=": True, "≥": True, "<=": False, "≤": False}
Status = Literal["run", "excluded", "refused", "failed"]


@dataclass(frozen=True)
class Requirement:
    """At least, or at most, `bound` of a metric [its own unit]."""

    metric: str
    at_least: bool
    bound: float
    called: str = ""
    measured_in: str = ""

    @property
    def unit(self) -> str:
        """Unit of the metric and the bound."""
        return self.measured_in if self.called else words(self.metric).unit

    @property
    def label(self) -> str:
        """What the metric is called."""
        return self.called or words(self.metric).label

    def margin(self, value: float) -> float:
        """By how much a value is on the good side of the bound [unit]; NaN of NaN."""
        return value - self.bound if self.at_least else self.bound - value

    def met(self, value: float) -> bool:
        """Whether a value is on the good side of the bound; one that is undefined is not."""
        return self.margin(value) >= 0.0

    @property
    def wanted(self) -> str:
        """The bound as people read it: "≥ 10 mm"."""
        unit = UNITS.get(self.unit, self.unit)
        bound = shown(self.bound, self.unit) if self.unit in _SMALLER else _joined(f"{self.bound:g}", unit)
        return f"{'≥' if self.at_least else '≤'} {bound.replace('-', '−')}"

    def __str__(self) -> str:
        return f"{self.metric} {'>=' if self.at_least else '<='} {self.bound:g} {self.unit}".rstrip()


def shown(value: float, unit: str, *, signed: bool = False) -> str:
    """A value with its unit, for people: short times in the next smaller unit."""
    if unit in _SMALLER and abs(value) < _SMALLER[unit][0]:
        _, factor, unit = _SMALLER[unit]
        value *= factor
    if math.isinf(value):
        return "endless"
    digits = "+.0f" if abs(value) >= 100.0 else "+.3g"
    text = as_number(value, unit) if unit not in _TIMES else f"{value:{digits}}".replace("-", "−")
    if not math.isfinite(value):
        return "–"
    return _joined(text if signed else text.removeprefix("+"), UNITS.get(unit, unit))


def as_number(value: float, unit: str) -> str:
    """A signed value with the digits that its unit deserves; more where nothing but zeros would be left."""
    text = number(value, unit, True)
    if value != 0.0 and math.isfinite(value) and not text.strip("+−0."):
        return f"{value:+.1g}".replace("-", "−")
    return text


def _joined(text: str, unit: str) -> str:
    return f"{text}{'' if unit.startswith('°') else ' '}{unit}".rstrip()


def read_requirements(
    texts: Sequence[str], chamber: str, chambers: Sequence[str] = (), volumes: Sequence[str] = ()
) -> tuple[Requirement, ...]:
    """Limits as they are written."""
    found = tuple(_read(text, chamber) for text in texts)
    if chambers:
        for each in found:
            _check_chamber(each.metric, chambers, volumes)
    return found


def _check_chamber(metric: str, chambers: Sequence[str], volumes: Sequence[str]) -> None:
    """Refuse the metric of a chamber that the orthosis does not have."""
    for form in () if metric in METRICS else _BY_CHAMBER:
        if not metric.startswith(form.removesuffix("{}")):
            continue
        names = [form.format(each) for each in (*chambers, *(() if is_filling(metric) else volumes))]
        if metric not in names:
            raise unknown(metric, names, field="limit", problem="is not of a chamber of this orthosis")


def _read(text: str, chamber: str) -> Requirement:
    found = re.fullmatch(r"\s*(\w+)\s*(>=|<=|≥|≤)\s*(.+?)\s*", str(text))
    if found is None:
        raise InputError(
            "is not a valid limit", field="limit", value=text, allowed=f'a metric and a bound: "{_EXAMPLE}"'
        )
    metric, sign, bound = found.groups()
    if metric in _OF_CHAMBER:
        if not chamber:
            raise InputError("is of a chamber, and the orthosis has none", field="limit", value=text)
        metric = _OF_CHAMBER[metric].format(chamber)
    row = words(metric)
    if row.group == OTHER:
        filled = [name.format(each) for name in METRICS if "{}" in name for each in (chamber, *_DIRECTIONS)]
        near = instead(metric, [*WORDS, *_OF_CHAMBER, *filled])
        problem = told("is not a valid metric", metric)
        raise InputError(problem, field="limit", value=metric, allowed="see `afo-sim run`", nearest=near)
    try:
        value = parse_quantity(bound.replace("%", " percent"), row.unit)
    except ValueError as error:
        raise InputError(str(error), field="limit", value=text, allowed=f'as "{_EXAMPLE}"') from None
    return Requirement(metric, _SIGNS[sign], value)


def usual(scenario: Scenario) -> tuple[Requirement, ...]:
    """What a walk is held against where nobody says: the toe clearance that the scenario's limits want."""
    if not scenario.walking or scenario.gait is None:
        return ()
    limits = scenario.limits or load("limits", USUAL_LIMITS)
    wanted = round(1e3 * limits.toe_clearance[0], 9) + 0.0  # [mm]
    names = ["toe_clearance"] + ([_FIRST_STRIDE] if scenario.gait.start_phase == 0.0 else [])
    return tuple(Requirement(name, True, wanted) for name in names)


def doubted(value: str, doubt: str) -> Notice:
    """A fact of a candidate that is not sure."""
    return Notice("doubted-fact", "{value} ({doubt})", severity="note", value=value, doubt=doubt)


@dataclass(frozen=True)
class Candidate:
    """A component, or a pressure, that a scenario is tried with."""

    name: str
    size: float
    sets: Mapping[str, Any] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    excluded: str = ""
    notes: tuple[str, ...] = ()
    doubt: str = ""


@dataclass(frozen=True)
class Tried:
    """A candidate, and what the run with it gave."""

    candidate: Candidate
    status: Status
    reason: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    short: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Of the candidate."""
        return self.candidate.name

    @property
    def meets(self) -> bool:
        """Whether it was run and meets all limits."""
        return self.status == "run" and not self.short

    @property
    def why(self) -> str:
        """Why it does not meet what is wanted, in words."""
        return ", ".join(self.short.values()) if self.status == "run" else f"{self.status}: {self.reason}"

    def margin(self, requirement: Requirement) -> float:
        """By how much it keeps a limit [the metric's unit]; NaN where that is not known."""
        return requirement.margin(self.values.get(requirement.metric, math.nan))


def closeness(tried: Tried, requirements: Sequence[Requirement]) -> float:
    """How far a run is from what is wanted: its largest shortfall as a share of the bound; inf if untold."""
    if tried.status != "run":
        return math.inf
    found = [0.0]
    for each in requirements:
        margin = tried.margin(each)
        found.append(math.inf if math.isnan(margin) else max(-margin, 0.0) / (abs(each.bound) or 1.0))
    return max(found)
