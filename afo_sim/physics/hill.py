"""Hill's muscle: a static spring beside a damper, in tension only.

    F = F_static(κ, p) − R p_abs κ̇

The damper pulls or lets go only while the braid is taut, so that a slack muscle carries nothing.
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
def hill_force(
    static_force: float,
    contraction: float,
    contraction_rate: float,
    absolute_pressure: float,
    damping: float,
    braid_stiffness: float,
) -> tuple[float, float]:
    """Total muscle force, F = F_static − R p_abs κ̇, in tension only.

    Parameters
    ----------
    static_force : signed static force at max(κ, 0) [N]
    contraction : κ [-]
    contraction_rate : κ̇, shortening positive [1/s]
    absolute_pressure : p_abs [Pa]
    damping : R [m²·s]
    braid_stiffness : [N] per unit of stretch

    Returns
    -------
    (force [N], −dF/dκ̇ [N·s]) : the tension and its damping coefficient.

    Source
    ------
    Piteľ & Tóthová 2016 (S2), F_d = R P κ̇ with absolute P; S1, F = F_s + F_D.
    """
    braid = braid_force(contraction, braid_stiffness)
    # the damper is engaged as far as spring or braid is taut; the blend's slope exceeds 1 in places
    taut = tension(static_force, FORCE_BLEND)[1] + tension(braid, FORCE_BLEND)[1]
    if taut > 1.0:
        taut = 1.0
    coefficient = taut * damping * absolute_pressure
    spring = 0.0 if static_force < 0.0 else static_force  # the bladder does not hold the braid back
    force, slope = tension(spring + braid - coefficient * contraction_rate, FORCE_BLEND)
    return force, slope * coefficient
