"""Friction and hysteresis beside any static force law, as kernels; `frictions` is their registry.

    F = F_static − F_friction

F_friction is positive while the muscle contracts (κ rises), so that it pulls with less force while
contracting than while extending. Some models give a force; those in pressure units give a friction
pressure q, and F_friction = q |∂F_static/∂p|: as if the muscle contracted at p − q. The models with a
memory say how far κ must travel to turn the friction over, those without only how fast it must travel.

Each kernel also gives the derivative by κ̇, for whoever integrates friction implicitly: a friction that
turns over within a few micrometres is far too stiff to be integrated explicitly. For the same reason a
model with a memory gives its pressure at the *end* of the step: taken at its start, the elastic part of
friction would feed energy into the joint at every step.

Symbols: κ contraction ratio [-], κ̇ contraction rate [1/s], p gauge pressure [Pa], h time step [s],
L0, r0 nominal length and radius [m], α0 braid angle at rest [rad], b = 1/sin²α0.
"""

import math

from numba.extending import register_jitable

SURFACE_LIMIT = 2.0  # largest contact surface, over that at rest [-]: beyond what a muscle can reach
ELEMENT_SHARES = (0.1, 0.2, 0.3, 0.4)  # of the dead band, for each element of the Maxwell-slip model


@register_jitable
def contact_surface(contraction: float, nominal_length: float, nominal_radius: float, b: float) -> float:
    """Surface over which the threads of a braid lie on each other.

    S = 2π r0 L0 sin α0/[(1 − κ) √(1 − cos²α0 (1 − κ)²)] = 2π r0 L0 · sin 2α0/sin 2α

    Two threads of width d that cross at 2α share a rhombus of area d²/sin 2α, and the number of
    crossings never changes; the scale takes the whole mantle of the resting braid, 2π r0 L0, as
    contact. So S falls as the muscle contracts, down to a braid angle of 45° (there the mantle, which
    goes with sin 2α, is largest), and rises again beyond.

    The formula is infinite where the threads lie along each other: as the braid locks (α = 0) and at
    no length (α = 90°). It is held at `SURFACE_LIMIT` times the rest value there, on both sides.
    From rest to 54.74°, where every ideal muscle slackens, no braid exceeds 1.061 of it.

    Parameters
    ----------
    contraction : κ [-]
    nominal_length, nominal_radius : L0, r0 [m]
    b : 1/sin²α0 [-], above 1

    Returns
    -------
    float : S [m²]

    Source
    ------
    Tondu & Lopez 2000, IEEE Control Syst. 20(2), doi 10.1109/37.833638; the rhombi are derived here.
    """
    x = 1.0 - contraction
    if x < 0.0:  # there is no shorter muscle than none
        x = 0.0
    square = x * x * (b - (b - 1.0) * x * x)  # (sin 2α/sin 2α0)²
    if square < 1.0 / (SURFACE_LIMIT * SURFACE_LIMIT):
        square = 1.0 / (SURFACE_LIMIT * SURFACE_LIMIT)
    return 2.0 * math.pi * nominal_radius * nominal_length / math.sqrt(square)


@register_jitable
def tondu_lopez_friction(
    contraction: float,
    contraction_rate: float,
    pressure: float,
    nominal_length: float,
    nominal_radius: float,
    b: float,
    static_coefficient: float,
    kinetic_coefficient: float,
    stribeck_velocity: float,
    creep_velocity: float,
) -> tuple[float, float]:
    """Dry friction of thread on thread: F = μ(v) S p sgn v, with μ = f_k + (f_s − f_k) e^(−|v|/v_s).

    v = L0 κ̇ is the shortening velocity of the whole muscle. sgn v is smoothed to tanh(v/v_r): a
    muscle that holds a load creeps, at most at about v_r, so v_r × holding time must be small.

    μ is an *effective* coefficient. S p is the normal force of all crossings, and μ S p would be the
    friction if the threads slid past each other at v; in fact they turn about each other. Hence also
    a friction force that grows with L0, while the muscle's force does not. The published values have
    f_s < f_k: friction rises with speed and dF/dκ̇ ≥ 0. With f_s > f_k (a true Stribeck curve) the
    derivative is negative over part of the way.

    Parameters
    ----------
    contraction, contraction_rate : κ [-], κ̇ [1/s]
    pressure : p, gauge [Pa]; below zero the bladder has left the braid and there is no friction
    nominal_length, nominal_radius, b : as in `contact_surface`
    static_coefficient, kinetic_coefficient : f_s, f_k [-]; 0.015, 0.105 published
    stribeck_velocity : v_s [m/s], above zero; 0.15 published
    creep_velocity : v_r [m/s], above zero

    Returns
    -------
    (friction force [N], its derivative by κ̇ [N·s])

    Source
    ------
    Tondu & Lopez 2000, IEEE Control Syst. 20(2), doi 10.1109/37.833638. Code in circulation has
    e^(+v/v_s), which grows without bound in one direction of motion.
    """
    if pressure < 0.0:
        pressure = 0.0
    velocity = nominal_length * contraction_rate
    sign = math.tanh(velocity / creep_velocity)
    fading = (static_coefficient - kinetic_coefficient) * math.exp(-abs(velocity) / stribeck_velocity)
    coefficient = kinetic_coefficient + fading
    slope = coefficient * (1.0 - sign * sign) / creep_velocity - fading / stribeck_velocity * abs(sign)
    normal_force = contact_surface(contraction, nominal_length, nominal_radius, b) * pressure
    return normal_force * coefficient * sign, normal_force * slope * nominal_length


@register_jitable
def hunt_dead_band(contraction_rate: float, dead_band: float, creep_rate: float) -> tuple[float, float]:
    """Coulomb friction in pressure units: q = Q sgn κ̇, smoothed to Q tanh(κ̇/κ̇_r).

    A muscle that holds a load creeps, at most at about κ̇_r.

    Parameters
    ----------
    contraction_rate : κ̇ [1/s]
    dead_band : Q, half the width of the hysteresis loop [Pa]
    creep_rate : κ̇_r [1/s], above zero

    Returns
    -------
    (friction pressure q [Pa], its derivative by κ̇ [Pa·s])

    Source
    ------
    Hunt, Graber-Tilton & Quinn 2017, Modeling length effects of braided pneumatic actuators, ASME
    IDETC, V05AT08A008: P = … + 15.6 kPa · S, S = +1 shortening, −1 lengthening, 0 static.
    """
    sign = math.tanh(contraction_rate / creep_rate)
    return dead_band * sign, dead_band * (1.0 - sign * sign) / creep_rate


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
