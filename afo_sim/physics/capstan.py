"""Friction of a cable that slides over guides: the capstan equation, as Euler and Eytelwein have it."""

import math

from afo_sim.physics.jitable import register_jitable

CREEP = 1e-4  # w0, over which friction turns; a cable that should stick creeps at about this speed [m/s]


@register_jitable
def turn(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Angle between two directions [rad], from 0 to π."""
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return math.atan2(math.sqrt(x * x + y * y + z * z), ax * bx + ay * by + az * bz)


@register_jitable
def capstan(tension: float, friction: float, turned: float, lengthening: float) -> tuple[float, float]:
    """Tension behind the guides, T' = T e^(μ β tanh(w/w0)), and how it rises with the speed, (T' − T)/w.

    A path that shortens pulls less behind its guides than its muscle does, one that lengthens more:
    T'/T = e^(∓μβ). Coulomb's jump at w = 0 is spread over w0.

    Parameters
    ----------
    tension : T, of the muscle [N]
    friction : μ [-]
    turned : β, the angles by which the path turns at its guides, together [rad]
    lengthening : w, speed at which the path grows longer [m/s]

    Returns
    -------
    (tension behind the guides [N], its secant from w = 0 [N·s/m], never negative)
    """
    turning = friction * turned
    more = tension * math.expm1(turning * math.tanh(lengthening / CREEP))
    if abs(lengthening) < 1e-9 * CREEP:  # a quotient of roundings
        return tension + more, tension * turning / CREEP
    return tension + more, more / lengthening
