"""The smallest valve, tube or source of the catalogue."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from afo_sim.common import InputError, assets
from afo_sim.description import USUAL_LIMITS, Scenario, Source, Tube, Valve, load
from afo_sim.metrics import words
from afo_sim.physics import AIR
from afo_sim.study.sizing.pressures import bar
from afo_sim.study.sizing.requirement import Candidate, Requirement, Tried, doubted, shown
from afo_sim.study.sizing.result import Sizing, larger_is_worse, smallest
from afo_sim.study.sizing.trial import Trials, shortfall

SIDES = ("both", "inlet", "outlet")
_DM3 = 1e8  # of C: dm³/(s·bar) in one m³/(s·Pa)
_UNIT = "dm³/(s·bar)"
_MEANING = f"C: sonic conductance [{_UNIT}]; b: critical pressure ratio; *: assumed"
_HELD = "3/2: its coil stays on until the outlet would open"
Interval = tuple[float, float]
HOURS, STRIDES = "hours_of_source", "strides_of_source"
_SAGS = 2.0  # share of the set pressure from which on a sag is reported [percent]
_ASKED = frozenset({"mean_flow", "peak_flow", "supply_sag", "source_empty_after", "stride_time"})
_NOTES = (
    "g, l: mass and volume of the source; mean, peak: flow out of it [l/min] of the free gas",
    "each run begins with a full source; strides and hours are of its content down to the set pressure, "
    "which cools as it gives the mean flow of the run; air before the first step is not taken out",
)


def size_valve(trials: Trials, chamber: str, side: str = "both", proportional: bool = False) -> Sizing:
    """The smallest valve."""
    if trials.scenario.orthosis.chamber[chamber].three_way and side != "both":
        problem = f"is of two valves, and chamber {chamber!r} has one 3/2 valve"
        raise InputError(problem, field="side", value=side, allowed="both")
    valves = {name: load("valve", name) for name in assets.names("valve")}
    ordered = sorted(valves.items(), key=lambda item: (item[1].conductance, item[0]))
    candidates = [_valve_candidate(trials.scenario, chamber, side, proportional, *each) for each in ordered]
    tried = trials.run(candidates)
    best = next((each for each in tried if each.meets), None)
    what = f"valve for {chamber}'s {'inlet and outlet' if side == 'both' else side}"
    return Sizing.of(
        trials,
        "valve",
        ("sonic conductance C", _UNIT, _DM3),
        tried,
        best,
        answer=smallest(tried, trials.requirements, what, "valve"),
        notes=(_MEANING, *larger_is_worse(tried, "valve")),
    )


def _valve_candidate(
    scenario: Scenario, chamber: str, side: str, proportional: bool, name: str, valve: Valve
) -> Candidate:
    ratio = f"{valve.critical_ratio:.3g}"
    source = valve.provenance.get("critical_ratio")
    facts = {
        "C": f"{_DM3 * valve.conductance:.3g}",
        "b": doubted(ratio, "assumed") if source is None or source.kind == "assumed" else ratio,
        "ways": "3/2" if valve.three_way else "2/2",
    }
    reason = why_not(scenario, side, proportional, valve)
    sets = {} if reason else _valve_sets(scenario, chamber, side, name, valve)
    notes = (_HELD,) if not reason and f"phases.{chamber}.outlet" in sets and valve.three_way else ()
    return Candidate(name, valve.conductance, sets, facts, reason, notes)


def why_not(scenario: Scenario, side: str, proportional: bool, valve: Valve) -> str:
    """Why a valve is not tried; "" where it is."""
    if valve.proportional and not proportional:
        return "a proportional valve, which is tried with --proportional"
    if valve.three_way and side != "both":
        return "a 3/2 valve is inlet and outlet in one, which is tried with --side both"
    if valve.working_pressure is None:
        return ""
    (low, high), pressure = valve.working_pressure, scenario.supply.pressure
    if pressure < low:
        return f"its pilot needs at least {bar(low)}, and the supply has {bar(pressure)}"
    return f"is made for {bar(high)} at most, and the supply has {bar(pressure)}" if pressure > high else ""


def _valve_sets(scenario: Scenario, chamber: str, side: str, name: str, valve: Valve) -> dict[str, Any]:
    """What lays a valve over a chamber."""
    key, now = f"orthosis.chamber.{chamber}", scenario.orthosis.chamber[chamber]
    if not valve.three_way and not now.three_way:
        sides = ("inlet", "outlet") if side == "both" else (side,)
        return {f"{key}.{each}": name for each in sides}
    table = scenario.resolved()["orthosis"]["chamber"][chamber]
    kept = {field: value for field, value in table.items() if field not in ("inlet", "outlet")}
    valves = {"inlet": name} if valve.three_way else {"inlet": name, "outlet": name}
    times = (
        {} if valve.three_way == now.three_way else times_for(scenario, chamber, three_way=valve.three_way)
    )
    return {key: kept | valves, **times}


# A 3/2 valve vents while its coil has no current. So its coil stays on from where the inlet would open until
# the outlet would. The other way round the outlet is open wherever that coil has no current.


def one_coil(inlets: Sequence[Interval], outlets: Sequence[Interval], period: float) -> list[Interval]:
    """Intervals in which a 3/2 valve's coil is on, in place of an inlet and an outlet."""
    if not outlets:
        return list(inlets)
    found: dict[float, Interval] = {}
    for start, end in inlets:
        held = min(((outlet - start) % period, outlet) for outlet, _ in outlets)
        if held[0] == 0.0:  # both open at once: nothing is held
            held = ((end - start) % period, end)
        until = held[1]
        if until not in found or held[0] > (until - found[until][0]) % period:
            found[until] = (start, until)
    return sorted(found.values())


def two_coils(inlets: Sequence[Interval], period: float) -> list[Interval]:
    """Intervals in which the outlet is open, in place of a 3/2 valve whose coil is on in `inlets`."""
    ordered = sorted(inlets)
    if not ordered:
        return [(0.0, period)]
    following = [*ordered[1:], ordered[0]]
    gaps = [(end, after) for (_, end), (after, _) in zip(ordered, following, strict=True)]
    return [(a % period, b or period) for a, b in gaps if (b - a) % period > 0.0]


def within(intervals: Sequence[Interval], period: float) -> list[Interval]:
    """The same without any that runs over the period's end."""
    found: list[Interval] = []
    for start, end in intervals:
        found += [(start, end)] if start < end else [(start, period)] + ([(0.0, end)] if end > 0.0 else [])
    return sorted(found)


def times_for(scenario: Scenario, chamber: str, *, three_way: bool) -> dict[str, Any]:
    """The keys that set a chamber's valve times for one 3/2 valve, or for two 2/2 valves."""
    for key, table in (("phases", scenario.phases), ("timer", scenario.timer)):
        if table is None or chamber not in table.chambers:
            continue
        times = table.chambers[chamber]
        cycle = 1.0 if scenario.timer is None else scenario.timer.period
        if three_way:
            inlet, outlet = one_coil(times.inlet, times.outlet, cycle), []
        else:
            inlet, outlet = list(times.inlet), two_coils(times.inlet, cycle)
        if key == "timer":
            inlet, outlet = within(inlet, cycle), within(outlet, cycle)
        return {
            f"{key}.{chamber}.inlet": [[_written(key, t) for t in each] for each in inlet],
            f"{key}.{chamber}.outlet": [[_written(key, t) for t in each] for each in outlet],
        }
    return {}


def _written(key: str, time: float) -> float | str:
    return f"{time!r} s" if key == "timer" else time


def size_tube(trials: Trials, length: float) -> Sizing:
    """The tube of smallest bore, of one length [m] at every chamber."""
    tubes = {name: load("tube", name) for name in assets.names("tube")}
    ordered = sorted(tubes.items(), key=lambda item: (item[1].bore, item[0]))
    tried = trials.run([_tube_candidate(trials.scenario, length, *each) for each in ordered])
    best = next((each for each in tried if each.meets), None)
    return Sizing.of(
        trials,
        "tube",
        ("bore", "mm", 1e3),
        tried,
        best,
        answer=smallest(tried, trials.requirements, f"tube of {length:g} m", "tube"),
        notes=tuple(_tube_notes(trials, tried, length)),
    )


def _tube_candidate(scenario: Scenario, length: float, name: str, tube: Tube) -> Candidate:
    facts = {
        "bore [mm]": f"{1e3 * tube.bore:.3g}",
        "C": f"{_DM3 * tube.conductance(length):.3g}",
        "b": f"{tube.critical_ratio(length):.2g}",
        "air [ml]": f"{1e6 * tube.volume(length):.3g}",
    }
    sets: dict[str, Any] = {}
    for chamber, now in scenario.orthosis.chamber.items():
        key = f"orthosis.chamber.{chamber}"
        sets |= {f"{key}.tube": name, f"{key}.tube_length": f"{length!r} m"}
        if now.tube is None:  # the volume stood for the tube
            sets[f"{key}.tube_volume"] = "0 ml"
    return Candidate(name, tube.bore, sets, facts)


def _tube_notes(trials: Trials, tried: list[Tried], length: float) -> list[str]:
    """What a larger bore costs, and what no run counts."""
    notes = [f"C, b: sonic conductance [{_UNIT}] and critical pressure ratio of the tube alone"]
    notes += larger_is_worse(tried, "tube")
    ran = [each for each in tried if each.status == "run"]
    if len(ran) > 1:
        first, last = ran[0], ran[-1]
        unit = words(trials.air).unit
        costs = " and ".join(f"{shown(e.values[trials.air], unit)} with {e.name}" for e in (first, last))
        notes.append(f"{words(trials.air).label.lower()}: {costs}; the tube's own air counts")
    replaced = [
        f"{name}'s {1e6 * now.tube_volume:.3g} ml"
        for name, now in trials.scenario.orthosis.chamber.items()
        if now.tube is None and now.tube_volume > 0.0
    ]
    if replaced:
        notes.append(f"the tube takes the place of tube_volume ({', '.join(replaced)})")
    if ran:
        delay = load("tube", ran[0].name).delay(length)
        notes.append(f"sound takes {1e3 * delay:.1f} ms through the tube, which no run counts")
    return notes


def size_supply(trials: Trials, hours: float | None = None, strides: float | None = None) -> Sizing:
    """The lightest source, then the smallest; each is run full, and lasts as long as its content does."""
    lasting = _lasting(trials.scenario, hours, strides)
    sources = {name: load("source", name) for name in assets.names("source")}
    ordered = sorted(sources.items(), key=lambda item: (item[1].mass or math.inf, item[1].volume, item[0]))
    candidates = [_source_candidate(trials.scenario, *each) for each in ordered]
    ran = dataclasses.replace(trials, beside=_ASKED).run(candidates)
    tried = [_with_lasting(each, sources[each.name], trials.scenario, lasting) for each in ran]
    requirements = (*trials.requirements, *lasting)
    best = next((each for each in tried if each.meets), None)
    return Sizing.of(
        dataclasses.replace(trials, requirements=requirements),
        "supply",
        ("mass of the source", "kg", 1.0),
        tried,
        best,
        answer=_source_answer(tried, requirements),
        notes=_NOTES,
    )


def _source_answer(tried: list[Tried], requirements: tuple[Requirement, ...]) -> str:
    """The lightest, and those that meet the limits too and whose mass nobody states."""
    known = [each for each in tried if math.isfinite(each.candidate.size)]
    unknown = [each for each in tried if each not in known]
    more = ", ".join(each.name for each in unknown if each.meets)
    if not more:
        return smallest(tried, requirements, "source by mass", "source")
    if not any(each.meets for each in known):
        text = smallest(unknown, requirements, "source by volume", "source")
        return f"{text}; its mass is unknown, and no source of known mass meets them"
    text = smallest(known, requirements, "source by mass, of those whose mass is known,", "source")
    return f"{text}; {more} {'meet' if ',' in more else 'meets'} them too, mass unknown"


def _lasting(scenario: Scenario, hours: float | None, strides: float | None) -> tuple[Requirement, ...]:
    found = []
    if scenario.walking and hours is None and strides is None:
        strides = (scenario.limits or load("limits", USUAL_LIMITS)).strides_per_bottle[0]
    if strides is not None:
        found.append(Requirement(STRIDES, True, strides, "Strides without a pause"))
    if hours is not None:
        found.append(Requirement(HOURS, True, hours, "Hours without a pause", "h"))
    return tuple(found)


def _source_candidate(scenario: Scenario, name: str, source: Source) -> Candidate:
    pressure = scenario.supply.pressure
    facts = {
        "g": "–" if source.mass is None else f"{1e3 * source.mass:.3g}",
        "l": f"{1e3 * source.volume:.2g}",
    }
    size = math.nan if source.mass is None else source.mass
    if not source.given(pressure) > 0.0:
        full = bar((source.switch_off if source.kind == "compressor" else source.filling_pressure) or 0.0)
        has = f"stops at {full}" if source.kind == "compressor" else f"has {full} when full"
        return Candidate(name, size, {}, facts, f"{has}, and the supply is set to {bar(pressure)}")
    if scenario.supply.line_pressure is None:
        return Candidate(name, size, {"supply.source": name}, facts)
    table = scenario.resolved()["supply"]  # a source takes the line's place
    supply = {key: value for key, value in table.items() if key != "line_pressure"} | {"source": name}
    return Candidate(name, size, {"supply": supply}, facts)


def _with_lasting(each: Tried, source: Source, scenario: Scenario, lasting: tuple[Requirement, ...]) -> Tried:
    """A source that was run, with how long it lasts, and whether that is long enough."""
    if each.status != "run":
        return each
    flow, pressure = each.values["mean_flow"], scenario.supply.pressure
    hours = _hours_of(source, flow, pressure)
    values = {**each.values, HOURS: hours, STRIDES: 3600.0 * hours / each.values["stride_time"]}
    short = {r.label: shortfall(r, values[r.metric]) for r in lasting if not r.met(values[r.metric])}
    facts = {"mean": f"{flow:.3g}", "peak": f"{values['peak_flow']:.3g}"}
    candidate = dataclasses.replace(each.candidate, facts={**each.candidate.facts, **facts})
    notes = list(each.notes)
    if values["supply_sag"] > _SAGS:
        notes.append(f"its pressure sags by {values['supply_sag']:.0f} %")
    if math.isfinite(values["source_empty_after"]):
        notes.append(f"below the set pressure after {shown(values['source_empty_after'], 's')}")
    if source.kind == "compressor":
        delivery = _delivery_of(source, pressure)
        kept = "keeps up" if flow <= delivery else "cannot keep up"
        notes.append(f"the compressor {kept}: it delivers {delivery:.3g} l/min at {bar(pressure)}")
    return dataclasses.replace(
        each, candidate=candidate, values=values, short={**each.short, **short}, notes=tuple(notes)
    )


def _hours_of(source: Source, flow: float, pressure: float) -> float:
    """How long a full source lasts at a mean flow [l/min ANR] down to a gauge pressure [Pa]; inf: endless."""
    lost = flow - _delivery_of(source, pressure)
    if lost <= 0.0:
        return math.inf
    taken = lost / 6e4 / source.real_gas.litres_per_gram  # [kg/s]: a gram's litres are a kilogram's m³
    return source.given_at(pressure, taken) / taken / 3600.0


def _delivery_of(source: Source, pressure: float) -> float:
    """Flow of a running compressor against a gauge pressure [Pa], as free air [l/min]; 0 of others."""
    return 6e4 * source.delivery(pressure) * AIR.litres_per_gram
