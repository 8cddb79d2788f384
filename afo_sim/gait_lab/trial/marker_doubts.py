"""Doubts about a leg's points: segments that change their length, points that leap, clocks that stutter."""

import numpy as np

from afo_sim.gait_lab.trial.leg_points import LegPoints

SEGMENTS = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle"), "foot": ("heel", "toe")}
THIGH_TO_SHANK = (0.75, 1.35)  # lengths; 0.87 to 1.04 in two models and three sets of markers (assumed) [-]
CHANGE = 0.1  # of a segment's length; skin moves markers by some centimetres of 0.4 m; assumed
LEAP = 0.1  # of a point in a frame, from where it would have gone; assumed [m]
ACCELERATION = 60.0  # of a foot at heel strike, that adds to it half a frame's time squared; assumed [m/s²]
LONGEST_STEP = 0.1  # between two samples over which a point's way can be foretold [s]
UNEVEN = 0.1  # of the usual step of time, that a step may differ


def marker_doubts(points: LegPoints) -> list[str]:
    """Segments that change by more than 10 %, and points that leap by more than 10 cm, one sentence each.

    Both are what exchanged markers do, for a few frames or all the time.
    """
    return _lengths(points) + _proportion(points) + _leaps(points)


def _proportion(points: LegPoints) -> list[str]:
    """A sentence where thigh and shank cannot be one person's: a hip or knee at another place."""
    means = {}
    for name, (upper, lower) in SEGMENTS.items():
        length = np.linalg.norm(points.points[upper].path - points.points[lower].path, axis=1)
        means[name] = float(np.nanmedian(length)) if np.isfinite(length).any() else np.nan
    ratio = means["thigh"] / means["shank"]
    if not np.isfinite(ratio) or THIGH_TO_SHANK[0] <= ratio <= THIGH_TO_SHANK[1]:
        return []
    return [
        f"the {points.side} thigh is {100.0 * means['thigh']:.0f} cm long and the shank "
        f"{100.0 * means['shank']:.0f} cm: is the hip's or the knee's marker at another place?"
    ]


def _lengths(points: LegPoints) -> list[str]:
    found = []
    for name, (upper, lower) in SEGMENTS.items():
        length = np.linalg.norm(points.points[upper].path - points.points[lower].path, axis=1)
        known = np.isfinite(length)
        if known.sum() < 3:
            continue
        median = float(np.median(length[known]))
        change = np.where(known, length, median) / median - 1.0
        if np.abs(change).max() <= CHANGE:
            continue
        k, bad = int(np.argmax(np.abs(change))), np.abs(change) > CHANGE
        first, last = points.time[bad][[0, -1]]
        when = (
            f"at {first:.2f} s" if bad.sum() == 1 else f"in {bad.sum()} frames of {first:.2f} to {last:.2f} s"
        )
        found.append(
            f"the {points.side} {name}, {upper} to {lower}, changes its length of {100.0 * median:.1f} cm by "
            f"{100.0 * change[k]:+.0f} %, {when}: exchanged or sliding markers?"
        )
    return found


def _leaps(points: LegPoints) -> list[str]:
    found = []
    for role, point in points.points.items():
        known = np.all(np.isfinite(point.path), axis=1)
        time, path = points.time[known], point.path[known]
        if len(time) < 3:
            continue
        step = np.diff(time)
        velocity = np.diff(path, axis=0) / step[:, None]
        off = np.linalg.norm((velocity[1:] - velocity[:-1]) * step[1:, None], axis=1)
        near = (step[1:] <= LONGEST_STEP) & (step[:-1] <= LONGEST_STEP)
        leaps = near & (off > LEAP + ACCELERATION * step[1:] ** 2)
        if np.any(leaps):
            k = int(np.argmax(leaps))
            found.append(
                f"the {points.side} {role} leaps by {100.0 * off[k]:.0f} cm at {time[k + 2]:.2f} s"
                f"{' and later' if leaps[k + 3 :].any() else ''}: exchanged markers?"
            )
    return found


def steps_of_time(what: str, time: np.ndarray, rate: float) -> list[str]:
    """Sentences on a clock that is slower than `rate` [Hz] or uneven."""
    steps = np.diff(time)
    step = float(np.median(steps))
    found = []
    if 1.0 / step < rate * (1.0 - 1e-6):
        found.append(f"{what} is sampled at {1.0 / step:.0f} Hz only; {rate:.0f} Hz or more show the events")
    uneven = np.abs(steps - step) > UNEVEN * step
    if np.any(uneven):
        worst = steps[np.argmax(np.abs(steps - step))]
        found.append(
            f"{what} has {uneven.sum()} of {len(steps)} steps of time that are not {1e3 * step:.3g} ms, one "
            f"of {1e3 * worst:.3g} ms: the samples between are interpolated"
        )
    return found
