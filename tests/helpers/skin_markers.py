"""A walking body with known joint centres and the markers on its skin, in any axes."""

import pathlib
from collections.abc import Mapping

import numpy as np

from afo_sim.gait_lab import Markers

RIGHT = {"right": 1.0, "left": -1.0}
THIGH, SHANK = 0.42, 0.41
WIDTH, DEPTH = 0.24, 0.16  # of the pelvis [m]
# Harrington et al. 2007 in millimetres, and a marker's radius of 7 mm, computed by hand for that pelvis:
# -0.24 * 160 - 9.9 - 7 = -55.3; -0.30 * 240 - 10.9 = -82.9; 0.33 * 240 + 7.3 = 86.5
HIP = (-0.0553, -0.0829, 0.0865)
SPEED = 1.2
FOOT = {  # from the ankle centre, forward, up, to the outside [m]
    "heel": (-0.07, -0.045, 0.0),
    "metatarsal_1": (0.13, -0.06, -0.04),
    "metatarsal_2": (0.14, -0.05, -0.01),
    "metatarsal_5": (0.11, -0.06, 0.05),
    "toe_tip": (0.19, -0.06, -0.01),
}
THIGH_CLUSTER = ((0.06, 0.18, 0.09), (-0.04, 0.17, 0.11), (-0.03, 0.28, 0.09), (0.05, 0.3, 0.1))
SHANK_CLUSTER = ((0.03, 0.3, 0.06), (0.01, 0.2, 0.07), (-0.06, 0.28, 0.05), (-0.05, 0.18, 0.06))


def turned(angle: np.ndarray, forward: float, up: float, across: float) -> np.ndarray:
    """Forward, up and to the right of a segment that leans forward by `angle` [rad] → (n, 3)."""
    x = forward * np.cos(angle) + up * np.sin(angle)
    y = -forward * np.sin(angle) + up * np.cos(angle)
    return np.stack([x, y, np.full_like(angle, across)], axis=1)


def body(time: np.ndarray, *, walks: bool = True) -> dict[str, dict[str, np.ndarray]]:
    """Centres and landmarks by side, x forward, y up, z right, each (n, 3) [m].

    Beside the landmarks there are `thigh_0` … and `shank_0` …, four each.
    """
    pelvis = np.stack([SPEED * time if walks else 0.0 * time, 0.98 + 0.0 * time, 0.0 * time], axis=1)
    tilt = 0.05 * np.sin(2.0 * time) if walks else 0.0 * time
    found: dict[str, dict[str, np.ndarray]] = {}
    for side, right in RIGHT.items():
        phase = 2.0 * np.pi * time / 1.1 + (0.0 if side == "right" else np.pi)
        move = 1.0 if walks else 0.0
        thigh = -0.45 * move * np.sin(phase) - 0.02
        shank = thigh + move * (0.5 - 0.5 * np.cos(phase + 0.6))
        foot = -move * 0.4 * np.sin(phase + 0.4) * (np.sin(phase + 0.4) < 0.0)
        hip = pelvis + turned(tilt, HIP[0], HIP[1], right * HIP[2])
        knee = hip + turned(thigh, 0.0, -THIGH, 0.0)
        ankle = knee + turned(shank, 0.0, -SHANK, 0.0)
        side_points = {
            "asis": pelvis + turned(tilt, 0.0, 0.0, right * WIDTH / 2),
            "psis": pelvis + turned(tilt, -DEPTH, 0.0, right * 0.04),
            "sacrum": pelvis + turned(tilt, -DEPTH, 0.0, 0.0),
            "hip_centre": hip,
            "trochanter": hip + turned(thigh, 0.0, 0.0, right * 0.09),
            "knee_centre": knee,
            "knee_lateral": knee + turned(thigh, 0.002, 0.003, right * 0.055),
            "knee_medial": knee + turned(thigh, -0.002, -0.003, -right * 0.055),
            "ankle_centre": ankle,
            "ankle_lateral": ankle + turned(shank, -0.008, -0.008, right * 0.04),
            "ankle_medial": ankle + turned(shank, 0.008, 0.008, -right * 0.04),
        }
        for name, (forward, up, out) in FOOT.items():
            side_points[name] = ankle + turned(foot, forward, up, right * out)
        for k, (forward, up, out) in enumerate(THIGH_CLUSTER):
            side_points[f"thigh_{k}"] = knee + turned(thigh, forward, up, right * out)
        for k, (forward, up, out) in enumerate(SHANK_CLUSTER):
            side_points[f"shank_{k}"] = ankle + turned(shank, forward, up, right * out)
        found[side] = side_points
    return found


def markers_of(
    points: Mapping[str, Mapping[str, np.ndarray]],
    names: Mapping[str, str],
    time: np.ndarray,
    *,
    axes: np.ndarray | None = None,
    noise: float = 0.0,
    sides: tuple[str, ...] = ("right", "left"),
) -> Markers:
    """Markers of some landmarks.

    Parameters
    ----------
    points : as `body` gives them
    names : landmark → name, with {s} r or l, {S} R or L, {side} right or left, {Side} Right or Left
    time : [s] (n,)
    axes : the laboratory's, as columns in which x forward, y up and z right are written (3, 3)
    noise : standard deviation of each coordinate [m]
    sides : that are marked
    """
    turn = np.eye(3) if axes is None else axes
    random = np.random.default_rng(1)
    found = {}
    for side in sides:
        for landmark, pattern in names.items():
            name = pattern.format(s=side[0], S=side[0].upper(), side=side, Side=side.capitalize())
            path = points[side][landmark] @ turn.T
            found.setdefault(name, path + noise * random.standard_normal(path.shape))
    return Markers(pathlib.Path("walk.trc"), time, found)
