"""Whose foot stands on a plate: the one that the centre of pressure keeps nearest to."""

from collections.abc import Mapping

import numpy as np

from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

REACH = 0.15  # mean distance of a foot's pressure from its line heel–toe, beyond which it is another's or a
# crutch's; 1 to 6 cm in the feet of four recorded walks, the other foot's 35 cm and more (derived) [m]
PLANAR = 1e-4  # width of a leg that is known in the plane of walking alone [m]


def stands_there(
    time: np.ndarray,
    place: np.ndarray,
    side: str,
    legs: Mapping[str, LegPoints],
    frame: WalkingFrame,
) -> bool:
    """Whether a centre of pressure is this foot's, by its line from heel to toe, seen from above.

    With short steps the pressure of one foot passes within a foot's length of the other ankle all through
    the contact, so that it takes both feet, and their places across the walk, to tell. A crutch's is beside.

    Units: time [s] (n,), place [m] (n, 3).
    """
    wide = bool(np.ptp(frame.across(place))) and all(_width(leg, frame) > PLANAR for leg in legs.values())
    pressed = _level(place, frame, wide)
    found = {}
    for name, leg in legs.items():
        ends = [_at(time, leg.time, _level(leg.points[role].path, frame, wide)) for role in ("heel", "toe")]
        away = _distance(pressed, *ends)
        if np.isfinite(away).mean() > 0.5:
            found[name] = float(np.nanmean(away))
    if side not in found:
        return True
    return found[side] == min(found.values()) and (found[side] < REACH or not wide)


def _width(leg: LegPoints, frame: WalkingFrame) -> float:
    """How far the leg's points lie apart across the walk [m]; none for one made of sagittal angles."""
    across = np.array([frame.across(point.path) for point in leg.points.values()])
    seen = across[:, np.isfinite(across).all(axis=0)]
    return float(np.ptp(seen, axis=0).max()) if seen.size else 0.0


def _level(points: np.ndarray, frame: WalkingFrame, wide: bool) -> np.ndarray:
    """(n, 3) in the laboratory → forward and across (n, 2); 0 across where that is not known."""
    return np.column_stack([frame.plane(points)[:, 0], frame.across(points) * wide])


def _at(time: np.ndarray, known: np.ndarray, way: np.ndarray) -> np.ndarray:
    """A way (n, 2) at other times, NaN before and after it and beside its gaps."""
    return np.column_stack([np.interp(time, known, column, np.nan, np.nan) for column in way.T])


def _distance(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance of points to lines between two ends, each (n, 2) [m] (n,)."""
    line = end - start
    share = np.sum((points - start) * line, axis=1) / np.maximum(np.sum(line**2, axis=1), 1e-9)
    return np.asarray(np.linalg.norm(points - start - np.clip(share, 0.0, 1.0)[:, None] * line, axis=1))
