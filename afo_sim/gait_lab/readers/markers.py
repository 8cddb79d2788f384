"""Marker trajectories."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Notice, plausible
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.stated import Stated
from afo_sim.gait_lab.readers.text import unique_names

_FILLER = 999_000.0  # coordinate from which on it says "lost", as in 9999999, in whatever unit


@dataclass(frozen=True, eq=False)
class Markers(Noted):
    """Trajectories in the laboratory's axes; a marker that was not seen is NaN."""

    file: pathlib.Path
    time: np.ndarray  # [s] (n,)
    positions: dict[str, np.ndarray]  # name as in the file: (n, 3) [m]
    notices: tuple[Notice, ...] = ()  # what was odd about the file and how it was read
    unseen: tuple[str, ...] = ()  # names in the file without a single place
    stated: Stated | None = None  # what the laboratory itself says, in a C3D

    def point(self, names: Sequence[str]) -> np.ndarray:
        """The midpoint of some markers [m] (n, 3)."""
        return np.asarray(np.mean([self.positions[name] for name in names], axis=0))


def lost_as_nan(points: np.ndarray) -> np.ndarray:
    """Coordinates with NaN for a lost marker, however the file marks it."""
    with np.errstate(invalid="ignore"):
        size = np.abs(points)
        lost = ~np.isfinite(points).all(axis=2) | (size >= _FILLER).any(axis=2) | (points == 0.0).all(axis=2)
        lost |= (points[..., :1] == points).all(axis=2) & (size[..., 0] >= 999.0)
    return plausible(np.where(lost[..., None], np.nan, points), missing=True)


def marker_set(
    file: pathlib.Path, time: np.ndarray, names: list[str], points: np.ndarray, notices: Sequence[Notice]
) -> Markers:
    """Markers by name: none twice, and none that is never seen."""
    titles = [name or f"unnamed {k}" for k, name in enumerate(names, start=1)]
    titles, doubles = unique_names(titles, "marker")
    seen = np.isfinite(points).all(axis=2).any(axis=0)
    found = [*notices, *doubles]
    if not all(names):
        unnamed = [title for title, name in zip(titles, names, strict=True) if not name]
        text = "{count} {have} no name: {names}"
        have = "marker has" if len(unnamed) == 1 else "markers have"
        names_shown = ", ".join(unnamed[:6])
        found.append(Notice("markers-unnamed", text, count=len(unnamed), have=have, names=names_shown))
    unseen = tuple(title for title, there in zip(titles, seen, strict=True) if not there)
    if unseen:
        found.append(note("markers-never-seen", "never seen: {names}", names=", ".join(unseen[:12])))
    positions = {title: points[:, k] for k, title in enumerate(titles) if seen[k]}
    return Markers(file, time, positions, tuple(found), unseen)
