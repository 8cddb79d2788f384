"""The constant that a plate reads while nobody stands on it, and what is left without it."""

import numpy as np

BAND = 10.0  # about the constant, within which a plate is unloaded [N]; assumed: twice a plate's noise
REST = 0.1  # shortest stretch without load [s]; assumed: a third of a swing
SHARE = 0.03  # of the trial that is without load [-]; assumed
STEPPED = 100.0  # beyond the constant: somebody was on the plate [N]; assumed
LARGEST = 0.15  # of the greatest load: beyond, it is somebody standing still [-]; assumed
# What is worth taking off: 2 N is given; 1 N·m moves the pressure of 700 N by 1.4 mm (derived).
WORTH = (2.0, 1.0)  # [N], [N·m]


def unloaded(time: np.ndarray, load: np.ndarray) -> np.ndarray | None:
    """Samples in which nothing presses, if they are clear.

    Units: time [s] (n,), load [N] (n,).
    """
    if len(load) < 8 or not np.isfinite(load).all():
        return None
    middle = float(np.median(load))
    up, down = np.quantile(load, 0.999) - middle, middle - np.quantile(load, 0.001)
    # a plate loaded for most of the trial swings to the other side: the end nearer to nothing is its rest
    rest = float(np.quantile(load, 0.03 if abs(np.max(load)) >= abs(np.min(load)) else 0.97))
    if max(up, down) < STEPPED:
        rest = middle
    for _ in range(3):
        near = np.abs(load - rest) < BAND
        if not near.any():
            return None
        rest = float(np.median(load[near]))
    near = np.abs(load - rest) < BAND
    greatest = float(np.abs(load - rest).max())
    edges = np.flatnonzero(np.diff(np.r_[False, near, False].astype(int)))
    step = float(time[-1] - time[0]) / (len(time) - 1)
    longest = float((edges[1::2] - edges[::2]).max()) * step
    largest = LARGEST * greatest if greatest >= STEPPED else STEPPED  # somebody who stands still is heavier
    if near.mean() < SHARE or longest < REST or abs(rest) > largest:
        return None
    # by chance in the band while a foot comes or goes: the long stretches alone
    kept = np.zeros(len(load), dtype=bool)
    for first, stop in zip(edges[::2], edges[1::2], strict=True):
        kept[first:stop] = (stop - first) * step >= 0.5 * REST
    return kept


def constant(time: np.ndarray, load: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """What the plate's signals read without load; zeros where that is little, or not clear.

    Units: time, load (n,), signals [N] (n, 3 or 6).
    """
    rest = unloaded(time, load)
    nothing = np.zeros(signals.shape[1])
    if rest is None or not np.isfinite(signals).all():
        return nothing
    found = np.median(signals[rest], axis=0)
    worth = np.linalg.norm(found[:3]) > WORTH[0] or np.linalg.norm(found[3:]) > WORTH[1]
    return np.asarray(found) if worth else nothing


def place_of(force: np.ndarray, moment: np.ndarray, up: np.ndarray, height: float) -> np.ndarray:
    """Where a force presses on a level plane.

    Units: force [N] (n, 3), moment [N·m] (n, 3), up (3,), height [m], returns [m].
    """
    across = force @ up
    with np.errstate(divide="ignore", invalid="ignore"):
        # from p × F = M and p·u = h: u × (p × F) = p (u·F) − F (u·p)
        place = (np.cross(up, moment) + height * force) / across[:, None]
    return np.where(np.abs(across[:, None]) < 1.0, np.nan, place)
