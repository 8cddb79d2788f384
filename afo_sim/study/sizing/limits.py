"""The limits that a size is to meet, as people write and read them."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from afo_sim.common import InputError, parse_quantity, unknown
from afo_sim.description import USUAL_LIMITS, Scenario, load
from afo_sim.metrics import FILL, OTHER, UNITS, VENT, WORDS, is_filling, no_metric, number, words
from afo_sim.metrics.metric_words import METRICS

_FIRST_STRIDE = "toe_clearance_stride_1"
_EXAMPLE = "toe_clearance >= 10 mm"
EXAMPLES = '"peak_dorsiflexion_angle >= 5 deg", "peak_dorsiflexion_torque >= 2 N*m", "fill_time <= 3 s"'
_DIRECTIONS = ("dorsiflexion", "plantarflexion")
_OF_CHAMBER = {"fill_time": FILL, "vent_time": VENT}
_BY_CHAMBER = (FILL, VENT, "peak_pressure_{}", "lowest_pressure_{}", "air_per_cycle_{}", "air_per_stride_{}")
_SMALLER = {"s": (10.0, 1e3, "ms"), "h": (1.0, 60.0, "min")}  # {unit: (below, factor, unit)}
_SIGNS = {">=": True, "≥": True, "<=": False, "≤": False}


@dataclass(frozen=True)
class Requirement:
    """At least, or at most, `bound` of a metric [its own unit]."""

    metric: str  # name
    at_least: bool  # else at most
    bound: float  # [the metric's unit]
    called: str = ""  # its own name for people, "" of the metric's
    measured_in: str = ""  # unit of a metric that has such a name

    @property
    def unit(self) -> str:
        """Unit of the metric and the bound."""
        return self.measured_in if self.called else words(self.metric).unit

    @property
    def label(self) -> str:
        """What the metric is called."""
        return self.called or words(self.metric).label

    @property
    def wanted(self) -> str:
        """The bound as people read it: "≥ 10 mm"."""
        unit = UNITS.get(self.unit, self.unit)
        bound = shown(self.bound, self.unit) if self.unit in _SMALLER else _joined(f"{self.bound:g}", unit)
        return f"{'≥' if self.at_least else '≤'} {bound.replace('-', '−')}"

    def margin(self, value: float) -> float:
        """By how much a value is on the good side of the bound [unit]; NaN of NaN."""
        return value - self.bound if self.at_least else self.bound - value

    def met(self, value: float) -> bool:
        """Whether a value is on the good side of the bound; one that is undefined is not."""
        return self.margin(value) >= 0.0

    def reached(self, value: float) -> str:
        """A value with its bound: "toe clearance 5.8 mm (target ≥ 10 mm)"."""
        text = self._undefined if math.isnan(value) else shown(value, self.unit)
        return f"{self._name} {text} (target {self.wanted})"

    def shortfall(self, value: float) -> str:
        """Why a value does not meet it, in words."""
        if math.isnan(value):
            return f"{self._name} is {self._undefined}"
        way = "below" if self.at_least else "above"
        return f"{self._name} {shown(abs(self.margin(value)), self.unit)} {way} {self.wanted[2:]}"

    @property
    def _name(self) -> str:
        return self.label[0].lower() + self.label[1:]

    @property
    def _undefined(self) -> str:
        return "not reached" if is_filling(self.metric) else "not defined"

    def __str__(self) -> str:
        return f"{self.metric} {'>=' if self.at_least else '<='} {self.bound:g} {self.unit}".rstrip()


def shown(value: float, unit: str) -> str:
    """A value with its unit, for people: short times in the next smaller unit."""
    if math.isinf(value):
        return "endless"
    if unit in _SMALLER and abs(value) < _SMALLER[unit][0]:
        _, factor, unit = _SMALLER[unit]
        value *= factor
    if unit in ("ms", "min", "h"):
        return _joined(f"{value:{'.0f' if abs(value) >= 100.0 else '.3g'}}".replace("-", "−"), unit)
    return _joined(signed(value, unit).removeprefix("+"), UNITS.get(unit, unit))


def signed(value: float, unit: str) -> str:
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
    """Limits as they are written; of no chamber that the orthosis does not have."""
    found = tuple(_read(text, chamber) for text in texts)
    for metric in (each.metric for each in found if chambers and each.metric not in METRICS):
        for form in (form for form in _BY_CHAMBER if metric.startswith(form.removesuffix("{}"))):
            names = [form.format(each) for each in (*chambers, *(() if is_filling(metric) else volumes))]
            if metric not in names:
                raise unknown(metric, names, field="limit", problem="is not of a chamber of this orthosis")
    return found


def _read(text: str, chamber: str) -> Requirement:
    found = re.fullmatch(r"\s*(\w+)\s*(>=|<=|≥|≤)\s*(.+?)\s*", str(text))
    if found is None:
        allowed = f'a metric and a bound: "{_EXAMPLE}"'
        raise InputError("is not a valid limit", field="limit", value=text, allowed=allowed)
    metric, sign, bound = found.groups()
    metric = _OF_CHAMBER[metric].format(chamber) if metric in _OF_CHAMBER else metric
    row = words(metric)
    if row.group == OTHER:
        filled = [name.format(each) for name in METRICS if "{}" in name for each in (chamber, *_DIRECTIONS)]
        known = [*WORDS, *_OF_CHAMBER, *filled]
        raise no_metric("is not a valid metric", metric, known, field="limit", allowed="see `afo-sim run`")
    try:
        value = parse_quantity(bound.replace("%", " percent"), row.unit)
    except ValueError as error:
        raise InputError(str(error), field="limit", value=text, allowed=f'as "{_EXAMPLE}"') from None
    return Requirement(metric, _SIGNS[sign], value)


def usual(scenario: Scenario) -> tuple[Requirement, ...]:
    """The default limit of a walk: the target toe clearance of the scenario's limits."""
    if not scenario.walking or scenario.gait is None:
        return ()
    limits = scenario.limits or load("limits", USUAL_LIMITS)
    wanted = round(1e3 * limits.toe_clearance[0], 9) + 0.0  # [mm]
    names = ["toe_clearance"] + ([_FIRST_STRIDE] if scenario.gait.start_phase == 0.0 else [])
    return tuple(Requirement(name, True, wanted) for name in names)
