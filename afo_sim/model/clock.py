"""The steps of a run within a repeating period: for which share of each a valve is switched on."""

from dataclasses import dataclass
from typing import Self

import numpy as np

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
        """The share of each step for which a valve is switched on.

        Parameters
        ----------
        intervals : [from, to) within the period

        Returns
        -------
        (n,) from 0 to 1: between them where an event falls within a step
        """
        merged = _merged(intervals)
        if not merged:
            return np.zeros(len(self.start[0]))
        share = (_until(merged, *self.end) - _until(merged, *self.start)) / self.step
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
