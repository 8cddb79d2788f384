"""Period of a walk that is recorded for hardly longer than one."""

import itertools
from collections.abc import Sequence

import numpy as np

from afo_sim.gait_lab.trial.events import vertex
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.travel import STRIDE

HARMONICS = 8  # of a leg filtered at 6 Hz, at a stride of 1.2 s
ROUGHNESS = 0.1  # weight of the third derivative, at the highest harmonic, beside the samples' distance [-]
# (chosen: of 5 to 12 harmonics and weights from 1e-5 to 0.1, the most exact with noise in a known walk)
LOOKED = 0.9  # part of a period from which on the period is looked for, so that a refusal can say it [-]
STEP = 0.002  # in which a period is looked for [s]
STRANGE = 0.1  # distance of the motion from a periodic one that is no walk's [rad] (assumed)
PLACE = 2.0  # weight of the ankle's place beside the angles [rad/m] (assumed: half a leg's length)
RATE = 120.0  # sampling that is enough [Hz]


def period_by_force(starts: Sequence[float], motion: LegMotion) -> float | None:
    """Mean time between heel strikes on plates, each weighted by how much of it the motion covers [s].

    None if they cover less than half of the motion, or the motion does not come back after that time.
    """
    weight = total = 0.0
    for start, end in itertools.pairwise(starts):
        covered = min(end, motion.time[-1]) - max(start, motion.time[0])
        if covered > 0.0 and STRIDE[0] <= end - start <= STRIDE[1]:
            weight, total = weight + covered, total + covered * (end - start)
    if weight < 0.5 * (motion.time[-1] - motion.time[0]):
        return None
    return total / weight if _strangeness(*_signals(motion), total / weight) < STRANGE else None


def period_by_motion(motion: LegMotion) -> float | None:
    """The period of the smooth periodic motion that comes nearest to the leg's [s].

    Least squares of eight harmonics, their third derivative held small. In a known walk with 1 mm of noise
    in each marker it is right to 6 ms (root mean square) from a whole period, 7 ms from 97.5 % of one and
    12 ms from 95.5 %, and to 33 ms where the recording ends in a heel strike.
    """
    length = float(motion.time[-1] - motion.time[0])
    tried = np.arange(STRIDE[0], min(length / LOOKED, STRIDE[1]), STEP)
    if len(tried) < 3:
        return None
    signals = _signals(motion)
    strange = np.array([_strangeness(*signals, period) for period in tried])
    k = int(np.argmin(strange))
    if not 0 < k < len(tried) - 1 or strange[k] > STRANGE:
        return None
    return float(tried[k] + STEP * vertex(strange[k - 1 : k + 2] ** 2))


def _signals(motion: LegMotion) -> tuple[np.ndarray, np.ndarray]:
    """What comes back in each stride: angles, the ankle's height and its place from the pelvis."""
    thin = slice(None, None, max(1, round(1.0 / (RATE * (motion.time[1] - motion.time[0])))))
    columns = [motion.shank_angle, motion.knee_angle, motion.ankle_angle, PLACE * motion.ankle_z]
    if motion.pelvis_x is not None:
        columns.append(PLACE * (motion.ankle_x - motion.pelvis_x))
    return motion.time[thin], np.column_stack(columns)[thin]


def _strangeness(time: np.ndarray, values: np.ndarray, period: float) -> float:
    """Root mean square distance from a smooth periodic motion, its roughness counted [rad]."""
    order = np.arange(1, HARMONICS + 1)
    wave = 2.0 * np.pi * np.outer((time - time[0]) / period, order)
    basis = np.column_stack([np.ones(len(time)), np.cos(wave), np.sin(wave)])
    rough = np.sqrt(ROUGHNESS * len(time)) * np.r_[0.0, np.tile((order / HARMONICS) ** 3.0, 2)]
    system = np.vstack([basis, np.diag(rough)])
    wanted = np.vstack([values, np.zeros((len(rough), values.shape[1]))])
    weights = np.linalg.lstsq(system, wanted, rcond=None)[0]
    return float(np.sqrt(np.sum((system @ weights - wanted) ** 2) / len(time)))
