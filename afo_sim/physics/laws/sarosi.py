"""The exponential law of fluidic muscles, Sárosi 2012."""

from afo_sim.physics.guards import BAR, STEEPEST, bounded_exp
from afo_sim.physics.law import CHARACTERISTIC, Law, LawParameter, plain, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def sarosi_2012(
    contraction: float, pressure: float, a1: float, a2: float, a3: float, a4: float, a5: float, a6: float
) -> Slopes:  # fmt: skip
    """Exponential law: F = (a1 p + a2) e^(a3 κ) + a4 κ p + a5 p + a6, κ in per cent and p in bar.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    a1, a2, a3, a4, a5, a6 : [N/bar, N, 1/%, N/(%·bar), N/bar, N], as they are published

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Sárosi 2012; Piteľ & Tóthová 2016 (S2), eq. 10; grouping of terms as in public code.
    """
    kappa, bar = 100.0 * contraction, pressure / BAR
    weight, weight_by_bar = a1 * bar + a2, a1
    if weight < 0.0:  # at pressures far beyond any muscle's; the exponential would turn over
        weight = weight_by_bar = 0.0
    power = bounded_exp(a3 * kappa)
    force = weight * power + a4 * kappa * bar + a5 * bar + a6
    by_kappa, by_bar = weight * a3 * min(power, STEEPEST) + a4 * bar, weight_by_bar * power + a4 * kappa + a5
    return force, 100.0 * by_kappa, by_bar / BAR


PARAMETERS = (
    LawParameter("a1", "a1", "", -1000.0, 1000.0, "N/bar, before the exponential", (-15.0, 0.0)),
    LawParameter("a2", "a2", "", 0.0, 1e5, "N, before the exponential", (100.0, 400.0)),
    LawParameter("a3", "a3", "", -3.0, -1e-3, "1/%, exponent by contraction", (-0.4, -0.15)),
    LawParameter("a4", "a4", "", -1000.0, 0.0, "N/(%·bar)", (-12.0, -1.0)),
    LawParameter("a5", "a5", "", -1e4, 1e5, "N/bar", (50.0, 350.0)),
    LawParameter("a6", "a6", "", -1e5, 1e5, "N", (-350.0, -100.0)),
)

SAROSI_2012 = Law(
    name="sarosi_2012",
    native_id=5,
    kernel=sarosi_2012,
    parameters=PARAMETERS,
    coefficients=plain(PARAMETERS),
    fitted=without_default(PARAMETERS),
    formula="(a1 p + a2) e^(a3 κ) + a4 κ p + a5 p + a6",
    pressure_range=CHARACTERISTIC,
    contraction_range=(0.0, 0.25),
    validity="one muscle: its numbers do not transfer to another length",
    source="Sárosi 2012; S2 eq. 10",
    force_powers=(1.0, 1.0, 0.0, 1.0, 1.0, 1.0),
)
