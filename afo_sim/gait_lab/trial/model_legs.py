"""Points of both legs from an OpenSim model: by its joint angles, or by the markers that a trial shows."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from afo_sim.common import InputError, Notice, nearest_name
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.opensim_joint import Coordinate
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.inverse_kinematics import posed_legs
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.model_leg import ModelLeg, find_leg
from afo_sim.gait_lab.trial.model_segments import fitted_leg
from afo_sim.gait_lab.trial.roles import plain

_BEYOND = np.radians(10.0)  # beyond a joint's range in the model: reported [rad] (assumed)
_SCALE = 0.05  # difference in length that a scaled model has not (assumed)
_APART = 0.03  # least distance of two markers that shows a scale [m] (assumed)


def legs_from_angles(model: OpenSimModel, table: OpenSimTable, degrees: bool) -> dict[str, LegPoints]:
    """Place both legs by forward kinematics."""
    return _both(lambda side: _placed_leg(model, find_leg(model, side), table, degrees), "")


def legs_from_model_markers(model: OpenSimModel, markers: Markers, choices: Choices) -> dict[str, LegPoints]:
    """Pose the model over the markers of a trial, as OpenSim's inverse kinematics does with equal weights."""
    seen, doubled = _match_markers(model, markers)

    def fitted(side: str) -> LegPoints:
        return fitted_leg(model, find_leg(model, side), markers, seen)

    legs = _both(fitted, choices.side, lambda laid: posed_legs(model, laid, seen))
    doubts = (*doubled, *_scale_warnings(model, seen))
    return {side: replace(leg, notices=(*doubts, *leg.notices)) for side, leg in legs.items()}


def _both(
    leg: Callable[[str], LegPoints],
    needed: str,
    together: Callable[[dict[str, LegPoints]], dict[str, LegPoints]] = dict,
) -> dict[str, LegPoints]:
    """Both legs, first each, then together; one that is not needed may be missing: a note of the other."""
    found: dict[str, LegPoints] = {}
    failed: dict[str, InputError] = {}
    for side in SIDES:
        try:
            found[side] = leg(side)
        except InputError as error:
            failed[side] = error
    if needed in failed or not found:
        raise failed.get(needed) or failed[SIDES[0]]
    found = together(found)
    for side, reason in failed.items():
        (other,) = found
        why = note("leg-left-out", "no {subject} leg: {reason}", subject=side, reason=str(reason))
        found[other] = replace(found[other], notices=(*found[other].notices, why))
    return found


def _placed_leg(model: OpenSimModel, leg: ModelLeg, table: OpenSimTable, degrees: bool) -> LegPoints:
    """Place a leg by its coordinates; parameters and errors as `legs_from_angles`."""
    names = ("ground", *(leg.bodies[segment] for segment in ("pelvis", "thigh", "shank", "foot")))
    parts = [
        [coordinate for joint, _ in model.path(a, b) for coordinate in joint.coordinates]
        for a, b in pairwise(names)
    ]
    coordinates = [coordinate for part in parts for coordinate in part]
    for moving in (leg.hip.joint, leg.knee.joint, leg.ankle.joint):
        columns = [c.name for c in moving.coordinates]
        if not any(name in table.columns for name in columns):
            problem = f"has no column for the {leg.side} {moving.name} of the model"
            nearest = nearest_name(columns[0], table.columns)
            raise InputError(problem, file=table.file, allowed=" or ".join(columns), nearest=nearest)
    values = {
        c.name: table.columns[c.name] * (np.pi / 180.0 if degrees and c.rotational else 1.0)
        for c in coordinates
        if c.name in table.columns
    }
    bodies = {names[1]: model.pose(names[0], names[1], values)}
    for a, b in pairwise(names[1:]):
        bodies[b] = bodies[a] @ model.pose(a, b, values)
    places = {role: bodies[leg.bodies[segment]].point(place) for role, (segment, place) in leg.points.items()}
    count, how, points = len(table.time), "joint angles in the model", {}
    for role, place in places.items():
        path = np.array(np.broadcast_to(place, (count, 3)))
        points[role] = LegPoint(path, leg.foot.sources.get(role, how), leg.foot.error.get(role))
    return LegPoints(
        side=leg.side,
        time=table.time,
        points=points,
        pelvis=np.array(np.broadcast_to(bodies[names[1]].position, (count, 3))),
        sole=leg.foot.pitch,
        ankle_height=leg.foot.ankle_height,
        outline=leg.foot.outline,
        notices=(*_placing(leg, table, parts, values), *_beyond(coordinates, values)),
    )


def _placing(
    leg: ModelLeg, table: OpenSimTable, parts: Sequence[list[Coordinate]], values: Mapping[str, np.ndarray]
) -> list[Notice]:
    """What places the leg, and what has no column; a pelvis, the first of its parts, stands still there."""
    still = [c.name for part in parts for c in part if c.name not in values]
    text = "{subject} leg placed by the model's joints; the toes stay straight on the foot"
    found = [note("placed-by-model", text, subject=leg.side)]
    if still:
        text = "without a column, and so at the model's default: {coordinates}"
        found.append(note("default-coordinates", text, coordinates=", ".join(still)))
    pelvis = [c.name for c in parts[0] if c.name in still]
    if pelvis:
        text = "{file} has no {coordinates}: the pelvis stands still in these"
        found.append(Notice("pelvis-still", text, file=table.file.name, coordinates=", ".join(pelvis)))
    return found


def _beyond(coordinates: Sequence[Coordinate], values: Mapping[str, np.ndarray]) -> tuple[Notice, ...]:
    """Joints far beyond the model's range: a table of another model, often with the knee's sign turned."""
    found = []
    for c in coordinates:
        if c.name not in values or not c.rotational or not np.isfinite(values[c.name]).any():
            continue
        low, high = float(np.nanmin(values[c.name])), float(np.nanmax(values[c.name]))
        if low < c.limits[0] - _BEYOND or high > c.limits[1] + _BEYOND:
            spans = (low, high), c.limits
            reach, allowed = (f"{np.degrees(a):.0f} to {np.degrees(b):.0f} deg" for a, b in spans)
            text = "{subject} goes from {reach}, the model allows {allowed}: is this its model?"
            found.append(Notice("beyond-model-range", text, subject=c.name, reach=reach, allowed=allowed))
    return tuple(found)


def _match_markers(model: OpenSimModel, markers: Markers) -> tuple[dict[str, np.ndarray], list[Notice]]:
    """Paths of the model's markers in the trial [m] (n, 3), by name; a warning where two have one name."""
    of_name = defaultdict(list)
    for name in markers.positions:
        of_name[plain(name)].append(name)
    found, doubled = {}, []
    for name in model.markers:
        there = [name] if name in markers.positions else of_name[plain(name)]
        if there and np.isfinite(markers.positions[there[0]]).any():
            found[name] = markers.positions[there[0]]
        if len(there) > 1:
            text = "{markers} are both the model's {subject}; {taken} was taken"
            both = " and ".join(there)
            doubled.append(Notice("model-marker-doubled", text, subject=name, markers=both, taken=there[0]))
    if not found:
        own = ", ".join(model.markers) or "none at all"
        problem = f"has no marker of the model {model.file.name}; the model's are {own}"
        raise InputError(problem, file=markers.file, value=", ".join(markers.positions))
    return found, doubled


def _scale_warnings(model: OpenSimModel, seen: Mapping[str, np.ndarray]) -> tuple[Notice, ...]:
    """A warning where distances between markers of one body are not the model's."""
    of_body = defaultdict(list)
    for name in seen:
        of_body[model.markers[name][0]].append(name)
    ratios = []
    for pair in (pair for names in of_body.values() for pair in combinations(names, 2)):
        there = np.linalg.norm(seen[pair[0]] - seen[pair[1]], axis=1)
        here = float(np.linalg.norm(model.markers[pair[0]][1] - model.markers[pair[1]][1]))
        if here > _APART and np.isfinite(there).any():
            ratios.append(float(np.nanmedian(there)) / here)
    if not ratios or abs(np.median(ratios) - 1.0) <= _SCALE:
        return ()
    ratio = float(np.median(ratios))
    text = "the trial's markers lie {ratio:.3g} times as far apart as the model's (median of {pairs} pairs, "
    text += "each on one body): is this the person's scaled model?"
    return (Notice("model-scale", text, ratio=ratio, pairs=len(ratios)),)
