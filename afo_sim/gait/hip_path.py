"""The ankle's path where only the angles of one leg and its load are known.

While the foot carries the body, the floor holds the ankle (`rocker`), and the chain ankle–knee–hip tells
where the hip is. The other leg does the same half a stride later. So the hip of the swinging leg is the
standing leg's, and the chain hip–knee–ankle leads down to the swinging ankle.
"""

from dataclasses import dataclass

import numpy as np

from afo_sim.gait.cycle import HARMONICS
from afo_sim.gait.fourier import FourierSeries
from afo_sim.gait.rocker import FootShape, rocking

THIGH, SHANK = 0.245, 0.246  # of body height (Winter 2009, figure 4.1, after Drillis & Contini)
LOADED = 0.6  # upward force above which the floor is taken to hold the foot [body weights]
LATE = 0.9  # phase beyond which force is the next heel strike's
SMOOTHED = 3  # harmonics of the hip's path in stance …
SPAN = 1.0 / 0.6  # … over this many strides, so that the window has no periodic ends


@dataclass(frozen=True)
class Chain:
    """Lengths of a leg: hip to knee, knee to ankle [m]."""

    thigh: float
    shank: float

    @classmethod
    def of_height(cls, body_height: float) -> "Chain":
        """Of a person of that height [m]."""
        return cls(THIGH * body_height, SHANK * body_height)

    def hip(self, shank_angle: np.ndarray, knee_angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The hip from the ankle: forward, up [m] (n,).

        Parameters
        ----------
        shank_angle : knee ahead of the ankle positive [rad] (n,)
        knee_angle : flexion positive [rad] (n,)
        """
        thigh = knee_angle - shank_angle  # knee ahead of the hip
        forward = self.shank * np.sin(shank_angle) - self.thigh * np.sin(thigh)
        return forward, self.shank * np.cos(shank_angle) + self.thigh * np.cos(thigh)


@dataclass(frozen=True, eq=False)
class AnklePath:
    """forward [m] (n,), from 0 at heel strike; up [m] (n,), above the floor.

    held: the phases between which the floor held the foot; gaps: what the chain missed the floor by at the
    end and at the start of that, (forward, up) × (end, start) [m] (2, 2).
    """

    forward: np.ndarray
    up: np.ndarray
    held: tuple[float, float]
    gaps: np.ndarray


def ankle_path(
    phase: np.ndarray,
    angles: tuple[np.ndarray, np.ndarray, np.ndarray],
    load: np.ndarray,
    stride_length: float,
    foot: FootShape,
    chain: Chain,
) -> AnklePath:
    """The ankle's path over one stride of a walker whose legs do alike.

    Units: phase [-] (n,), angles [rad] (n,), load [body weights] (n,), stride_length [m].
    """
    shank, knee, ankle = angles
    start = float(phase[np.argmax(load > LOADED)])
    end = float(phase[(load > LOADED) & (phase < LATE)][-1])
    way = stride_length * phase
    floor = rocking(ankle - shank, foot)
    joined, gaps = [], []
    for held, to_hip, travel in zip(floor, chain.hip(shank, knee), (way, 0.0 * way), strict=True):
        swing = _Swing(phase, held - travel, to_hip, (start, end))
        joined.append(swing.joined() + travel)
        gaps.append(swing.gaps)
    forward, up = (
        FourierSeries.fit(phase, signal, HARMONICS, progressing=number == 0)(phase)
        for number, signal in enumerate(joined)
    )
    return AnklePath(forward - forward[0], up, (start, end), np.array(gaps))


class _Swing:
    """One coordinate of the ankle, steady travel apart, through stance and swing."""

    def __init__(
        self, phase: np.ndarray, held: np.ndarray, to_hip: np.ndarray, window: tuple[float, float]
    ) -> None:
        """held: the ankle by the floor; to_hip: the hip from the ankle; window: where the floor holds."""
        self.phase, self.held, self.to_hip = phase, held, to_hip
        self.start, self.end = window
        inside = (phase >= self.start) & (phase <= self.end)
        self._weights = np.linalg.lstsq(_basis(phase[inside]), (held + to_hip)[inside], rcond=None)[0]
        ends = np.array([self.end, 1.0 + self.start])
        self.gaps = self._hanging(ends) - np.interp(ends % 1.0, phase, held)

    def _hanging(self, phase: np.ndarray) -> np.ndarray:
        """The ankle that hangs from the standing leg's hip, at phases from `end` to 1 + `start` (m,)."""
        other = np.clip(phase - 0.5, self.start, self.end)
        return np.asarray(_basis(other) @ self._weights - np.interp(phase % 1.0, self.phase, self.to_hip))

    def joined(self) -> np.ndarray:
        """By the floor where it holds, else by the chain (n,).

        What the chain misses at the two ends is the pelvis' turn and drop: it is taken out, linear between.
        """
        later = np.where(self.phase < self.start, self.phase + 1.0, self.phase)
        share = (later - self.end) / (1.0 + self.start - self.end)
        hanging = self._hanging(later) - self.gaps[0] * (1.0 - share) - self.gaps[1] * share
        return np.where((later <= self.end) & (later >= self.start), self.held, hanging)


def _basis(phase: np.ndarray) -> np.ndarray:
    """Constant, cosines and sines (n, 1 + 2 SMOOTHED)."""
    turn = 2.0 * np.pi * np.outer(phase / SPAN, np.arange(1, SMOOTHED + 1))
    return np.column_stack([np.ones(len(phase)), np.cos(turn), np.sin(turn)])
