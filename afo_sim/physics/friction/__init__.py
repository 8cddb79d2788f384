"""The registry FRICTIONS of friction models: one file each, found here.

A new friction is a new file in this folder: its kernels, its parameters, and a `Friction` at the top level
with a native id of its own. FRICTIONS and the dispatchers of `dispatch` follow.
"""

from afo_sim.physics.friction.law import MAX_FRICTION_COEFFICIENTS, Friction, check
from afo_sim.physics.registry import check_coefficients, collect


def collected() -> dict[str, Friction]:
    """The frictions of this folder by name, as their native ids rise; a wrong entry is a ValueError."""
    frictions = collect(__name__, Friction, besides=("law", "dispatch"))
    for friction in frictions.values():
        check(friction)
        check_coefficients(friction, friction.n_arguments, MAX_FRICTION_COEFFICIENTS)
    return frictions


FRICTIONS: dict[str, Friction] = collected()
# Of former versions: their springs grew stiffer with the pressure, and gave energy where it rose.
RETIRED_FRICTIONS = {"vo_minh_2011": "maxwell_slip", "bouc_wen_1976": "maxwell_slip"}
