"""A person who stands: the quiet part of a trial, its mean posture, the flat foot."""

from collections.abc import Collection

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.markers import Markers

QUIET = 0.05  # speed below which a marker stands still; sway is slower by half (assumed) [m/s]
LONG = 0.5  # shortest quiet part [s]
LAG = 0.1  # before and after, over which a speed is taken, so that noise is none [s]
FEW = 0.1  # share of markers that may move: an arm, a flicker
HEIGHTS = (0.04, 0.14)  # that an ankle centre has above the floor [m]


def quiet_part(markers: Markers, names: Collection[str] | None = None) -> slice | None:
    """The longest stretch in which nothing moves."""
    moving = _speeds(markers, names)
    seen = np.isfinite(moving).sum(axis=1)
    still = (seen >= 3) & ((moving > QUIET).sum(axis=1) <= FEW * seen)
    edges = np.flatnonzero(np.diff(np.r_[False, still, False].astype(int)))
    runs = list(zip(edges[::2], edges[1::2], strict=True))
    if not runs:
        return None
    start, stop = max(runs, key=lambda run: run[1] - run[0])
    return slice(int(start), int(stop)) if markers.time[stop - 1] - markers.time[start] >= LONG else None


def standing_posture(markers: Markers) -> Markers:
    """The mean posture of a standing trial's quiet part, as markers of one frame."""
    time = markers.time
    if len(time) == 1 or time[-1] - time[0] < LONG:
        return quiet_posture(markers, slice(0, len(time)))
    found = quiet_part(markers)
    if found is None:
        slowest = _slowest(_speeds(markers, None))
        raise InputError(
            f"nobody stands still for {LONG:g} s in it; at best the markers move at {slowest:.2f} m/s",
            file=markers.file,
            field="static",
            allowed="a trial of a person who stands",
        )
    return quiet_posture(markers, found)


def quiet_posture(markers: Markers, quiet: slice) -> Markers:
    """The mean posture of some frames, as markers of one frame."""
    positions = {name: _mean_place(path[quiet])[None] for name, path in markers.positions.items()}
    start, end = markers.time[quiet][[0, -1]]
    told = f"standing from {start:.2f} to {end:.2f} s of {markers.file.name}"
    return Markers(markers.file, markers.time[quiet][:1], positions, (told,))


def _mean_place(path: np.ndarray) -> np.ndarray:
    """Mean of the seen part of a path (n, 3); NaN if nothing is seen."""
    seen = path[np.isfinite(path).all(axis=1)]
    return np.asarray(seen.mean(axis=0)) if len(seen) else np.full(3, np.nan)


def sole_pitch(heel: np.ndarray, toe: np.ndarray, vertical: np.ndarray) -> float:
    """Pitch of the line from heel to toe where the foot stands flat, toe up positive [rad].

    Units: heel, toe [m] (3,), vertical (3,).
    """
    foot = toe - heel
    rise = float(foot @ vertical)
    return float(np.arctan2(rise, np.linalg.norm(foot - rise * vertical)))


def flat_ankle_height(ankle: np.ndarray, vertical: np.ndarray) -> float | None:
    """The ankle centre's height above the laboratory's zero; None if that is no ankle's height [m].

    Units: ankle [m] (3,), vertical (3,).
    """
    height = float(ankle @ vertical)
    return height if HEIGHTS[0] <= height <= HEIGHTS[1] else None


def _speeds(markers: Markers, names: Collection[str] | None) -> np.ndarray:
    """Speed of each marker over 2 `LAG` (n, m), that of the nearest whole span at the ends [m/s]."""
    chosen = list(markers.positions) if names is None else [n for n in markers.positions if n in names]
    paths = np.stack([markers.positions[name] for name in chosen], axis=1)
    time = markers.time
    step = max(1, round(LAG / float(np.median(np.diff(time)))))
    if len(time) <= 2 * step:
        return np.full(paths.shape[:2], np.nan)
    way = np.linalg.norm(paths[2 * step :] - paths[: -2 * step], axis=2)
    inner = way / (time[2 * step :] - time[: -2 * step])[:, None]
    return np.pad(inner, ((step, step), (0, 0)), mode="edge")


def _slowest(speeds: np.ndarray) -> float:
    seen = np.isfinite(speeds)
    mean = np.where(seen, speeds, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    return float(np.min(mean[seen.any(axis=1)], initial=np.inf))
