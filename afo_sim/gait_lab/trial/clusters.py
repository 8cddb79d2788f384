"""Markers that move with one segment of the body: the rigid fit, and points that move with them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.choices import SIDES
from afo_sim.gait_lab.trial.leg_points import mean_place

_OFF_LINE = 0.01  # spread of markers across their line, over the spread along it, below which the turn
# about the line counts as unknown (assumed)

Pose = Mapping[str, np.ndarray]  # name → place in one posture [m] (3,)
Segment = tuple[str, str]  # side, and "pelvis", "thigh", "shank" or "foot"
_REACH = 0.2  # of a marker from its bone (assumed) [m]
# Standard deviation of a distance within a segment above which a marker is elsewhere (assumed: skin moves by
# up to a centimetre on the shank and twice that on the thigh) [m]
_LOOSE = 0.015
_BROAD = 0.012  # spread of markers across their line that fixes the turn about it (assumed) [m]
FEWEST = 3  # markers that place a segment
_SEEN = 0.5  # share of the most seen marker's frames in which another one of the segment has to be seen
# Landmarks that move with a segment; those of another segment never count to it.
_OF_SEGMENT = {
    "pelvis": ("asis", "psis", "sacrum"),
    "thigh": ("knee_lateral", "knee_medial"),
    "shank": ("ankle_lateral", "ankle_medial"),
    "foot": ("heel", "metatarsal_1", "metatarsal_2", "metatarsal_5"),
}
_BONES = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle"), "foot": ("heel", "toe")}


@dataclass(frozen=True, eq=False)
class RigidFit:
    """Place of a body over time; NaN in a frame that shows too few of its markers."""

    rotation: np.ndarray  # from the body's axes to the laboratory's (n, 3, 3)
    position: np.ndarray  # of the body's origin, in the laboratory's axes [m] (n, 3)
    rms: np.ndarray  # distance between seen and fitted markers, root of the mean square [m] (n,)

    def place(self, point: np.ndarray) -> np.ndarray:
        """A point of the body (3,) [m] → its path in the laboratory (n, 3) [m]."""
        return np.asarray(self.rotation @ point + self.position)


def fit_rigid(local: np.ndarray, seen: np.ndarray) -> RigidFit:
    """Find `rotation` and `position` so that seen = rotation @ local + position, at best."""
    local, seen = np.asarray(local, dtype=float), np.asarray(seen, dtype=float)
    known = np.all(np.isfinite(seen), axis=2) & np.all(np.isfinite(local), axis=1)  # (n, k)
    weight = known[..., None].astype(float)
    count = known.sum(axis=1)
    share = 1.0 / np.maximum(count, 1)[:, None]
    body = np.where(known[..., None], local, 0.0)  # (n, k, 3)
    laboratory = np.where(known[..., None], seen, 0.0)
    middle, centre = body.sum(axis=1) * share, laboratory.sum(axis=1) * share
    body = weight * (body - middle[:, None])
    laboratory = weight * (laboratory - centre[:, None])
    left, spread, right = np.linalg.svd(np.einsum("nki,nkj->nij", laboratory, body))
    left[:, :, 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))[:, None]
    rotation = left @ right
    position = centre - np.einsum("nij,nj->ni", rotation, middle)
    missed = laboratory - body @ rotation.transpose(0, 2, 1)
    rms = np.sqrt((missed**2).sum(axis=(1, 2)) * share[:, 0])
    known_turn = spread[:, 1] > _OFF_LINE**2 * spread[:, 0]  # of the cross-covariance: squares of spreads
    lost = ~((count >= 3) & known_turn)
    rotation[lost], position[lost], rms[lost] = np.nan, np.nan, np.nan
    return RigidFit(rotation, position, rms)


@dataclass(frozen=True, eq=False)
class Cluster:
    """Markers of one segment."""

    names: tuple[str, ...]
    places: np.ndarray  # in one posture [m] (k, 3)
    paths: np.ndarray  # in the walk [m] (n, k, 3)

    @property
    def places_segment(self) -> bool:
        """Whether the markers are enough and not on one line."""
        if len(self.names) < FEWEST:
            return False
        spreads = np.linalg.svd(self.places - self.places.mean(axis=0), compute_uv=False)
        return bool(spreads[1] >= _BROAD * np.sqrt(len(self.names)))

    def joined(self, name: str, place: np.ndarray, path: np.ndarray) -> "Cluster":
        """The cluster with one more point: its place (3,) and its path (n, 3) [m]."""
        places = np.vstack([self.places, place])
        return Cluster((*self.names, name), places, np.concatenate([self.paths, path[:, None]], axis=1))

    def carry(self, place: np.ndarray) -> tuple[np.ndarray, float]:
        """A point's place in the posture (3,) → its path (n, 3); the markers' median RMS misfit [m]."""
        fit = fit_rigid(self.places, self.paths)
        known = fit.rms[np.isfinite(fit.rms)]
        return fit.place(place), float(np.median(known)) if len(known) else 0.0

    def bridge(self, path: np.ndarray) -> tuple[np.ndarray, float]:
        """Fill the gaps of a point's path by its mean place among the markers."""
        whole = np.flatnonzero(np.isfinite(self.paths).all(axis=(1, 2)))
        if not len(whole):
            return path, math.inf  # they are never seen all at once
        first = self.paths[whole[len(whole) // 2]]
        shape = np.stack([_mean_place(first, self.paths, each) for each in self.paths.swapaxes(0, 1)])
        carried = fit_rigid(shape, self.paths).place(_mean_place(shape, self.paths, path))
        square = np.sum((carried - path) ** 2, axis=1)
        known = square[np.isfinite(square)]
        stray = float(np.sqrt(known.mean())) if len(known) else math.inf
        return np.where(np.isfinite(path), path, carried), stray


Clusters = Mapping[Segment, Cluster]


def find_clusters(
    markers: Markers,
    pose: Pose,
    points: Mapping[str, Mapping[str, np.ndarray]],
    names: Mapping[str, Mapping[str, Sequence[str]]],
) -> Clusters:
    """Markers by side and segment."""
    taken = {name for side in SIDES for group in names[side].values() for name in group}
    free = _near_bones({name: pose[name] for name in pose if name not in taken}, points)
    found = {}
    for side in SIDES:
        for segment, landmarks in _OF_SEGMENT.items():
            sides = SIDES if segment == "pelvis" else (side,)
            own = [name for each in sides for mark in landmarks for name in names[each].get(mark, ())]
            both = [n for n in (*dict.fromkeys(own), *free.get((side, segment), ())) if n in pose]
            known = (n for n in both if n in markers.positions)
            seen = {n: int(np.isfinite(markers.positions[n]).all(axis=1).sum()) for n in known}
            kept = _constant(markers, [n for n in seen if seen[n] > _SEEN * max(seen.values())])
            places = np.array([pose[name] for name in kept]).reshape(-1, 3)
            paths = [markers.positions[name] for name in kept]
            empty = np.empty((len(markers.time), 0, 3))
            found[side, segment] = Cluster(tuple(kept), places, np.stack(paths, axis=1) if kept else empty)
    return found


def _constant(markers: Markers, names: Sequence[str]) -> list[str]:
    """The markers whose mutual distances stay constant; the worst are left out one by one."""
    kept = list(names)
    while len(kept) >= FEWEST:
        paths = np.stack([markers.positions[name] for name in kept], axis=1)
        apart = np.linalg.norm(paths[:, :, None] - paths[:, None], axis=3)
        seen = np.isfinite(apart)
        count = np.maximum(seen.sum(axis=0), 1)
        mean = np.where(seen, apart, 0.0).sum(axis=0) / count
        deviation = np.sqrt((np.where(seen, apart - mean, 0.0) ** 2).sum(axis=0) / count)
        loose = deviation.sum(axis=1) / (len(kept) - 1)
        if loose.max() <= _LOOSE:
            break
        kept.pop(int(np.argmax(loose)))
    return kept


def completed(paths: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Markers of one segment, with gaps filled where three others are seen."""
    if len(paths) <= FEWEST:
        return dict(paths)
    seen = np.stack(list(paths.values()), axis=1)
    segment = Cluster(tuple(paths), seen[0], seen)
    return {name: segment.bridge(path)[0] for name, path in paths.items()}


def _mean_place(shape: np.ndarray, seen: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Mean place of a moving point (n, 3) among markers of a shape (k, 3); NaN if never seen with them."""
    fit = fit_rigid(shape, seen)
    return mean_place(np.einsum("nji,nj->ni", fit.rotation, path - fit.position))


def _near_bones(pose: Pose, points: Mapping[str, Mapping[str, np.ndarray]]) -> dict[Segment, list[str]]:
    """Markers by the nearest bone within `_REACH`."""
    bones = {
        (side, segment): (points[side][start], points[side][end])
        for side in SIDES
        for segment, (start, end) in _BONES.items()
        if start in points[side] and end in points[side]
    }
    found: dict[Segment, list[str]] = {segment: [] for segment in bones}
    for name, place in pose.items():
        distances = {segment: _distance(place, *bone) for segment, bone in bones.items()}
        nearest = min(distances, key=lambda segment: distances[segment], default=None)
        if nearest is not None and distances[nearest] < _REACH:
            found[nearest].append(name)
    return found


def _distance(place: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Of a point from a straight bone [m]."""
    way = end - start
    share = float(np.clip((place - start) @ way / (way @ way), 0.0, 1.0))
    return float(np.linalg.norm(place - start - share * way))
