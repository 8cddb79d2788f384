"""The law of a braid with tapered ends, Tondu & Lopez 2000, without and with a rubber bladder."""

import math

from afo_sim.physics.law import Law, LawParameter, radial
from afo_sim.physics.law_slope import Slopes, slopes_of, with_slopes


@with_slopes
def tondu_lopez_2000(
    contraction: float, pressure: float, nominal_radius: float, b: float, k: float
) -> Slopes:
    """Braid with tapered ends: F = π r0² p [a (1 − k κ)² − b], with a = 3 (b − 1).

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_radius : r0 [m]
    b : 1/sin²α0 [-]
    k : end correction [-]; 1 is a cylinder, more lowers the maximum contraction

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Tondu & Lopez 2000, IEEE Control Syst. 20(2), doi 10.1109/37.833638; S1, "Hill spring force".
    """
    x = 1.0 - k * contraction
    if x < 0.0:  # the parabola would rise again
        x = 0.0
    area, bracket = math.pi * nominal_radius * nominal_radius, 3.0 * (b - 1.0) * x * x - b
    return area * pressure * bracket, -area * pressure * 6.0 * (b - 1.0) * x * k, area * bracket


_braid = slopes_of(tondu_lopez_2000)


@with_slopes
def tondu_lopez_2000_bladder(
    contraction: float, pressure: float, nominal_radius: float, b: float, k: float, bladder_force: float,
    bladder_stiffness: float,
) -> Slopes:  # fmt: skip
    """Tondu–Lopez less what the rubber bladder takes: F = F_TL − F0 − K_b κ.

    Parameters
    ----------
    contraction, pressure, nominal_radius, b, k : as in `tondu_lopez_2000`
    bladder_force : F0 [N], what it takes to bring the bladder to the braid
    bladder_stiffness : K_b [N] per unit of contraction

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    The bladder terms are this project's, derived from S1's tables I and II; not published.
    """
    braid, by_contraction, by_pressure = _braid(contraction, pressure, nominal_radius, b, k)
    force = braid - bladder_force - bladder_stiffness * contraction
    return force, by_contraction - bladder_stiffness, by_pressure


K = LawParameter("k", "k", "", 0.5, 3.0, "end correction; 1 is a cylinder", (0.8, 1.8), 1.0)
BLADDER_FORCE = LawParameter(
    "bladder_force", "F0", "N", 0.0, 5000.0, "force taken by the bladder at κ = 0", (0.0, 200.0)
)
BLADDER_STIFFNESS = LawParameter(
    "bladder_stiffness", "K_b", "N", 0.0, 5e4, "bladder force per contraction", (0.0, 1000.0)
)

TONDU_LOPEZ_2000 = Law(
    name="tondu_lopez_2000",
    native_id=1,
    kernel=tondu_lopez_2000,
    parameters=(K,),
    coefficients=radial("k"),
    fitted=("braid_angle", "k"),
    formula="π r0² p [a (1 − k κ)² − b]",
    pressure_range=(1e5, 8e5),
    contraction_range=(0.0, 0.4),
    validity="force proportional to pressure; no bladder",
    source="Tondu & Lopez 2000; S1",
    braids=True,
    force_powers=(0.5, 0.0, 0.0),
)

TONDU_LOPEZ_2000_BLADDER = Law(
    name="tondu_lopez_2000_bladder",
    native_id=2,
    kernel=tondu_lopez_2000_bladder,
    parameters=(K, BLADDER_FORCE, BLADDER_STIFFNESS),
    coefficients=radial("k", "bladder_force", "bladder_stiffness"),
    fitted=("braid_angle", "bladder_force", "bladder_stiffness"),
    formula="π r0² p [a (1 − k κ)² − b] − F0 − K_b κ",
    pressure_range=(1e5, 8e5),
    contraction_range=(0.0, 0.4),
    validity="hand-made muscle with a rubber bladder",
    source="Tondu & Lopez 2000, bladder terms derived here",
    braids=True,
    force_powers=(0.5, 0.0, 0.0, 1.0, 1.0),
    rubber=True,
)
