"""Assigns markers to landmarks by position and motion in a walk, when names do not help."""

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.choices import SIDES
from afo_sim.gait_lab.trial.landmarks import find_landmarks
from afo_sim.gait_lab.trial.roles import Roles

# Assumed; of drawn bodies no role was wrong with them. Deviation of the distance of two points of one segment
# [m], and how far above the best one's a marker cannot be meant: times, and at least [m].
_RIGID, _TIMES, _MORE = 0.008, 2.0, 0.004
_FRAMES, _MARKERS = 50, 10  # that are needed
_Found = dict[str, int]  # landmark → which marker


def place_roles(markers: Markers) -> Roles:
    """The landmarks that markers sit on, in a right-handed laboratory; none where others could be meant."""
    seen = {name: np.isfinite(path).all(axis=1) for name, path in markers.positions.items()}
    names = [name for name in seen if seen[name].mean() > 0.5]
    whole = np.logical_and.reduce([seen[name] for name in names])
    sides: dict[str, dict[str, tuple[str, ...]]] = {side: {} for side in SIDES}
    if len(names) < _MARKERS or np.sum(whole) < _FRAMES:
        return Roles(sides)
    paths = np.stack([markers.positions[name][whole] for name in names], axis=1)
    paths = paths @ _axes(paths)
    mean = (paths - paths.mean(axis=1, keepdims=True)).mean(axis=0)
    apart = np.stack([np.linalg.norm(paths - paths[:, [k]], axis=2).std(axis=0) for k in range(len(names))])
    pelvis, told = _pelvis(mean, apart), []
    moved = Markers(markers.file, markers.time[whole], {n: paths[:, k] for k, n in enumerate(names)})
    named = {side: {mark: (names[k],) for mark, k in pelvis.get(side, {}).items()} for side in SIDES}
    landmarks = find_landmarks(moved, Roles(named), "y")
    for side, sign in zip(pelvis, (1.0, -1.0), strict=False):
        hip = landmarks.ways(side, "hip")[1]
        out = sign * (mean[:, 2] - np.mean([mean[each["asis"], 2] for each in pelvis.values()]))
        leg, times = _leg(paths, mean, apart, out, hip.path if hip else paths[:, 0])
        if leg:
            sides[side] = {mark: (names[k],) for mark, k in (pelvis[side] | leg).items()}
            each = ", ".join(f"{mark} {name}" for mark, (name,) in sides[side].items())
            text = "{subject} by where markers are and move, in a right-handed laboratory, else it is the "
            text += "other leg: {each}; others fit {times:.0f} or more times worse"
            told.append(Notice("roles-placed", text, subject=f"{side} leg", each=each, times=times))
    # with shoulders taken for a pelvis one leg alone may fit by chance (6 of 660 drawn), both did not
    return Roles(sides, tuple(told)) if all(sides.values()) else Roles({side: {} for side in SIDES})


def _axes(paths: np.ndarray) -> np.ndarray:
    """Forward, up, right as columns: a body is tall, its feet swing most, and faster forward than back."""
    within = paths - paths.mean(axis=1, keepdims=True)
    mean, motion = within.mean(axis=0), within.std(axis=0).sum(axis=1)
    tall = np.eye(3)[np.argmax(np.ptp(mean, axis=0))]
    up = -tall * np.sign((mean @ tall) @ (motion - motion.mean()))
    feet = np.argsort(mean @ up)[:4]
    level = (within[:, feet] - mean[feet]).reshape(-1, 3) * (1.0 - tall)
    ahead = np.linalg.svd(level, full_matrices=False)[2][0]
    ahead = ahead * np.sign(np.sum(np.diff(paths[:, feet] @ ahead, axis=0) ** 3))
    return np.column_stack([ahead, up, np.cross(ahead, up)])


def _pelvis(mean: np.ndarray, apart: np.ndarray) -> dict[str, _Found]:
    """The foremost low pair that is rigid with a pair, or one marker, behind its middle, by side."""
    ahead, above, _ = np.abs(mean[:, None] - mean[None, :]).transpose(2, 0, 1)
    level = (apart < _RIGID) & (above < 0.03) & (ahead < 0.07)  # turned by up to some 10 deg in the mean
    wide = np.where(level, mean[:, None, 2] - mean[None, :, 2], 0.0)  # right of left marker
    found: list[tuple[np.ndarray, dict[str, _Found]]] = []
    broad = 0.16 * (mean[:, 1] - mean[:, 1].min())  # a head is narrower for its height
    for front in np.argwhere((wide > np.maximum(0.12, broad)) & (wide < 0.35)):
        across = np.subtract(*mean[front]) / np.linalg.norm(np.subtract(*mean[front]))
        own = np.column_stack([np.cross([0.0, 1.0, 0.0], across), [0.0, 1.0, 0.0], across])
        forward, up, right = ((mean[front].mean(axis=0) - mean) @ own).T
        behind = (apart[front].max(axis=0) < _RIGID) & (np.abs(forward - 0.155) < 0.095) & (np.abs(up) < 0.08)
        pairs = np.argwhere((wide > 0.03) & (wide < 0.15) & behind & behind[:, None])
        pairs = pairs[(np.abs(right[pairs].sum(axis=1)) < 0.025) & (np.abs(right[pairs]).min(axis=1) > 0.025)]
        back = "psis" if behind.sum() > 1 else "sacrum"
        backs = pairs if back == "psis" else np.argwhere(behind & (np.abs(right) < 0.02)).repeat(2, axis=1)
        if len(backs) == 1:
            both = zip(SIDES, front, backs[0], strict=True)
            found.append((mean[front].mean(axis=0), {side: {"asis": k, back: m} for side, k, m in both}))
    lowest = min((place[1] for place, _ in found), default=0.0)  # another is of chest or head
    near = [each for each in found if each[0][1] < lowest + 0.2]
    return max(near, key=lambda each: each[0][0])[1] if near else {}


def _leg(
    paths: np.ndarray, mean: np.ndarray, apart: np.ndarray, out: np.ndarray, hip: np.ndarray
) -> tuple[_Found, float]:
    """Heel, forefoot, ankle, knee of a side, and how many times worse others fit; nothing if others may."""
    heights = np.quantile(paths[:, :, 1], 0.1, axis=0)
    tall = np.quantile(hip[:, 1], 0.1) - heights[out > 0.0].min()
    height = np.where(out > 0.0, (heights - heights[out > 0.0].min()) / tall, np.inf)
    low = np.flatnonzero(height < 0.08)
    heel = low[np.argmin(mean[low, 0])]
    toe = max(low[apart[heel, low] < 2.0 * _RIGID], key=lambda k: mean[k, 0])
    share = (mean[:, 0] - mean[heel, 0]) / max(mean[toe, 0] - mean[heel, 0], 1e-3)
    aside = out - out[heel] - share * (out[toe] - out[heel])  # outward of the foot's line
    of_hip = np.linalg.norm(paths - hip[:, None], axis=2).std(axis=0)
    ankles = np.flatnonzero((np.abs(height - 0.1) < 0.08) & (np.abs(share - 0.25) < 0.2))
    knees = np.flatnonzero(np.abs(height - 0.525) < 0.125)
    pairs = sorted((max(apart[a, b], of_hip[b]), a, b) for a in ankles for b in knees)
    best = pairs[0][0] if pairs else np.inf
    limit = max(_TIMES * best, best + _MORE)
    if best > 1.25 * _RIGID or mean[toe, 0] - mean[heel, 0] < 0.1 * tall:
        return {}, 0.0
    found: _Found = {"heel": int(heel), "toe_tip": int(toe)}
    for joint, which in (("ankle", 1), ("knee", 2)):
        like = sorted({pair[which] for pair in pairs if pair[0] <= limit}, key=lambda k: -out[k])
        way = np.abs(mean[like[0]] - mean[like[-1]])  # of a lateral and a medial one
        twins = len(like) == 2 and way[:2].max() < 0.04 and 0.03 < way[2] < 0.15
        if aside[like[0]] < 0.015 or not (twins or len(like) == 1):
            return {}, 0.0
        found |= {f"{joint}_{end}": int(k) for end, k in zip(("lateral", "medial"), like, strict=False)}
    return found, min([pair[0] / max(best, 1e-3) for pair in pairs if pair[0] > limit] + [99.0])
