"""When a foot lands and leaves by motion alone, when a leg's posture comes back, and the period of a walk."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.travel import STRIDE

_SMOOTH = 10.0  # low-pass of the distances, upper end of what is used with the method [Hz] (assumed)
STEP = 0.1  # way of the heel about the pelvis that is a walk's; in adults 0.6 to 0.8 [m] (assumed)
_APART = 0.5  # shortest time between two events of one kind: the shortest stride [s]
_USUAL = 1.2  # time of a stride where nothing shows it better [s]
STANCE = 0.6  # share of it after which the toe leaves, likewise (Perry 1992) [-]
_SEGMENT = 0.42  # thigh and shank: 0.245 and 0.246 of the height (Winter 2009), at 1.7 m [m]
_HEEL_FIRST = np.radians(8.0)  # pitch of the foot from which on the heel lands first (Altman, Davis 2012)
_FLOOR = 0.05  # share of the samples in which a point of the foot is lower than when it stands [-] (assumed)
_LANDED = 0.01  # height above that from which on the lowest point goes straight down to it [m] (assumed: more
# than what a filter of 6 Hz rounds off)
# Speed of the heel ahead of the pelvis from which on the foot still swings [m/s] (assumed: it swings by at
# 3 m/s or more, and lands at about nothing)
_SWINGING = 1.0
_ABOUT = 0.15  # how far from the farthest heel the landing of the lowest point is looked for [s] (assumed)

_POSTURE_SMOOTH = 6.0  # low-pass for comparing postures [Hz]
_STRANGER = 0.5  # largest distance of two postures that are taken for the same [rad]
_VELOCITY = 0.1  # time by which angular velocities are multiplied to be compared with angles [s]
_HARMONICS = 8  # of a leg filtered at 6 Hz, at a stride of 1.2 s
_ROUGHNESS = 0.1  # weight of the third derivative, at the highest harmonic, beside the samples' distance [-]
# (chosen: of 5 to 12 harmonics and weights from 1e-5 to 0.1, the most exact with noise in a known walk)
_LOOKED = 0.9  # part of a period from which on the period is looked for, so that a refusal can say it [-]
_STATISTIC_STEP = 0.002  # in which a period is looked for [s]
_STRANGE = 0.1  # distance of the motion from a periodic one that is no walk's [rad] (assumed)
_PLACE = 2.0  # weight of the ankle's place beside the angles [rad/m] (assumed: half a leg's length)
RATE = 120.0  # sampling that is enough [Hz]


@dataclass(frozen=True)
class FootEvents:
    """Events of one foot from kinematics, in order [s]."""

    strikes: tuple[float, ...]
    toe_offs: tuple[float, ...]
    method: str  # in words
    reach: float  # from the heel's farthest behind to its farthest ahead [m]

    @property
    def stride_time(self) -> float:
        """Median time between two like events, or else an adult's [s]."""
        times = [*np.diff(self.strikes), *np.diff(self.toe_offs)]
        return float(np.median(times)) if times else _USUAL


def find_events(motion: LegMotion) -> FootEvents:
    """Heel strikes and toe-offs of a leg, on the floor or on a treadmill."""
    heel, toe = motion.heel[:, 0], motion.toe[:, 0]
    origin = motion.pelvis_x
    if origin is None:
        # the hip, over an adult's segments: when it is farthest hardly depends on their length
        thigh = motion.shank_angle - motion.knee_angle
        origin = motion.ankle_x + _SEGMENT * (np.sin(motion.shank_angle) + np.sin(thigh))
    ahead, behind = low_pass(motion.time, np.column_stack([heel - origin, origin - toe]), _SMOOTH).T
    strikes = _farthest(motion.time, ahead)
    method = "Zeni 2008 with the heel against the hip" if motion.pelvis_x is None else "Zeni 2008"
    swings = np.gradient(ahead, motion.time) > _SWINGING
    landed = [_landing(motion, swings, strike) for strike in strikes]
    if any(time is not None for time in landed):
        method += ", the lowest foot point where the heel does not land first"
    return FootEvents(
        strikes=tuple(sorted(s if at is None else at for s, at in zip(strikes, landed, strict=True))),
        toe_offs=tuple(_farthest(motion.time, behind)),
        method=method,
        reach=float(np.ptp(ahead)),
    )


def _farthest(time: np.ndarray, distance: np.ndarray) -> list[float]:
    """Times of the maxima in the upper half of a distance's range, to a part of a sample [s]."""
    from scipy.signal import find_peaks

    if np.ptp(distance) < STEP:
        return []
    step = float(time[1] - time[0])
    middle = 0.5 * (distance.min() + distance.max())
    peaks, _ = find_peaks(distance, height=middle, distance=max(1, round(_APART / step)))
    return [float(time[k]) + step * _vertex(distance[k - 1 : k + 2]) for k in peaks]


def _vertex(three: np.ndarray) -> float:
    """Where the parabola through three samples has its vertex, from the middle one [samples]."""
    left, middle, right = three
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend else 0.0


def _landing(motion: LegMotion, swings: np.ndarray, strike: float) -> float | None:
    """When the lowest point of a foot lands that does not land on its heel; None if it does."""
    heel, toe = (p[:, 1] - np.quantile(p[:, 1], _FLOOR) for p in (motion.heel, motion.toe))
    length = float(np.median(np.linalg.norm(motion.toe - motion.heel, axis=1)))
    rise = float(np.interp(strike, motion.time, toe - heel))
    if rise > length * np.sin(_HEEL_FIRST):
        return None
    near = np.flatnonzero((np.abs(motion.time - strike) <= _ABOUT) & ~swings)
    lowest = np.minimum(heel, toe)[near]
    down = np.flatnonzero((lowest[:-1] > _LANDED) & (lowest[1:] <= _LANDED))
    if not len(down):
        return None
    k = int(down[np.argmin(np.abs(motion.time[near][down] - strike))])
    steps = lowest[k] / (lowest[k] - lowest[k + 1])
    return float(motion.time[near][k] + steps * (motion.time[1] - motion.time[0]))


def posture(motion: LegMotion) -> np.ndarray:
    """Shank, knee and ankle angle, and a tenth of a second of their velocities [rad] (n, 6)."""
    angles = np.column_stack([motion.shank_angle, motion.knee_angle, motion.ankle_angle])
    angles = low_pass(motion.time, angles, _POSTURE_SMOOTH)  # else velocities of unfiltered data are noise
    return np.hstack([angles, _VELOCITY * np.gradient(angles, motion.time, axis=0)])


def _distance_to(motion: LegMotion, start: float) -> np.ndarray:
    """Distance of the posture at each sample to that at `start` [rad] (n,)."""
    state = posture(motion)
    here = np.array([np.interp(start, motion.time, column) for column in state.T])
    return np.asarray(np.linalg.norm(state - here, axis=1))


def posture_return(motion: LegMotion, start: float) -> float | None:
    """First time after `start` at which the leg's posture returns [s]; None if the motion ends before."""
    distance = _distance_to(motion, start)
    later = (motion.time >= start + STRIDE[0]) & (motion.time <= start + STRIDE[1])
    lows = _lows(distance, later)
    if not len(lows):
        cut = later[-1] and distance[-2] > distance[-1] < 0.5 * _STRANGER  # at the heel strike
        return float(motion.time[-1]) if cut else None
    k = int(lows[np.argmax(distance[lows] < 2.0 * distance[lows].min() + 0.05)])
    return _refined(motion.time, distance, k)


def posture_near(motion: LegMotion, start: float, about: float, within: float) -> float | None:
    """Time at which the posture of `start` is most nearly met, at most `within` from `about` [s]."""
    distance = _distance_to(motion, start)
    lows = _lows(distance, np.abs(motion.time - about) <= within)
    return _refined(motion.time, distance, int(lows[np.argmin(distance[lows])])) if len(lows) else None


def _lows(distance: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Samples at which the distance has a minimum that is no stranger's (k,)."""
    inner = np.flatnonzero(where[1:-1]) + 1
    lows = inner[(distance[inner] <= distance[inner - 1]) & (distance[inner] < distance[inner + 1])]
    return lows[distance[lows] < _STRANGER]


def _refined(time: np.ndarray, distance: np.ndarray, k: int) -> float:
    return float(time[k] + _vertex(distance[k - 1 : k + 2] ** 2) * (time[1] - time[0]))


def period_by_force(starts: Sequence[float], motion: LegMotion) -> float | None:
    """Mean time between heel strikes on plates, each weighted by how much of it the motion covers [s]."""
    weight = total = 0.0
    for start, end in itertools.pairwise(starts):
        covered = min(end, motion.time[-1]) - max(start, motion.time[0])
        if covered > 0.0 and STRIDE[0] <= end - start <= STRIDE[1]:
            weight, total = weight + covered, total + covered * (end - start)
    if weight < 0.5 * (motion.time[-1] - motion.time[0]):
        return None
    return total / weight if _strangeness(*_signals(motion), total / weight) < _STRANGE else None


def period_by_motion(motion: LegMotion, other: LegMotion | None = None) -> float | str:
    """The period of the smooth periodic motion that comes nearest to the leg's [s], or why there is none."""
    length = float(motion.time[-1] - motion.time[0])
    tried = np.arange(STRIDE[0], min(length / _LOOKED, STRIDE[1]), _STATISTIC_STEP)
    if len(tried) < 3:
        return f"the motion is seen for {length:.2f} s at a stretch, less than a stride"
    time, values = _signals(motion)
    if other is not None and other.time[0] <= time[0] and time[-1] <= other.time[-1] and not other.hidden:
        at, beside = _signals(other)
        values = np.column_stack([values, *(np.interp(time, at, column) for column in beside.T)])
        values /= np.sqrt(2.0)  # distances are those of one leg
    strange = np.array([_strangeness(time, values, period) for period in tried])
    # the first return: longer periods are hardly covered, or are several, and any motion is near to such
    lows = np.flatnonzero((strange[1:-1] <= strange[:-2]) & (strange[1:-1] < strange[2:])) + 1
    if not len(lows):
        return f"the leg's motion does not come back within {length:.2f} s"
    k = int(next((low for low in lows if strange[low] <= _STRANGE), lows[np.argmin(strange[lows])]))
    if strange[k] > _STRANGE:
        off, most = np.ceil(10.0 * np.degrees(strange[k])) / 10.0, np.degrees(_STRANGE)
        came = f"after {tried[k]:.2f} s within {off:.1f} deg"
        return f"the leg's motion comes back {came}, and a walk's within {most:.1f} deg"
    return float(tried[k] + _STATISTIC_STEP * _vertex(strange[k - 1 : k + 2] ** 2))


def _signals(motion: LegMotion) -> tuple[np.ndarray, np.ndarray]:
    """What comes back in each stride: angles, the ankle's height and its place from the pelvis."""
    thin = slice(None, None, max(1, round(1.0 / (RATE * (motion.time[1] - motion.time[0])))))
    columns = [motion.shank_angle, motion.knee_angle, motion.ankle_angle, _PLACE * motion.ankle_z]
    if motion.pelvis_x is not None:
        columns.append(_PLACE * (motion.ankle_x - motion.pelvis_x))
    return motion.time[thin], np.column_stack(columns)[thin]


def _strangeness(time: np.ndarray, values: np.ndarray, period: float) -> float:
    """Root mean square distance from a smooth periodic motion, its roughness counted [rad]."""
    order = np.arange(1, _HARMONICS + 1)
    wave = 2.0 * np.pi * np.outer((time - time[0]) / period, order)
    basis = np.column_stack([np.ones(len(time)), np.cos(wave), np.sin(wave)])
    rough = _ROUGHNESS * len(time) * np.r_[0.0, np.tile((order / _HARMONICS) ** 6.0, 2)]
    shared = basis.T @ values
    explained = np.sum(shared * np.linalg.solve(basis.T @ basis + np.diag(rough), shared))
    return float(np.sqrt(max(0.0, np.sum(values**2) - explained) / len(time)))
