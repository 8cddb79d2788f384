"""Recorded walking laid out over the steps of a run: gait phase, the shank's pose, what drives it exactly.

The shank's ankle point and angle are joints with an armature so large that nothing moves them but their own
motors. The motors apply the second difference of the sampled pose, which the integrator sums to that pose:
the foot feels the true acceleration, and the pose is kept to rounding.
"""

import functools
import pathlib
from dataclasses import dataclass

import numpy as np

from afo_sim.common import assets
from afo_sim.description.scenario import Scenario
from afo_sim.description.walking import Gait
from afo_sim.gait import file as gait_file
from afo_sim.gait.cycle import GaitCycle, fit_to_leg
from afo_sim.gait.fourier import Wave
from afo_sim.model.clock import Clock
from afo_sim.model.foot import Turn

ARMATURE = 1e12  # of the shank's joints [kg, kg·m²]
JOINTS = ("shank_x", "shank_z", "shank_angle")
SIGNALS = ("ankle_x", "shank_angle", "ankle_angle", "knee_angle")  # the same in every leg


@dataclass(frozen=True, eq=False)
class Walk:
    """A gait cycle over the steps of a run; arrays hold one sample more before and after the run.

    phase counts strides [-]; pose is ankle x, ankle z [m] and shank angle [rad]; ankle is the recorded
    ankle angle [rad]; knee the recorded knee angle [rad]; all (n_step + 2, …), sample 0 at −h.
    """

    cycle: GaitCycle
    shift: float
    timestep: float
    phase: np.ndarray
    pose: np.ndarray
    ankle: np.ndarray
    knee: np.ndarray

    # what every case of a sweep asks of it, computed once

    @functools.cached_property
    def time(self) -> np.ndarray:
        """Of the samples [s] (n_step + 2,)."""
        return _kept((np.arange(len(self.phase)) - 1.0) * self.timestep)

    @functools.cached_property
    def acceleration(self) -> np.ndarray:
        """Of the pose, as second differences (n_step, 3)."""
        return _kept((self.pose[2:] - 2.0 * self.pose[1:-1] + self.pose[:-2]) / self.timestep**2)

    @functools.cached_property
    def velocity(self) -> np.ndarray:
        """Of the recorded ankle [rad/s] (n_step,)."""
        return _kept((self.ankle[2:] - self.ankle[:-2]) / (2.0 * self.timestep))

    @functools.cached_property
    def ankle_acceleration(self) -> np.ndarray:
        """Of the recorded ankle [rad/s²] (n_step,)."""
        return _kept(np.diff(self.ankle, 2) / self.timestep**2)

    @functools.cached_property
    def turn(self) -> Turn:
        """Of the recorded sole (n_step,)."""
        return Turn.by((self.ankle - self.pose[:, 2])[1:-1])

    @functools.cached_property
    def ground_lever(self) -> np.ndarray:
        """Moment of the recorded ground force about the ankle over the body's weight [m] (n_step,)."""
        forward, upward, place = self.cycle.ground(self.phase[1:-1])
        height = self.pose[1:-1, 1]
        return _kept(place * upward + height * forward)

    @functools.cached_property
    def clock(self) -> Clock:
        """The steps in strides."""
        phase = self.phase[1:-1]
        # over a step the phase advances evenly: its share is the time's
        return Clock.of(phase, self.phase[2:] - phase, 1.0)

    def start(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Start of the run: pose and ankle (4,), the pose's velocity half a step before (3,), the ankle's."""
        ankle_velocity = (self.ankle[2] - self.ankle[0]) / (2.0 * self.timestep)
        velocity = (self.pose[1] - self.pose[0]) / self.timestep
        return np.append(self.pose[1], self.ankle[1]), velocity, float(ankle_velocity)


def lay_out(scenario: Scenario, ankle_height: float) -> Walk:
    """Read the scenario's gait cycle, fit it to the leg, and sample it at every step.

    Parameters
    ----------
    scenario : with a gait
    ankle_height : of the leg's ankle above its flat sole [m]

    Raises
    ------
    InputError
        The gait cannot be found or read.
    """
    assert scenario.gait is not None
    file = assets.find_gait(scenario.gait.cycle)
    when = file.stat().st_mtime_ns
    return _laid_out(file, when, scenario.gait, ankle_height, scenario.timestep, scenario.n_step)


def stride_time_of(gait: Gait) -> float:
    """Mean duration of a stride [s]: the scenario's own, or the recording's.

    Raises
    ------
    InputError
        The gait cannot be found or read.
    """
    if gait.stride_time is not None:
        return gait.stride_time
    file = assets.find_gait(gait.cycle)
    return _cycle(file, file.stat().st_mtime_ns).stride_time


# Cases of a sweep share most of this; a changed file has another time of change.
@functools.lru_cache(maxsize=8)
def _cycle(file: pathlib.Path, when: int) -> GaitCycle:
    return gait_file.read(file)


@functools.lru_cache(maxsize=8)
def _fitted(file: pathlib.Path, when: int, ankle_height: float) -> tuple[GaitCycle, float]:
    cycle, shift = fit_to_leg(_cycle(file, when), ankle_height)
    for value in vars(cycle).values():
        if isinstance(value, np.ndarray):
            _kept(value)
    return cycle, shift


@functools.lru_cache(maxsize=2)
def _sampled(
    file: pathlib.Path, when: int, gait: Gait, timestep: float, n_step: int
) -> tuple[np.ndarray, dict[str, np.ndarray], Wave]:
    """Gait phase, and what does not depend on the ankle's height and offset."""
    cycle = _cycle(file, when)
    phase = _kept(phase_at(gait, cycle.stride_time, (np.arange(n_step + 2) - 1.0) * timestep))
    wave = Wave.at(phase)
    return phase, {name: cycle.signal(name, wave) for name in SIGNALS}, wave


@functools.lru_cache(maxsize=2)
def _laid_out(
    file: pathlib.Path, when: int, gait: Gait, ankle_height: float, timestep: float, n_step: int
) -> Walk:
    cycle, shift = _fitted(file, when, ankle_height)
    as_recorded = gait.model_copy(update={"ankle_offset": 0.0})
    phase, signals, wave = _sampled(file, when, as_recorded, timestep, n_step)
    pose = _kept(
        np.stack([signals["ankle_x"], cycle.signal("ankle_z", wave), signals["shank_angle"]], axis=1)
    )
    ankle = _kept(signals["ankle_angle"] + gait.ankle_offset)
    return Walk(cycle, shift, timestep, phase, pose, ankle, _kept(signals["knee_angle"]))


def _kept(array: np.ndarray) -> np.ndarray:
    """An array that later runs share, made read-only."""
    array.flags.writeable = False
    return array


def phase_at(gait: Gait, recorded: float, time: np.ndarray) -> np.ndarray:
    """Gait phase, counting strides, at times.

    Strides of varied duration are joined by a spline through their heel strikes, so that the shank has no
    kink where one stride passes into the next.

    Parameters
    ----------
    gait : stride time, its variability and seed
    recorded : stride time of the cycle [s]
    time : [s] (n,)

    Returns
    -------
    (n,), `start_phase` at time 0
    """
    mean = gait.stride_time or recorded
    if gait.variability == 0.0:
        return gait.start_phase + time / mean
    from scipy.interpolate import CubicSpline  # large, and seldom needed

    count = int(np.ceil(time[-1] / (0.4 * mean))) + 6
    drawn = np.random.default_rng(gait.seed).standard_normal(count).clip(-3.0, 3.0)
    strikes = np.concatenate([[0.0], np.cumsum(mean * (1.0 + gait.variability * drawn))])
    phase = CubicSpline(strikes, np.arange(count + 1.0), bc_type="natural")
    start = CubicSpline(np.arange(count + 1.0), strikes, bc_type="natural")(2.0 + gait.start_phase)
    return phase(start + time) - 2.0
