"""Four Maxwell-slip elements in pressure units, Vo-Minh et al. 2011."""

from afo_sim.physics.friction.law import DEAD_BAND, Friction
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import LawParameter

ELEMENT_SHARES = (0.1, 0.2, 0.3, 0.4)  # of the dead band, for each element


@register_jitable
def maxwell_slip_elements(
    dead_band: float, presliding_contraction: float
) -> tuple[float, float, float, float, float]:
    """Divide a dead band over four Maxwell-slip elements of equal stiffness k.

    Element i slips at i/4 of the pre-sliding contraction s, W_i = k s i/4, and together the four make
    up the dead band Q = Σ W_i: k = Q/(2.5 s), W_i = i Q/10. From rest the friction rises through
    0.4, 0.7, 0.9 and 1 of Q at 1/4, 2/4, 3/4 and 4/4 of s, straight in between.

    Parameters
    ----------
    dead_band : Q [Pa]
    presliding_contraction : s [-], above zero; the travel from rest until all four slip

    Returns
    -------
    (k [Pa per unit of κ], W_1, W_2, W_3, W_4 [Pa])
    """
    first, second, third, fourth = ELEMENT_SHARES
    stiffness = 4.0 * first * dead_band / presliding_contraction
    return stiffness, first * dead_band, second * dead_band, third * dead_band, fourth * dead_band


@register_jitable
def _slip(pressure: float, travel: float, limit: float) -> tuple[float, float]:
    """Pressure of one element after `travel` = k Δκ [Pa], and 1 if it sticks, 0 if it slips."""
    moved = pressure + travel
    if moved >= limit:
        return limit, 0.0
    if moved <= -limit:
        return -limit, 0.0
    return moved + 0.0 * limit, 1.0  # a NaN, also one of the limit, comes out here


@register_jitable
def maxwell_slip_rates(
    contraction_rate: float,
    q1: float,
    q2: float,
    q3: float,
    q4: float,
    stiffness: float,
    dead_band: float,
    timestep: float,
) -> tuple[float, float, float, float]:
    """Rates of four Maxwell-slip elements, such that an Euler step of h is exact: q_i → q_i + h q̇_i.

    q_i ← clamp(q_i + k κ̇ h, ±W_i): springs in series with sliding blocks, all side by side. Exact for
    a κ̇ that is constant over the step, whatever the step; rate-independent, with non-local memory
    (a closed minor loop leaves no trace) and Masing's rule (a branch after a turning point is the
    virgin curve at twice its size).

    Parameters
    ----------
    contraction_rate : κ̇ [1/s]
    q1, q2, q3, q4 : friction pressures of the elements, the states [Pa]; 0 is a muscle never moved
    stiffness, dead_band : k [Pa per unit of κ] from `maxwell_slip_elements`, Q [Pa]
    timestep : h [s]

    Returns
    -------
    (q̇1, q̇2, q̇3, q̇4) [Pa/s]

    Source
    ------
    Vo-Minh, Tjahjowidodo, Ramon & Van Brussel 2011, IEEE/ASME Trans. Mechatronics 16(1): N = 4. Pressure
    units and the division of the dead band are this project's.
    """
    travel = stiffness * (contraction_rate * timestep)
    return (
        (_slip(q1, travel, ELEMENT_SHARES[0] * dead_band)[0] - q1) / timestep,
        (_slip(q2, travel, ELEMENT_SHARES[1] * dead_band)[0] - q2) / timestep,
        (_slip(q3, travel, ELEMENT_SHARES[2] * dead_band)[0] - q3) / timestep,
        (_slip(q4, travel, ELEMENT_SHARES[3] * dead_band)[0] - q4) / timestep,
    )


@register_jitable
def maxwell_slip_pressure(
    contraction_rate: float,
    q1: float,
    q2: float,
    q3: float,
    q4: float,
    stiffness: float,
    dead_band: float,
    timestep: float,
) -> tuple[float, float]:
    """Friction pressure of four Maxwell-slip elements at the end of a step, q = Σ q_i.

    Over any path and with any steps Σ q Δκ is at least what the springs have stored: at a constant
    |∂F_static/∂p| friction never gives energy that it was not given.

    Parameters
    ----------
    contraction_rate, q1, q2, q3, q4, stiffness, dead_band, timestep : as in `maxwell_slip_rates`

    Returns
    -------
    (q [Pa], its derivative by κ̇ [Pa·s]) : the derivative is k h for each element that sticks.
    """
    travel = stiffness * (contraction_rate * timestep)
    p1, stuck1 = _slip(q1, travel, ELEMENT_SHARES[0] * dead_band)
    p2, stuck2 = _slip(q2, travel, ELEMENT_SHARES[1] * dead_band)
    p3, stuck3 = _slip(q3, travel, ELEMENT_SHARES[2] * dead_band)
    p4, stuck4 = _slip(q4, travel, ELEMENT_SHARES[3] * dead_band)
    return p1 + p2 + p3 + p4, (stuck1 + stuck2 + stuck3 + stuck4) * stiffness * timestep


PARAMETERS = (
    DEAD_BAND,
    LawParameter(
        "presliding_contraction", "s", "", 1e-5, 0.3, "contraction from rest to full friction", (0.01, 0.03)
    ),
)

VO_MINH_2011 = Friction(
    name="vo_minh_2011",
    native_id=2,
    unit="Pa",
    n_state=4,
    sticks=True,
    parameters=PARAMETERS,
    coefficients=lambda braid, q: (
        maxwell_slip_elements(q["dead_band"], q["presliding_contraction"])[0],
        q["dead_band"],
    ),
    kernel=maxwell_slip_pressure,
    rate_kernel=maxwell_slip_rates,
    formula="q = Σ q_i, q_i ← clamp(q_i + k Δκ, ±W_i), four elements of one stiffness (Maxwell-slip)",
    validity="rate-independent, holds at rest; "
    "Q about 0.16 bar for a Festo Ø10, to 0.45 bar with much rubber",
    source="Vo-Minh, Tjahjowidodo, Ramon & Van Brussel 2011; in pressure units here",
)
