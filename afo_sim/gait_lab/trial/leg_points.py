"""The points of a leg over time, and its length, which shows a wrong unit."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait_lab.noted import Noted

# Hip centre to ankle centre, toddlers to the tallest. Adults have 0.49 of the body's height (Winter 2009,
# segment lengths: thigh 0.245 H, shank 0.246 H); 1.2 m is 2.45 m of height, 0.15 m is 0.3 m.
_LEG = (0.15, 1.2)  # [m]
_UNITS = {
    1000.0: "millimetres",
    100.0: "centimetres",
    10.0: "decimetres",
    0.001: "metres read as millimetres",
}


@dataclass(frozen=True, eq=False)
class LegPoint:
    """A point of the leg over time."""

    path: np.ndarray  # in the laboratory's axes, NaN where it was not seen [m] (n, 3)
    source: str  # what it is, in words: "midpoint of R.Knee.Lat and R.Knee.Med"
    error: float | None = None  # standard error of its place in the sagittal plane, where one is known [m]
    better: str = ""  # what would place it better, in words
    bridged: np.ndarray | None = None  # frames in which its segment's markers stand in for it (n,)
    way: str = ""  # how the source gives the point, where it is not the point itself: "lateral alone"
    carriers: tuple[str, ...] = ()  # markers that carry it from a standing posture into the walk

    @property
    def how(self) -> str:
        """Where it comes from, in words."""
        carried = f"standing, carried by {', '.join(self.carriers)}" if self.carriers else ""
        return ", ".join(part for part in (self.source, self.way, carried) if part)


@dataclass(frozen=True, eq=False)
class LegPoints(Noted):
    """Hip, knee and ankle centre, heel and toe of one leg; unfiltered, with gaps."""

    side: str  # "right" or "left"
    time: np.ndarray  # [s] (n,)
    points: Mapping[str, LegPoint]  # by role: hip, knee, ankle, heel, toe
    pelvis: np.ndarray | None = None  # a point of the pelvis, in the laboratory's axes [m] (n, 3)
    sole: float | None = None  # pitch of the line heel–toe with the sole flat, where a model or a standing
    # trial shows it, toe up positive [rad]
    ankle_height: float | None = None  # of the ankle centre above the flat sole, likewise [m]
    outline: Mapping[str, float] = field(default_factory=dict)  # of the foot, ahead of the ankle when flat:
    # "heel" and "toe" [m], likewise
    by_angles: bool = False  # placed by joint angles, not by markers
    notices: tuple[Notice, ...] = ()


def mean_place(path: np.ndarray) -> np.ndarray:
    """Mean of the seen part of a path (n, 3); NaN if nothing is seen."""
    seen = path[np.isfinite(path).all(axis=1)]
    return np.asarray(seen.mean(axis=0)) if len(seen) else np.full(3, np.nan)


def leg_length(points: LegPoints) -> float:
    """Hip to knee to ankle, the trial's median [m]; NaN if they are never seen together."""
    paths = {role: points.points[role].path for role in ("hip", "knee", "ankle")}
    thigh, shank = paths["hip"] - paths["knee"], paths["knee"] - paths["ankle"]
    lengths = np.linalg.norm(thigh, axis=1) + np.linalg.norm(shank, axis=1)
    return float(np.nanmedian(lengths)) if np.any(np.isfinite(lengths)) else float("nan")


def unit_doubt(points: LegPoints) -> str | None:
    """A sentence on the unit of a leg of impossible length; None if the length is possible."""
    length = leg_length(points)
    if not np.isfinite(length) or _LEG[0] <= length <= _LEG[1]:
        return None
    seen = f"the {points.side} leg, hip to knee to ankle, is {length:.3g} m long"
    for factor, unit in _UNITS.items():
        if _LEG[0] <= length / factor <= _LEG[1]:
            return f"{seen}: {unit}? divided by {factor:g} it is {length / factor:.2f} m; state the unit"
    return f"{seen}, and no unit of length makes it a leg of {_LEG[0]:g} to {_LEG[1]:g} m"


Legs = Mapping[str, LegPoints]  # by side
