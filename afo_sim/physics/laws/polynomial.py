"""A polynomial of fifth order in contraction and pressure, Piteľ & Tóthová 2016."""

from afo_sim.physics.guards import BAR, SPAN, descending
from afo_sim.physics.law import CHARACTERISTIC, Law, LawParameter, plain, without_default
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def polynomial(contraction: float, pressure: float, *a: float) -> Slopes:
    """Polynomial of fifth order: F = Σ a_ij x^i y^j over i + j ≤ 5, with x = 10 κ and y = p/(6 bar).

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    a : 21 coefficients a00, a01, …, a05, a10, …, a50 [N]

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Piteľ & Tóthová 2016 (S2), eq. 11; scaled here, so that the coefficients are of one size.
    """
    y = pressure / (6.0 * BAR)
    q0 = a[0] + y * (a[1] + y * (a[2] + y * (a[3] + y * (a[4] + y * a[5]))))
    q1 = a[6] + y * (a[7] + y * (a[8] + y * (a[9] + y * a[10])))
    q2 = a[11] + y * (a[12] + y * (a[13] + y * a[14]))
    q3 = a[15] + y * (a[16] + y * a[17])
    q4 = a[18] + y * a[19]
    by0 = a[1] + y * (2.0 * a[2] + y * (3.0 * a[3] + y * (4.0 * a[4] + y * 5.0 * a[5])))
    by1 = a[7] + y * (2.0 * a[8] + y * (3.0 * a[9] + y * 4.0 * a[10]))
    by2 = a[12] + y * (2.0 * a[13] + y * 3.0 * a[14])
    by = (by0, by1, by2, a[16] + y * 2.0 * a[17], a[19], 0.0)
    force, by_x, by_y = descending(10.0 * contraction, 10.0 * SPAN, (q0, q1, q2, q3, q4, a[20]), by)
    return force, 10.0 * by_x, by_y / (6.0 * BAR)


START = {(0, 1): (500.0, 1500.0), (1, 0): (-1500.0, -500.0)}  # where fits start; (−30, 30) elsewhere
PARAMETERS = tuple(
    LawParameter(
        f"a{i}{j}",
        f"a{i}{j}",
        "N",
        -1e7,
        1e7,
        f"by (10 κ)^{i} (p/6 bar)^{j}",
        START.get((i, j), (-30.0, 30.0)),
    )
    for i in range(6)
    for j in range(6 - i)
)

POLYNOMIAL = Law(
    name="polynomial",
    native_id=6,
    kernel=polynomial,
    parameters=PARAMETERS,
    coefficients=plain(PARAMETERS),
    fitted=without_default(PARAMETERS),
    formula="Σ a_ij (10 κ)^i (p/6 bar)^j, i + j ≤ 5",
    pressure_range=CHARACTERISTIC,
    contraction_range=(0.0, 0.25),
    validity="one muscle, nowhere beyond its measured range; 21 coefficients want many points",
    source="Piteľ & Tóthová 2016, S2 eq. 11",
    force_powers=(1.0,) * 21,
)
