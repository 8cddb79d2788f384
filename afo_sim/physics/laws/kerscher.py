"""The braid's law with two empirical corrections, Kerscher et al. 2006."""

import math

from afo_sim.physics.guards import BAR, STEEPEST, bounded_exp
from afo_sim.physics.law import CHARACTERISTIC, Law, LawParameter, radial, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def kerscher_2006(
    contraction: float, pressure: float, nominal_radius: float, b: float, a_epsilon: float, b_epsilon: float,
    a_kappa: float, b_kappa: float, c_kappa: float,
) -> Slopes:  # fmt: skip
    """Braid with two corrections: F = μ(κ) π r0² p [a (1 − ε(p) κ)² − b].

    μ = a_κ e^(−c_κ κ) − b_κ, ε = a_ε e^(−p) − b_ε with p in bar, a = 3 (b − 1). Beyond the zero,
    where the muscle is slack, μ is left out: it would let the force rise again.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_radius : r0 [m]
    b : 1/sin²α0 [-]
    a_epsilon, b_epsilon, a_kappa, b_kappa, c_kappa : [-]; b_ε and b_κ come out negative in every fit

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Kerscher et al. 2006, in the form of Piteľ & Tóthová 2016 (S2), eq. 3–7, whose minus signs are kept.
    """
    falls = bounded_exp(-pressure / BAR)
    epsilon, epsilon_by = a_epsilon * falls - b_epsilon, -a_epsilon * min(falls, STEEPEST) / BAR
    x = 1.0 - epsilon * contraction
    if x < 0.0:
        x = 0.0
    area, bracket = math.pi * nominal_radius * nominal_radius, 3.0 * (b - 1.0) * x * x - b
    force, by_x = area * pressure * bracket, area * pressure * 6.0 * (b - 1.0) * x
    by_contraction, by_pressure = -by_x * epsilon, area * bracket - by_x * contraction * epsilon_by
    more = bounded_exp(-c_kappa * contraction)
    mu = a_kappa * more - b_kappa
    if force <= 0.0:
        return force + 0.0 * mu, by_contraction, by_pressure  # a NaN stays one
    mu_by = -a_kappa * c_kappa * min(more, STEEPEST)
    return mu * force, mu * by_contraction + mu_by * force, mu * by_pressure


PARAMETERS = (
    LawParameter("a_epsilon", "a_ε", "", 0.0, 500.0, "of ε(p) = a_ε e^(−p/bar) − b_ε", (1.0, 40.0)),
    LawParameter("b_epsilon", "b_ε", "", -10.0, 0.0, "of ε(p)", (-2.0, -0.8)),
    LawParameter("a_kappa", "a_κ", "", 0.0, 10.0, "of μ(κ) = a_κ e^(−c_κ κ) − b_κ", (0.02, 0.4)),
    LawParameter("b_kappa", "b_κ", "", -10.0, 0.0, "of μ(κ)", (-1.3, -0.6)),
    LawParameter("c_kappa", "c_κ", "", 0.1, 1000.0, "of μ(κ)", (20.0, 100.0)),
)

KERSCHER_2006 = Law(
    name="kerscher_2006",
    native_id=3,
    kernel=kerscher_2006,
    parameters=PARAMETERS,
    coefficients=radial(*(p.name for p in PARAMETERS)),
    fitted=without_default(PARAMETERS),
    formula="μ(κ) π r0² p [a (1 − ε(p) κ)² − b]",
    pressure_range=CHARACTERISTIC,
    contraction_range=(0.0, 0.25),
    validity="fluidic muscle; c_κ is hardly identifiable",
    source="Kerscher et al. 2006; S2 eq. 3–7",
    force_powers=(0.5, *[0.0] * 6),
)
