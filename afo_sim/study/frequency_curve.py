"""A frequency response as curves: first harmonic, gain, phase, distortion, bandwidth."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from afo_sim.common import in_unit

Relation = Literal["at", "below", "above"]
_FIRST_PHASE = (-1.5 * math.pi, 0.5 * math.pi)  # of the lowest frequency: a lag is likelier than a lead
HALF_POWER = 20.0 * math.log10(math.sqrt(0.5))  # −3.01 dB
_QUARTER_TURN = -0.5 * math.pi
_SHOWN = {"rad": "deg", "Pa": "bar"}  # units that people read; others as they are


@dataclass(frozen=True)
class Harmonic:
    """A signal as mean + Re(phasor · exp(j 2π f t)), and the rest."""

    phasor: complex
    mean: float
    distortion: float


def first_harmonic(time: np.ndarray, signal: np.ndarray, frequency: float) -> Harmonic:
    """The first harmonic by least squares; over whole periods it is Fourier's."""
    turn = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.ones_like(turn), np.cos(turn), np.sin(turn)])
    (mean, cosine, sine), *_ = np.linalg.lstsq(basis, signal, rcond=None)
    phasor = complex(cosine, -sine)  # Re((a − jb) e^jωt) = a cos ωt + b sin ωt
    rest = signal - basis @ (mean, cosine, sine)
    size = abs(phasor) / math.sqrt(2.0)
    distortion = float(np.sqrt(np.mean(rest**2))) / size if size > 0.0 else math.nan
    return Harmonic(phasor, float(mean), distortion)


def unwrapped(phase: np.ndarray) -> np.ndarray:
    """Phases [rad] from the lowest frequency on, without jumps; the first lies within _FIRST_PHASE."""
    followed = np.unwrap(phase)
    low, high = _FIRST_PHASE
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
    """Where a curve first falls to a level, on straight lines over the logarithm of the frequency."""
    under = np.flatnonzero(curve <= level)
    if not len(under):
        return Crossing(float(frequencies[-1]), "above")
    k = int(under[0])
    if k == 0:
        return Crossing(float(frequencies[0]), "at" if curve[0] == level else "below")
    share = (curve[k - 1] - level) / (curve[k - 1] - curve[k])
    low, high = np.log(frequencies[k - 1 : k + 1])
    return Crossing(float(np.exp(low + share * (high - low))))


@dataclass(frozen=True, eq=False)
class Curve:
    """One output over one input, over frequency."""

    output: str
    unit: str
    input_unit: str
    frequency: np.ndarray
    gain: np.ndarray
    phase: np.ndarray
    distortion: np.ndarray
    mean: np.ndarray
    unsettled: np.ndarray

    @property
    def is_ratio(self) -> bool:
        """Whether output and input are of one quantity, so that a gain of 1 follows exactly."""
        return self.unit == self.input_unit

    @property
    def decibel(self) -> np.ndarray:
        """Gain [dB] (n,): over 1 where output and input are of one quantity, else over the first gain."""
        found: np.ndarray = 20.0 * np.log10(self.gain / (1.0 if self.is_ratio else self.gain[0]))
        return found

    @property
    def bandwidth(self) -> Crossing:
        """Frequency at which the gain first falls to −3 dB [Hz], over what `decibel` is over."""
        return falls_to(self.frequency, self.decibel, HALF_POWER)

    @property
    def quarter(self) -> Crossing:
        """Frequency at which the phase first lags by 90° [Hz]."""
        level = _QUARTER_TURN - (math.pi if self.phase[0] < 1.5 * _QUARTER_TURN else 0.0)
        return falls_to(self.frequency, self.phase, level)

    @property
    def gain_unit(self) -> str:
        """Unit of `shown_gain`."""
        if self.is_ratio:
            return ""
        over = _SHOWN.get(self.input_unit, self.input_unit)
        unit = _SHOWN.get(self.unit, self.unit)
        return f"{unit}/{over}" if over else unit

    @property
    def shown_gain(self) -> np.ndarray:
        """Gain in units that people read (n,)."""
        found: np.ndarray = self.gain * _factor(self.unit) / _factor(self.input_unit)
        return found

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "output": self.output,
            "unit": self.unit,
            "input_unit": self.input_unit,
            "frequency": self.frequency.tolist(),
            "gain": self.gain.tolist(),
            "phase": self.phase.tolist(),
            "distortion": self.distortion.tolist(),
            "mean": self.mean.tolist(),
            "unsettled": self.unsettled.tolist(),
            "bandwidth": {"frequency": self.bandwidth.frequency, "relation": self.bandwidth.relation},
            "phase_90": {"frequency": self.quarter.frequency, "relation": self.quarter.relation},
        }


def _factor(unit: str) -> float:
    """Factor from an SI unit to the one that people read."""
    return in_unit(1.0, unit, _SHOWN[unit]) if unit in _SHOWN else 1.0
