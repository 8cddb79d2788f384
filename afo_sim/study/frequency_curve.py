"""A frequency response as curves: gain, phase, distortion, bandwidth."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common.units import in_unit
from afo_sim.study.harmonic import Crossing, falls_to

HALF_POWER = 20.0 * math.log10(math.sqrt(0.5))  # −3.01 dB
QUARTER_TURN = -0.5 * math.pi
SHOWN = {"rad": "deg", "Pa": "bar"}  # units that people read; others as they are


@dataclass(frozen=True, eq=False)
class Curve:
    """One output over one input, over frequency.

    output : column
    unit, input_unit : SI units of output and input; "" of plain numbers
    frequency : as it was run [Hz] (n,)
    gain : amplitude of the output's first harmonic over the input's [unit/input_unit] (n,)
    phase : of the output's first harmonic against the input's, a lag is negative [rad] (n,)
    distortion : root mean square of what is neither mean nor first harmonic, over that of the first
        harmonic [-] (n,)
    mean : of the output [unit] (n,)
    unsettled : share by which the first harmonic still changed from one half of the periods that are
        analysed to the other [-] (n,)
    """

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
        """Frequency at which the phase first lags by 90° [Hz].

        Of an output that falls as its input rises, such as the other chamber's pressure, by 270°.
        """
        level = QUARTER_TURN - (math.pi if self.phase[0] < 1.5 * QUARTER_TURN else 0.0)
        return falls_to(self.frequency, self.phase, level)

    @property
    def gain_unit(self) -> str:
        """Unit of `shown_gain`."""
        if self.is_ratio:
            return ""
        over = SHOWN.get(self.input_unit, self.input_unit)
        unit = SHOWN.get(self.unit, self.unit)
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
    return in_unit(1.0, unit, SHOWN[unit]) if unit in SHOWN else 1.0
