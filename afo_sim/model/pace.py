"""Pace of a walker: how far the walk has come by a time, where the cadence changes and the walker stands.

The cadence is the walker's own times a factor. A factor that jumped would jerk the shank. So it passes from
one value f to the next g along a cubic, f + (g − f)(3 s² − 2 s³) with s from 0 to 1 over `change`. The
phase φ, its rate and its second derivative are continuous, and so is the shank's acceleration
φ̈ q′(φ) + φ̇² q″(φ).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from afo_sim.description.walking import Gait


@dataclass(frozen=True)
class Pace:
    """Factors on the cadence: `factors[0]` first; from `times[k]` [s] on it becomes `factors[k + 1]`.

    Each change takes `change` [s].
    """

    times: tuple[float, ...]
    factors: tuple[float, ...]
    change: float

    @classmethod
    def of(cls, gait: Gait) -> Self:
        """What a gait tells; the walker's own cadence before the first time that it tells."""
        told = gait.pace
        if not told or told[0][0] > 0.0:
            told = ((0.0, 1.0), *told)
        return cls(tuple(at for at, _ in told[1:]), tuple(factor for _, factor in told), gait.pace_change)

    def walked(self, time: np.ndarray) -> np.ndarray:
        """Time that the walk takes at the walker's own cadence to come as far: the integral of the factor.

        Units: time [s] (n,), returns [s].
        """
        walked = self.factors[0] * np.minimum(time, self.times[0] if self.times else np.inf)
        for k, (old, new) in enumerate(pairwise(self.factors)):
            since = np.maximum(time - self.times[k], 0.0)
            share = np.minimum(since / self.change, 1.0)
            # ∫ (3 s² − 2 s³) ds = s³ − s⁴/2
            walked += self.change * (old * share + (new - old) * (share**3 - 0.5 * share**4))
            until = self.times[k + 1] if k + 1 < len(self.times) else np.inf
            walked += new * np.maximum(np.minimum(time, until) - self.times[k] - self.change, 0.0)
        return walked

    @property
    def stands(self) -> tuple[tuple[float, float], ...]:
        """Stretches of time in which the walker stands: [from, to] [s]; who stays has no end."""
        begun = (0.0, *(at + self.change for at in self.times))
        ended = (*self.times, np.inf)
        return tuple(
            (start, end)
            for start, end, factor in zip(begun, ended, self.factors, strict=True)
            if factor == 0.0
        )
