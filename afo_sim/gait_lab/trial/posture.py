"""When a leg's posture comes back: the next heel strike of a walk that repeats."""

import numpy as np

from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.events import vertex
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.travel import STRIDE

SMOOTH = 6.0  # low-pass for comparing postures [Hz]
STRANGER = 0.5  # largest distance of two postures that are taken for the same [rad]
VELOCITY = 0.1  # time by which angular velocities are multiplied to be compared with angles [s]


def posture(motion: LegMotion) -> np.ndarray:
    """Shank, knee and ankle angle, and a tenth of a second of their velocities [rad] (n, 6)."""
    angles = np.column_stack([motion.shank_angle, motion.knee_angle, motion.ankle_angle])
    angles = low_pass(motion.time, angles, SMOOTH)  # else velocities of unfiltered data are noise
    return np.hstack([angles, VELOCITY * np.gradient(angles, motion.time, axis=0)])


def distance_to(motion: LegMotion, start: float) -> np.ndarray:
    """Distance of the posture at each sample to that at `start` [rad] (n,)."""
    state = posture(motion)
    here = np.array([np.interp(start, motion.time, column) for column in state.T])
    return np.asarray(np.linalg.norm(state - here, axis=1))


def posture_return(motion: LegMotion, start: float) -> float | None:
    """First time after `start` at which the leg's posture returns [s]; None if the motion ends before.

    The return is the nearest approach, to a part of a sample, of the first cycle.
    """
    distance = distance_to(motion, start)
    later = (motion.time >= start + STRIDE[0]) & (motion.time <= start + STRIDE[1])
    lows = _lows(distance, later)
    if not len(lows) and later[-1] and distance[-2] > distance[-1] < 0.5 * STRANGER:
        return float(motion.time[-1])  # the recording was cut at the heel strike
    if not len(lows):
        return None
    k = int(lows[np.argmax(distance[lows] < 2.0 * distance[lows].min() + 0.05)])
    return _refined(motion.time, distance, k)


def posture_near(motion: LegMotion, start: float, about: float, within: float) -> float | None:
    """Time at which the posture of `start` is most nearly met, at most `within` from `about` [s]."""
    distance = distance_to(motion, start)
    lows = _lows(distance, np.abs(motion.time - about) <= within)
    return _refined(motion.time, distance, int(lows[np.argmin(distance[lows])])) if len(lows) else None


def _lows(distance: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Samples at which the distance has a minimum that is no stranger's (k,)."""
    inner = np.flatnonzero(where[1:-1]) + 1
    lows = inner[(distance[inner] <= distance[inner - 1]) & (distance[inner] < distance[inner + 1])]
    return lows[distance[lows] < STRANGER]


def _refined(time: np.ndarray, distance: np.ndarray, k: int) -> float:
    return float(time[k] + vertex(distance[k - 1 : k + 2] ** 2) * (time[1] - time[0]))
