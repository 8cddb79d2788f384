"""How often valves are switched, how long they last at that, and how long chambers take to fill and to vent.

A filling begins where the inlet's coil is switched on after the chamber vented, and ends where it vents
again; a venting is the other way round. A 3/2 valve vents from where its coil has no current.
"""

import math
from collections.abc import Mapping

import numpy as np

from afo_sim.common import Doubles
from afo_sim.metrics.air_per_stride import SET
from afo_sim.metrics.facts import Run
from afo_sim.metrics.kernel import NUMBERS, R, S, base, call, chambers, has, kernel, valves
from afo_sim.metrics.metric import AIR, Found, Of, reported
from afo_sim.metrics.window import ON_ROW, crossed
from afo_sim.physics import register_jitable

ON = "how often its coil is switched on; a proportional valve's, from shut to open"
SECONDS = 3600.0  # of an hour


@register_jitable
def _rise(b: Doubles, coil: int, counts: int, count: int, k: int) -> float:
    """How often a coil is switched on in a row's step: by what its drive counts, else (−1) by its current."""
    if counts >= 0:
        return max(b[counts + k + 1] - b[counts + k], 0.0) if k + 1 < count else 0.0
    return 1.0 if b[coil + k] > 0.0 and not (k > 0 and b[coil + k - 1] > 0.0) else 0.0


@kernel()
def _rises(b: Doubles, out: Doubles) -> float:
    for k in range(int(b[0])):
        out[k] = _rise(b, NUMBERS, NUMBERS if b[1] else -1, int(b[0]), k)
    return 0.0


def rises(columns: Mapping[str, np.ndarray], valve: str) -> np.ndarray:
    """How often a valve's coil is switched on in each row's step (n,)."""
    counted = columns.get(f"valve/{valve}/switches")
    values = columns[f"valve/{valve}/coil"] if counted is None else counted
    return call(_rises, (counted is not None,), values, len(values))


@reported(AIR, ("switches_per_stride_{}", "", "Switchings per stride, {}", ON), of=Of.WORN)
@kernel(R.valves)
def switching(b: Doubles, out: Doubles) -> float:
    """Switchings of each valve in a stride."""
    for valve in range(int(b[S.valves])):
        row, out[valve] = R.chambers + 2 * int(b[S.chambers]) + 2 * valve, 0.0
        counts = base(b, row) if has(b, row) else -1
        for k in range(int(b[S.first]), int(b[S.end])):
            out[valve] += _rise(b, base(b, row + 1), counts, int(b[S.count]), k)
    return 0.0


@reported(AIR, ("switches_per_minute_{}", "", "Switchings per minute, {}", ON))
def switching_by_the_minute(columns: Mapping[str, np.ndarray], steps: np.ndarray) -> Found:
    """Switchings of each valve in a run, by the minute; of the rows whose whole step counts."""
    minutes, counted = float(steps.sum()) / 60.0, steps > (1.0 - ON_ROW) * steps[0]
    for valve in valves(columns):
        yield f"switches_per_minute_{valve}", float(rises(columns, valve)[counted].sum()) / minutes


@reported(
    AIR,
    ("hours_until_valve_life", "h", "Hours until a valve's rated switchings",
     "of the valve that comes to them first, switched without a pause as in this run"),
    of=Of.RUN,
    made_of=("stride_time",),
)  # fmt: skip
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
        found = call(_fills, (FULL, EMPTY, from_rest), (columns["time"], inlet, outlet, pressure, supply), 2)
        for form, longest in zip((FILL, VENT), found.tolist(), strict=True):
            if math.isfinite(longest):
                yield form.format(name), longest


def is_filling(metric: str) -> bool:
    """Whether a metric's name is that of a time to fill or to vent."""
    return metric.startswith((FILL.format(""), VENT.format("")))


@kernel()
def _fills(b: Doubles, out: Doubles) -> float:
    """Longest filling and venting, each until the other begins; ∞ where one of them falls short."""
    # One whose pressure is there as it begins does not count, nor one that the last row cuts short.
    n, at = int(b[0]), NUMBERS
    for side in range(2):
        sign, start, state, missed = 1.0 - 2.0 * side, -1, 0.0, 0.0  # `missed` in the row before
        out[side] = -math.inf
        for k in range(n):
            beyond = sign * (b[at + 3 * n + k] - b[1 + side] * b[at + 4 * n + k])
            now = -1.0 if b[at + 2 * n + k] > 0.0 else b[at + n + k]  # both open: it vents
            if now != 0.0 and now != state:
                out[side] = math.inf if start >= 0 else out[side]
                state, start = now, k if now == sign and (b[3] or k > 0) and not beyond >= 0.0 else -1
            elif start >= 0 and beyond >= 0.0:
                until = crossed(b[at + k - 1], b[at + k], missed, beyond)
                out[side], start = max(out[side], until - b[at + start]), -1
            missed = beyond
    return 0.0
