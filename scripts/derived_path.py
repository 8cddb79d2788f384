"""The ankle's path where only the angles of one leg and its load are known, as in published mean curves.

While the foot carries the body, the floor holds the ankle: the foot rocks over the heel, stands flat, and
rocks over the ball with its toes flat. The chain ankle–knee–hip leads to the hip. The other leg does the
same half a stride later. So the hip of the swinging leg is the standing leg's, and the chain hip–knee–ankle
leads down to the swinging ankle.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait import COP_FORCE, LATE_SWING, Chain, GaitCycle
from afo_sim.gait.cycle import HARMONICS
from afo_sim.gait.fourier import FourierSeries

_ADULT = 1.75  # body height that the lengths below belong to [m]
# Heel's contact behind the ankle centre: halfway between the centre of pressure of the loaded heel (10 mm:
# Bovi 2011, by moment and force) and the heel bone's end (48.8 mm: opensim-models, talus to calcaneus).
HEEL = 0.030
_HINGE = 0.130  # joint of the toes ahead of the ankle centre (opensim-models: 178.8 − 48.8 mm) [m]
_HINGE_HEIGHT = 0.025  # of that joint above the floor: an ankle axis at 69 mm, the joint 44 mm below [m]


@dataclass(frozen=True)
class FootShape:
    """What rocks on the floor, from the ankle centre, with the foot flat."""

    ankle_height: float
    heel: float
    hinge: float
    hinge_height: float

    @classmethod
    def of_height(cls, body_height: float, ankle_height: float, behind: float = 0.0) -> "FootShape":
        """An adult's foot, scaled by body height."""
        size = body_height / _ADULT
        return cls(ankle_height, size * HEEL - behind, size * _HINGE + behind, size * _HINGE_HEIGHT)


def rocking(pitch: np.ndarray, foot: FootShape) -> tuple[np.ndarray, np.ndarray]:
    """Where the ankle is while the foot stands and turns without sliding.

    Source: Perry & Burnfield 2010, Gait Analysis, chapter 3 (heel, ankle and forefoot rocker), as rigid
    parts. Units: pitch [rad] (n,), returns [m].
    """
    sine, cosine = np.sin(np.abs(pitch)), np.cos(pitch)
    above = foot.ankle_height - foot.hinge_height  # of the ankle above the hinge
    on_heel = foot.heel * (cosine - 1.0) - foot.ankle_height * sine
    on_ball = foot.hinge * (1.0 - cosine) + above * sine
    over_heel = foot.heel * sine + foot.ankle_height * cosine
    over_ball = foot.hinge_height + foot.hinge * sine + above * cosine
    toe_up = pitch > 0.0
    return np.where(toe_up, on_heel, on_ball), np.where(toe_up, over_heel, over_ball)


LOADED = 0.6  # upward force above which the floor is taken to hold the foot [body weights]
_SMOOTHED = 3  # harmonics of the hip's path in stance …
_SPAN = 1.0 / 0.6  # … over this many strides, so that the window has no periodic ends


@dataclass(frozen=True, eq=False)
class AnklePath:
    """forward [m] (n,), from 0 at heel strike; up [m] (n,), above the floor."""

    forward: np.ndarray
    up: np.ndarray
    gaps: np.ndarray


def ankle_path(
    phase: np.ndarray,
    angles: tuple[np.ndarray, np.ndarray, np.ndarray],
    load: np.ndarray,
    stride_length: float,
    foot: FootShape,
    chain: Chain,
) -> AnklePath:
    """The ankle's path over one stride of a walker whose legs do alike."""
    shank, knee, ankle = angles
    start = float(phase[np.argmax(load > LOADED)])
    end = float(phase[(load > LOADED) & (phase < LATE_SWING)][-1])
    way = stride_length * phase
    floor = rocking(ankle - shank, foot)
    joined, gaps = [], []
    for held, to_hip, travel in zip(floor, chain.hip(shank, knee), (way, 0.0 * way), strict=True):
        coordinate, gap = _through_swing(phase, held - travel, to_hip, start, end)
        joined.append(coordinate + travel)
        gaps.append(gap)
    forward, up = (
        FourierSeries.fit(phase, signal, HARMONICS, progressing=number == 0)(phase)
        for number, signal in enumerate(joined)
    )
    return AnklePath(forward - forward[0], up, np.array(gaps))


def _through_swing(
    phase: np.ndarray, held: np.ndarray, to_hip: np.ndarray, start: float, end: float
) -> tuple[np.ndarray, np.ndarray]:
    """One coordinate of the ankle, steady travel apart (n,), and how far floor and hip differ at the ends
    of where the floor holds it (2,).

    held: the ankle by the floor; to_hip: the hip from the ankle.
    """
    inside = (phase >= start) & (phase <= end)
    weights = np.linalg.lstsq(_basis(phase[inside]), (held + to_hip)[inside], rcond=None)[0]

    def hanging(at: np.ndarray) -> np.ndarray:
        """From the standing leg's hip, at phases from `end` to 1 + `start` (m,)."""
        other = np.clip(at - 0.5, start, end)
        return np.asarray(_basis(other) @ weights - np.interp(at % 1.0, phase, to_hip))

    ends = np.array([end, 1.0 + start])
    gaps = hanging(ends) - np.interp(ends % 1.0, phase, held)
    later = np.where(phase < start, phase + 1.0, phase)
    share = (later - end) / (1.0 + start - end)
    swinging = hanging(later) - gaps[0] * (1.0 - share) - gaps[1] * share
    return np.where((later <= end) & (later >= start), held, swinging), gaps


def _basis(phase: np.ndarray) -> np.ndarray:
    """Constant, cosines and sines (n, 1 + 2 _SMOOTHED)."""
    turn = 2.0 * np.pi * np.outer(phase / _SPAN, np.arange(1, _SMOOTHED + 1))
    return np.column_stack([np.ones(len(phase)), np.cos(turn), np.sin(turn)])


_ROWS = 201  # every 0.5 % of the stride, so that points at every 2 % stay what they were
_ANGLES = ("shank_angle", "knee_angle", "ankle_angle")
_FORCES = ("grf_x", "grf_z", "ankle_moment")


def resampled(phase: np.ndarray, curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Published points as smooth columns of ROWS rows over one closed stride."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    fine = np.linspace(0.0, 1.0, _ROWS)
    columns = {"phase": fine}
    for name in _ANGLES:
        values = curves[name] - (curves[name][-1] - curves[name][0]) * (phase - 0.5)
        values[-1] = values[0]  # equal to the last bit, which the spline asks for
        columns[name] = CubicSpline(phase, values, bc_type="periodic")(fine)
    return columns | {name: PchipInterpolator(phase, curves[name])(fine) for name in _FORCES}


def with_derived_path(cycle: GaitCycle, foot: FootShape, chain: Chain) -> GaitCycle:
    """The same stride with its ankle's path and centre of pressure derived from its other columns."""
    length = cycle.walking_speed * cycle.stride_time
    angles = cycle.shank_angle, cycle.knee_angle, cycle.ankle_angle
    path = ankle_path(cycle.phase, angles, cycle.grf_z, length, foot, chain)
    # Where the ground presses, ahead of the ankle, so that its force has the ankle's moment [m] (n,)
    pressing = cycle.grf_z > COP_FORCE
    ahead = -cycle.ankle_moment / GRAVITY - path.up * cycle.grf_x
    place = np.where(pressing, ahead / np.where(pressing, cycle.grf_z, 1.0), np.nan)
    place = np.where(cycle.phase < LATE_SWING, place, np.nan)
    return dataclasses.replace(cycle, ankle_x=path.forward, ankle_z=path.up, cop_x=place)
