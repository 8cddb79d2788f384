"""The steps of a run within a repeating period: for which share of each a valve is switched on."""

from dataclasses import dataclass
from typing import Self

import numpy as np

STILL = 1e-9  # of a stride, below which a step goes nowhere: its share would be rounding [-]
Intervals = tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Clock:
    """The start and end of each step, as (whole periods, what is beyond them), and its duration (n,)."""

    start: tuple[np.ndarray, np.ndarray]
    end: tuple[np.ndarray, np.ndarray]
    step: float | np.ndarray

    @classmethod
    def of(cls, time: np.ndarray, step: float | np.ndarray, period: float) -> Self:
        """Of steps that start at times (n,)."""
        return cls(np.divmod(time, period), np.divmod(time + step, period), step)

    def share(self, intervals: Intervals) -> np.ndarray:
        """The share of each step for which a valve is switched on."""
        merged = _merged(intervals)
        if not merged:
            return np.zeros(len(self.start[0]))
        moved = np.asarray(self.step) > STILL
        if not moved.all():  # who stands at a phase has a valve on there or not
            return np.where(moved, self._moving(merged, np.where(moved, self.step, 1.0)), self._still(merged))
        return self._moving(merged, self.step)

    def _still(self, merged: list[tuple[float, float]]) -> np.ndarray:
        beyond = self.start[1]
        return np.any([(start <= beyond) & (beyond < end) for start, end in merged], axis=0).astype(float)

    def _moving(self, merged: list[tuple[float, float]], step: float | np.ndarray) -> np.ndarray:
        share = (_until(merged, *self.end) - _until(merged, *self.start)) / step
        # to a billionth, so that an event on a step's edge is one
        return np.round(np.minimum(np.maximum(share, 0.0), 1.0), 9)


def _until(merged: list[tuple[float, float]], periods: np.ndarray, beyond: np.ndarray) -> np.ndarray:
    """How long a valve has been switched on since time 0."""
    inside = [np.minimum(np.maximum(beyond - start, 0.0), end - start) for start, end in merged]
    total = sum(end - start for start, end in merged)
    return periods * total + (inside[0] if len(inside) == 1 else np.sum(inside, axis=0))


def _merged(intervals: Intervals) -> list[tuple[float, float]]:
    """Overlapping events as one."""
    merged: list[tuple[float, float]] = []
    for start, end in sorted(intervals):
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return merged
