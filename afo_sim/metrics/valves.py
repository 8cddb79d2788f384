"""How often valves are switched, how long they last at that, and how long chambers take to fill and to vent.

A filling begins where the inlet's coil is switched on after the chamber vented, and ends where it vents
again; a venting is the other way round. A 3/2 valve vents from where its coil has no current.
"""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from afo_sim.metrics.air_per_stride import SET
from afo_sim.metrics.facts import Run
from afo_sim.metrics.metric import AIR, Found, Of, reported
from afo_sim.metrics.strides import Stride, chambers
from afo_sim.metrics.window import ON_ROW, crossing

ON = "how often its coil is switched on; a proportional valve's, from shut to open"
SECONDS = 3600.0  # of an hour


def valves(columns: Mapping[str, np.ndarray]) -> list[str]:
    """Names of a recording's valves."""
    return [name.split("/")[1] for name in columns if name.startswith("valve/") and name.endswith("/coil")]


def rises(columns: Mapping[str, np.ndarray], valve: str) -> np.ndarray:
    """How often a valve's coil is switched on in each row's step (n,)."""
    counted = columns.get(f"valve/{valve}/switches")
    if counted is not None:
        return np.maximum(np.diff(counted, append=counted[-1:]), 0.0)
    on = columns[f"valve/{valve}/coil"] > 0.0
    before = np.concatenate([[False], on[:-1]])
    return np.asarray(on & ~before, float)


@reported(AIR, ("switches_per_stride_{}", "", "Switchings per stride, {}", ON), of=Of.WORN)
def switching(stride: Stride) -> Found:
    """Switchings of each valve in a stride."""
    for valve in valves(stride.columns):
        yield f"switches_per_stride_{valve}", float(rises(stride.columns, valve)[stride.rows].sum())


@reported(AIR, ("switches_per_minute_{}", "", "Switchings per minute, {}", ON))
def switching_by_the_minute(columns: Mapping[str, np.ndarray], steps: np.ndarray) -> Found:
    """Switchings of each valve in a run, by the minute; of the rows whose whole step counts."""
    minutes, counted = float(steps.sum()) / 60.0, steps > (1.0 - ON_ROW) * steps[0]
    for valve in valves(columns):
        yield f"switches_per_minute_{valve}", float(rises(columns, valve)[counted].sum()) / minutes


@reported(
    AIR,
    (
        "hours_until_valve_life",
        "h",
        "Hours until a valve's rated switchings",
        "of the valve that comes to them first, switched without a pause as in this run",
    ),
    of=Of.RUN,
    made_of=("stride_time",),
)
def valve_life(run: Run) -> Found:
    """Hours until a valve's rated switchings; of walking, by the strides that count, else by the minute."""
    rated, counted = run.facts.rated_switches or {}, run.counted
    rates = {}
    if counted:
        seconds = sum(stride.duration for stride in counted)
        for valve in rated:
            switched = rises(run.columns, valve)
            rates[valve] = sum(float(switched[stride.rows].sum()) for stride in counted) / seconds
    elif not run.facts.walks:
        rates = {valve: run.totals[f"switches_per_minute_{valve}"].value / 60.0 for valve in rated}
    yield from life_metrics(rates, rated)


def life_metrics(rates: Mapping[str, float], rated: Mapping[str, float]) -> Found:
    """Hours until the first valve has been switched as often as its maker rates it."""
    hours = [rated[valve] / rate / SECONDS for valve, rate in rates.items() if valve in rated and rate > 0.0]
    if hours:
        yield "hours_until_valve_life", min(hours)


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
    """Longest filling and venting of each chamber [s]."""
    for name in chambers(columns):
        inlet = columns[f"valve/{name}_inlet/coil"] > 0.0
        outlet = columns[f"valve/{name}_outlet/coil"] > 0.0
        if not outlet.any() and columns[f"valve/{name}_outlet/opening"].any():
            outlet = ~inlet  # a 3/2 valve has one coil
        pressure = columns[f"chamber/{name}/pressure"]
        supply = columns.get(SET, columns["supply/pressure"])
        fills, vents = _turns(inlet, outlet, from_rest)
        for form, turns, beyond in (
            (FILL, fills, pressure - FULL * supply),
            (VENT, vents, EMPTY * supply - pressure),
        ):
            found = list(_times(columns["time"], turns, beyond))
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
    fills = [turn for turn in turns if state[turn[0]] == 1]
    return fills, [turn for turn in turns if state[turn[0]] == -1]


def _times(time: np.ndarray, turns: Sequence[Turn], beyond: np.ndarray) -> Iterator[float]:
    """Time that each turn takes until its pressure is there, 0 or beyond; of one that begins there, none."""
    n, there = len(time), beyond >= 0.0
    begun = [(start, end) for start, end in turns if start < n and not there[start]]
    whole = [turn for turn in begun if turn[1] < n or there[turn[0] : turn[1]].any()] or begun
    for start, end in whole:
        after = np.flatnonzero(there[start:end])
        yield crossing(time, beyond, start + int(after[0])) - float(time[start]) if len(after) else math.inf
