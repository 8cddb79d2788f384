"""One function over all static force laws, and the law as a muscle asks it.

A law gives the force that the braid would exert at a contraction ratio and gauge pressure. It is
*signed*: negative beyond its first zero, where a real muscle goes slack (`hill.tension` clamps it),
and never positive again beyond that zero. The kernels are in `braid_laws` and `empirical_laws`, their
names, parameters and ranges in `laws`.
"""

import math
from collections.abc import Sequence

from numba.extending import register_jitable

from afo_sim.physics.braid_laws import (
    chou_hannaford_1996,
    martens_boblan_2017,
    tondu_lopez_2000,
    tondu_lopez_2000_bladder,
)
from afo_sim.physics.empirical_laws import (
    bolen_2026,
    kerscher_2006,
    maximum_force,
    polynomial,
    sarosi_2012,
    takosoglu_2016,
    three_element,
)

MAX_COEFFICIENTS = 21


@register_jitable
def static_force(law: float, contraction: float, pressure: float, u: Sequence[float], c: int) -> float:
    """Signed force of the law with a native id, whose coefficients start at u[c] [N]."""
    if law == 0.0:
        return chou_hannaford_1996(contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3])
    if law == 1.0:
        return tondu_lopez_2000(contraction, pressure, u[c], u[c + 1], u[c + 2])
    if law == 2.0:
        return tondu_lopez_2000_bladder(contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4])
    if law == 3.0:
        return kerscher_2006(
            contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4], u[c + 5], u[c + 6]
        )
    if law == 4.0:
        return maximum_force(
            contraction,
            pressure,
            u[c],
            u[c + 1],
            u[c + 2],
            u[c + 3],
            u[c + 4],
            u[c + 5],
            u[c + 6],
            u[c + 7],
            u[c + 8],
        )
    if law == 5.0:
        return sarosi_2012(contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4], u[c + 5])
    if law == 6.0:
        return polynomial(
            contraction,
            pressure,
            u[c],
            u[c + 1],
            u[c + 2],
            u[c + 3],
            u[c + 4],
            u[c + 5],
            u[c + 6],
            u[c + 7],
            u[c + 8],
            u[c + 9],
            u[c + 10],
            u[c + 11],
            u[c + 12],
            u[c + 13],
            u[c + 14],
            u[c + 15],
            u[c + 16],
            u[c + 17],
            u[c + 18],
            u[c + 19],
            u[c + 20],
        )
    if law == 7.0:
        return takosoglu_2016(contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4], u[c + 5])
    if law == 8.0:
        return martens_boblan_2017(
            contraction,
            pressure,
            u[c],
            u[c + 1],
            u[c + 2],
            u[c + 3],
            u[c + 4],
            u[c + 5],
            u[c + 6],
            u[c + 7],
            u[c + 8],
        )
    if law == 9.0:
        return bolen_2026(contraction, pressure, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4])
    if law == 10.0:
        return three_element(
            contraction,
            pressure,
            u[c],
            u[c + 1],
            u[c + 2],
            u[c + 3],
            u[c + 4],
            u[c + 5],
            u[c + 6],
            u[c + 7],
        )
    return math.nan


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
