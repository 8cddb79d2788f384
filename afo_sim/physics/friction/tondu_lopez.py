"""Dry friction of thread on thread, Tondu & Lopez 2000."""

import math

from afo_sim.physics.friction.law import Friction
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Braid, LawParameter, Values

SURFACE_LIMIT = 2.0  # largest contact surface, over that at rest [-]: beyond what a muscle can reach


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
    contraction: float, contraction_rate: float, pressure: float, nominal_length: float,
    nominal_radius: float, b: float, static_coefficient: float, kinetic_coefficient: float,
    stribeck_velocity: float, creep_velocity: float,
) -> tuple[float, float]:  # fmt: skip
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


PARAMETERS = (
    LawParameter(
        "static_coefficient",
        "f_s",
        "",
        0.0,
        1.0,
        "friction coefficient at rest; 0.015 published",
        (0.01, 0.02),
    ),
    LawParameter(
        "kinetic_coefficient", "f_k", "", 0.0, 1.0, "the same at high speed; 0.105 published", (0.09, 0.12)
    ),
    LawParameter(
        "stribeck_velocity", "v_s", "m/s", 1e-3, 10.0, "from rest to speed; 0.15 published", (0.1, 0.2)
    ),
    LawParameter(
        "creep_velocity", "v_r", "m/s", 1e-7, 0.1, "speed at which friction is 76 % there", (5e-4, 1.5e-3)
    ),
)


def _steepest_fall(braid: Braid, q: Values, pressure: float) -> float:
    """(f_s − f_k)/v_s · S p at rest, where f_s is above f_k [N·s/m]."""
    surface = contact_surface(0.0, braid.nominal_length, braid.nominal_radius, braid.b)
    fall = (q["static_coefficient"] - q["kinetic_coefficient"]) / q["stribeck_velocity"]
    return max(fall, 0.0) * surface * pressure


STRIBECK = Friction(
    name="tondu_lopez_2000_stribeck",
    native_id=1,
    unit="N",
    n_state=0,
    parameters=PARAMETERS,
    coefficients=lambda braid, q: (
        braid.nominal_length,
        braid.nominal_radius,
        braid.b,
        *(q[p.name] for p in PARAMETERS),
    ),
    kernel=tondu_lopez_friction,
    steepest_fall=_steepest_fall,
    formula="F = [f_k + (f_s − f_k) e^(−|v|/v_s)] S p tanh(v/v_r), v = L0 κ̇, S = 2π r0 L0 sin 2α0/sin 2α",
    validity="hand-made braid; no force at rest, so a held muscle creeps; grows with the muscle's length",
    source="Tondu & Lopez 2000",
)
