"""A rubber tube inside a braid: what it pulls by its stretch along the muscle, around it and across."""

import functools
import math

from afo_sim.physics.jitable import register_jitable

LONGEST, STEPS = 0.9, 900  # contraction up to which the tube's turn is sought [-], and in how many steps


@register_jitable
def rubber_force(
    contraction: float, stiffness: float, bore: float, b: float, turn: float
) -> tuple[float, float]:
    """Tension of an incompressible neo-Hookean tube whose outside a braid holds, and its slope.

    Along the muscle λ = 1 − κ; around its outside h² = b − (b − 1) λ² by the braid, and g = λ h² − 1. The
    wall keeps its volume: a radius R at rest stretches by √[(1 + g R0²/R²)/λ]. With the energy
    μ/2 (λ1² + λ2² + λ3² − 3) integrated over the wall, of a length at rest,

        U/L0 = S f      f = (1 − ρ)(λ² − 3 + 2/λ) + g/λ ln[(ρ + g)/(ρ (1 + g))]      T = S df/dλ

    Stretched, it goes on in a straight line, with the slope at κ = 0: h would fall to zero where the braid
    locks, and the wall grow beyond all bounds, which the braid's own stiffness keeps it from. From `turn` on
    T stays: some tubes would take less again, and a muscle's force has to fall.

    Parameters
    ----------
    contraction : κ [-]
    stiffness : S = π μ R0²/2 [N], with μ a third of Young's modulus and R0 the braid's radius
    bore : ρ, the tube's inner radius over its outer, squared [-]
    b : 1/sin²α0 of the braid [-]
    turn : contraction at which the tube takes most, from `turning`, below 1 [-]

    Returns
    -------
    (T [N], dT/dκ [N]): zero at κ = 0, negative beyond, where the tube takes force; positive when stretched

    Source
    ------
    Derived by this project; the idea, an elastic tube beside a braid's formula, from Chou & Hannaford 1996
    and Klute & Hannaford 2000.
    """
    if contraction < 0.0:
        slope = -stiffness * (1.0 - bore) * (6.0 + 2.0 * (3.0 - 2.0 * b) * (3.0 - 2.0 * b) / bore)
        return slope * contraction + 0.0 * turn, slope  # a NaN stays one
    held, x = contraction > turn, 1.0 - contraction
    if held:
        x = 1.0 - turn
    g, by_x, bend = b * x - (b - 1.0) * x * x * x - 1.0, b - 3.0 * (b - 1.0) * x * x, -6.0 * (b - 1.0) * x
    inner, outer = 1.0 / (bore + g), 1.0 / (1.0 + g)
    wall = math.log1p(g * (1.0 - bore) / bore * outer)
    wall_by, fall = by_x * (inner - outer), (by_x - g / x) / x
    force = (1.0 - bore) * (2.0 * x - 2.0 / (x * x)) + fall * wall + g / x * wall_by + 0.0 * turn
    if held:
        return stiffness * force, 0.0
    wall_bend = bend * (inner - outer) - by_x * by_x * (inner * inner - outer * outer)
    slope = (1.0 - bore) * (2.0 + 4.0 / (x * x * x)) + (bend - 2.0 * fall) / x * wall
    slope += 2.0 * fall * wall_by + g / x * wall_bend
    return stiffness * force, -stiffness * slope


@functools.lru_cache(maxsize=256)
def turning(b: float, bore: float) -> float:
    """Contraction ratio up to which a tube in a braid takes more and more force.

    Parameters
    ----------
    b : 1/sin²α0 of the braid [-]
    bore : ρ, the tube's inner radius over its outer, squared, above 0 [-]

    Returns
    -------
    κ [-], on a grid of 0.001; at most that at which the air is half of that at rest, or 0.9

    Source
    ------
    Derived by this project.
    """
    for k in range(1, STEPS):
        x = 1.0 - LONGEST * k / STEPS
        empty = b * x - (b - 1.0) * x**3 - 1.0 <= -0.5 * bore  # the air is half of that at rest
        if empty or rubber_force(1.0 - x, 1.0, bore, b, LONGEST)[1] >= 0.0:
            return LONGEST * (k - 1) / STEPS
    return LONGEST * (STEPS - 1) / STEPS
