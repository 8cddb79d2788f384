"""Hill's muscle: a static spring beside a damper, in tension only.

    F = F_static(κ, p) − R p_abs κ̇ − F_friction

The damper acts only while the braid is taut: contracting, it can take off no more than the muscle carries
(tension ends at zero); drawn out, it can add no more than that. The second bound is an assumption, since no
paper measures the damper there; without it a muscle that becomes taut at speed is struck by the whole of
R p_abs κ̇ at its first newton.
"""

from numba.extending import register_jitable

FORCE_BLEND = 1.0  # width of the smooth start of tension [N]: small beside any useful force
BRAID_BLEND = 0.005  # stretch over which the braid's stiffness sets in [-]


@register_jitable
def tension(force: float, width: float) -> tuple[float, float]:
    """Clamp a signed force to tension, smoothly, and give the slope dF/d(force).

    Zero up to zero, `force` beyond `width`, and between them the cubic x² (2 w − x)/w², which meets
    both with equal slope: never more than `force`, never negative.

    Parameters
    ----------
    force : signed force [N]
    width : w [N]

    Returns
    -------
    (tension [N], slope [-])
    """
    if force <= 0.0:
        return 0.0, 0.0
    if force < width:
        x = force / width
        return force * x * (2.0 - x), x * (4.0 - 3.0 * x)
    return force, 1.0  # a NaN comes out here


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
        damping = r2 + r3 * pressure
    if damping < 0.0:
        return 0.0
    return damping + 0.0 * contraction_rate  # a NaN stays one


DAMPER_COEFFICIENTS = 7


@register_jitable
def bounded(loss: float, bound: float) -> tuple[float, float, float]:
    """A loss that cannot exceed a bound, and its slopes d/d(loss) and d/d(bound).

    The loss itself up to half the bound b, from there b − (3b/2 − x)²/2b, which meets b at 3b/2 levelly.

    Parameters
    ----------
    loss : x, not negative [N]
    bound : b, not negative [N]

    Returns
    -------
    (loss [N], slope by the loss [-], slope by the bound [-])
    """
    if loss <= 0.5 * bound:
        return loss, 1.0, 0.0
    if loss < 1.5 * bound:
        rest = 1.5 - loss / bound
        return bound * (1.0 - 0.5 * rest * rest), rest, (1.0 - rest) * (1.0 - 0.5 * rest)
    return bound + 0.0 * loss, 0.0, 1.0  # a NaN stays one


@register_jitable
def hill_force(
    static_force: float,
    contraction: float,
    contraction_rate: float,
    damping: float,
    friction: float,
    friction_slope: float,
    static_slope: float,
    braid_stiffness: float,
) -> tuple[float, float]:
    """Total muscle force, F = F_static − c κ̇ − F_friction, in tension only.

    Parameters
    ----------
    static_force : signed static force at max(κ, 0) [N]
    contraction : κ [-]
    contraction_rate : κ̇, shortening positive [1/s]
    damping : c [N·s], the Hill damper's R p_abs and what else is in proportion to κ̇
    friction : F_friction, positive while shortening [N]
    friction_slope : its derivative by κ̇ [N·s]
    static_slope : −dF_static/dκ̇ [N·s], of friction that `static_force` already holds
    braid_stiffness : [N] per unit of stretch

    Returns
    -------
    (force [N], −dF/dκ̇ [N·s]) : the tension and its damping coefficient.

    Source
    ------
    Piteľ & Tóthová 2016 (S2), F_d = R P κ̇ with absolute P; S1, F = F_s + F_D.
    """
    spring = static_force
    if spring < 0.0:  # the bladder does not hold the braid back
        spring, static_slope = 0.0, 0.0
    carried = spring + braid_force(contraction, braid_stiffness)
    loss = damping * contraction_rate + friction
    if loss < 0.0:  # drawn out, it holds at most as much again as it carries
        pull, engaged = tension(carried, FORCE_BLEND)
        held, by_loss, by_pull = bounded(-engaged * loss, pull)
        slope = by_loss * (damping + friction_slope) + (1.0 + by_pull) * static_slope
        return pull + held, engaged * slope
    force, slope = tension(carried - loss, FORCE_BLEND)
    return force, slope * (damping + friction_slope + static_slope)
