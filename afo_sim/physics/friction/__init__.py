"""The registry FRICTIONS of friction models: one file each, found here.

A shipped friction is a file in this folder: its kernels, its parameters, and a `Friction` at the top level
with a native id of its own. FRICTIONS and the dispatchers of `dispatch` follow. A user's is registered.
"""

import math
from dataclasses import replace

from afo_sim.common import InputError
from afo_sim.physics import user_kernels
from afo_sim.physics.friction.law import MAX_FRICTION_COEFFICIENTS, Friction, check
from afo_sim.physics.registry import check_coefficients, collect


def collected() -> dict[str, Friction]:
    """The frictions of this folder by name, as their native ids rise; a wrong entry is a ValueError."""
    frictions = collect(__name__, Friction, besides=("law", "dispatch"))
    for friction in frictions.values():
        _checked(friction)
    return frictions


def _checked(friction: Friction) -> int:
    """Number of a friction's coefficients; ValueError where it is wrong."""
    check(friction)
    return check_coefficients(friction, friction.n_arguments, MAX_FRICTION_COEFFICIENTS)


FRICTIONS: dict[str, Friction] = collected()
SHIPPED = tuple(FRICTIONS.values())  # whose kernels are compiled together
# Of former versions: their springs grew stiffer with the pressure, and gave energy where it rose.
RETIRED_FRICTIONS = {"vo_minh_2011": "maxwell_slip", "bouc_wen_1976": "maxwell_slip"}


def add(friction: Friction) -> None:
    """Add a friction of a user's own; InputError where it is wrong."""
    try:
        number = _checked(replace(friction, native_id=user_kernels.FIRST_USER_ID))
        found = friction.kernel(*[0.01] * friction.n_arguments, *friction.typical)
        if not all(map(math.isfinite, found)):
            raise ValueError(f"it gives {found}")
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"is wrong: {error}", field="Friction", value=friction.name) from error
    friction = replace(friction, kernel=user_kernels.anew(friction.kernel))
    user_kernels.add(friction, FRICTIONS, user_kernels.friction_bodies(friction, number))
