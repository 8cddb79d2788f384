"""How long a chamber takes to fill and to vent, in place: through its own valves and tube.

A filling begins where the inlet's coil is switched on after the chamber vented, and ends where it vents
again; a venting is the other way round. A 3/2 valve vents from where its coil has no current.
"""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from afo_sim.metrics.ankle import chambers
from afo_sim.metrics.facts import Run
from afo_sim.metrics.metric import AIR, Found, Of, reported
from afo_sim.metrics.supply import SET

FULL, EMPTY = 0.9, 0.1  # of the supply's set gauge pressure [-]
FILL, VENT = "fill_time_{}", "vent_time_{}"
SINCE = "from the coil's switching on, the valve's delay included; the longest, none where one falls short"


@reported(
    AIR,
    (FILL, "s", "Time to fill, {}", f"to 90 % of the supply's set pressure, {SINCE}"),
    (VENT, "s", "Time to vent, {}", f"to 10 % of the supply's set pressure, {SINCE}"),
    of=Of.RUN,
)
def fill_times(run: Run) -> Found:
    """Longest filling and venting of each chamber [s]."""
    return filling(run.columns, run.from_rest)


def filling(columns: Mapping[str, np.ndarray], from_rest: bool = True) -> Found:
    """Longest filling and venting of each chamber [s].

    Parameters
    ----------
    columns : of a recording at the full step rate, SI
    from_rest : the first row is the start of the run; else what goes on there began before, and is left out

    Yields
    ------
    (name, value). Nothing of a chamber that is never filled, or never vented, or where one filling or venting
    ends before its pressure is reached. One that is cut off by the end of the run counts only where there is
    no whole one.
    """
    for name in chambers(columns):
        inlet, outlet = (columns[f"valve/{name}_{side}/coil"] > 0.0 for side in ("inlet", "outlet"))
        if not outlet.any() and columns[f"valve/{name}_outlet/opening"].any():
            outlet = ~inlet  # a 3/2 valve has one coil
        pressure = columns[f"chamber/{name}/pressure"]
        supply = columns.get(SET, columns["supply/pressure"])
        fills, vents = _turns(inlet, outlet, from_rest)
        for form, turns, there in (
            (FILL, fills, pressure >= FULL * supply),
            (VENT, vents, pressure <= EMPTY * supply),
        ):
            found = list(_times(columns["time"], turns, there))
            if found and math.isfinite(max(found)):
                yield form.format(name), max(found)


Turn = tuple[int, int]  # rows from, to


def is_filling(metric: str) -> bool:
    """Whether a metric's name is that of a time to fill or to vent."""
    return metric.startswith((FILL.format(""), VENT.format("")))


def _turns(inlet: np.ndarray, outlet: np.ndarray, from_rest: bool) -> tuple[list[Turn], list[Turn]]:
    """Rows from which on a chamber is filled, and vented, until the other begins."""
    state = np.where(outlet, -1, np.where(inlet, 1, 0))  # both open: it vents
    known = np.flatnonzero(state)
    if not len(known):
        return [], []
    begins = known[np.flatnonzero(np.diff(state[known], prepend=0))]
    ends = [*begins[1:], len(state)]
    turns = [(a, b) for a, b in zip(map(int, begins), map(int, ends), strict=True) if from_rest or a > 0]
    fills, vents = ([turn for turn in turns if state[turn[0]] == way] for way in (1, -1))
    return fills, vents


def _times(time: np.ndarray, turns: Sequence[Turn], there: np.ndarray) -> Iterator[float]:
    """Time that each turn takes until its pressure is there; of one that begins there, none."""
    n = len(time)
    begun = [(start, end) for start, end in turns if start < n and not there[start]]
    whole = [turn for turn in begun if turn[1] < n or there[turn[0] : turn[1]].any()] or begun
    for start, end in whole:
        after = np.flatnonzero(there[start:end])
        yield float(time[start + after[0]] - time[start]) if len(after) else math.inf
