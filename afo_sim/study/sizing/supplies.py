"""The lightest source of the catalogue whose pressure suffices and that lasts long enough."""

import dataclasses
import math

from afo_sim.common import assets
from afo_sim.description.air.source import Source
from afo_sim.description.reader import USUAL_LIMITS, load
from afo_sim.description.scenario import Scenario
from afo_sim.physics.gas import AIR
from afo_sim.study.sizing.candidate import Candidate, Tried
from afo_sim.study.sizing.pressures import bar
from afo_sim.study.sizing.requirement import Requirement, shown
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.sizing.trial import Trials, shortfall
from afo_sim.study.sizing.words import smallest

HOURS, STRIDES = "hours_of_source", "strides_of_source"
SAGS = 2.0  # share of the set pressure from which on a sag is told [percent]
ASKED = frozenset({"mean_flow", "peak_flow", "supply_sag", "source_empty_after", "stride_time"})
NOTES = (
    "g, l: mass and volume of the source; mean, peak: flow out of it [l/min] of the free gas",
    "each run begins with a full source; strides and hours are of its content down to the set pressure, "
    "which cools as it gives the mean flow of the run; air before the first step is not taken out",
)


def size_supply(trials: Trials, hours: float | None = None, strides: float | None = None) -> Sizing:
    """The lightest source, then the smallest; each is run full, and lasts as long as its content does."""
    lasting = _lasting(trials.scenario, hours, strides)
    sources = {name: load("source", name) for name in assets.names("source")}
    ordered = sorted(sources.items(), key=lambda item: (item[1].mass or math.inf, item[1].volume, item[0]))
    candidates = [_candidate(trials.scenario, *each) for each in ordered]
    ran = dataclasses.replace(trials, beside=ASKED).run(candidates)
    tried = [_with_lasting(each, sources[each.name], trials.scenario, lasting) for each in ran]
    requirements = (*trials.requirements, *lasting)
    best = next((each for each in tried if each.meets), None)
    return Sizing(
        kind="supply",
        scenario=trials.scenario.name,
        requirements=requirements,
        air=trials.air,
        axis=("mass of the source", "kg", 1.0),
        tried=tuple(tried),
        best=best,
        answer=_answer(tried, requirements),
        notes=NOTES,
    )


def _answer(tried: list[Tried], requirements: tuple[Requirement, ...]) -> str:
    """The lightest, and those that meet the limits too and whose mass nobody tells."""
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


def _candidate(scenario: Scenario, name: str, source: Source) -> Candidate:
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
    hours = hours_of(source, flow, pressure)
    values = {**each.values, HOURS: hours, STRIDES: 3600.0 * hours / each.values["stride_time"]}
    short = {r.label: shortfall(r, values[r.metric]) for r in lasting if not r.met(values[r.metric])}
    facts = {"mean": f"{flow:.3g}", "peak": f"{values['peak_flow']:.3g}"}
    candidate = dataclasses.replace(each.candidate, facts={**each.candidate.facts, **facts})
    notes = list(each.notes)
    if values["supply_sag"] > SAGS:
        notes.append(f"its pressure sags by {values['supply_sag']:.0f} %")
    if math.isfinite(values["source_empty_after"]):
        notes.append(f"below the set pressure after {shown(values['source_empty_after'], 's')}")
    if source.kind == "compressor":
        delivery = delivery_of(source, pressure)
        kept = "keeps up" if flow <= delivery else "cannot keep up"
        notes.append(f"the compressor {kept}: it delivers {delivery:.3g} l/min at {bar(pressure)}")
    return dataclasses.replace(
        each, candidate=candidate, values=values, short={**each.short, **short}, notes=tuple(notes)
    )


def hours_of(source: Source, flow: float, pressure: float) -> float:
    """How long a full source lasts at a mean flow [l/min ANR] down to a gauge pressure [Pa]; inf: endless.

    It cools meanwhile. The air before the first step is not taken out.
    """
    lost = flow - delivery_of(source, pressure)
    if lost <= 0.0:
        return math.inf
    taken = lost / 6e4 / source.real_gas.litres_per_gram  # [kg/s]: a gram's litres are a kilogram's m³
    return source.given_at(pressure, taken) / taken / 3600.0


def delivery_of(source: Source, pressure: float) -> float:
    """Flow of a running compressor against a gauge pressure [Pa], as free air [l/min]; 0 of others."""
    return 6e4 * source.delivery(pressure) * AIR.litres_per_gram
