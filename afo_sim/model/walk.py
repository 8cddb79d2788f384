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

ARMATURE = 1e12  # of the shank's joints [kg, kg·m²]
JOINTS = ("shank_x", "shank_z", "shank_angle")


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

    @property
    def acceleration(self) -> np.ndarray:
        """Of the pose, as second differences (n_step, 3)."""
        return (self.pose[2:] - 2.0 * self.pose[1:-1] + self.pose[:-2]) / self.timestep**2

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


# Cases of a sweep share most of this; a changed file has another time of change.
@functools.lru_cache(maxsize=8)
def _cycle(file: pathlib.Path, when: int, ankle_height: float) -> tuple[GaitCycle, float]:
    cycle, shift = fit_to_leg(gait_file.read(file), ankle_height)
    _keep(*(value for value in vars(cycle).values() if isinstance(value, np.ndarray)))
    return cycle, shift


@functools.lru_cache(maxsize=2)
def _laid_out(
    file: pathlib.Path, when: int, gait: Gait, ankle_height: float, timestep: float, n_step: int
) -> Walk:
    cycle, shift = _cycle(file, when, ankle_height)
    time = (np.arange(n_step + 2) - 1.0) * timestep
    phase = phase_at(gait, cycle.stride_time, time)
    pose = np.stack([cycle.signal(name, phase) for name in ("ankle_x", "ankle_z", "shank_angle")], axis=1)
    ankle = cycle.signal("ankle_angle", phase) + gait.ankle_offset
    knee = cycle.signal("knee_angle", phase)
    _keep(phase, pose, ankle, knee)
    return Walk(cycle, shift, timestep, phase, pose, ankle, knee)


def _keep(*arrays: np.ndarray) -> None:
    """Make arrays read-only that later runs share."""
    for array in arrays:
        array.flags.writeable = False


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
