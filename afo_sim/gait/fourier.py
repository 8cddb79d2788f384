"""Periodic signals as Fourier series: smooth at any phase, with exact derivatives."""

import functools
import math
from dataclasses import dataclass
from typing import Self

import numpy as np

KEPT = 8192  # phases of a wave, up to which its harmonics are kept


@dataclass(frozen=True, eq=False)
class Wave:
    """Phases, any real numbers of cycles [-], and exp(2πi phase): what all series at them have in common."""

    phase: np.ndarray
    turned: np.ndarray

    @classmethod
    def at(cls, phase: "np.ndarray | float | Wave") -> "Wave":
        """Of phases of any shape, wrapped, so that the thousandth stride is as exact as the first."""
        if isinstance(phase, Wave):
            return phase
        phases = np.asarray(phase, dtype=float)
        return cls(phases, np.exp(2j * np.pi * (phases % 1.0)))


@functools.lru_cache(maxsize=8)  # cases of a sweep ask for other series at the same phases
def _waves(wave: Wave, harmonics: int) -> np.ndarray:
    """Cosines and sines of a wave's phases, which series of as many harmonics weigh."""
    found, turned = np.empty((wave.phase.size, 2 * harmonics)), np.ones_like(wave.turned)
    for k in range(harmonics):
        turned = turned * wave.turned
        found[:, k], found[:, harmonics + k] = turned.real, turned.imag
    return found


@functools.lru_cache(maxsize=16)  # strides are sampled at the same phases
def _basis(phases: bytes, harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    """What a mean, cosines and sines are at phases, and what makes their weights of samples there."""
    wave = 2.0 * np.pi * np.outer(np.frombuffer(phases), np.arange(1, harmonics + 1))
    basis = np.column_stack([np.ones(len(wave)), np.cos(wave), np.sin(wave)])
    return basis, np.linalg.pinv(basis)


@dataclass(frozen=True, eq=False)
class FourierSeries:
    """A signal over phase: mean + progress · phase + harmonics of one cycle."""

    mean: float
    progress: float
    cosine: np.ndarray
    sine: np.ndarray
    closing_error: float  # value at phase 1 minus value at phase 0, before the drift was taken out
    residual: float  # root mean square of the samples about the series, drift apart

    @classmethod
    def fit(cls, phase: np.ndarray, values: np.ndarray, harmonics: int, *, progressing: bool = False) -> Self:
        """The least-squares series through samples of one cycle."""
        closing = float(values[-1] - values[0])
        level = values - closing * (phase - (0.0 if progressing else 0.5))
        basis, inverse = _basis(phase[:-1].tobytes(), harmonics)  # phase 1 is phase 0 again
        weights = inverse @ level[:-1]
        left = level[:-1] - basis @ weights
        return cls(
            mean=float(weights[0]),
            progress=closing if progressing else 0.0,
            cosine=weights[1 : harmonics + 1],
            sine=weights[harmonics + 1 :],
            closing_error=0.0 if progressing else closing,
            residual=math.sqrt(float(left @ left) / len(left)),
        )

    def __add__(self, other: "FourierSeries") -> "FourierSeries":
        """The sum of two signals, with the harmonics of the one that has more."""
        count = max(len(self.cosine), len(other.cosine))

        def longer(values: np.ndarray) -> np.ndarray:
            return np.concatenate([values, np.zeros(count - len(values))])

        return FourierSeries(
            mean=self.mean + other.mean,
            progress=self.progress + other.progress,
            cosine=longer(self.cosine) + longer(other.cosine),
            sine=longer(self.sine) + longer(other.sine),
            closing_error=self.closing_error + other.closing_error,
            residual=math.hypot(self.residual, other.residual),
        )

    def __call__(self, phase: np.ndarray | float | Wave, derivative: int = 0) -> np.ndarray:
        """The signal, or its first, second, … derivative with respect to phase."""
        wave = Wave.at(phase)
        if derivative == 0 and wave is phase and wave.phase.ndim == 1 and len(wave.phase) <= KEPT:
            waves = _waves(wave, len(self.cosine))
            harmonics: np.ndarray = waves @ np.concatenate([self.cosine, self.sine])
            return harmonics + self.mean + self.progress * wave.phase
        order = 2.0 * np.pi * np.arange(1, len(self.cosine) + 1)
        # Re Σ c_k w^k with w = exp(2πi phase), by Horner's rule: one exponential a sample, not one a harmonic
        weight = (self.cosine - 1j * self.sine) * (1j * order) ** derivative
        total = np.zeros_like(wave.turned)
        for coefficient in weight[::-1]:
            total += coefficient
            total *= wave.turned
        harmonics = total.real
        if derivative == 0:
            return harmonics + self.mean + self.progress * wave.phase
        return harmonics + (self.progress if derivative == 1 else 0.0)
