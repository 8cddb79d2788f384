"""Points of both legs from markers: by their names, a standing posture, regressions."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.carried_centres import Chosen, carry_centres, choose
from afo_sim.gait_lab.trial.choices import ROLES, SIDES, Choices
from afo_sim.gait_lab.trial.clusters import Cluster, find_clusters
from afo_sim.gait_lab.trial.landmarks import NEEDED, Landmarks, find_landmarks, first
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.role_map import mapped_roles
from afo_sim.gait_lab.trial.roles import Roles, find_roles, missing_roles, named_points
from afo_sim.gait_lab.trial.static_pose import (
    flat_ankle_height,
    quiet_part,
    quiet_posture,
    sole_pitch,
    standing_posture,
)

Clusters = Mapping[tuple[str, str], Cluster]


def legs_from_markers(
    markers: Markers, choices: Choices, standing: Markers | None = None
) -> dict[str, LegPoints]:
    """Hip, knee and ankle centre, heel and toe of both legs, as far as the markers tell them.

    A joint's centre comes from the best of: a centre in the file, the midpoint of the lateral and the medial
    marker, one of the two, a regression. Where a standing trial, or a quiet part of the walk, tells it in a
    better way than the walk, it is carried into the walk by the markers of its segment.
    """
    roles = _roles(markers, choices, standing)
    landmarks = find_landmarks(markers, roles, choices.up)
    ways = {side: _ways(markers, landmarks, choices, side) for side in SIDES}
    clusters = _clusters_of_walk(markers, landmarks, ways)
    chosen = {side: choose(ways[side], side, clusters) for side in SIDES}
    posture = standing_posture(standing) if standing else _quiet_posture(markers, landmarks)
    still = None
    if posture:
        still = find_landmarks(posture, _roles(posture, choices, markers), choices.up)
        clusters = _clusters_of_posture(markers, landmarks, posture, still)
    legs, remarks = {}, []
    for side in SIDES:
        carried = carry_centres(chosen[side], side, still, clusters) if still else chosen[side]
        missing = [role for role in ROLES if role not in carried.points]
        if missing and side == choices.side:
            needed = {role: NEEDED[role] for role in missing}
            raise missing_roles(markers, side, needed, _known(roles), choices.map)
        if missing:
            remarks.append(f"the {side} leg is left out: no marker of its {', '.join(missing)} is known")
        else:
            legs[side] = _leg(side, markers, landmarks, carried, still)
    told = posture.remarks if posture else ()
    asked = legs[choices.side]
    legs[choices.side] = replace(
        asked,
        remarks=(*roles.remarks, *told, *remarks, *asked.remarks),
        warnings=(*roles.warnings, *asked.warnings),
    )
    return legs


def _roles(markers: Markers, choices: Choices, other: Markers | None) -> Roles:
    """By map or by name; `other` is a second file whose markers a map may use."""
    if choices.map is None:
        return find_roles(markers)
    return mapped_roles(choices.map, markers, other.positions if other else ())


def _known(roles: Roles) -> set[str]:
    return {name for side in roles.sides.values() for names in side.values() for name in names}


def _ways(
    markers: Markers, landmarks: Landmarks, choices: Choices, side: str
) -> dict[str, list[LegPoint | None]]:
    """Ways to each point; what a person named is the only way."""
    ways = {role: landmarks.ways(side, role) for role in ROLES}
    if side == choices.side:
        for role, names in named_points(markers, choices).items():
            told = f"{'midpoint of ' if len(names) > 1 else ''}{' and '.join(names)}, as chosen"
            ways[role] = [LegPoint(markers.point(names), told)]
    return ways


def _clusters_of_walk(
    markers: Markers, landmarks: Landmarks, ways: Mapping[str, Mapping[str, list[LegPoint | None]]]
) -> Clusters:
    """Markers by segment, from the frame of the walk in which most are seen."""
    points = {
        side: {role: point.path for role in ROLES if (point := first(ways[side][role]))} for side in SIDES
    }
    paths = [path for side in SIDES for path in points[side].values()]
    if not paths:
        return {}
    whole = sum(np.isfinite(path).all(axis=1) for path in paths).astype(float)
    seen = sum(np.isfinite(path).all(axis=1) for path in markers.positions.values())
    frame = int(np.argmax(whole * (1 + len(markers.positions)) + seen))
    pose = {name: path[frame] for name, path in markers.positions.items() if np.isfinite(path[frame]).all()}
    places = {
        side: {role: path[frame] for role, path in points[side].items() if np.isfinite(path[frame]).all()}
        for side in SIDES
    }
    return find_clusters(markers, pose, places, landmarks.names)


def _clusters_of_posture(
    markers: Markers, landmarks: Landmarks, posture: Markers, still: Landmarks
) -> Clusters:
    """Markers by segment, and their places in a standing posture."""
    pose = {name: path[0] for name, path in posture.positions.items() if np.isfinite(path[0]).all()}
    places = {
        side: {
            role: point.path[0]
            for role in ROLES
            if (point := first(still.ways(side, role))) and np.isfinite(point.path[0]).all()
        }
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
    side: str, markers: Markers, landmarks: Landmarks, chosen: Chosen, still: Landmarks | None
) -> LegPoints:
    """The leg, with the flat foot's numbers where a posture tells them."""
    sole = height = None
    remarks = chosen.remarks
    vertical = still.vertical() if still else None
    if still and vertical is not None:
        heel, toe, ankle = (_place(still, side, role, chosen) for role in ("heel", "toe", "ankle"))
        if heel is not None and toe is not None:
            sole = sole_pitch(heel, toe, vertical)
            pitch = np.degrees(sole)
            remarks += (f"standing, the line from heel to toe is pitched {pitch:+.1f} deg, toe up positive",)
        height = flat_ankle_height(ankle, vertical) if ankle is not None else None
    return LegPoints(
        side,
        markers.time,
        chosen.points,
        landmarks.pelvis(),
        sole=sole,
        ankle_height=height,
        remarks=remarks,
        warnings=chosen.warnings,
    )


def _place(still: Landmarks, side: str, role: str, chosen: Chosen) -> np.ndarray | None:
    """A point's place in the posture, found in the way that the walk's was found."""
    ways = still.ways(side, role)
    rank = chosen.ranks[role]
    point = ways[rank] if 0 <= rank < len(ways) else None
    return point.path[0] if point and np.isfinite(point.path[0]).all() else None
