"""Where in the shank's curve a walker's heel strikes, from what the strike does to the shank.

The floor stops the heel, and the shank, which has begun to rise, falls back and swings on within a tenth of a
second. In four recorded legs of three people the dip lies 41, 42, 50 and 51 ms behind the instant at which a
force plate feels the heel (GaitAnalysisToolKit's walk, BMClab's walk 2, OpenSim's walking5; one stride each).
A dip in a single stride is hardly larger than a sensor's noise; here it is looked for in the mean of many, in
what the curve of few harmonics leaves over.
"""

import math

import numpy as np

FROM, BIN, BINS = -0.08, 0.005, 51  # phase of the first bin, width of each, and how many there are
DIP = 0.047  # from the strike to the dip [s]; the four above have 46 ms on average
HALF = 0.035  # from the dip to the heights before and after it [s]
HALVES = 3, 10  # the same, at least and at most, in bins
WEIGHTS = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0  # of neighbouring bins
ENOUGH = 0.5  # samples of a bin that counts
KEPT = 40.0  # strides whose mean a bin is
# Standard deviation of where people's heels strike in the population's curve, and of a dip that the curve's
# higher harmonics give alone. 70 walkers of an independent test had 0.022 of the first; both are assumed.
SPREAD, RESIDUAL = 0.025, math.radians(0.35)
USUAL = 0.1  # share of the mean square dip of all places that counts as the curve's own
NOTHING = 6.0  # twice the log of how much likelier a dip must make a place to be believed
SURE = 0.9  # share of likelihood from which on the strike counts as seen


class HeelStrike:
    """Learns the phase of a walker's heel strike, in the phase of the population's."""

    def __init__(self) -> None:
        self.phase = 0.0
        self.seen = False
        self.forget()

    def forget(self) -> None:
        """Forget the mean, and keep the phase."""
        self._mean, self._count = np.zeros(BINS), np.zeros(BINS)

    def take(self, phase: float, left: float, gone: float) -> None:
        """Take in what the curve leaves over [rad] at a phase, of a sample that is so much of a stride."""
        place = ((phase - FROM) % 1.0) / BIN
        first = int(place)
        if first >= BINS - 1:
            return
        for k, share in ((first, 1.0 - place + first), (first + 1, place - first)):
            self._count[k] += share
            if self._count[k] > 0.0:
                self._mean[k] += share / self._count[k] * (left - self._mean[k])
            self._count[k] = min(self._count[k], KEPT * BIN / max(gone, 1e-5))

    def find(self, noise: float, rate: float) -> None:
        """Weigh every place by its dip, of a noise [rad²] and a rate of strides [1/s]."""
        half, spare = int(min(max(HALF * rate / BIN, HALVES[0]), HALVES[1]) + 0.5), len(WEIGHTS) // 2
        middle = np.arange(half + spare, BINS - half - spare)
        level = np.convolve(self._mean, WEIGHTS, "same")
        doubt = np.convolve(1.0 / np.where(self._count > ENOUGH, self._count, 1e-9), WEIGHTS**2, "same")
        dip = level[middle - half] + level[middle + half] - 2.0 * level[middle]
        variance = doubt[middle - half] + doubt[middle + half] + 4.0 * doubt[middle]
        places = FROM + BIN * middle - DIP * rate
        known = np.maximum(dip, 0.0) ** 2 / (noise * variance + RESIDUAL**2 + USUAL * np.mean(dip**2))
        score = 0.5 * (known - (places / SPREAD) ** 2)
        best = max(float(score.max()), 0.5 * NOTHING)
        weights = np.exp(score - best)
        seen, whole = float(weights.sum()), float(weights.sum()) + math.exp(0.5 * NOTHING - best)
        self.phase, self.seen = float(weights @ places) / whole, seen > SURE * whole
