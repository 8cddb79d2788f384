"""Points of both legs from an OpenSim model: by its joint angles, or by the markers that a trial shows."""

from collections.abc import Callable
from dataclasses import replace

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.model_angles import placed_leg
from afo_sim.gait_lab.trial.model_leg import find_leg
from afo_sim.gait_lab.trial.model_markers import match_markers, name_warnings, scale_warnings
from afo_sim.gait_lab.trial.model_segments import fitted_leg
from afo_sim.gait_lab.trial.posed_legs import posed_legs


def legs_from_angles(model: OpenSimModel, table: OpenSimTable, degrees: bool) -> dict[str, LegPoints]:
    """Place both legs by forward kinematics."""
    return _both(lambda side: placed_leg(model, find_leg(model, side), table, degrees), "")


def legs_from_model_markers(model: OpenSimModel, markers: Markers, choices: Choices) -> dict[str, LegPoints]:
    """Pose the model over the markers of a trial, as OpenSim's inverse kinematics does with equal weights.

    Where the whole model cannot be posed, its segments are laid over their markers one by one.
    """
    seen = match_markers(model, markers)
    legs = _both(
        lambda side: fitted_leg(model, find_leg(model, side), markers, seen),
        choices.side,
        lambda laid: posed_legs(model, laid, seen),
    )
    doubts = (*name_warnings(model, markers), *scale_warnings(model, seen))
    return {side: replace(leg, warnings=(*doubts, *leg.warnings)) for side, leg in legs.items()}


def _both(
    leg: Callable[[str], LegPoints],
    needed: str,
    together: Callable[[dict[str, LegPoints]], dict[str, LegPoints]] = dict,
) -> dict[str, LegPoints]:
    """Both legs, first each, then together; one that is not needed may be missing: a remark of the other."""
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
        remark = f"no {side} leg: {reason}"
        found[other] = replace(found[other], remarks=(*found[other].remarks, remark))
    return found
