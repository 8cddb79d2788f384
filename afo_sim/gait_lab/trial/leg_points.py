"""Points of one leg in the laboratory, with the way in which each was found."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class LegPoint:
    """A point of the leg over time."""

    path: np.ndarray  # in the laboratory's axes, NaN where it was not seen [m] (n, 3)
    how: str  # where it comes from, in words: "midpoint of R.Knee.Lat and R.Knee.Med"
    error: float | None = None  # standard error of its place in the sagittal plane, where one is known [m]
    better: str = ""  # what would place it better, in words
    bridged: np.ndarray | None = None  # frames in which its segment's markers stand in for it (n,)


@dataclass(frozen=True, eq=False)
class LegPoints:
    """Hip, knee and ankle centre, heel and toe of one leg; unfiltered, with gaps."""

    side: str  # "right" or "left"
    time: np.ndarray  # [s] (n,)
    points: Mapping[str, LegPoint]  # by role: hip, knee, ankle, heel, toe
    pelvis: np.ndarray | None = None  # a point of the pelvis, in the laboratory's axes [m] (n, 3)
    sole: float | None = None  # pitch of the line heel–toe with the sole flat, where a model or a standing
    # trial tells it, toe up positive [rad]
    ankle_height: float | None = None  # of the ankle centre above the flat sole, likewise [m]
    outline: Mapping[str, float] = field(default_factory=dict)  # of the foot, ahead of the ankle when flat:
    # "heel" and "toe" [m], likewise
    by_angles: bool = False  # placed by joint angles, not by markers
    remarks: tuple[str, ...] = ()  # what was understood, one sentence each
    warnings: tuple[str, ...] = ()  # what a person should look at, one sentence each
