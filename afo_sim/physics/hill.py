"""Hill's muscle: a static spring beside a damper.

    F_static(κ, p) − R p_abs κ̇ − F_friction = T

κ is the muscle's own contraction, and T the tension of the cable in series with it. The damper acts on a
slack muscle too: it returns to its free length at the speed that the damper allows. Only the cable cannot
push.
"""

from afo_sim.physics.jitable import register_jitable

BRAID_BLEND = 0.005  # stretch over which the braid's stiffness sets in [-]
DAMPER_COEFFICIENTS = 7


@register_jitable
def braid_force(contraction: float, braid_stiffness: float) -> float:
    """Tension of the braid's own fibres when it is stretched beyond its nominal length.

    Parameters
    ----------
    contraction : κ [-]; acts below zero
    braid_stiffness : force per unit of stretch [N]

    Returns
    -------
    float : tension [N], quadratic over the first `BRAID_BLEND` of stretch, then linear.
    """
    stretch = -contraction
    if stretch <= 0.0:
        return 0.0
    if stretch < BRAID_BLEND:
        return braid_stiffness * stretch * stretch / (2.0 * BRAID_BLEND)
    return braid_stiffness * (stretch - 0.5 * BRAID_BLEND)


@register_jitable
def three_element_damping(
    pressure: float,
    contraction_rate: float,
    b0: float,
    b1: float,
    switch_pressure: float,
    r0: float,
    r1: float,
    r2: float,
    r3: float,
) -> float:
    """Damping of the three-element model, another while contracting than while relaxing.

    B = b0 + b1 p contracting; relaxing r0 + r1 p below the switch pressure, r2 + r3 p from there. Never
    negative: Reynolds' line for deflation would be, beyond 747 kPa.

    Parameters
    ----------
    pressure : p, gauge [Pa]
    contraction_rate : κ̇ [1/s], shortening positive
    b0, b1, r0, r1, r2, r3 : [N·s/m] and [N·s/(m·Pa)] in turn
    switch_pressure : [Pa]

    Returns
    -------
    float : B [N·s/m], force per shortening velocity of the muscle

    Source
    ------
    Reynolds et al. 2003, doi 10.1114/1.1554921 (as quoted by Lilly & Quesada 2004); Serres et al. 2009; S0.
    Code in circulation has + where Reynolds' line for deflation falls with pressure.
    """
    if contraction_rate > 0.0:
        damping = b0 + b1 * pressure
    elif pressure < switch_pressure:
        damping = r0 + r1 * pressure
    else:
        damping = r2 + r3 * pressure + 0.0 * switch_pressure
    if damping < 0.0:
        return 0.0
    return damping + 0.0 * contraction_rate  # a NaN stays one
