"""Choices that change nothing beside the files that are given."""

from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.files import WalkingTrial

OF_MARKERS = ("markers", "map", "static")  # which a model's own markers make needless
OF_ANGLES = ("thigh", "shank", "hip", "degrees")  # of a chain of joint angles without a model


def unused_choices(trial: WalkingTrial, choices: Choices, *, by_model: bool) -> tuple[str, ...]:
    """A sentence on what a person has chosen in vain; none if all counts."""
    names: list[str] = []
    if by_model:
        names += [*OF_MARKERS, "thigh", "shank", "hip"]
        names += [] if trial.angles is not None else ["degrees"]
    elif trial.angles is None:
        names += OF_ANGLES
    given = [name for name in names if getattr(choices, name) not in (None, {}, ())]
    why = "the model places the joints" if by_model else "they are of joint angles, and these are markers"
    return (f"{', '.join(given)}: not used, {why}",) if given else ()
