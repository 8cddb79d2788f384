"""The dip of a point's height in swing, which is its clearance."""

import numpy as np

RIPPLE = 1e-3  # depth from which a dip of the clearance is one [m]
MID_SWING = (0.25, 0.75)  # of the swing, where no dip is found [-]


def dip(height: np.ndarray) -> tuple[int, bool]:
    """Row of the least clearance of a swing, and whether that is a minimum between two peaks.

    Parameters
    ----------
    height : of a point of the sole above the floor, toe-off to heel strike [m] (n,)

    Returns
    -------
    (row, True) of the lowest minimum between two peaks, at least 1 mm deep; without one (row, False) of the
    lowest in the middle half of the swing, since at both its ends the foot is on the floor

    Source
    ------
    Minimum toe clearance as a local minimum in mid-swing: Winter 1991; Schulz 2011 (which also counts the
    swings that have none).
    """
    inner = height[1:-1]
    turns = np.flatnonzero((inner < height[:-2]) & (inner <= height[2:])) + 1
    dips = [int(k) for k in turns if min(_rise(height[k::-1]), _rise(height[k:])) >= RIPPLE]
    if dips:
        return min(dips, key=lambda k: height[k]), True
    start, end = (round(share * (len(height) - 1)) for share in MID_SWING)
    return start + int(np.argmin(height[start : end + 1])), False


def _rise(height: np.ndarray) -> float:
    """Climb of a height above its first value before it falls below it [m]."""
    below = height < height[0]
    end = int(np.argmax(below)) if below.any() else len(height)
    return float(height[:end].max() - height[0])
