"""The smallest muscles of the catalogue for one group, mounted so that they are taut at the same ankle angle.

A muscle of length L0 with ends and a link of length l is taut where its path is as long as both. Another
muscle L0' is taut there with

    l' = l + (L0 + ends) − (L0' + ends')
"""

import dataclasses
import math

from afo_sim.common import assets
from afo_sim.description import Muscle, MuscleGroup, Scenario, load
from afo_sim.study.effects import SHARES, beyond_limit
from afo_sim.study.sizing.pressures import bar
from afo_sim.study.sizing.requirement import Candidate, Tried, doubted
from afo_sim.study.sizing.result import Sizing, best_of, larger_is_worse, smallest
from afo_sim.study.sizing.trial import FULL, Trials

_MEANING = (
    "volume: of all braids at rest; link: so that the muscle is taut at the same ankle angle; "
    "grade: of the muscle's numbers, A measured to D guessed; *: not measured"
)
_IDEAL = ("chou_hannaford_1996", "tondu_lopez_2000")  # laws of the braid's geometry alone
_NOT_MEASURED = "not measured"
UPPER_BOUND = f"{_NOT_MEASURED}, ideal law: an upper bound"
DERIVED = f"{_NOT_MEASURED}, derived from another muscle"
_LIMITS = {name: limit for name, limit in SHARES.items() if name.startswith("muscle_")}


def size_muscle(trials: Trials, group: str | None = None, count: tuple[int, int] | None = None) -> Sizing:
    """The muscles of least volume at rest, of all kinds and counts."""
    name = group or next(iter(trials.scenario.orthosis.muscle))
    now = trials.scenario.orthosis.muscle[name]
    low, high = count or (now.count, now.count)
    muscles = {each: load("muscle", each) for each in assets.names("muscle")}
    candidates = [
        _candidate(trials.scenario, name, now, kind, muscle, n)
        for kind, muscle in muscles.items()
        for n in range(low, high + 1)
    ]
    tried = [_within_limits(each) for each in trials.run(sorted(candidates, key=lambda c: (c.size, c.name)))]
    best = best_of(tried)
    measured = "" if best is None or best.candidate.doubt else "measured "
    others = "; no measured one that was tried does" if best is not None and best.candidate.doubt else ""
    return Sizing.of(
        trials,
        "muscle",
        ("volume of all muscles at rest", "ml", 1e6),
        tried,
        best,
        answer=smallest(tried, trials.requirements, f"set of {measured}muscles for {name}", "muscle")
        + others,
        notes=(_MEANING, *larger_is_worse(tried, "muscle")),
    )


def _candidate(
    scenario: Scenario, group: str, now: MuscleGroup, name: str, muscle: Muscle, count: int
) -> Candidate:
    size = count * 0.25 * math.pi * muscle.bore**2 * muscle.nominal_length
    facts = {
        "bore [mm]": f"{1e3 * muscle.bore:.3g}",
        "volume [ml]": f"{1e6 * size:.0f}" if size >= 1e-4 else f"{1e6 * size:.3g}",
    }
    key = f"orthosis.muscle.{group}"
    sets = {f"{key}.type": name, f"{key}.count": count}
    link = link_for(now, muscle)
    reason = ""
    if link is not None:
        facts["link [cm]"] = f"{1e2 * link:.3g}".replace("-", "−")
        sets[f"{key}.link_length"] = f"{link!r} m"
        if link < 0.0:
            reason = f"is {-1e2 * link:.3g} cm too long for the path"
    doubt = doubt_of(muscle)
    facts["grade"] = doubted(muscle.grade, doubt) if doubt else muscle.grade
    if muscle.limits.pressure < scenario.supply.pressure:
        allowed, pressure = bar(muscle.limits.pressure), bar(scenario.supply.pressure)
        reason = reason or f"may hold {allowed}, and the supply has {pressure}"
    return Candidate(
        f"{count} × {name}", size, {} if reason else sets, facts, reason, (doubt,) if doubt else (), doubt
    )


def doubt_of(muscle: Muscle) -> str:
    """Why a muscle's force is not sure: its law has no number from a measurement; "" where it has one."""
    kinds = {each.kind for each in muscle.laws[muscle.law].provenance.values()}
    if not kinds:
        return _NOT_MEASURED if muscle.grade == "D" else ""
    if kinds - {"assumed", "derived"}:
        return ""
    if "derived" in kinds:
        return DERIVED
    return UPPER_BOUND if muscle.law in _IDEAL else _NOT_MEASURED


def link_for(now: MuscleGroup, muscle: Muscle) -> float | None:
    """Length of the link with which another muscle is taut at the same ankle angle [m]."""
    if now.link_length is None:
        return None
    own = now.type
    return now.link_length + own.nominal_length + own.end_length - muscle.nominal_length - muscle.end_length


def _within_limits(each: Tried) -> Tried:
    """The same; a muscle that leaves its own limits does not meet what is wanted."""
    beyond = {
        limit: beyond_limit(name, each.values[name])
        for name, limit in _LIMITS.items()
        if each.values.get(name, 0.0) > FULL
    }
    notes = tuple(note for note in each.notes if note not in beyond.values())
    return dataclasses.replace(each, short={**each.short, **beyond}, notes=notes)
