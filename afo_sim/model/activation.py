"""Activation of the patient's muscles: which side the recorded walking needs, and how its strength follows.

The instants at which the sides change belong to the gait cycle, and between them the lags have a closed form.
So the activation at an instant does not depend on the time step.
"""

import functools
import math

import numpy as np

from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.fourier import Wave
from afo_sim.model.toes import Resting
from afo_sim.model.walk import Walk

# Lags of the stiffness behind the active side [s]: two equal ones in series, as a twitch rises (critically
# damped: Milner-Brown, Stein & Yemm 1973; the triceps surae's twitch peaks after about 0.1 s). Half of it is
# there after 84 ms. The lag of its fall only avoids a jump: `patient.STIFFNESS` already holds the fall before
# toe-off, and a stiffness that lingers would hold a hanging foot up. Both times are assumed.
RISE, FALL = 0.05, 0.005
SAMPLES = 4096  # of a stride in which the change of sides is looked for


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def one_stride(cycle: GaitCycle, stride_time: float, offset: float, resting: Resting | None) -> Walk:
    """One stride of a gait cycle, from heel strike to heel strike, at `SAMPLES` instants.

    Units: stride_time [s], offset [rad].
    """
    phase = (np.arange(SAMPLES + 2) - 1.0) / SAMPLES
    wave = Wave.at(phase)
    pose = np.stack([cycle.signal(name, wave) for name in ("ankle_x", "ankle_z", "shank_angle")], axis=1)
    ankle = cycle.signal("ankle_angle", wave) + offset
    knee = cycle.signal("knee_angle", wave)
    toe = None if resting is None else resting.at(wave)
    return Walk(cycle, (0.0, 0.0), stride_time / SAMPLES, phase, pose, ankle, knee, toe, offset, resting)


def crossings(moment: np.ndarray) -> np.ndarray:
    """Gait phases at which a periodic moment changes its sign.

    Units: moment (n,).
    """
    following = np.roll(moment, -1)
    before = np.flatnonzero((moment > 0.0) != (following > 0.0))
    share = moment[before] / (moment[before] - following[before])
    return (before + share) / len(moment)


def switching(walk: Walk, moment: np.ndarray) -> tuple[np.ndarray, bool]:
    """Instants of a walk at which the active side changes, and the side that it starts with.

    Units: moment [N·m] (n,), returns [s].
    """
    edges = crossings(moment)
    start, end = walk.phase[1], walk.phase[-1]
    strides = np.arange(math.floor(start), math.ceil(end) + 1)
    every = (strides[:, np.newaxis] + edges).ravel()
    passed = int(np.searchsorted(edges, start % 1.0, side="right"))
    dorsal = bool(moment[0] > 0.0) != bool(passed % 2)
    ahead = every[(every > start) & (every <= end)]
    return np.interp(ahead, walk.phase, walk.time), dorsal


def activated(time: np.ndarray, switches: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Activation of a muscle: the excitation after two equal first-order lags in series.

    Units: time [s] (n,), switches [s] (m,), levels (m + 1,).
    """
    if np.ptp(levels) == 0.0:
        return np.full(len(time), levels[0])
    return _follow(time, switches, levels)


def _follow(time: np.ndarray, switches: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Both lags from event to event: a switch, or the first lag meeting the second, which turns round."""
    given, known, passed, begun = np.empty(len(time)), 0, 0, 0.0
    first = second = target = float(levels[0])
    while known < len(time):
        switch = float(switches[passed]) if passed < len(switches) else math.inf
        meeting = begun + _meeting(first, second, target)
        event = min(switch, meeting)
        until = known + int(np.searchsorted(time[known:], event))
        ends = [event] if event < math.inf else []
        left, right = _settled(first, second, target, np.append(time[known:until], ends) - begun)
        given[known:until] = right[: until - known]
        if event < math.inf:
            first, second = float(left[-1]), float(left[-1] if meeting <= switch else right[-1])
        if switch < meeting:
            target, passed = float(levels[passed + 1]), passed + 1
        known, begun = until, event
    return given


def _lags(first: float, second: float, target: float) -> tuple[float, float]:
    """Time constants of both lags [s]; a second one that stands at the first follows it."""
    rises = target > first
    second_rises = rises if first == second else first > second
    return RISE if rises else FALL, RISE if second_rises else FALL


def _settled(first: float, second: float, target: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both lags after times (n,) in which neither turns round: (first (n,), second (n,))."""
    lag, second_lag = _lags(first, second, target)
    gap, left = first - target, np.exp(-time / lag)
    if lag == second_lag:
        return target + gap * left, target + (second - target + gap * time / lag) * left
    share = gap * lag / (lag - second_lag)
    rest = (second - target - share) * np.exp(-time / second_lag)
    return target + gap * left, target + share * left + rest


def _meeting(first: float, second: float, target: float) -> float:
    """Time until the first lag, coming towards the second one, meets it [s]; infinite where it does not."""
    if (target - first) * (first - second) >= 0.0:
        return math.inf
    lag, second_lag = _lags(first, second, target)
    share = (first - target) * lag / (lag - second_lag)
    ratio = (second - target - share) / (first - target - share)
    return max(0.0, math.log(ratio) / (1.0 / second_lag - 1.0 / lag))
