"""The static part of the three-element model: Reynolds et al. 2003, Serres et al. 2009."""

from afo_sim.physics.law import Law, LawParameter, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def three_element(
    contraction: float, pressure: float, nominal_length: float, f0: float, f1: float, switch_pressure: float,
    k0: float, k1: float, k2: float, k3: float,
) -> Slopes:  # fmt: skip
    """Static part of the three-element model: F = F_ce(p) − K(p) x, with x = κ L0.

    F_ce = f0 + f1 p; K = k0 + k1 p below the switch pressure and k2 + k3 p from there.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length : L0 [m]
    f0, f1 : [N, N/Pa]
    switch_pressure : [Pa]
    k0, k1, k2, k3 : [N/m, N/(m·Pa), N/m, N/(m·Pa)]

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Reynolds et al. 2003, Ann. Biomed. Eng. 31, doi 10.1114/1.1554921; S0.
    """
    stiffness, by = (k0 + k1 * pressure, k1) if pressure < switch_pressure else (k2 + k3 * pressure, k3)
    if stiffness < 0.0:
        stiffness = by = 0.0
    unknown = 0.0 * (switch_pressure + k0 + k1 + k2 + k3)  # a NaN stays one
    force = f0 + f1 * pressure - stiffness * nominal_length * contraction + unknown
    return force, -stiffness * nominal_length, f1 - by * nominal_length * contraction


LINES = (
    LawParameter("f0", "f0", "N", -1e4, 1e4, "of F_ce = f0 + f1 p", (-200.0, 200.0)),
    LawParameter("f1", "f1", "N/Pa", 0.0, 1.0, "of F_ce", (1e-3, 3e-3)),
    LawParameter("k0", "k0", "N/m", -1e6, 1e6, "of K = k0 + k1 p", (2000.0, 8000.0)),
    LawParameter("k1", "k1", "N/(m*Pa)", -1.0, 1.0, "of K", (0.01, 0.04)),
)
SECOND_LINES = (
    LawParameter("switch_pressure", "p_s", "Pa", 1e4, 2e6, "where K changes", (3e5, 3e5), 314e3),
    LawParameter("k2", "k2", "N/m", -1e6, 1e6, "of K = k2 + k3 p above p_s", (2000.0, 8000.0)),
    LawParameter("k3", "k3", "N/(m*Pa)", -1.0, 1.0, "of K above p_s", (0.01, 0.04)),
)

REYNOLDS_2003 = Law(
    name="reynolds_2003",
    native_id=10,
    kernel=three_element,
    parameters=LINES,
    coefficients=lambda braid, q: (
        braid.nominal_length,
        *(q["f0"], q["f1"], 0.0, q["k0"], q["k1"], q["k0"], q["k1"]),
    ),
    fitted=without_default(LINES),
    formula="F_ce(p) − K(p) x, F_ce = f0 + f1 p, K = k0 + k1 p, x = κ L0",
    pressure_range=(206.8e3, 620.5e3),
    contraction_range=(0.0, 0.25),
    validity="one muscle; its length is not given",
    source="Reynolds et al. 2003; S0",
    force_powers=(0.0, 1.0, 1.0, 0.0, *[1.0] * 4),
    length="one",
)

SERRES_2009 = Law(
    name="serres_2009",
    native_id=10,
    kernel=three_element,
    parameters=(*LINES, *SECOND_LINES),
    coefficients=lambda braid, q: (
        braid.nominal_length,
        *(q[name] for name in ("f0", "f1", "switch_pressure", "k0", "k1", "k2", "k3")),
    ),
    fitted=without_default((*LINES, *SECOND_LINES)),
    formula="F_ce(p) − K(p) x, K with one kink",
    pressure_range=(150e3, 550e3),
    contraction_range=(0.0, 0.25),
    validity="one muscle; its make and length are not in the abstract",
    source="Serres et al. 2009",
    force_powers=(0.0, 1.0, 1.0, 0.0, *[1.0] * 4),
    length="one",
)
