"""The least supply pressure that meets what is wanted: a scan, then ever closer between what fails and holds.

More pressure can be worse: it holds push-off back. So a scan of the whole range comes first, and the
answer is where it begins to hold, and from where on it no longer does. A pressure that a muscle or a valve
is not allowed never suffices.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from afo_sim.common import InputError, with_code
from afo_sim.description import Scenario, highest_pressures
from afo_sim.model import valves_of
from afo_sim.study.effects import BEYOND_LIMIT
from afo_sim.study.sizing.requirement import Candidate, Tried
from afo_sim.study.sizing.result import Sizing, nearest_miss
from afo_sim.study.sizing.trial import Trials, sentence_of

_STEP = 5e3  # to which the answer is found [Pa]
_SCAN = 9  # pressures that are tried first
_LOWEST = 5e4  # of the scan, gauge [Pa]
_HIGHEST = 6e5  # where no muscle states its own limit [Pa]
_INNER = 3  # pressures tried at once between one that fails and one that holds
Range = tuple[float, float]
_ALLOWED = "allowed pressure"  # what a pressure beyond it fails
_ALIKE = 1.0 + 1e-9
Limit = tuple[float, str]  # gauge pressure [Pa], who is allowed no more


def size_pressure(trials: Trials, at: float | None = None, between: Range | None = None) -> Sizing:
    """The least supply pressure."""
    low, high = between or _usual_range(trials.scenario)
    if not 0.0 <= low < high:
        raise InputError(
            "is not a valid range", field="between", value=f"{bar(low)} to {bar(high)}", allowed="rising"
        )
    ceiling = highest_allowed(trials.scenario, high)
    scan = _lattice(np.append(np.linspace(low, high, _SCAN), max(low, ceiling)))
    tried = _run(trials, scan if at is None else sorted({*scan, at}))
    while inner := _between(tried):
        tried += _run(trials, inner, done=len(tried))
        tried.sort(key=lambda each: each.candidate.size)
    first = next((k for k, each in enumerate(tried) if each.meets), None)
    best = None if first is None else tried[first]
    interval = None
    if first is not None:
        below = tried[first - 1].candidate.size if first else float("nan")
        interval = (below, tried[first].candidate.size)
    asked = next((each for each in tried if each.candidate.size == at), None)
    return Sizing.of(
        trials,
        "pressure",
        ("supply pressure", "bar", 1e-5),
        tried,
        best,
        answer=_answer(trials, tried, best, asked),
        notes=tuple(_notes(tried, best)),
        asked=asked,
        interval=interval,
    )


def _candidate(pressure: float) -> Candidate:
    """A supply pressure [Pa] to try."""
    return Candidate(bar(pressure), pressure, {"supply.pressure": f"{pressure:.9g} Pa"})


def _run(trials: Trials, pressures: Sequence[float], done: int = 0) -> list[Tried]:
    """What runs at these pressures [Pa] give; one that is not allowed does not meet what is wanted."""
    found = trials.run([_candidate(p) for p in pressures], beyond=done)
    for k, each in enumerate(found):
        if limit := exceeded(trials.scenario, each.candidate.size):
            beyond = f"beyond what {limit[1]} allowed ({bar(limit[0])})"
            found[k] = dataclasses.replace(each, short={_ALLOWED: beyond, **each.short})
    return found


def bar(pressure: float) -> str:
    """A pressure [Pa] for people."""
    return f"{1e-5 * pressure:.4g} bar"


def _usual_range(scenario: Scenario) -> Range:
    """From 0.5 bar to the highest supply pressure that all muscles and valves are allowed."""
    limits = [group.type.limits.pressure for group in scenario.orthosis.muscle.values()]
    top = highest_allowed(scenario, max(min(limits, default=_HIGHEST), scenario.supply.pressure))
    return min(_LOWEST, 0.5 * top), top


def _lattice(pressures: np.ndarray) -> list[float]:
    """Pressures on whole steps, each once; the last is not above the range."""
    return [float(_STEP * n) for n in np.unique(np.floor(pressures / _STEP + 1e-6).astype(int))]


def _between(tried: Sequence[Tried]) -> list[float]:
    """What to try next: about the first that holds, where it ends to hold, and where it may hold between."""
    meets = [each.meets for each in tried]
    first = meets.index(True) if True in meets else len(meets)
    last = next((k for k in range(first, len(meets)) if not meets[k]), len(meets))
    places = {k for k in (first, last) if 0 < k < len(tried)}
    if last < len(meets) and tried[last].short.keys() == {_ALLOWED}:
        places.discard(last)  # where it ends is the limit itself
    for k in range(1, first):
        below, above = tried[k - 1], tried[k]
        if k < len(tried) and below.short and above.short and not below.short.keys() & above.short.keys():
            places.add(k)
    return [p for k in sorted(places) for p in _inner(tried[k - 1].candidate.size, tried[k].candidate.size)]


def _inner(low: float, high: float) -> list[float]:
    """Up to three pressures on whole steps between two others; none where these are a step apart."""
    if high - low <= _STEP * (1.0 + 1e-6):
        return []
    inside = [n for n in range(int(low // _STEP) + 1, int(np.ceil(high / _STEP))) if low < _STEP * n < high]
    if len(inside) > _INNER:
        inside = [inside[round(k * (len(inside) - 1) / (_INNER + 1))] for k in range(1, _INNER + 1)]
    return [float(_STEP * n) for n in dict.fromkeys(inside)]


def _answer(trials: Trials, tried: Sequence[Tried], best: Tried | None, asked: Tried | None) -> str:
    least = "no pressure that was tried does" if best is None else f"the least that does is {best.name}"
    if best is not None and best is tried[0]:
        also = " too" if asked is not None and asked.meets else ""
        least = f"{best.name}, the lowest that was tried, does{also}"
    if asked is not None and _ALLOWED in asked.short:
        how = sentence_of(trials.requirements, asked.values) if asked.status == "run" else asked.reason
        return f"{asked.name} is {asked.short[_ALLOWED]}: {how}; {least}"
    if asked is not None:
        if asked.status != "run":
            return f"{asked.name} does not suffice: it was {asked.status} ({asked.reason}); {least}"
        how = sentence_of(trials.requirements, asked.values)
        if asked.meets:
            minded = "".join(f"; mind: {note}" for note in with_code(asked.notes, BEYOND_LIMIT))
            return f"{asked.name} suffices: {how}; {least}{minded}"
        return f"{asked.name} does not suffice: {how}; {least}"
    if best is None:
        allowed = [each for each in tried if _ALLOWED not in each.short]
        if not allowed:
            return f"no pressure that was tried is allowed: {tried[0].name} is {tried[0].short[_ALLOWED]}"
        ends = f"{allowed[0].name} to {allowed[-1].name}"
        return nearest_miss(allowed, trials.requirements, f"no pressure from {ends}")
    below = [each for each in tried if each.candidate.size < best.candidate.size]
    if not below:
        return f"{best.name} is enough, and the lowest that was tried: {_how(trials, best)}"
    return (
        f"{best.name} is the least that suffices: {_how(trials, best)}; at {below[-1].name} {below[-1].why}"
    )


def _how(trials: Trials, best: Tried) -> str:
    return sentence_of(trials.requirements, best.values)


def _notes(tried: Sequence[Tried], best: Tried | None) -> list[str]:
    """What to mind: more pressure that is worse, and pressures that could not be tried."""
    notes = []
    if best is not None:
        above = [each for each in tried if each.candidate.size > best.candidate.size]
        worse = next((each for each in above if not each.meets), None)
        if worse is not None and worse.short.keys() == {_ALLOWED}:
            notes.append(f"{worse.name} is {worse.short[_ALLOWED]}")
        elif worse is not None:
            k = above.index(worse)
            last = above[k - 1] if k else best
            notes.append(f"more is not better: from {worse.name} on it no longer holds ({worse.why}); "
                         f"{last.name} still does")  # fmt: skip
            if any(each.meets for each in above[k:]):
                notes.append("above that it holds again in places: see the table")
    return notes


def exceeded(scenario: Scenario, pressure: float) -> Limit | None:
    """The lowest limit that a supply pressure exceeds: of a muscle, or of what a valve's maker allows."""
    orthosis = scenario.orthosis
    highest = highest_pressures(orthosis, pressure)
    found: list[Limit] = []
    for name, group in orthosis.muscle.items():
        limit = group.type.limits.pressure
        if highest.get(group.chamber or name, pressure) > limit * _ALIKE:
            found.append((limit, "the muscles are"))
    for name, valve, before in valves_of(orthosis):
        if (
            valve.working_pressure is not None
            and highest.get(before, 0.0) > valve.working_pressure[1] * _ALIKE
        ):
            found.append((valve.working_pressure[1], f"valve {name} ({valve.name or 'unnamed'}) is"))
    return min(found, default=None)


def highest_allowed(scenario: Scenario, pressure: float) -> float:
    """The pressure, or the highest below it that all muscles and valves are allowed [Pa]."""
    limit = exceeded(scenario, pressure)
    while limit is not None and limit[0] < pressure:
        pressure = limit[0]
        limit = exceeded(scenario, pressure)
    return pressure
