"""Forward kinematics of one leg of an OpenSim model."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.gait_lab.readers.opensim_joint import Coordinate
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.model_leg import ModelLeg

BEYOND = np.radians(10.0)  # beyond a joint's range in the model, from which on it is told [rad] (assumed)


def placed_leg(model: OpenSimModel, leg: ModelLeg, table: OpenSimTable, degrees: bool) -> LegPoints:
    """Place a leg by its coordinates; parameters and errors as `legs_from_angles`."""
    names = ("ground", *(leg.bodies[segment] for segment in ("pelvis", "thigh", "shank", "foot")))
    parts = [
        [coordinate for joint, _ in model.path(a, b) for coordinate in joint.coordinates]
        for a, b in pairwise(names)
    ]
    coordinates = [coordinate for part in parts for coordinate in part]
    _require_angles(table, leg)
    values = {
        c.name: table.columns[c.name] * (np.pi / 180.0 if degrees and c.rotational else 1.0)
        for c in coordinates
        if c.name in table.columns
    }
    bodies = {names[1]: model.pose(names[0], names[1], values)}
    for a, b in pairwise(names[1:]):
        bodies[b] = bodies[a] @ model.pose(a, b, values)
    places = {role: bodies[leg.bodies[segment]].point(place) for role, (segment, place) in leg.points.items()}
    count = len(table.time)
    how = "joint angles in the model"
    return LegPoints(
        side=leg.side,
        time=table.time,
        points={
            role: LegPoint(
                np.array(np.broadcast_to(place, (count, 3))),
                leg.foot.how.get(role, how),
                leg.foot.error.get(role),
            )
            for role, place in places.items()
        },
        pelvis=np.array(np.broadcast_to(bodies[names[1]].position, (count, 3))),
        sole=leg.foot.pitch,
        ankle_height=leg.foot.ankle_height,
        outline=leg.foot.outline,
        remarks=_remarks(leg, coordinates, values),
        warnings=(*_still(table, parts[0], values), *_beyond(coordinates, values)),
    )


def _require_angles(table: OpenSimTable, leg: ModelLeg) -> None:
    for joint in (leg.hip.joint, leg.knee.joint, leg.ankle.joint):
        names = [c.name for c in joint.coordinates]
        if not any(name in table.columns for name in names):
            problem = f"has no column for the {leg.side} {joint.name} of the model"
            allowed = " or ".join(names)
            raise InputError(
                problem, file=table.file, allowed=allowed, nearest=nearest_name(names[0], table.columns)
            )


def _remarks(
    leg: ModelLeg, coordinates: Sequence[Coordinate], values: Mapping[str, np.ndarray]
) -> tuple[str, ...]:
    still = [c.name for c in coordinates if c.name not in values]
    lines = [f"{leg.side} leg placed by the model's joints; the toes stay straight on the foot"]
    if still:
        lines.append(f"without a column, and so at the model's default: {', '.join(still)}")
    return tuple(lines)


def _still(
    table: OpenSimTable, coordinates: Sequence[Coordinate], values: Mapping[str, np.ndarray]
) -> tuple[str, ...]:
    """A pelvis that has no columns of its own stands still."""
    lost = [c.name for c in coordinates if c.name not in values]
    if not lost:
        return ()
    return (f"{table.file.name} has no {', '.join(lost)}: the pelvis stands still in these",)


def _beyond(coordinates: Sequence[Coordinate], values: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """Joints far beyond the model's range: a table of another model, often with the knee's sign turned."""
    found = []
    for c in coordinates:
        if c.name not in values or not c.rotational or not np.isfinite(values[c.name]).any():
            continue
        low, high = float(np.nanmin(values[c.name])), float(np.nanmax(values[c.name]))
        if low < c.limits[0] - BEYOND or high > c.limits[1] + BEYOND:
            reach, allowed = (
                f"{np.degrees(a):.0f} to {np.degrees(b):.0f} deg" for a, b in ((low, high), c.limits)
            )
            found.append(f"{c.name} goes from {reach}, the model allows {allowed}: is this its model?")
    return tuple(found)
