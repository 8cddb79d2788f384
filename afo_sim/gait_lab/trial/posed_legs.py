"""Legs of a model that is posed as a whole over a trial's markers."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_joint import Pose
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.trial.inverse_kinematics import Posed, pose_over, skeleton_of
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.model_leg import ModelLeg, find_leg
from afo_sim.gait_lab.trial.model_segment import MISFIT
from afo_sim.gait_lab.trial.model_segments import UNSEEN
from afo_sim.gait_lab.trial.rigid_fit import fit_rigid

DILUTION = 5.0  # error of a point over that of a marker, above which a frame does not show it (assumed)


def posed_legs(
    model: OpenSimModel, legs: Mapping[str, LegPoints], seen: Mapping[str, np.ndarray]
) -> dict[str, LegPoints]:
    """Pose pelvis and legs with the model's joints; where that fails, leave the segments as they are.

    Units: seen [m] (n, 3).
    """
    found = {side: find_leg(model, side) for side in legs}
    try:
        posed = _posed(model, found, seen)
        return {side: _leg(posed, found[side], legs[side]) for side in legs}
    except InputError as error:
        reason = f"every segment is laid over its own markers, as the whole model cannot be posed: {error}"
        return {side: replace(leg, remarks=(reason, *leg.remarks)) for side, leg in legs.items()}


def _posed(model: OpenSimModel, legs: Mapping[str, ModelLeg], seen: Mapping[str, np.ndarray]) -> Posed:
    bodies = [leg.bodies for leg in legs.values()]
    root, ends = bodies[0]["pelvis"], [leg.get("toes", leg["foot"]) for leg in bodies]
    return pose_over(skeleton_of(model, root, ends, list(seen)), seen, _start(model, root, seen))


def _start(model: OpenSimModel, root: str, seen: Mapping[str, np.ndarray]) -> Pose:
    """The root laid over its own markers; in a gap, where it stands in the nearest frame."""
    names = [name for name in seen if model.markers[name][0] == root]
    if len(names) < 3:
        raise InputError(f"of the {root}, only {', '.join(names) or 'nothing'} is seen")
    fit = fit_rigid(
        np.array([model.markers[name][1] for name in names]), np.stack([seen[name] for name in names], axis=1)
    )
    shown = np.flatnonzero(np.isfinite(fit.rms))
    if not len(shown):
        raise InputError(f"no frame shows three markers of the {root} off a line")
    frames = np.arange(len(fit.rms))
    after = np.clip(np.searchsorted(shown, frames), 0, len(shown) - 1)
    before = np.maximum(after - 1, 0)
    near = np.where(frames - shown[before] < np.abs(shown[after] - frames), shown[before], shown[after])
    return Pose(fit.rotation[near], fit.position[near])


def _leg(posed: Posed, leg: ModelLeg, laid: LegPoints) -> LegPoints:
    """The points of a leg, in place of those of segments laid one by one."""
    points = {}
    for role, (segment, place) in leg.points.items():
        path, error = _shown(posed, leg.bodies[segment], place)
        if not np.isfinite(path).any():
            raise InputError(f"no frame shows the {leg.side} {role}")
        points[role] = LegPoint(
            path,
            leg.foot.how.get(role, "posed with the whole model"),
            float(np.hypot(error, leg.foot.error.get(role, UNSEEN))),
            laid.points[role].better,
        )
    pelvis, _ = _shown(posed, leg.bodies["pelvis"], np.zeros(3))
    return replace(
        laid,
        points=points,
        pelvis=pelvis,
        remarks=(_remark(posed, leg),),
        warnings=(*laid.warnings, *_warnings(posed)),
    )


def _shown(posed: Posed, body: str, place: np.ndarray) -> tuple[np.ndarray, float]:
    """Path of a point of a body, NaN where too little is seen (n, 3) [m], and its standard error [m]."""
    dilution = posed.dilution(body, place)
    shown = dilution < DILUTION
    error = posed.error * float(np.median(dilution[shown])) if shown.any() else float("nan")
    return np.where(shown[:, None], posed.bodies[body].point(place), np.nan), error


def _remark(posed: Posed, leg: ModelLeg) -> str:
    """How well the whole model meets the markers, and the leg's parts of it."""
    parts = {
        "pelvis": ("pelvis",),
        f"{leg.side} thigh": ("thigh",),
        f"{leg.side} shank": ("shank",),
        f"{leg.side} foot": ("foot", "toes"),
    }
    bodies = {part: [leg.bodies[s] for s in names if s in leg.bodies] for part, names in parts.items()}
    lines = [f"{part} {1e3 * posed.rms(of):.1f}" for part, of in bodies.items()]
    return (
        f"whole model posed over {len(posed.skeleton.markers)} markers (inverse kinematics): residual "
        f"{1e3 * posed.rms(list(posed.bodies)):.1f} mm RMS; {', '.join(lines)}"
    )


def _warnings(posed: Posed) -> tuple[str, ...]:
    """A residual that says that the model's joints do not fit the person."""
    rms = posed.rms(list(posed.bodies))
    if not rms > MISFIT:
        return ()
    return (f"the posed model misses the trial's markers by {1e3 * rms:.0f} mm RMS: another person's model?",)
