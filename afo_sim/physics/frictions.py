"""The registry FRICTIONS of friction models: name, kernels, native id, parameters, source."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from afo_sim.physics.friction import (
    bouc_wen_pressure,
    bouc_wen_rate,
    hunt_dead_band,
    maxwell_slip_elements,
    maxwell_slip_pressure,
    maxwell_slip_rates,
    tondu_lopez_friction,
)
from afo_sim.physics.law import Braid, LawParameter

MAX_FRICTION_COEFFICIENTS = 7
State = Sequence[float]
Coefficients = tuple[float, ...]


@dataclass(frozen=True)
class Friction:
    """A friction model: what its kernel needs, in one form for all of them.

    evaluate : (κ, κ̇, p, state, coefficients, h) → (friction [unit], its derivative by κ̇ [unit·s])
    rates : (κ̇, state, coefficients, h) → rates of the n_state states [Pa/s]
    coefficients : (braid, parameters) → what the kernels take after the muscle's own variables
    unit : "N", a force; "Pa", a pressure, to be multiplied by |∂F_static/∂p|
    native_id : from 1; 0 is no friction
    """

    name: str
    native_id: int
    n_state: int
    unit: str
    parameters: tuple[LawParameter, ...]
    coefficients: Callable[[Braid, Mapping[str, float]], Coefficients]
    evaluate: Callable[[float, float, float, State, Coefficients, float], tuple[float, float]]
    rates: Callable[[float, State, Coefficients, float], tuple[float, ...]]
    formula: str
    validity: str
    source: str


_FS = LawParameter("static_coefficient", "f_s", "", 0.0, 1.0, "friction coefficient at rest; 0.015 published")
_FK = LawParameter("kinetic_coefficient", "f_k", "", 0.0, 1.0, "the same at high speed; 0.105 published")
_VS = LawParameter("stribeck_velocity", "v_s", "m/s", 1e-3, 10.0, "from rest to speed; 0.15 published")
_VR = LawParameter("creep_velocity", "v_r", "m/s", 1e-7, 0.1, "speed at which friction is 76 % there")
_RR = LawParameter("creep_rate", "κ̇_r", "s^-1", 1e-6, 1.0, "contraction rate at which friction is 76 % there")
_Q = LawParameter("dead_band", "Q", "Pa", 0.0, 2e5, "half the hysteresis loop's width in pressure")
_S4 = LawParameter("presliding_contraction", "s", "", 1e-5, 0.3, "contraction from rest to full friction")
_S63 = LawParameter("presliding_contraction", "s", "", 1e-5, 0.3, "contraction from rest to 63 % of friction")

FRICTIONS = {
    friction.name: friction
    for friction in (
        Friction(
            "tondu_lopez_2000_stribeck",
            1,
            0,
            "N",
            (_FS, _FK, _VS, _VR),
            lambda braid, q: (
                braid.nominal_length,
                braid.nominal_radius,
                braid.b,
                q["static_coefficient"],
                q["kinetic_coefficient"],
                q["stribeck_velocity"],
                q["creep_velocity"],
            ),
            lambda kappa, rate, pressure, _, c, h: tondu_lopez_friction(kappa, rate, pressure, *c),
            lambda rate, _, c, h: (),
            "F = [f_k + (f_s − f_k) e^(−|v|/v_s)] S p tanh(v/v_r), v = L0 κ̇, S = 2π r0 L0 sin 2α0/sin 2α",
            "hand-made braid; no force at rest, so a held muscle creeps; grows with the muscle's length",
            "Tondu & Lopez 2000",
        ),
        Friction(
            "vo_minh_2011",
            2,
            4,
            "Pa",
            (_Q, _S4),
            lambda braid, q: (
                maxwell_slip_elements(q["dead_band"], q["presliding_contraction"])[0],
                q["dead_band"],
            ),
            lambda kappa, rate, pressure, z, c, h: maxwell_slip_pressure(rate, z[0], z[1], z[2], z[3], *c, h),
            lambda rate, z, c, h: maxwell_slip_rates(rate, z[0], z[1], z[2], z[3], *c, h),
            "q = Σ q_i, q_i ← clamp(q_i + k Δκ, ±W_i), four elements of one stiffness (Maxwell-slip)",
            "rate-independent, holds at rest; Q about 0.16 bar for a Festo Ø10, to 0.45 bar with much rubber",
            "Vo-Minh, Tjahjowidodo, Ramon & Van Brussel 2011; in pressure units here",
        ),
        Friction(
            "hunt_2017",
            3,
            0,
            "Pa",
            (_Q, _RR),
            lambda braid, q: (q["dead_band"], q["creep_rate"]),
            lambda kappa, rate, pressure, _, c, h: hunt_dead_band(rate, *c),
            lambda rate, _, c, h: (),
            "q = Q tanh(κ̇/κ̇_r)",
            "Festo Ø10, Q = 15.6 kPa; no force at rest, so a held muscle creeps",
            "Hunt, Graber-Tilton & Quinn 2017",
        ),
        Friction(
            "bouc_wen_1976",
            4,
            1,
            "Pa",
            (_Q, _S63),
            lambda braid, q: (q["dead_band"], q["presliding_contraction"]),
            lambda kappa, rate, pressure, z, c, h: bouc_wen_pressure(rate, z[0], *c, h),
            lambda rate, z, c, h: (bouc_wen_rate(rate, z[0], *c, h),),
            "ż = (Q κ̇ − |κ̇| z/2 − κ̇ |z|/2)/s, q = z",
            "rate-independent, holds at rest; smooth, but minor loops do not close",
            "Wen 1976, after Bouc 1967; in pressure units here",
        ),
    )
}
