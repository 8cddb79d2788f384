"""A stretch of a recording between two instants, each of which may lie between two rows."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

ON_ROW = 1e-6  # of a step: what is no further from a row is on it [-]


@dataclass(frozen=True)
class Window:
    """From one row's number to another, whole or not; nothing lies in one that ends where it starts."""

    start: float
    end: float

    @cached_property
    def places(self) -> np.ndarray:
        """Numbers of its start, of the rows within it and of its end (n,)."""
        within = np.arange(math.floor(self.start) + 1, math.ceil(self.end))
        return np.concatenate([[self.start], within, [self.end]] if self.start < self.end else [[]])

    def of(self, values: np.ndarray) -> np.ndarray:
        """A recording's column at these places (n,), straight between two rows, beyond the last as there."""
        if not len(self.places):
            return values[:0]
        first, last = math.floor(self.start), math.ceil(self.end)
        near = values[first : last + 1]
        if (lacking := last + 1 - first - len(near)) > 0:
            near = np.append(near, np.full(lacking, near[-1]))
        if (first, last) == (self.start, self.end):
            return near
        found = near.copy()
        found[0] += (self.start - first) * (near[1] - near[0])
        found[-1] -= (last - self.end) * (near[-1] - near[-2])
        return found

    def mean(self, values: np.ndarray) -> float:
        """Mean of a recording's column over its time; 0 where nothing lies in it."""
        area = increments(self.of(values), self.places).sum()
        return float(area / (self.end - self.start)) if len(self.places) else 0.0

    def shares(self, first: int, rows: int) -> np.ndarray:
        """Shares in it of rows' steps [-] (n,), to sum up means of a step; outer rows have what is beyond."""
        found = np.clip(self.end - np.arange(first, first + rows), 0.0, 1.0)
        found[0] += first - self.start
        found[-1] += max(0.0, self.end - first - rows)
        return found


def whole_cycles(rows: int, timestep: float, period: float) -> tuple[int, Window]:
    """Number of the whole cycles that begin with a run, and their stretch; 1 and the run where none fits."""
    number = math.floor((rows + 0.5 + ON_ROW) * timestep / period)
    return max(number, 1), Window(0.0, number * period / timestep if number else rows)


def increments(values: np.ndarray, over: np.ndarray) -> np.ndarray:
    """∫ values d(over) of each step from row to row, by the trapezoidal rule (n − 1,)."""
    found: np.ndarray = 0.5 * (values[1:] + values[:-1]) * (over[1:] - over[:-1])
    return found


def crossing(over: np.ndarray, values: np.ndarray, row: int) -> float:
    """Where values cross zero in the step to a row, on a straight line; the row's where they do not."""
    if row == 0 or not values[row - 1] * values[row] < 0.0:
        return float(over[row])
    share = values[row - 1] / (values[row - 1] - values[row])
    return float(over[row - 1] + share * (over[row] - over[row - 1]))
