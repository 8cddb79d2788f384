"""The maximum-force approximation, Piteľ & Tóthová 2016."""

from afo_sim.physics.guards import SPAN, descending
from afo_sim.physics.law import CHARACTERISTIC, Law, LawParameter, plain, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def maximum_force(
    contraction: float, pressure: float, maximum_pressure: float, b0: float, b1: float, b2: float, b3: float,
    b4: float, a0: float, a1: float, a2: float,
) -> Slopes:  # fmt: skip
    """Maximum-force approximation: F = F_max(κ) − (p_max − p) g(κ).

    F_max = b0 + b1 κ + b2 κ² + b3 κ³ + b4 κ⁴ is the force at p_max, g = a0 + a1 κ + a2 κ² its slope
    by pressure.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    maximum_pressure : p_max [Pa]
    b0…b4 : [N]
    a0, a1, a2 : [N/Pa]

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Piteľ & Tóthová 2016 (S2), eq. 8–9, doi 10.1051/matecconf/20167602015. The bracket g cannot be
    recovered from the text; this form is derived here: on the maker's characteristics ∂F/∂p is
    independent of p and a parabola in κ.
    """
    missing = maximum_pressure - pressure
    q = (b0 - missing * a0, b1 - missing * a1, b2 - missing * a2, b3, b4, 0.0)
    return descending(contraction, SPAN, q, (a0, a1, a2, 0.0, 0.0, 0.0))


B = ((500.0, 2000.0), (-6000.0, -3000.0), (0.0, 1e4), (-1e4, 0.0), (0.0, 1e4))  # where fits start
A = ((5e-4, 3e-3), (-1e-3, 0.0), (-1e-3, 0.0))
PARAMETERS = (
    LawParameter(
        "maximum_pressure", "p_max", "Pa", 1e4, 2e6, "pressure that F_max belongs to", (6e5, 6e5), 6e5
    ),
    *(
        LawParameter(f"b{i}", f"b{i}", "N", -1e8, 1e8, f"of F_max, by κ^{i}", start)
        for i, start in enumerate(B)
    ),
    *(
        LawParameter(f"a{i}", f"a{i}", "N/Pa", -1.0, 1.0, f"of the slope by pressure, by κ^{i}", start)
        for i, start in enumerate(A)
    ),
)

MAXIMUM_FORCE = Law(
    name="maximum_force",
    native_id=4,
    kernel=maximum_force,
    parameters=PARAMETERS,
    coefficients=plain(PARAMETERS),
    fitted=without_default(PARAMETERS),
    formula="F_max(κ) − (p_max − p) (a0 + a1 κ + a2 κ²)",
    pressure_range=CHARACTERISTIC,
    contraction_range=(0.0, 0.25),
    validity="one muscle; the slope's form is derived here, the paper's is not recoverable",
    source="Piteľ & Tóthová 2016, S2 eq. 8–9",
    force_powers=(0.0, *[1.0] * 8),
)
