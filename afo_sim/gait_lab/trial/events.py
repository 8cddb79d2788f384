"""Heel strikes and toe-offs from the leg's motion alone.

The method is Zeni's (Zeni, Richards, Higginson 2008, Gait & Posture 27:710): the heel strikes where the heel
is farthest ahead of the pelvis, and the toe leaves where it is farthest behind. Both are relative to the
pelvis, so a treadmill changes nothing. Without the pelvis, the hip takes its place.

Heel strikes by this method come 0 to 40 ms before a plate carries 20 to 30 N (four strides of two recorded
walks), some 3 % of a slow stride. So the events of plates go first wherever there are any.
"""

from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.leg_motion import LegMotion

SMOOTH = 10.0  # low-pass of the distances, upper end of what is used with the method [Hz] (assumed)
STEP = 0.1  # way of the heel about the pelvis that is a walk's; in adults 0.6 to 0.8 [m] (assumed)
APART = 0.5  # shortest time between two events of one kind: the shortest stride [s]
USUAL = 1.2  # time of a stride where nothing tells it better [s]
STANCE = 0.6  # share of it after which the toe leaves, likewise (Perry 1992) [-]
SEGMENT = 0.42  # thigh and shank: 0.245 and 0.246 of the height (Winter 2009), at 1.7 m [m]
HEEL_FIRST = np.radians(8.0)  # pitch of the foot from which on the heel lands first (Altman, Davis 2012)
FLOOR = 0.05  # share of the samples in which a point of the foot is lower than when it stands [-] (assumed)
LANDED = 0.01  # height above that from which on the lowest point goes straight down to it [m] (assumed: more
# than what a filter of 6 Hz rounds off)
SWINGING = 1.0  # speed of the heel ahead of the pelvis from which on the foot still swings [m/s] (assumed: it
# swings by at 3 m/s or more, and lands at about nothing)
ABOUT = 0.15  # how far from the farthest heel the landing of the lowest point is looked for [s] (assumed)


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
        return float(np.median(times)) if times else USUAL

    def toe_off_after(self, strike: float) -> float | None:
        """The first toe-off after a heel strike [s]."""
        return next((t for t in self.toe_offs if t > strike + 0.1), None)


def find_events(motion: LegMotion) -> FootEvents:
    """Heel strikes and toe-offs of a leg, on the floor or on a treadmill.

    A foot that lands with less than 8 degrees of pitch does not land on the heel alone. Then the lowest of
    heel and toe decides: it has landed when the last 10 mm of its way down have led to where it stands.
    """
    heel = motion.ankle_x if motion.heel is None else motion.heel[:, 0]
    toe = motion.ankle_x if motion.toe is None else motion.toe[:, 0]
    origin = _hip(motion) if motion.pelvis_x is None else motion.pelvis_x
    ahead, behind = low_pass(motion.time, np.column_stack([heel - origin, origin - toe]), SMOOTH).T
    strikes = _farthest(motion.time, ahead)
    method = "Zeni 2008"
    if motion.heel is None or motion.pelvis_x is None:
        points = "ankle" if motion.heel is None else "heel", "hip" if motion.pelvis_x is None else "pelvis"
        method += f" with the {points[0]} against the {points[1]}"
    swings = np.gradient(ahead, motion.time) > SWINGING
    landed = [_landing(motion, swings, strike) for strike in strikes]
    if any(time is not None for time in landed):
        method += ", the lowest foot point where the heel does not land first"
    return FootEvents(
        strikes=tuple(sorted(s if at is None else at for s, at in zip(strikes, landed, strict=True))),
        toe_offs=tuple(_farthest(motion.time, behind)),
        method=method,
        reach=float(np.ptp(ahead)),
    )


def _hip(motion: LegMotion) -> np.ndarray:
    """The hip's forward way, over a shank and a thigh of an adult's length; when it is farthest hardly
    depends on that length."""
    thigh = motion.shank_angle - motion.knee_angle
    return np.asarray(motion.ankle_x + SEGMENT * (np.sin(motion.shank_angle) + np.sin(thigh)))


def _farthest(time: np.ndarray, distance: np.ndarray) -> list[float]:
    """Times of the maxima in the upper half of a distance's range, to a part of a sample [s]."""
    from scipy.signal import find_peaks

    if np.ptp(distance) < STEP:
        return []
    step = float(time[1] - time[0])
    middle = 0.5 * (distance.min() + distance.max())
    peaks, _ = find_peaks(distance, height=middle, distance=max(1, round(APART / step)))
    return [float(time[k]) + step * vertex(distance[k - 1 : k + 2]) for k in peaks]


def vertex(three: np.ndarray) -> float:
    """Where the parabola through three samples has its vertex, from the middle one [samples]."""
    left, middle, right = three
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend else 0.0


def _landing(motion: LegMotion, swings: np.ndarray, strike: float) -> float | None:
    """When the lowest point of a foot lands that does not land on its heel; None if it does."""
    if motion.heel is None or motion.toe is None:
        return None
    heel, toe = (p[:, 1] - np.quantile(p[:, 1], FLOOR) for p in (motion.heel, motion.toe))
    length = float(np.median(np.linalg.norm(motion.toe - motion.heel, axis=1)))
    rise = float(np.interp(strike, motion.time, toe - heel))
    if rise > length * np.sin(HEEL_FIRST):
        return None
    near = np.flatnonzero((np.abs(motion.time - strike) <= ABOUT) & ~swings)
    lowest = np.minimum(heel, toe)[near]
    down = np.flatnonzero((lowest[:-1] > LANDED) & (lowest[1:] <= LANDED))
    if not len(down):
        return None
    k = int(down[np.argmin(np.abs(motion.time[near][down] - strike))])
    steps = lowest[k] / (lowest[k] - lowest[k + 1])
    return float(motion.time[near][k] + steps * (motion.time[1] - motion.time[0]))
