"""What may be of the smallest size: pressures; valves, tubes, sources and muscles of the catalogue."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from afo_sim.common import JsonDict, JsonMapping, assets
from afo_sim.description import Muscle, MuscleGroup, Scenario, Valve, highest_pressures, load
from afo_sim.model import valves_of
from afo_sim.study.sizing.limits import Requirement
from afo_sim.study.sizing.three_way import times_for

STEP = 5e3  # of pressures [Pa]
_SCAN = 9  # pressures that are tried first
_LOWEST = 5e4  # of the scan, gauge [Pa]
_HIGHEST = 6e5  # where no muscle states its own limit [Pa]
_ALIKE = 1.0 + 1e-9
_DM3 = 1e8  # of C: dm³/(s·bar) in one m³/(s·Pa)
_HELD = "3/2: its coil stays on until the outlet would open"
_IDEAL = ("chou_hannaford_1996", "tondu_lopez_2000")  # laws of the braid's geometry alone
_NOT_MEASURED = "not measured"
UPPER_BOUND = f"{_NOT_MEASURED}, ideal law: an upper bound"
DERIVED = f"{_NOT_MEASURED}, derived from another muscle"
MASS_UNKNOWN = "mass unknown"
Status = Literal["run", "excluded", "refused", "failed"]


@dataclass(frozen=True)
class Candidate:
    """A component, or a pressure, that a scenario is tried with, and what the run with it gave."""

    name: str  # of the product, or the pressure
    size: float  # by which candidates are ordered [SI]; inf where it is not known
    sets: JsonMapping = field(default_factory=dict)  # laid over the scenario
    facts: Mapping[str, str] = field(default_factory=dict)  # of its data sheet, in words
    reason: str = ""  # why it was not run
    notes: tuple[str, ...] = ()  # what to mind
    doubt: str = ""  # why it is not sure that it would do
    status: Status = "run"  # "run", or why not: "excluded", "refused", "failed"
    values: Mapping[str, float] = field(default_factory=dict)  # metrics of the run
    short: Mapping[str, str] = field(default_factory=dict)  # {limit: why it is not met}
    said: Mapping[str, str] | None = None  # {answer: word} of its verdict beside the limits, where not good

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


def _all(kind: str) -> JsonDict:
    return {name: load(kind, name) for name in assets.names(kind)}


def bar(pressure: float) -> str:
    """A pressure [Pa] for people."""
    return f"{1e-5 * pressure:.4g} bar"


def pressure(value: float) -> Candidate:
    """A supply pressure [Pa]."""
    return Candidate(bar(value), value, {"supply.pressure": f"{value:.9g} Pa"})


def scanned(scenario: Scenario, between: tuple[float, float] | None) -> list[float]:
    """Pressures of a range that muscles and valves are allowed; a range's lowest, where none is [Pa]."""
    if between is None:
        limits = [group.type.limits.pressure for group in scenario.orthosis.muscle.values()]
        high = max(min(limits, default=_HIGHEST), scenario.supply.pressure)
        top = highest_allowed(scenario, high)
        between = min(_LOWEST, 0.5 * top), top
    low, high = between
    steps = np.floor(np.linspace(low, max(low, highest_allowed(scenario, high)), _SCAN) / STEP + 1e-6)
    return [float(STEP * n) for n in np.unique(steps.astype(int))]


def steps_between(low: float, high: float) -> list[float]:
    """Pressures on whole steps between two others [Pa]."""
    return [STEP * n for n in range(int(low // STEP) + 1, math.ceil(high / STEP)) if low < STEP * n < high]


def exceeded(scenario: Scenario, pressure: float) -> tuple[float, str] | None:
    """The lowest limit [Pa] that a supply pressure exceeds, and whose it is: a muscle's or a valve's."""
    orthosis = scenario.orthosis
    highest = highest_pressures(orthosis, pressure)
    found = [
        (group.type.limits.pressure, "the muscles are")
        for name, group in orthosis.muscle.items()
        if highest.get(group.chamber or name, pressure) > group.type.limits.pressure * _ALIKE
    ]
    for name, valve, before in valves_of(orthosis):
        most = math.inf if valve.working_pressure is None else valve.working_pressure[1]
        if highest.get(before, 0.0) > most * _ALIKE:
            found.append((most, f"valve {name} ({valve.name or 'unnamed'}) is"))
    return min(found, default=None)


def highest_allowed(scenario: Scenario, pressure: float) -> float:
    """The pressure, or the highest below it that all muscles and valves are allowed [Pa]."""
    while (limit := exceeded(scenario, pressure)) is not None and limit[0] < pressure:
        pressure = limit[0]
    return pressure


def valves(
    scenario: Scenario, chamber: str, side: str = "both", proportional: bool = False
) -> list[Candidate]:
    """Every valve on one chamber, by sonic conductance."""
    found = []
    for name, valve in sorted(_all("valve").items(), key=lambda item: (item[1].conductance, item[0])):
        source = valve.provenance.get("critical_ratio")
        facts = {
            "C": f"{_DM3 * valve.conductance:.3g}",
            "b": f"{valve.critical_ratio:.3g}{' *' if source is None or source.kind == 'assumed' else ''}",
            "ways": "3/2" if valve.three_way else "2/2",
        }
        reason = why_not(scenario, side, proportional, valve)
        sets = {} if reason else _valve_sets(scenario, chamber, side, name, valve)
        notes = (_HELD,) if f"phases.{chamber}.outlet" in sets and valve.three_way else ()
        found.append(Candidate(name, valve.conductance, sets, facts, reason, notes))
    return found


def why_not(scenario: Scenario, side: str, proportional: bool, valve: Valve) -> str:
    """Why a valve is not tried; "" where it is."""
    if valve.proportional and not proportional:
        return "a proportional valve; try it with --proportional"
    if valve.three_way and side != "both":
        return "a 3/2 valve is inlet and outlet in one; try it with --side both"
    (low, high), pressure = valve.working_pressure or (-math.inf, math.inf), scenario.supply.pressure
    if pressure < low:
        return f"its pilot needs at least {bar(low)}, but the supply has {bar(pressure)}"
    return f"is made for {bar(high)} at most, but the supply has {bar(pressure)}" if pressure > high else ""


def _valve_sets(scenario: Scenario, chamber: str, side: str, name: str, valve: Valve) -> JsonDict:
    key, now = f"orthosis.chamber.{chamber}", scenario.orthosis.chamber[chamber]
    if not valve.three_way and not now.three_way:
        return {f"{key}.{each}": name for each in (("inlet", "outlet") if side == "both" else (side,))}
    table = scenario.resolved()["orthosis"]["chamber"][chamber]
    kept = {field: value for field, value in table.items() if field not in ("inlet", "outlet")}
    kept |= {"inlet": name} if valve.three_way else {"inlet": name, "outlet": name}
    changed = valve.three_way != now.three_way
    return {key: kept} | (times_for(scenario, chamber, three_way=valve.three_way) if changed else {})


def tubes(scenario: Scenario, length: float) -> list[Candidate]:
    """Every tube, of one length [m] at every chamber, by bore."""
    found = []
    for name, tube in sorted(_all("tube").items(), key=lambda item: (item[1].bore, item[0])):
        facts = {
            "bore [mm]": f"{1e3 * tube.bore:.3g}",
            "C": f"{_DM3 * tube.conductance(length):.3g}",
            "b": f"{tube.critical_ratio(length):.2g}",
            "air [ml]": f"{1e6 * tube.volume(length):.3g}",
        }
        sets: JsonDict = {}
        for chamber, now in scenario.orthosis.chamber.items():
            key = f"orthosis.chamber.{chamber}"
            sets |= {f"{key}.tube": name, f"{key}.tube_length": f"{length!r} m"}
            if now.tube is None:  # the volume stood for the tube
                sets[f"{key}.tube_volume"] = "0 ml"
        found.append(Candidate(name, tube.bore, sets, facts))
    return found


def tube_notes(scenario: Scenario, length: float) -> list[str]:
    """What a tube replaces, and what no run counts."""
    replaced = [
        f"{name}'s {1e6 * now.tube_volume:.3g} ml"
        for name, now in scenario.orthosis.chamber.items()
        if now.tube is None and now.tube_volume > 0.0
    ]
    notes = [f"the tube takes the place of tube_volume ({', '.join(replaced)})"] if replaced else []
    delay = load("tube", assets.names("tube")[0]).delay(length)
    return [*notes, f"sound takes {1e3 * delay:.1f} ms through the tube, which no run counts"]


def sources(scenario: Scenario) -> list[Candidate]:
    """Every source, by mass, then by volume; each is run full."""
    pressure, found = scenario.supply.pressure, []
    every = _all("source").items()
    by_size = sorted(every, key=lambda item: (item[1].mass or math.inf, item[1].volume, item[0]))
    for name, source in by_size:
        size, doubt = (math.inf, MASS_UNKNOWN) if source.mass is None else (source.mass, "")
        facts = {"g": "–" if doubt else f"{1e3 * size:.3g}", "l": f"{1e3 * source.volume:.2g}"}
        reason = ""
        if not source.given(pressure) > 0.0:
            pumps = source.kind == "compressor"
            full = bar((source.switch_off if pumps else source.filling_pressure) or 0.0)
            has = f"stops at {full}" if pumps else f"holds {full} when full"
            reason = f"{has}, and the supply is set to {bar(pressure)}"
        sets: JsonDict = {"supply.source": name}
        if scenario.supply.line_pressure is not None:  # a source takes the line's place
            table = scenario.resolved()["supply"]
            sets = {"supply": {k: v for k, v in table.items() if k != "line_pressure"} | {"source": name}}
        found.append(Candidate(name, size, sets, facts, reason, doubt=doubt))
    return found


def muscles(scenario: Scenario, group: str, count: tuple[int, int] | None = None) -> list[Candidate]:
    """Every muscle for one group and number of them, by the volume of all braids at rest."""
    now, pressure = scenario.orthosis.muscle[group], scenario.supply.pressure
    low, high = count or (now.count, now.count)
    found = []
    for (name, muscle), n in itertools.product(_all("muscle").items(), range(low, high + 1)):
        size = n * 0.25 * math.pi * muscle.bore**2 * muscle.nominal_length
        volume = f"{1e6 * size:.0f}" if size >= 1e-4 else f"{1e6 * size:.3g}"
        facts = {"bore [mm]": f"{1e3 * muscle.bore:.3g}", "volume [ml]": volume}
        key = f"orthosis.muscle.{group}"
        sets: JsonDict = {f"{key}.type": name, f"{key}.count": n}
        link, reason = link_for(now, muscle), ""
        if link is not None:
            facts["link [cm]"] = f"{1e2 * link:.3g}".replace("-", "−")
            sets[f"{key}.link_length"] = f"{link!r} m"
            reason = f"is {-1e2 * link:.3g} cm too long for the path" if link < 0.0 else ""
        least, most = muscle.law_set.pressure_range
        beyond = "" if least <= pressure <= most else f"its law holds from {bar(least)} to {bar(most)}"
        doubt = doubt_of(muscle) or beyond
        facts["grade"] = f"{muscle.grade} *" if doubt else muscle.grade
        if muscle.limits.pressure < pressure and not reason:
            reason = f"may hold {bar(muscle.limits.pressure)}, but the supply has {bar(pressure)}"
        notes = (doubt,) if doubt else ()
        found.append(Candidate(f"{n} × {name}", size, sets, facts, reason, notes, doubt))
    return sorted(found, key=lambda each: (each.size, each.name))


def doubt_of(muscle: Muscle) -> str:
    """Why a muscle's force is not sure: its law has no number from a measurement; "" where it has one."""
    kinds = {each.kind for each in muscle.laws[muscle.law].provenance.values()}
    if not kinds:
        return _NOT_MEASURED if muscle.grade == "D" else ""
    if kinds - {"assumed", "derived"}:
        return ""
    if "derived" in kinds:
        return DERIVED
    return UPPER_BOUND if muscle.law in _IDEAL and muscle.tube is None else _NOT_MEASURED


def link_for(now: MuscleGroup, muscle: Muscle) -> float | None:
    """Length of the link with which another muscle is taut at the same ankle angle [m]."""
    if now.link_length is None:
        return None
    own = now.type  # taut where the path is as long as braid, ends and link together
    return now.link_length + own.nominal_length + own.end_length - muscle.nominal_length - muscle.end_length
