"""A stretch of a recording between two instants, each of which may lie between two rows."""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Doubles
from afo_sim.metrics.kernel import NUMBERS, call, kernel
from afo_sim.physics import register_jitable

ON_ROW = 1e-6  # of a step: what is no further from a row is on it [-]


@register_jitable
def rectified(value: float) -> float:
    """At least zero; no number stays none."""
    return 0.0 if value < 0.0 else value


@register_jitable
def row_at(b: Doubles, base: int, count: int, place: float) -> float:
    """A row's value at a place from 0 on, straight between two, beyond the last as there."""
    if place >= count - 1.0:
        return b[base + count - 1]
    k = int(place) if place >= 0.0 else 0
    return b[base + k] + (place - k) * (b[base + k + 1] - b[base + k])


@register_jitable
def places(start: float, end: float) -> int:
    """How many places a window has: its start, the rows within it and its end; none where it is empty."""
    return int(end) + int(int(end) < end) - int(start) + 1 if start < end else 0


@register_jitable
def place_of(start: float, end: float, k: int) -> float:
    """The k-th of a window's places."""
    return start if k == 0 else min(float(int(start) + k), end)


@register_jitable
def mean(b: Doubles, base: int, count: int, start: float, end: float) -> float:
    """Mean of a row over a window; 0 where it is empty."""
    area, at, before = 0.0, start, row_at(b, base, count, start)
    for k in range(1, places(start, end)):
        there = place_of(start, end, k)
        value = row_at(b, base, count, there)
        area, before, at = area + 0.5 * (before + value) * (there - at), value, there
    return area / (end - start) if start < end else 0.0


@register_jitable
def share(k: int, first: int, last: int, start: float, end: float) -> float:
    """Share in a window of a row's step [-], to sum up means of a step; outer rows have what is beyond."""
    found = min(max(end - k, 0.0), 1.0)
    if k == first:
        found += first - start
    return found + max(0.0, end - k - 1.0) if k == last else found


@register_jitable
def crossed(before: float, at: float, value_before: float, value: float) -> float:
    """Place at which what goes from one value to another crosses zero; the later one where it does not."""
    if not value_before * value < 0.0:
        return at
    return before + value_before / (value_before - value) * (at - before)


@kernel()
def _part(b: Doubles, out: Doubles) -> float:
    for k in range(places(b[1], b[2])):
        out[k] = row_at(b, NUMBERS, int(b[0]), place_of(b[1], b[2], k))
    return 0.0


@kernel()
def _shares(b: Doubles, out: Doubles) -> float:
    for k in range(int(b[2])):
        out[k] = share(int(b[1]) + k, int(b[1]), int(b[1] + b[2]) - 1, b[3], b[4])
    return 0.0


@dataclass(frozen=True)
class Window:
    """From one row's number to another, whole or not; nothing lies in one that ends where it starts."""

    start: float
    end: float

    def of(self, values: np.ndarray) -> np.ndarray:
        """A column from start to end (n,), straight between two rows, beyond the last as there."""
        return call(_part, (self.start, self.end), values, places(self.start, self.end))

    def shares(self, first: int, rows: int) -> np.ndarray:
        """Shares in it of rows' steps [-] (n,), to sum up means of a step; outer rows have what is beyond."""
        return call(_shares, (first, rows, self.start, self.end), (), rows)


def whole_cycles(rows: int, timestep: float, period: float) -> tuple[int, Window]:
    """Number of the whole cycles that begin with a run, and their stretch; 1 and the run where none fits."""
    number = math.floor((rows + 0.5 + ON_ROW) * timestep / period)
    return max(number, 1), Window(0.0, number * period / timestep if number else rows)
