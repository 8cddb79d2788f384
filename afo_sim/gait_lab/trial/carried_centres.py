"""Joint centres chosen among several ways, and carried by the markers of their segments."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.gait_lab.trial.clusters import FEWEST, Cluster
from afo_sim.gait_lab.trial.landmarks import Landmarks
from afo_sim.gait_lab.trial.leg_points import LegPoint

ENOUGH = 0.9  # of the most seen way's frames, from which on a better way is taken
STRAY = 0.015  # from its mean place in a segment, above which a point is not bridged by it (assumed) [m]
MISFIT = 0.015  # of a posture's markers to the walk's, above which they are doubted (assumed) [m]
# Segments that carry a joint, the best first: the shank's skin moves less than the thigh's.
CARRIERS = {"hip": ("pelvis",), "knee": ("shank", "thigh"), "ankle": ("shank", "foot")}
POOR = 3  # number of the way from which on no posture is asked: a medial marker alone, the trochanter

Clusters = Mapping[tuple[str, str], Cluster]


@dataclass(frozen=True, eq=False)
class Chosen:
    """Points of one leg, each with the number of the way that it was found in."""

    points: Mapping[str, LegPoint]
    ranks: Mapping[str, int]
    remarks: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def choose(ways: Mapping[str, list[LegPoint | None]], side: str, clusters: Clusters) -> Chosen:
    """The best way to each point that is seen in nearly as many frames as any.

    A joint's gaps are bridged by the markers of its segment.
    """
    points, ranks, remarks = {}, {}, []
    for role, each in ways.items():
        most = max((_seen(way) for way in each if way), default=0)
        for rank, way in enumerate(each):
            if way is None or not _seen(way):
                continue
            whole = _bridged(way, [clusters.get((side, segment)) for segment in CARRIERS.get(role, ())])
            if _seen(whole) >= ENOUGH * most:
                points[role], ranks[role] = whole, rank
                more = _seen(whole) - _seen(way)
                if more:
                    told = f"{_seen(way)} of {len(way.path)} frames"
                    remarks.append(f"{side} {role}: seen in {told}, in {more} more by its segment's markers")
                break
    return Chosen(points, ranks, tuple(remarks))


def carry_centres(chosen: Chosen, side: str, still: Landmarks, clusters: Clusters) -> Chosen:
    """Joint centres of a standing posture in the walk, where the posture tells them in a better way."""
    points, ranks = dict(chosen.points), dict(chosen.ranks)
    remarks, warnings = list(chosen.remarks), list(chosen.warnings)
    upper: tuple[str, np.ndarray] | None = None  # the joint above and its place in the posture
    for role in CARRIERS:
        ways = still.ways(side, role)
        rank = next((k for k, way in enumerate(ways) if way and _seen(way)), len(ways))
        if rank < min(ranks.get(role, len(ways)), POOR):
            way = ways[rank]
            assert way is not None
            cluster = _carrier(role, side, clusters, upper, points)
            if cluster is None:
                few = _too_few(role, side, clusters)
                remarks.append(f"the {side} {role} of the standing posture is not used: {few}")
            else:
                how = f"{way.how}, standing, carried by {', '.join(cluster.names)}"
                points[role] = LegPoint(cluster.carry(way.path[0]), how, way.error, way.better)
                ranks[role] = rank
                off = cluster.misfit()
                if off > MISFIT:
                    warnings.append(
                        f"{', '.join(cluster.names)} lie {1e3 * off:.0f} mm off where they were in standing: "
                        "the same person, the same markers?"
                    )
        same = ways[ranks[role]] if 0 <= ranks.get(role, -1) < len(ways) else None
        upper = (role, same.path[0]) if same and _seen(same) else None
    return replace(chosen, points=points, ranks=ranks, remarks=tuple(remarks), warnings=tuple(warnings))


def _carrier(
    role: str,
    side: str,
    clusters: Clusters,
    upper: tuple[str, np.ndarray] | None,
    points: Mapping[str, LegPoint],
) -> Cluster | None:
    """The markers that carry a joint; with the joint above where they are too few, as in Plug-in Gait."""
    found = [cluster for segment in CARRIERS[role] if (cluster := clusters.get((side, segment)))]
    proximal = clusters.get((side, {"knee": "thigh", "ankle": "shank"}.get(role, "")))
    if proximal is not None and upper is not None:
        joined = proximal.joined(f"the {upper[0]} centre", upper[1], points[upper[0]].path)
        found.insert(found.index(proximal) + 1, joined)
    return next((cluster for cluster in found if cluster.places_segment), None)


def _too_few(role: str, side: str, clusters: Clusters) -> str:
    segment = CARRIERS[role][0]
    cluster = clusters.get((side, segment))
    names = cluster.names if cluster else ()
    told = ", ".join(names) or "no marker"
    return f"both trials see {told} on the {segment}, and {FEWEST} that are not on a line are needed"


def _bridged(way: LegPoint, carriers: list[Cluster | None]) -> LegPoint:
    """The way with its gaps filled: first by the segment in which the point strays least."""
    if np.isfinite(way.path).all():
        return way
    filled = [c.bridge(way.path) for c in carriers if c is not None and c.places_segment]
    path = way.path
    for more, stray in sorted(filled, key=lambda each: each[1]):
        if stray < STRAY:
            path = np.where(np.isfinite(path), path, more)
    bridged = np.isfinite(path).all(axis=1) & ~np.isfinite(way.path).all(axis=1)
    return replace(way, path=path, bridged=bridged)


def _seen(way: LegPoint) -> int:
    return int(np.isfinite(way.path).all(axis=1).sum())
