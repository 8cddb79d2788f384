"""The legs of a trial, from the best that its files hold."""

from dataclasses import replace

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.angle_unit import angle_unit
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.trial.chain_legs import ANGLES, legs_from_chain
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers
from afo_sim.gait_lab.trial.model_legs import legs_from_angles, legs_from_model_markers
from afo_sim.gait_lab.trial.unused_choices import unused_choices


def find_legs(
    trial: WalkingTrial, choices: Choices, model: OpenSimModel | None
) -> tuple[dict[str, LegPoints], OpenSimModel | None]:
    """Points of both legs, or of the one that the files hold.

    A model with joint angles goes first, then a model with markers, then joint angles alone with whatever
    places the ankle, then markers alone.
    """
    if model is not None and trial.angles is not None:
        knees = [
            name for name in trial.angles.columns if name.startswith("knee_angle_") and "beta" not in name
        ]
        degrees, warnings = angle_unit(trial.angles, knees, choices.degrees)
        legs = legs_from_angles(model, trial.angles, degrees)
        warnings = (*warnings, *unused_choices(trial, choices, by_model=True))
        legs = {side: replace(_warned(leg, warnings), by_angles=True) for side, leg in legs.items()}
        return _require_side(legs, trial, choices), model
    if model is not None and trial.markers is not None:
        return _by_model(model, trial, choices)
    if trial.angles is not None:
        return legs_from_chain(trial.angles, choices, trial.bodies, _seen(trial, choices)), None
    if trial.markers is not None:
        legs = legs_from_markers(trial.markers, choices, trial.standing)
        told = unused_choices(trial, choices, by_model=False)
        legs = {side: _warned(leg, told) for side, leg in legs.items()}
        return _require_side(legs, trial, choices), None
    raise InputError(
        "no file holds the leg's motion",
        file=", ".join(str(file) for file in trial.files),
        allowed=f"joint angles ({', '.join(ANGLES)}) in a .mot or .sto, or markers in a .trc, .c3d or .csv",
    )


def _by_model(
    model: OpenSimModel, trial: WalkingTrial, choices: Choices
) -> tuple[dict[str, LegPoints], OpenSimModel | None]:
    """The model posed over the markers; markers alone, with a warning, where it cannot be."""
    assert trial.markers is not None
    try:
        legs = legs_from_model_markers(model, trial.markers, choices)
    except InputError as error:
        problem = error
    else:
        unused = unused_choices(trial, choices, by_model=True)
        return {side: _warned(leg, unused) for side, leg in legs.items()}, model
    try:
        legs = legs_from_markers(trial.markers, choices, trial.standing)
    except InputError:
        raise problem from None
    told = f"the model {model.name} is not used, the markers alone are; is it this person's?"
    told += f" It {problem.problem}"
    return {side: _warned(leg, (told,)) for side, leg in legs.items()}, None


def _seen(trial: WalkingTrial, choices: Choices) -> dict[str, LegPoints] | None:
    """Legs from markers beside joint angles, if they are complete: only the ankle's place is wanted."""
    if trial.markers is None:
        return None
    try:
        return legs_from_markers(trial.markers, choices, trial.standing)
    except InputError:
        if choices.markers or choices.map:  # what the person named herself must be right
            raise
        return None


def _warned(leg: LegPoints, warnings: tuple[str, ...]) -> LegPoints:
    return replace(leg, warnings=(*leg.warnings, *warnings))


def _require_side(legs: dict[str, LegPoints], trial: WalkingTrial, choices: Choices) -> dict[str, LegPoints]:
    if choices.side not in legs:
        raise InputError(
            f"the files do not hold the {choices.side} leg",
            file=", ".join(str(file) for file in trial.files),
            field="side",
            value=choices.side,
            allowed=", ".join(legs) or "a leg",
        )
    return legs
