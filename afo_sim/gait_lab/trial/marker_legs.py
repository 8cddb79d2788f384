"""Points of both legs from markers: by their names, a standing posture, and their segments' markers."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, Notice, unknown
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.signals import stretches
from afo_sim.gait_lab.trial.choices import ROLES, SIDES, Choices
from afo_sim.gait_lab.trial.clusters import FEWEST, Cluster, Clusters, find_clusters
from afo_sim.gait_lab.trial.joint_centres import without
from afo_sim.gait_lab.trial.landmarks import NEEDED, Landmarks, find_landmarks, first
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints, mean_place
from afo_sim.gait_lab.trial.placed_roles import place_roles
from afo_sim.gait_lab.trial.roles import Names, Roles, find_roles, mapped_roles, missing_roles

_QUIET = 0.05  # speed below which a marker stands still; sway is slower by half (assumed) [m/s]
_LONG = 0.5  # shortest quiet part [s]
_LAG = 0.1  # before and after, over which a speed is taken, so that noise is none [s]
_FEW = 0.1  # share of markers that may move: an arm, a flicker
_HEIGHTS = (0.04, 0.14)  # that an ankle centre has above the floor [m]
_ENOUGH = 0.9  # of the most seen way's frames, from which on a better way is taken
_STRAY = 0.015  # from its mean place in a segment, above which a point is not bridged by it (assumed) [m]
_MISFIT = 0.015  # of a posture's markers to the walk's, above which they are doubted (assumed) [m]
# Segments that carry a joint, the best first: the shank's skin moves less than the thigh's.
_Ways = Mapping[str, Mapping[str, list[LegPoint | None]]]  # by side and role
_CARRIERS = {"hip": ("pelvis",), "knee": ("shank", "thigh"), "ankle": ("shank", "foot")}
# How far a heel that nobody marked lies behind the ankle centre, of the shank's length: 85 to 98 mm in four
# shod legs of two persons, less barefoot (assumed; it changes no angle), and that heel's error [m].
_BEHIND, _BEHIND_ERROR = 0.2, 0.025
# Of the ankle angle by the line from ankle to forefoot, RMS: 2.5 to 3.3 in these legs (measured) [deg].
_UNMARKED = 3.0
_FLAT = 0.1  # share of the frames, those with the lowest ankle and forefoot, in which the foot lies flat
_AXIS = 0.1  # along the axis of the knee, to a third point of foot, by which two show its turn [m]
_POOR = 3  # number of the way from which on no posture is asked: a medial marker alone, the trochanter


@dataclass(frozen=True, eq=False)
class _Chosen(Noted):
    """Points of one leg, each with the number of the way that it was found in."""

    points: Mapping[str, LegPoint]
    ranks: Mapping[str, int]
    notices: tuple[Notice, ...] = ()
    sole: float | None = None  # pitch of the line heel–toe with the sole flat, where a posture shows it [rad]


def legs_from_markers(
    markers: Markers, choices: Choices, standing: Markers | None = None
) -> dict[str, LegPoints]:
    """Hip, knee and ankle centre, heel and toe of both legs, as far as the markers show them."""
    roles = _roles(markers, choices, standing)
    landmarks = find_landmarks(markers, roles, choices.up)
    ways = {side: {role: landmarks.ways(side, role) for role in ROLES} for side in SIDES}
    for role, names in choices.markers.items():  # what a person named is the only way
        for name in (name for name in names if name not in markers.positions):
            problem = f"there is no such marker in {markers.file}"
            raise unknown(name, markers.positions, field=f"marker.{role}", problem=problem)
        source = f"{'midpoint of ' if len(names) > 1 else ''}{' and '.join(names)}"
        ways[choices.side][role] = [LegPoint(markers.point(names), source, way="as chosen")]
    clusters = _clusters(markers, landmarks, markers, ways)
    chosen = {side: _choose(ways[side], side, clusters) for side in SIDES}
    posture = standing_posture(standing) if standing else _quiet_posture(markers, landmarks)
    still = None
    if posture:
        still = find_landmarks(posture, _roles(posture, choices, markers, roles.sides), choices.up)
        standing_ways = {side: {role: still.ways(side, role) for role in ROLES} for side in SIDES}
        clusters = _clusters(markers, landmarks, posture, standing_ways)
    legs, left_out = {}, []
    for side in SIDES:
        carried = _carry_centres(chosen[side], side, still, clusters) if still else chosen[side]
        for end in ("heel", "toe"):
            carried = _carry_end(carried, end, side, still, clusters, landmarks.vertical())
        missing = [role for role in ROLES if role not in carried.points]
        if missing and side == choices.side:
            needed = {role: NEEDED[role] for role in missing}
            known = {name for names in roles.sides.values() for group in names.values() for name in group}
            stood = {role: first(still.ways(side, role)) for role in missing} if still else {}
            held = {role: point.source for role, point in stood.items() if point}
            raise missing_roles(markers, side, needed, known, held)
        if missing:
            text = "the {subject} leg is left out: no marker of its {roles} is known"
            left_out.append(note("leg-left-out", text, subject=side, roles=", ".join(missing)))
        else:
            legs[side] = _leg(side, markers, landmarks, carried, still)
    standing_notes = posture.notices if posture else ()
    leg = legs[choices.side]
    notices = (*roles.notices, *landmarks.notices, *standing_notes, *left_out, *leg.notices)
    legs[choices.side] = replace(leg, notices=notices)
    return legs


def _roles(
    markers: Markers, choices: Choices, other: Markers | None, walk: Mapping[str, Names] | None = None
) -> Roles:
    """By map, name or place; `other`: a second file whose markers a map may use, `walk`: the walk's roles."""
    if choices.map is not None:
        return mapped_roles(choices.map, markers, choices.side, other.positions if other else ())
    named = find_roles(markers)
    if any(named.sides.values()):
        return named
    if walk is None:
        return place_roles(markers)
    here = {*markers.positions}
    return Roles({s: {mark: names for mark, names in walk[s].items() if here >= {*names}} for s in SIDES})


def _clusters(markers: Markers, landmarks: Landmarks, shown: Markers, ways: _Ways) -> Clusters:
    """The walk's markers by segment, from the frame of the walk or of a posture in which most are seen."""
    points = {
        side: {role: point.path for role in ROLES if (point := first(ways[side][role]))} for side in SIDES
    }
    paths = [path for side in SIDES for path in points[side].values()]
    if not paths:
        return {}
    whole = sum(np.isfinite(path).all(axis=1) for path in paths).astype(float)
    seen = sum(np.isfinite(path).all(axis=1) for path in shown.positions.values())
    frame = int(np.argmax(whole * (1 + len(shown.positions)) + seen))
    pose = {name: path[frame] for name, path in shown.positions.items() if np.isfinite(path[frame]).all()}
    places = {
        side: {role: path[frame] for role, path in points[side].items() if np.isfinite(path[frame]).all()}
        for side in SIDES
    }
    return find_clusters(markers, pose, places, landmarks.names)


def _quiet_posture(markers: Markers, landmarks: Landmarks) -> Markers | None:
    """The posture of a part of the walk in which pelvis and feet are still."""
    names = {
        name
        for side in SIDES
        for landmark, group in landmarks.names[side].items()
        if landmark.startswith(("asis", "psis", "sacrum", "heel", "metatarsal", "toe"))
        for name in group
    }
    quiet = quiet_part(markers, names) if len(names) >= 3 else None
    return quiet_posture(markers, quiet) if quiet else None


def _leg(
    side: str, markers: Markers, landmarks: Landmarks, chosen: _Chosen, still: Landmarks | None
) -> LegPoints:
    """The leg, with the flat foot's numbers where a posture shows them."""
    sole, height, notices = chosen.sole, None, chosen.notices
    vertical = still.vertical() if still else None
    if still and vertical is not None:
        heel, toe, ankle = (_place(still, side, role, chosen) for role in ("heel", "toe", "ankle"))
        if heel is not None and toe is not None:
            rise = float((toe - heel) @ vertical)
            sole = float(np.arctan2(rise, np.linalg.norm(toe - heel - rise * vertical)))
            text = "standing, the line from heel to toe is pitched {pitch:+.1f} deg, toe up positive"
            notices += (note("sole-pitch", text, subject=side, pitch=float(np.degrees(sole))),)
        if ankle is not None and _HEIGHTS[0] <= ankle @ vertical <= _HEIGHTS[1]:
            height = float(ankle @ vertical)
    return LegPoints(side, markers.time, chosen.points, landmarks.pelvis(), sole, height, notices=notices)


def _place(still: Landmarks, side: str, role: str, chosen: _Chosen) -> np.ndarray | None:
    """A point's place in the posture, found in the way that the walk's was found."""
    ways = still.ways(side, role)
    rank = chosen.ranks[role]
    point = ways[rank] if 0 <= rank < len(ways) else None
    return point.path[0] if point and np.isfinite(point.path[0]).all() else None


def quiet_part(markers: Markers, names: Collection[str] | None = None) -> slice | None:
    """The longest stretch in which nothing moves."""
    moving = _speeds(markers, names)
    seen = np.isfinite(moving).sum(axis=1)
    still = (seen >= 3) & ((moving > _QUIET).sum(axis=1) <= _FEW * seen)
    if not still.any():
        return None
    start, stop = max(stretches(still), key=lambda run: run[1] - run[0])
    return slice(start, stop) if markers.time[stop - 1] - markers.time[start] >= _LONG else None


def standing_posture(markers: Markers) -> Markers:
    """The mean posture of a standing trial's quiet part, as markers of one frame."""
    time = markers.time
    if len(time) == 1 or time[-1] - time[0] < _LONG:
        return quiet_posture(markers, slice(0, len(time)))
    found = quiet_part(markers)
    if found is None:
        speeds = _speeds(markers, None)
        speeds = speeds[np.isfinite(speeds).any(axis=1)]
        slowest = float(np.min(np.nanmean(speeds, axis=1), initial=np.inf))
        problem = f"nobody stands still for {_LONG:g} s in it; at best the markers move at {slowest:.2f} m/s"
        allowed = "a trial of a standing person"
        raise InputError(problem, file=markers.file, field="static", allowed=allowed)
    return quiet_posture(markers, found)


def quiet_posture(markers: Markers, quiet: slice) -> Markers:
    """The mean posture of some frames, as markers of one frame."""
    positions = {name: mean_place(path[quiet])[None] for name, path in markers.positions.items()}
    start, end = markers.time[quiet][[0, -1]]
    text = "standing from {start:.2f} to {end:.2f} s of {file}"
    found = note("standing-posture", text, start=float(start), end=float(end), file=markers.file.name)
    return Markers(markers.file, markers.time[quiet][:1], positions, (found,))


def _speeds(markers: Markers, names: Collection[str] | None) -> np.ndarray:
    """Speed of each marker over 2 `_LAG` (n, m), that of the nearest whole span at the ends [m/s]."""
    chosen = list(markers.positions) if names is None else [n for n in markers.positions if n in names]
    paths = np.stack([markers.positions[name] for name in chosen], axis=1)
    time = markers.time
    step = max(1, round(_LAG / float(np.median(np.diff(time)))))
    if len(time) <= 2 * step:
        return np.full(paths.shape[:2], np.nan)
    way = np.linalg.norm(paths[2 * step :] - paths[: -2 * step], axis=2)
    inner = way / (time[2 * step :] - time[: -2 * step])[:, None]
    return np.pad(inner, ((step, step), (0, 0)), mode="edge")


def _choose(ways: Mapping[str, list[LegPoint | None]], side: str, clusters: Clusters) -> _Chosen:
    """The best way to each point that is seen in nearly as many frames as any."""
    points, ranks, notices = {}, {}, []
    for role, each in ways.items():
        most = max((_seen(way) for way in each if way), default=0)
        for rank, way in enumerate(each):
            if way is None or not _seen(way):
                continue
            whole = _bridged(way, [clusters.get((side, segment)) for segment in _CARRIERS.get(role, ())])
            if _seen(whole) >= _ENOUGH * most:
                points[role], ranks[role] = whole, rank
                more = _seen(whole) - _seen(way)
                if more:
                    seen = "seen in {seen} of {frames} frames"
                    text = f"{{subject}}: {seen}, in {{more}} more by its segment's markers"
                    data = {"seen": _seen(way), "frames": len(way.path), "more": more}
                    notices.append(note("point-bridged", text, subject=f"{side} {role}", **data))
                break
    return _Chosen(points, ranks, tuple(notices))


def _carry_centres(chosen: _Chosen, side: str, still: Landmarks, clusters: Clusters) -> _Chosen:
    """Joint centres of a standing posture in the walk, where the posture shows them in a better way."""
    points, ranks = dict(chosen.points), dict(chosen.ranks)
    notices = list(chosen.notices)
    upper: tuple[str, np.ndarray] | None = None  # the joint above and its place in the posture
    for role in _CARRIERS:
        ways = still.ways(side, role)
        rank = next((k for k, way in enumerate(ways) if way and _seen(way)), len(ways))
        if rank < min(ranks.get(role, len(ways)), _POOR):
            way = ways[rank]
            assert way is not None
            carriers = [cluster for segment in _CARRIERS[role] if (cluster := clusters.get((side, segment)))]
            proximal = clusters.get((side, {"knee": "thigh", "ankle": "shank"}.get(role, "")))
            if proximal is not None and upper is not None:
                # with the joint above where the markers are too few, as in Plug-in Gait
                joined = proximal.joined(f"the {upper[0]} centre", upper[1], points[upper[0]].path)
                carriers.insert(carriers.index(proximal) + 1, joined)
            cluster = next((each for each in carriers if each.places_segment), None)
            if cluster is None:
                notices.append(_not_carried(role, side, clusters))
            else:
                carried, off = cluster.carry(way.path[0])
                points[role] = replace(way, path=carried, carriers=tuple(cluster.names), bridged=None)
                ranks[role] = rank
                notices += _misfit(cluster, off)
        same = ways[ranks[role]] if 0 <= ranks.get(role, -1) < len(ways) else None
        upper = (role, same.path[0]) if same and _seen(same) else None
    return replace(chosen, points=points, ranks=ranks, notices=tuple(notices))


def _carry_end(
    chosen: _Chosen, end: str, side: str, still: Landmarks | None, clusters: Clusters, up: np.ndarray | None
) -> _Chosen:
    """An end of the foot that the walk has no marker of: a posture's, or a heel at the forefoot's height."""
    roles = ("knee", "ankle", {"heel": "toe", "toe": "heel"}[end])
    if end in chosen.points or not {*roles} <= set(chosen.points):
        return chosen
    paths = [chosen.points[role].path for role in roles]
    stood = [_place(still, side, role, chosen) for role in roles] if still else [None]
    shown = (
        paths
        if any(place is None for place in stood)
        else [place[None] for place in stood if place is not None]
    )
    ways = still.ways(side, end) if still and shown is not paths else []
    rank, point = next(((k, way) for k, way in enumerate(ways) if way and _seen(way)), (-1, None))
    notices, sole = chosen.notices, None
    if point:
        cluster = clusters[side, "foot"].joined("the ankle centre", shown[1][0], paths[1])
        if not cluster.places_segment:
            cluster = _turned_foot(roles[2], _with_axis(*shown)[0], paths)
        path, off = cluster.carry(point.path[0])
        notices = (*notices, *_misfit(cluster, off))
        point = replace(point, path=path, carriers=tuple(cluster.names))
    elif end == "toe" or up is None:
        return chosen
    else:
        height = (shown[1] + shown[2]) @ up
        with np.errstate(invalid="ignore"):
            foot = (shown[2] - shown[1])[height <= np.nanquantile(height, _FLAT)]
        rise, length = np.mean(foot @ up), np.mean(np.linalg.norm(without(foot, up), axis=1))
        behind = _BEHIND * np.nanmedian(np.linalg.norm(paths[0] - paths[1], axis=1))
        flat = np.array([[0.0, 0.0, 0.0], [length, rise, 0.0], [0.0, 0.0, -_AXIS]])
        path, _ = _turned_foot("toe", flat, paths).carry(np.array([-behind, rise, 0.0]))
        where, sole = ("where the foot lies flat", None) if shown is paths else ("in standing", 0.0)
        how = "ankle and forefoot", _BEHIND_ERROR, "a marker of the heel"
        point = LegPoint(path, *how, way=f"level {where}")
        text = "the {subject} heel has no marker that is known by its name: the foot is the line from ankle "
        text += "to forefoot, level {where}; ankle angle ±{error:.0f} deg, and the equinus of a foot that "
        text += "never lies flat is lost"
        notices = (*notices, Notice("heel-unmarked", text, subject=side, where=where, error=_UNMARKED))
    points, ranks = {**chosen.points, end: point}, {**chosen.ranks, end: rank}
    return _Chosen(points, ranks, notices, sole)


def _with_axis(knee: np.ndarray, ankle: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Ankle, one end of the foot, and a point beside the ankle on the normal of their plane with the knee."""
    normal = np.cross(knee - ankle, end - ankle)
    beside = ankle + _AXIS * normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([ankle, end, beside], axis=1)


def _turned_foot(end: str, places: np.ndarray, paths: list[np.ndarray]) -> Cluster:
    """A foot seen by its ankle and one end, turned with the shank about the line between these."""
    return Cluster(("the ankle centre", f"the {end}", "the shank's plane"), places, _with_axis(*paths))


def _not_carried(role: str, side: str, clusters: Clusters) -> Notice:
    segment = _CARRIERS[role][0]
    cluster = clusters.get((side, segment))
    text = "the {subject} of the standing posture is not used: both trials see {markers} on the {segment}, "
    text += "and {needed} that are not on a line are needed"
    seen = ", ".join(cluster.names if cluster else ()) or "no marker"
    data = {"markers": seen, "segment": segment, "needed": FEWEST}
    return note("standing-centre-unused", text, subject=f"{side} {role}", **data)


def _misfit(cluster: Cluster, off: float) -> list[Notice]:
    """A warning where the markers of a segment lie otherwise than they did in standing."""
    if off <= _MISFIT:
        return []
    text = "{subject} lie {off_mm:.0f} mm off where they were in standing: the same person, the same markers?"
    return [Notice("standing-misfit", text, subject=", ".join(cluster.names), off_mm=1e3 * off)]


def _bridged(way: LegPoint, carriers: list[Cluster | None]) -> LegPoint:
    """The way with its gaps filled: first by the segment in which the point strays least."""
    if np.isfinite(way.path).all():
        return way
    filled = [c.bridge(way.path) for c in carriers if c is not None and c.places_segment]
    path = way.path
    for more, stray in sorted(filled, key=lambda each: each[1]):
        if stray < _STRAY:
            path = np.where(np.isfinite(path), path, more)
    bridged = np.isfinite(path).all(axis=1) & ~np.isfinite(way.path).all(axis=1)
    return replace(way, path=path, bridged=bridged)


def _seen(way: LegPoint) -> int:
    return int(np.isfinite(way.path).all(axis=1).sum())
