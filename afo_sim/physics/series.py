"""Series elements of a muscle, which only pull: its cable, the guides that the cable slides over, and the
anchor on the limb that gives way."""

import math

from afo_sim.physics.jitable import register_jitable

_ANCHOR_ITERATIONS = 60  # of Newton's method on a convex function; it takes three to five


@register_jitable
def cable_tension(stretch: float, stiffness: float) -> tuple[float, float]:
    """Tension of a cable, T = k max(e, 0), and its slope dT/de.

    Parameters
    ----------
    stretch : e, path length less all that is in series; negative, the cable hangs through [m]
    stiffness : k [N/m]

    Returns
    -------
    (tension [N], slope [N/m])
    """
    if stretch <= 0.0:
        return 0.0, 0.0
    return stiffness * stretch, stiffness  # a NaN comes out here


@register_jitable
def anchor_displacement(
    pull: float, stiffness: float, force: float, length: float, damping: float, last: float, last_move: float,
    step: float,
) -> tuple[float, float]:  # fmt: skip
    """Displacement of an anchor under the pull of all its muscles at the end of a step, and its slope dz/dP.

    Undamped:  P = k z, or P = a (e^(z/x0) − 1) for one that stiffens, S(z) below.
    Damped:    P = S(z) + c ż,  ż = (3 (z − z_last) − (z_last − z_before))/(2 h), of the second order (BDF2)

    Parameters
    ----------
    pull : P, not negative [N]
    stiffness : k [N/m]; 0 for one that stiffens
    force, length : a [N], x0 [m]
    damping : c [N·s/m]
    last : z_last [m]
    last_move : z_last − z_before, over the step before [m]
    step : h [s]

    Returns
    -------
    (z [m], dz/dP [m/N])

    Source
    ------
    The stiffening form is that of Schiebl et al. 2025, Sensors 25, 4605, for upper-arm cuffs.
    """
    if damping == 0.0:
        if stiffness != 0.0:
            return pull / stiffness, 1.0 / stiffness
        return length * math.log1p(pull / force), length / (pull + force)
    per_move = 1.5 * damping / step
    known = pull + per_move * (last + last_move / 3.0)
    if stiffness != 0.0:
        return known / (stiffness + per_move), 1.0 / (stiffness + per_move)
    z, slope = last, 1.0
    highest = length * math.log1p(max(known, 0.0) / force)  # as if its damper held nothing
    for _ in range(_ANCHOR_ITERATIONS):
        z = min(z, highest)
        grown = math.exp(z / length)
        slope = force / length * grown + per_move
        change = (known - force * (grown - 1.0) - per_move * z) / slope
        z += change
        if abs(change) < 1e-15:
            break
    return z, 1.0 / slope


@register_jitable
def anchor_force(displacement: float, stiffness: float, force: float, length: float) -> float:
    """Elastic force of an anchor, k z or a (e^(z/x0) − 1) [N]; arguments as in `anchor_displacement`."""
    if stiffness != 0.0:
        return stiffness * displacement
    return force * math.expm1(displacement / length)


@register_jitable
def anchor_energy(displacement: float, stiffness: float, force: float, length: float) -> float:
    """Energy stored in an anchor, ½ k z² or a (x0 (e^(z/x0) − 1) − z) [J]; as `anchor_force`."""
    if stiffness != 0.0:
        return 0.5 * stiffness * displacement * displacement
    return force * (length * math.expm1(displacement / length) - displacement)


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
