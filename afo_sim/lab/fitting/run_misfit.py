"""Each channel's errors against its noise, and sentences about the channels that the run does not explain."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.lab.fitting.identifiability import rms

MISFIT = 1.15  # times the noise: above it, and above what chance does to so few samples, something is missing
CHANCE = 3.0  # standard deviations
CAUSES = {
    "pressure": "a leak, a valve's conductance or delay, the supply's pressure, a tube's volume, heat",
    "mass": "a leak, a valve's conductance or delay",
    "mass_flow": "a leak, a valve's conductance or delay",
    "angle": "friction, inertia, a moment arm, the tissue's stiffness",
    "velocity": "friction, inertia, a moment arm, the tissue's stiffness",
    "force": "the muscle's law or friction, a moment arm, the load cell's zero",
    "contraction": "a link's length or stiffness, a moment arm",
    "coil": "the timer's times, a valve's delay",
    "opening": "the timer's times, a valve's delay",
}
OTHERWISE = "a part that the scenario does not have"


@dataclass(frozen=True)
class Errors:
    """RMS errors of one channel [SI]: over the whole log, with the start values and with the fitted ones;
    over the part held out, with the start values and with those fitted to the rest.

    `noise` is the channel's own, and `samples` and `samples_held_out` are how many there are.
    """

    noise: float
    samples: int
    before: float
    after: float
    samples_held_out: int = 0
    before_held_out: float | None = None
    held_out: float | None = None

    @property
    def chi_squared(self) -> float:
        """Mean square error after the fit, in units of the noise: 1 where nothing but noise is left."""
        return (self.after / self.noise) ** 2

    @property
    def chi_squared_held_out(self) -> float | None:
        """The same over the part held out."""
        return None if self.held_out is None else (self.held_out / self.noise) ** 2


Differences = Mapping[str, np.ndarray]


def channel_errors(
    noise: Mapping[str, float],
    first: Differences,
    last: Differences,
    unseen: Differences | None,
    rest: np.ndarray,
) -> dict[str, Errors]:
    """Each channel's errors.

    Units: noise [SI], first, last [SI].
    """
    found = {}
    for title in first:
        whole = (noise[title], len(first[title]), rms(first[title]), rms(last[title]))
        if unseen is None:
            found[title] = Errors(*whole)
        else:
            parts = rms(first[title][rest]), rms(unseen[title][rest])
            found[title] = Errors(*whole, int(rest.sum()), *parts)
    return found


def doubts(errors: Mapping[str, Errors], columns: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each channel whose errors are more than noise, in the log or where it was held out."""
    for title, found in errors.items():
        ratios = []
        if found.chi_squared > _limit(found.samples):
            ratios.append(f"{math.sqrt(found.chi_squared):.2g} times its noise after the fit")
        held_out = found.chi_squared_held_out
        if held_out is not None and held_out > _limit(found.samples_held_out):
            ratios.append(f"{math.sqrt(held_out):.2g} times where it was held out")
        if ratios:
            causes = CAUSES.get(columns[title].rpartition("/")[2].partition("_in")[0], OTHERWISE)
            yield (
                f"{title}: its errors are {' and '.join(ratios)}; the scenario lacks something: {causes}; "
                "the fitted values make up for it and may be wrong by more than their intervals"
            )


def _limit(samples: int) -> float:
    """Mean square in units of the noise above which it is more than noise."""
    return MISFIT**2 * (1.0 + CHANCE * math.sqrt(2.0 / max(samples, 1)))
