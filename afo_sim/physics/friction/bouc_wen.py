"""The Bouc–Wen model in pressure units, Wen 1976."""

import math

from afo_sim.physics.friction.law import DEAD_BAND, Friction
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import LawParameter


@register_jitable
def bouc_wen_pressure(
    contraction_rate: float, z: float, dead_band: float, presliding_contraction: float, timestep: float
) -> tuple[float, float]:
    """Friction pressure of the Bouc–Wen model at the end of a step: its equation, solved exactly.

    ż = A κ̇ − β |κ̇| z − γ κ̇ |z|, with n = 1, A = Q/s and β = γ = A/(2 Q) = 1/(2 s)

    (A − (β + γ) |z| = 0 at |z| = Q, and β = γ takes the bend out of unloading), which is

    loading, κ̇ z ≥ 0:  z → ±Q exponentially, Q ∓ z falling by e for each s of travel;
    unloading:          z goes straight to zero with slope Q/s, then loads the other way.

    The solution at constant κ̇ depends on the travel alone: rate-independent, stable and within ±Q at
    any step. From rest 63 % of Q is reached at s, where the Maxwell-slip model has reached all of it.
    A small loop within a large one does not close: reloading is softer than unloading was.

    Parameters
    ----------
    contraction_rate : κ̇ [1/s]
    z : friction pressure, the state [Pa]; 0 is a muscle never moved
    dead_band : Q [Pa]
    presliding_contraction : s [-], above zero
    timestep : h [s]

    Returns
    -------
    (z at the end of the step [Pa], its derivative by κ̇ [Pa·s]) : at κ̇ = 0 the one for contracting.

    Source
    ------
    Wen 1976, J. Eng. Mech. Div. ASCE 102(2), doi 10.1061/JMCEA3.0002106, after Bouc 1967. Pressure units
    and the two parameters are this project's.
    """
    travel = contraction_rate * timestep
    sign = 1.0 if travel >= 0.0 else -1.0
    travel = abs(travel)
    ahead = sign * z  # seen along the motion
    if ahead > dead_band:  # no path leads beyond ±Q, but a first state or a changed Q may lie there
        ahead = dead_band
    elif ahead < -dead_band:
        ahead = -dead_band
    slope = dead_band / presliding_contraction * timestep
    if ahead >= 0.0:
        # an increment, so that a muscle at rest keeps its state to the last bit
        reached = ahead - (dead_band - ahead) * math.expm1(-travel / presliding_contraction)
    else:
        straight = ahead + dead_band * travel / presliding_contraction
        if straight <= 0.0:
            return sign * straight, slope
        reached = -dead_band * math.expm1(-straight / dead_band)
    return sign * reached, slope - reached * (timestep / presliding_contraction)


@register_jitable
def bouc_wen_rate(
    contraction_rate: float, z: float, dead_band: float, presliding_contraction: float, timestep: float
) -> float:
    """Rate of the Bouc–Wen state, such that an Euler step of h is exact: z → z + h ż.

    Parameters
    ----------
    contraction_rate, z, dead_band, presliding_contraction, timestep : as in `bouc_wen_pressure`

    Returns
    -------
    float : ż [Pa/s]; as h → 0 the right-hand side of Bouc and Wen's equation
    """
    end = bouc_wen_pressure(contraction_rate, z, dead_band, presliding_contraction, timestep)[0]
    return (end - z) / timestep


PARAMETERS = (
    DEAD_BAND,
    LawParameter(
        "presliding_contraction",
        "s",
        "",
        1e-5,
        0.3,
        "contraction from rest to 63 % of friction",
        (0.01, 0.03),
    ),
)

BOUC_WEN_1976 = Friction(
    name="bouc_wen_1976",
    native_id=4,
    unit="Pa",
    n_state=1,
    parameters=PARAMETERS,
    coefficients=lambda braid, q: (q["dead_band"], q["presliding_contraction"]),
    kernel=bouc_wen_pressure,
    rate_kernel=bouc_wen_rate,
    formula="ż = (Q κ̇ − |κ̇| z/2 − κ̇ |z|/2)/s, q = z",
    validity="rate-independent, holds at rest; smooth, but minor loops do not close",
    source="Wen 1976, after Bouc 1967; in pressure units here",
)
