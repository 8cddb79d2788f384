"""The normalised law of fluidic muscles, Bolen et al. 2026."""

import math

from afo_sim.physics.guards import STEEPEST, bounded_exp
from afo_sim.physics.law import Braid, Coefficients, Law, LawParameter, Values, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def bolen_2026(
    contraction: float, pressure: float, force_620: float, contraction_620: float, c0: float, c1: float,
    c2: float,
) -> Slopes:  # fmt: skip
    """Normalised law: F = F620 [c0 (e^(−c1 ε) − 1) + P e^(−c2 ε²)], ε = κ/κ620, P = p/620 kPa.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    force_620 : F620(L0) [N], the force at 620 kPa and no contraction
    contraction_620 : κ620 [-], the contraction at 620 kPa without load
    c0, c1, c2 : [-]

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Bolen, Elzein, Pang & Hunt, Actuators 2026, accepted manuscript.
    """
    x = contraction / contraction_620
    square = x * x if x > 0.0 else 0.0 * x  # a stretched muscle is not weaker
    lost, kept = bounded_exp(-c1 * x), bounded_exp(-c2 * square)
    by_x = -c0 * c1 * min(lost, STEEPEST) - pressure / 620e3 * 2.0 * c2 * max(x, 0.0) * kept
    force = force_620 * (c0 * (lost - 1.0) + pressure / 620e3 * kept)
    return force, force_620 * by_x / contraction_620, force_620 * kept / 620e3


PARAMETERS = (
    LawParameter("c0", "c0", "", 0.0, 10.0, "force lost by contraction, over F620", (0.1, 0.6)),
    LawParameter("c1", "c1", "", 0.0, 100.0, "rate of that loss", (3.0, 11.0)),
    LawParameter("c2", "c2", "", 0.0, 20.0, "of the pressure's force", (0.4, 2.2)),
    LawParameter(
        "contraction_620", "κ620", "", 0.05, 0.5, "contraction at 620 kPa, unloaded", (0.2, 0.3), 0.25
    ),
    LawParameter("f1", "f1", "N", 0.0, 1e5, "of F620 = f1 atan(f2 (L0 − f3))", (200.0, 1500.0)),
    LawParameter("f2", "f2", "m^-1", 0.1, 1e4, "of F620", (15.0, 19.0), 17.0),
    LawParameter("f3", "f3", "m", 0.0, 0.1, "of F620", (0.01, 0.013), 0.01),
)


def _coefficients(braid: Braid, q: Values) -> Coefficients:
    force_620 = q["f1"] * math.atan(q["f2"] * (braid.nominal_length - q["f3"]))
    return force_620, q["contraction_620"], q["c0"], q["c1"], q["c2"]


BOLEN_2026 = Law(
    name="bolen_2026",
    native_id=9,
    kernel=bolen_2026,
    parameters=PARAMETERS,
    coefficients=_coefficients,
    fitted=without_default(PARAMETERS),
    formula="F620(L0) [c0 (e^(−c1 ε) − 1) + P e^(−c2 ε²)], ε = κ/κ620, P = p/620 kPa",
    pressure_range=(0.0, 6.2e5),
    contraction_range=(0.0, 0.28),
    validity="fluidic muscles of 10 mm (11–52 cm) and 20 mm (30–51 cm)",
    source="Bolen et al. 2026",
    force_powers=(1.0, 0.0, 0.0, 0.0, 0.0),
    length="own",
)
