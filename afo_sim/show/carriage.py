"""A carriage for the camera that keeps up with a walker."""

from dataclasses import dataclass
from typing import Self

import numpy as np


@dataclass(frozen=True)
class Carriage:
    """Motion of even speed over a stride: x = start + length · strides [m].

    The carriage neither stops in stance nor hurries in swing, as the foot does. It keeps up with the walker
    where strides differ in duration. `ends` are its first and last x [m], `stride_time`
    is the mean [s].
    """

    start: float
    length: float
    ends: tuple[float, float]
    stride_time: float

    @classmethod
    def beside(cls, time: np.ndarray, walked: np.ndarray, x: np.ndarray) -> Self:
        """The carriage that stays nearest to an ankle.

        Units: time [s] (n,), walked [-] (n,), x [m] (n,).
        """
        basis = np.column_stack([np.ones_like(walked), walked])
        (start, length), *_ = np.linalg.lstsq(basis, x, rcond=None)
        took, count = float(np.ptp(time)), float(np.ptp(walked))
        ends = float(start + length * walked[0]), float(start + length * walked[-1])
        return cls(float(start), float(length), ends, took / count if count > 0.0 else 1.0)

    def at(self, walked: np.ndarray) -> np.ndarray:
        """Its x at strides (n,) [m]."""
        x: np.ndarray = self.start + self.length * walked
        return x
