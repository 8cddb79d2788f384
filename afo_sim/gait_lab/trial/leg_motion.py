"""The leg over time in the plane of walking: shank, knee and ankle angle, the ankle's and the foot's way."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.signals import evenly, fill_gaps, low_pass
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_LEAP = 0.05  # way of a marker to and fro within two frames, which no foot goes (assumed) [m]
_Smoother = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # time, way → time, way


@dataclass(frozen=True, eq=False)
class LegMotion:
    """Sagittal motion of one leg in the laboratory, filtered; arrays (n,)."""

    time: np.ndarray  # even steps [s]
    shank_angle: np.ndarray  # knee ahead of ankle positive [rad]
    knee_angle: np.ndarray  # flexion positive [rad]
    ankle_angle: np.ndarray  # dorsiflexion positive, its zero where the line heel–toe lies level [rad]
    ankle_x: np.ndarray  # forward [m]
    ankle_z: np.ndarray  # above the floor [m]
    heel: np.ndarray  # forward and above the floor [m] (n, 2)
    toe: np.ndarray  # likewise
    hidden: tuple[tuple[str, float, float], ...] = ()  # what was not seen, from when to when [s]
    side: str = "right"
    pelvis_x: np.ndarray | None = None  # forward [m]
    marked: tuple[float, ...] = ()  # heel strikes that the laboratory marked [s]


def from_points(
    leg: LegPoints, frame: WalkingFrame, cutoff: float, closed: RecordedStride | None = None
) -> LegMotion:
    """Angles between the lines hip–knee, knee–ankle and heel–toe, seen along the walker's left-right axis."""

    def smooth(time: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if closed is None:
            return time, low_pass(time, way, cutoff)
        return _smooth_cycle(time, way, closed, frame.belt_speed, cutoff)

    ways, hidden = {}, []
    time = smooth(*evenly(leg.time, np.zeros((len(leg.time), 2))))[0]
    for role, point in leg.points.items():
        ways[role], gaps = _way(leg.time, frame.over_floor(point.path), smooth)
        hidden += [(f"{role} ({point.how})", *gap) for gap in gaps]
    pelvis = None if leg.pelvis is None else _way(leg.time, frame.plane(leg.pelvis), smooth)[0][:, 0]
    shank = _lean(ways["knee"] - ways["ankle"])
    thigh = _lean(ways["hip"] - ways["knee"])
    foot = ways["toe"] - ways["heel"]
    pitch = _about_mean(np.arctan2(foot[:, 1], foot[:, 0]))
    return LegMotion(
        time=time,
        shank_angle=shank,
        knee_angle=shank - thigh,
        ankle_angle=pitch + shank,
        ankle_x=ways["ankle"][:, 0],
        ankle_z=ways["ankle"][:, 1],
        hidden=tuple(hidden),
        side=leg.side,
        heel=ways["heel"],
        toe=ways["toe"],
        pelvis_x=pelvis,
    )


def _way(
    time: np.ndarray, points: np.ndarray, smooth: _Smoother
) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """A point's filtered way in the plane (n, 2), and when it was not seen."""
    columns, hidden = [], []
    # a sample that lies far from both neighbours is a label that jumped for a frame
    off = np.linalg.norm(points[1:-1] - 0.5 * (points[:-2] + points[2:]), axis=1)
    beside = np.linalg.norm(points[2:] - points[:-2], axis=1)
    leaps = np.r_[False, (off > _LEAP) & (off > 2.0 * beside), False]
    for column in np.where(leaps[:, None], np.nan, points).T:
        filled, gaps = fill_gaps(time, column)
        columns.append(filled)
        hidden += [gap for gap in gaps if gap not in hidden]
    return smooth(*evenly(time, np.column_stack(columns)))[1], hidden


def _smooth_cycle(
    time: np.ndarray, way: np.ndarray, closed: RecordedStride, belt_speed: float, cutoff: float
) -> tuple[np.ndarray, np.ndarray]:
    """The window's times and the filtered way (n, 2) there; three periods of it are filtered."""
    from scipy.interpolate import Akima1DInterpolator

    assert closed.closed is not None
    step = float(time[1] - time[0])
    start, end = closed.closed.window
    inside = (time >= start - 0.5 * step) & (time <= end + 0.5 * step)
    inside &= time < time[inside][0] + closed.time - 0.5 * step  # the period's end is its beginning
    gain = np.array([closed.closed.length - belt_speed * closed.time, 0.0])
    times = np.concatenate([time[inside] + k * closed.time for k in (-1, 0, 1)])
    ways = np.vstack([way[inside] + k * gain for k in (-1, 0, 1)])
    grid = time[inside][0] + step * np.arange(-inside.sum() + 2, 2 * inside.sum() - 2)
    smooth = low_pass(grid, Akima1DInterpolator(times, ways)(grid), cutoff)
    kept = (grid >= start - 0.5 * step) & (grid <= end + 0.5 * step)
    return grid[kept], smooth[kept]


def _lean(upward: np.ndarray) -> np.ndarray:
    """Angle of an upward vector (n, 2) from the vertical, forward positive [rad]."""
    return _about_mean(np.arctan2(upward[:, 0], upward[:, 1]))


def _about_mean(angle: np.ndarray) -> np.ndarray:
    """Angles within half a turn of their mean direction: a leg does not turn over, an invented gap may."""
    mean = np.angle(np.exp(1j * angle).mean())
    return np.asarray(mean + np.angle(np.exp(1j * (angle - mean))))
