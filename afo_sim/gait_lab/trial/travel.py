"""Where a walker goes: the way of the body, its direction and its turns."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.signals import evenly, low_pass
from afo_sim.gait_lab.trial.leg_points import LegPoints

STRIDE = (0.5, 4.0)  # shortest and longest time of a stride, of patients at 0.2 m/s too; assumed [s]
_RETURN = 0.5  # of the difference of unlike postures: below it a posture has returned; assumed [-]
SMOOTH = 6.0  # low-pass for velocities; Winter 2009's cutoff for walking [Hz]
_STRAIGHT = 15.0  # range of the strides' headings that is one walk along a line; assumed [deg]
_MOVING = 0.3  # of the largest speed: below it the walker stops or starts; assumed [-]


@dataclass(frozen=True, eq=False)
class Heading:
    """The longest straight part of a walk, in the two level axes."""

    direction: np.ndarray  # unit vector (2,)
    speed: float  # [m/s]
    span: tuple[float, float]  # from when to when the walk is straight [s]
    whole: bool  # the walk is straight from its first to its last stride
    turn: float  # of the direction over one stride in the span [rad]
    off: float  # largest angle between `direction` and travel in the span [rad]
    stride_length: float  # [m]


def body_path(legs: Mapping[str, LegPoints]) -> tuple[np.ndarray, np.ndarray, str]:
    """Way of the pelvis, or else of the hips' middle, or else of the ankles'."""
    first = next(iter(legs.values()))
    alike = [leg for leg in legs.values() if len(leg.time) == len(first.time)]
    candidates = [("pelvis", [leg.pelvis for leg in alike if leg.pelvis is not None])]
    candidates += [(f"{role}s", [leg.points[role].path for leg in alike]) for role in ("hip", "ankle")]
    for name, paths in candidates:
        if paths:
            time, path = seen(first.time, np.mean(paths, axis=0))
            if len(time) > 2:
                return time, path, name
    return first.time, np.zeros((len(first.time), 3)), "nothing"


def seen(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From the first to the last complete sample, gaps between bridged by lines; time in even steps."""
    known = np.flatnonzero(np.all(np.isfinite(values), axis=1))
    if len(known) < 2:
        return time[:0], values[:0]
    inside = slice(known[0], known[-1] + 1)
    filled = [np.interp(time[inside], time[known], column[known]) for column in values.T]
    return evenly(time[inside], np.column_stack(filled))


def stride_period(legs: Mapping[str, LegPoints], up: np.ndarray) -> float | None:
    """Time after which the legs' posture first returns [s]; None if the recording is shorter."""
    first = next(iter(legs.values()))
    columns = []
    for leg in legs.values():
        if len(leg.time) != len(first.time):
            continue
        paths = {role: point.path for role, point in leg.points.items()}
        columns += [paths[role] @ up for role in ("ankle", "heel", "toe")]
        columns.append(np.linalg.norm(paths["hip"] - paths["ankle"], axis=1))
    time, posture = seen(first.time, np.column_stack(columns))
    if len(time) < 10:
        return None
    step = float(time[1] - time[0])
    lags = np.arange(max(1, int(STRIDE[0] / step)), min(len(time) - 4, int(STRIDE[1] / step) + 1))
    if len(lags) < 3:
        return None
    apart = np.array([np.mean((posture[lag:] - posture[:-lag]) ** 2) for lag in lags])
    lows = 1 + np.flatnonzero((apart[1:-1] <= apart[:-2]) & (apart[1:-1] < apart[2:]))
    lows = lows[apart[lows] < _RETURN * 2.0 * np.mean(np.var(posture, axis=0))]
    if not len(lows):
        return None
    # of neighbouring ripples the deepest; a later stride's return is no deeper than the first but for noise
    near = lows[lags[lows] < 1.3 * lags[lows[0]]]
    return float(step * lags[near[np.argmin(apart[near])]])


def heading(time: np.ndarray, path: np.ndarray, period: float | None) -> Heading:
    """Direction and speed of the longest straight part of a walk."""
    step = float(time[1] - time[0])
    lag = len(time) - 1 if period is None else min(len(time) - 1, max(1, round(period / step)))
    chords = path[lag:] - path[:-lag]
    lengths = np.linalg.norm(chords, axis=1)
    moving = np.flatnonzero(lengths >= _MOVING * lengths.max())
    angles = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0])[moving])
    first, last = _straight(moving, angles)
    mean = chords[moving[first : last + 1]].mean(axis=0)
    length = float(np.linalg.norm(mean))
    start, end = int(moving[first]), int(moving[last]) + lag
    turn = 0.0 if period is None else _turn(time[start : end + 1], path[start : end + 1], lag)
    return Heading(
        direction=mean / length if length > 0.0 else np.array([1.0, 0.0]),
        speed=length / (lag * step),
        span=(float(time[start]), float(time[end])),
        whole=first == 0 and last == len(moving) - 1,
        turn=turn,
        off=0.5 * (abs(turn) + float(np.ptp(angles[first : last + 1]))),
        stride_length=length,
    )


def _straight(moving: np.ndarray, angles: np.ndarray) -> tuple[int, int]:
    """First and last of the longest run of strides whose directions differ by less than `_STRAIGHT`."""
    best, first = (0, 0), 0
    limit = math.radians(_STRAIGHT)
    for last in range(len(angles)):
        if last and moving[last] != moving[last - 1] + 1:
            first = last
        while np.ptp(angles[first : last + 1]) > limit:
            first += 1
        if last - first > best[1] - best[0]:
            best = first, last
    return best


def _turn(time: np.ndarray, path: np.ndarray, lag: int) -> float:
    """Angle between the velocities at two ends of a stride, at the same phase, on average [rad]."""
    if len(time) < lag + 4:
        return 0.0
    velocity = np.gradient(low_pass(time, path, SMOOTH), time, axis=0)
    before, after = velocity[:-lag], velocity[lag:]
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return float(np.arctan2(cross.mean(), np.sum(before * after, axis=1).mean()))
