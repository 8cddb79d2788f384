"""A rubber tube inside a braid: what it pulls by its stretch along the muscle and around it."""

import functools

from afo_sim.physics.jitable import register_jitable

LONGEST, STEPS = 0.9, 900  # contraction up to which the tube's turn is sought [-], and in how many steps


@register_jitable
def rubber_force(contraction: float, stiffness: float, b: float, turn: float) -> tuple[float, float]:
    """Tension of an incompressible neo-Hookean tube that a braid holds around, and its slope.

    With λ = 1 − κ along the muscle and h² = b − (b − 1) λ² around it,

        W = μ/2 [λ² + h² + 1/(λ h)² − 3]        T = A dW/dλ

        T = A μ [(2 − b) λ − 1/(λ³ h²) + (b − 1)/(λ h⁴)]

    Stretched, it goes on in a straight line, with the slope at κ = 0: h would fall to zero where the braid
    locks, and the wall grow beyond all bounds, which the braid's own stiffness keeps it from. From `turn` on
    T stays: tubes in braids of less than some 26° would take less again, and a muscle's force has to fall.

    Parameters
    ----------
    contraction : κ [-]
    stiffness : A μ [N], cross-section of the rubber times a third of its Young's modulus
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
        slope = -2.0 * stiffness * (1.0 + (b - 1.0) * (b - 1.0) + (b - 2.0) * (b - 2.0))
        return slope * contraction + 0.0 * turn, slope  # a NaN stays one
    held, x = contraction > turn, 1.0 - contraction
    if held:
        x = 1.0 - turn
    square = b - (b - 1.0) * x * x
    along, around = 1.0 / (x * square), (b - 1.0) / square
    force = stiffness * ((2.0 - b) * x + along * (around - 1.0 / (x * x))) + 0.0 * turn
    if held:
        return force, 0.0
    slope = 2.0 - b + 3.0 * along / x * (1.0 / (x * x) - around) + 4.0 * around * around / square
    return force, -stiffness * slope


@functools.lru_cache(maxsize=64)
def turning(b: float) -> float:
    """Contraction ratio up to which a tube in a braid of this b takes more and more force [-]."""
    steps = (LONGEST * k / STEPS for k in range(1, STEPS))
    rising = (kappa for kappa in steps if rubber_force(kappa, 1.0, b, LONGEST)[1] >= 0.0)
    return next(rising, LONGEST) - LONGEST / STEPS
