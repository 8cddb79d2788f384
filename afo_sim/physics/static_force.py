"""One function over all static force laws, and the law as a muscle asks it.

A law gives the force that the braid would exert at a contraction ratio and gauge pressure. It is
*signed*: negative beyond its first zero, where a real muscle goes slack (`hill.tension` clamps it),
and never positive again beyond that zero.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from numba.extending import register_jitable

from afo_sim.physics.law import Law
from afo_sim.physics.laws import LAWS
from afo_sim.physics.registry import Branch, check_branches, dispatcher, items, typical_coefficients

StaticForce = Callable[[float, float, float, Any, int], float]


def over(laws: Iterable[Law]) -> StaticForce:
    """A function over laws: (native id, κ [-], p gauge [Pa], u, c) → signed force [N].

    The coefficients of the law start at u[c]. The force of an unknown id is not a number.
    """
    branches = []
    for law in laws:
        taken = ["contraction", "pressure", *items("u", "c", len(typical_coefficients(law)))]
        branches.append(Branch(law.native_id, law.kernel, (f"return {{kernel}}({', '.join(taken)})",)))
    return dispatcher(
        "static_force",
        ("law", "contraction", "pressure", "u", "c"),
        branches,
        description="Signed force of the law with a native id, whose coefficients start at u[c] [N].",
    )


def check(function: StaticForce, laws: Mapping[str, Law]) -> None:
    """Refuse a `static_force` without a branch for one of the laws (ValueError)."""

    def asked(law: Law) -> float:
        return function(float(law.native_id), 0.1, 3e5, typical_coefficients(law), 0)

    def own(law: Law) -> float:
        return law.kernel(0.1, 3e5, *typical_coefficients(law))

    check_branches(laws, asked, own, "static_force")


static_force: StaticForce = over(LAWS.values())
check(static_force, LAWS)


@register_jitable
def muscle_static_force(
    law: float, contraction: float, pressure: float, lowest_pressure: float, u: Sequence[float], c: int
) -> float:
    """The law as a muscle asks it: at κ ≥ 0 and p ≥ 0, and no pull without air.

    Stretched, the braid carries (`hill.braid_force`). A bladder below ambient leaves the braid. Below
    the lowest pressure that the law was shown at, the force is at most in proportion to the pressure: most
    empirical laws would pull a little, or a lot, without any air.

    Parameters
    ----------
    law : native id
    contraction : κ [-]
    pressure : p, gauge [Pa]
    lowest_pressure : of the law's range, gauge [Pa]; 0 for none
    u, c : the law's coefficients start at u[c]

    Returns
    -------
    float : signed force [N]
    """
    kappa = 0.0 if contraction < 0.0 else contraction
    if pressure < 0.0:
        pressure = 0.0
    force = static_force(law, kappa, pressure, u, c)
    if pressure < lowest_pressure:
        most = static_force(law, kappa, lowest_pressure, u, c) * pressure / lowest_pressure
        if most < force:
            return most
    return force
