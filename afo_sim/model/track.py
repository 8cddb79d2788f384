"""A path through a day: the recorded stride at other cadences and amplitudes, and standing between strides.

Every angle and the ankle's height are scaled about upright standing on a flat foot, and so is each step:

    q(t) = q₀ + a(t) (q(φ(t)) − q₀),   ẋ = a(t) dx/dt(φ(t)),   a = walking · reach

A foot that is flat in the recording stays flat, and one that stands on its ball does to first order. φ and a
are smooth, so the shank's acceleration is continuous. The ground force is the recorded one, and half the
body's weight where the wearer stands. A healthy ankle's moment of this path is that of inverse dynamics.
Left out: sideways motion and the body's lean in a turn, slopes, and whatever a person does who stumbles.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from afo_sim.common import InputError
from afo_sim.gait import Wave
from afo_sim.model.build import Built, along
from afo_sim.model.foot import Resting
from afo_sim.model.walk import Walk, bent

STANDS = 0.25  # gait phase at which a walker stops and starts: the foot is flat, the other one swings [-]
RAMP = 0.3  # of a stride, over which it grows out of standing: before the next toe-off [-]
WEIGHT = 0.5  # of the body, on this foot where both stand [-]
AHEAD = 0.04  # centre of pressure of a standing foot, ahead of the ankle [m]; assumed, 3 to 6 cm from memory


@dataclass(frozen=True, eq=False)
class Track(Walk):
    """A walk with stops, short steps and changes of cadence."""

    walking: np.ndarray | None = None
    described: ClassVar[bool] = False

    @cached_property
    def ground(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ground force and its place, as `Walk.ground`."""
        assert self.walking is not None
        walks, stands = self.walking, 1.0 - self.walking
        forward, upward, place = self.cycle.ground(self.phase)
        return walks * forward, walks * upward + stands * WEIGHT, walks * place + stands * AHEAD


def on_track(built: Built, phase: np.ndarray, walking: np.ndarray, reach: np.ndarray) -> Built:
    """A compiled scenario of walking on another path."""
    recorded = built.walk
    assert recorded is not None
    if built.contact is not None:
        problem = "meets the floor: other paths are walked on the recorded ground"
        raise InputError(problem, field="ground.mode", value="contact", allowed="recorded")
    cycle, wave, amplitude = recorded.cycle, Wave.at(phase), walking * reach
    signal = {name: cycle.signal(name, wave) for name in cycle.series}
    level, between = float(cycle.signal("ankle_z", STANDS)), 0.5 * (amplitude[1:] + amplitude[:-1])
    ahead = np.concatenate([[0.0], np.cumsum(between * np.diff(signal["ankle_x"]))])
    height = level + amplitude * (signal["ankle_z"] - level)
    track = Track(
        cycle,
        recorded.shift,
        recorded.timestep,
        phase,
        np.stack([ahead, height, amplitude * signal["shank_angle"]], axis=1),
        amplitude * signal["ankle_angle"] + recorded.offset,
        amplitude * signal["knee_angle"],
        recorded.offset,
        wave,
        walking=walking,
    )
    return along(built, track if recorded.toe is None else bent(track, Resting.of(built.scenario)))
