"""The first harmonic of a signal, and where a curve over frequency crosses a level."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

Relation = Literal["at", "below", "above"]
FIRST_PHASE = (-1.5 * math.pi, 0.5 * math.pi)  # of the lowest frequency: a lag is likelier than a lead


@dataclass(frozen=True)
class Harmonic:
    """A signal as mean + Re(phasor · exp(j 2π f t)), and the rest.

    phasor : of the first harmonic, in the signal's unit
    mean : in the signal's unit
    distortion : root mean square of the rest over that of the first harmonic [-]
    """

    phasor: complex
    mean: float
    distortion: float


def first_harmonic(time: np.ndarray, signal: np.ndarray, frequency: float) -> Harmonic:
    """The first harmonic by least squares; over whole periods it is Fourier's.

    Units: time [s] (n,), signal (n,), frequency [Hz].
    """
    turn = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.ones_like(turn), np.cos(turn), np.sin(turn)])
    (mean, cosine, sine), *_ = np.linalg.lstsq(basis, signal, rcond=None)
    phasor = complex(cosine, -sine)  # Re((a − jb) e^jωt) = a cos ωt + b sin ωt
    rest = signal - basis @ (mean, cosine, sine)
    size = abs(phasor) / math.sqrt(2.0)
    distortion = float(np.sqrt(np.mean(rest**2))) / size if size > 0.0 else math.nan
    return Harmonic(phasor, float(mean), distortion)


def unwrapped(phase: np.ndarray) -> np.ndarray:
    """Phases [rad] from the lowest frequency on, without jumps; the first lies within FIRST_PHASE."""
    followed = np.unwrap(phase)
    low, high = FIRST_PHASE
    turns = math.ceil((followed[0] - high) / (2.0 * math.pi))
    found: np.ndarray = followed - 2.0 * math.pi * turns
    assert low - 1e-12 <= found[0] <= high + 1e-12
    return found


@dataclass(frozen=True)
class Crossing:
    """Frequency [Hz] at which a curve first falls to a level; or it is below or above all that were tried."""

    frequency: float
    relation: Relation = "at"

    def __str__(self) -> str:
        return f"{'' if self.relation == 'at' else self.relation + ' '}{self.frequency:.3g} Hz"


def falls_to(frequencies: np.ndarray, curve: np.ndarray, level: float) -> Crossing:
    """Where a curve first falls to a level, on straight lines over the logarithm of the frequency.

    Units: frequencies [Hz] (n,), curve [dB] (n,).
    """
    under = np.flatnonzero(curve <= level)
    if not len(under):
        return Crossing(float(frequencies[-1]), "above")
    k = int(under[0])
    if k == 0:
        return Crossing(float(frequencies[0]), "at" if curve[0] == level else "below")
    share = (curve[k - 1] - level) / (curve[k - 1] - curve[k])
    low, high = np.log(frequencies[k - 1 : k + 1])
    return Crossing(float(np.exp(low + share * (high - low))))
