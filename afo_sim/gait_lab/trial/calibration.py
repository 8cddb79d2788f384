"""Calibration by the flat foot: the ankle angle's zero, and the ankle's height."""

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.checks import RANGES
from afo_sim.gait_lab.trial.choices import Choices

# Pitch of the sole where it should lie flat, from which on it does not: a model's sole is pitched by 0.7 to
# 4.3 deg there in eight legs of two healthy adults, so twice the most (derived) [deg].
RAISED = 8.0
CHAIN_ERROR = 0.03  # of typed lengths together; 1 cm costs about 0.05 N·m/kg (assumed) [m]


def ankle_zero(flat: float, sole: float | None, keep: bool) -> tuple[float, tuple[str, ...], tuple[str, ...]]:
    """The ankle angle's zero [rad]: the foot's pitch where flat, or the sole's if it never lies flat there.

    With a remark or a warning on it.
    """
    words = f"{np.degrees(flat):+.1f} deg"
    if keep:
        return 0.0, (f"ankle's zero kept; the foot's pitch where flat is {words}",), ()
    if sole is None or abs(np.degrees(flat - sole)) <= RAISED:
        moved = f"{np.degrees(-flat):+.1f} deg"
        return flat, (f"ankle's zero moved by {moved}, so that the flat foot is level",), ()
    raised = (
        f"the sole is pitched by {np.degrees(flat - sole):+.1f} deg, toe up positive, in the part of stance "
        f"in which it should lie flat: the ankle's zero is moved by {np.degrees(-sole):+.1f} deg, "
        "as the standing trial or the model tells"
    )
    return sole, (), (raised,)


def require_height(height: float, choices: Choices) -> None:
    """Refuse an ankle that stands nowhere near the floor, or not where typed lengths have it.

    Units: height [m].
    """
    low, high = RANGES["ankle_height_m"]
    stated = choices.ankle_height
    if choices.thigh is not None and stated is not None and abs(height - stated) > CHAIN_ERROR:
        word = "short" if height > stated else "long"
        raise InputError(
            f"thigh, shank and ankle height are {100.0 * abs(height - stated):.0f} cm too {word}: they leave "
            f"the ankle {100.0 * height:.0f} cm above the floor with the foot flat",
            field="thigh",
            allowed=f"the walker's own, within {100.0 * CHAIN_ERROR:.0f} cm together; or the scaled model, "
            "`model`",
        )
    if stated is None and not low <= height <= high:
        raise InputError(
            f"the ankle is {height:.3g} m above the laboratory's zero with the foot flat",
            field="up",
            allowed="the axis upward, with the floor at 0; the person's own scaled model; or the ankle height"
            ', for example "7 cm"',
        )
