"""The braid's law with a free exponent, Takosoglu et al. 2016, constant or by pressure."""

import math

from afo_sim.physics.guards import BAR, STEEPEST, bounded_exp
from afo_sim.physics.law import CHARACTERISTIC, Braid, Coefficients, Law, LawParameter, Values
from afo_sim.physics.law_slope import Slopes, with_slopes

LEAST_PRESSURE = 0.05  # [bar] below which n(p) and a(p) are held


@with_slopes
def takosoglu_2016(
    contraction: float, pressure: float, nominal_radius: float, a0: float, a1: float, b: float, n0: float,
    n1: float,
) -> Slopes:  # fmt: skip
    """Braid with a free exponent: F = π r0² p [a(p) (1 − κ)^n(p) − b], a = a0 + a1/p, n = n0 + n1/p.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]; in bar within a(p) and n(p), where it is held below 0.05 bar
    nominal_radius : r0 [m]
    a0, a1 : [-, bar]; with a1 = 0, a is constant
    b : [-], a free number here
    n0, n1 : [-, bar]; with n1 = 0, n is constant

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Takosoglu et al. 2016 (S3), eq. 5, doi 10.1177/0020294016629176. The paper's own n(p) and a(p) (eq.
    6–9) are lost from its text; 1/p is the form derived here on independent 10 mm characteristics.
    """
    bar, held = pressure / BAR, 0.0
    if bar < LEAST_PRESSURE:
        bar, held = LEAST_PRESSURE, 1.0
    per_bar = (held - 1.0) / (bar * bar * BAR)  # d(1/bar)/dp
    a, n, a_by = a0 + a1 / bar, n0 + n1 / bar, a1 * per_bar
    if a < 0.0:
        a = a_by = 0.0
    x = 1.0 - contraction
    power = 0.0 * (a + n)
    by_x = by_n = 0.0
    if x > 0.0:
        power = bounded_exp(n * math.log(x))
        by_x, by_n = min(power, STEEPEST) * n / x, min(power, STEEPEST) * math.log(x)
    elif x != x:
        power = x
    area = math.pi * nominal_radius * nominal_radius
    by_pressure = area * (a * power - b) + area * pressure * (a_by * power + a * by_n * n1 * per_bar)
    return area * pressure * (a * power - b), -area * pressure * a * by_x, by_pressure


A = LawParameter("a", "a", "", 0.0, 1000.0, "force at no contraction, over π r0² p", (10.0, 25.0))
B = LawParameter("b", "b", "", 0.0, 1000.0, "force lost, over π r0² p", (5.0, 12.0))
A0 = LawParameter("a0", "a0", "", 0.0, 1000.0, "of a(p) = a0 + a1/p", (10.0, 25.0))
A1 = LawParameter("a1", "a1", "", -100.0, 100.0, "bar, of a(p) = a0 + a1/p", (-4.0, 0.0))
N = LawParameter("n", "n", "", 0.1, 200.0, "exponent", (2.0, 10.0))
N0 = LawParameter("n0", "n0", "", 0.0, 200.0, "of n(p) = n0 + n1/p", (0.0, 4.0))
N1 = LawParameter("n1", "n1", "", 0.0, 200.0, "bar, of n(p) = n0 + n1/p", (0.0, 20.0))
DERIVED = "p-dependence derived here; S3's own is lost from its text"


def _law(
    suffix: str, parameters: tuple[LawParameter, ...], formula: str, validity: str, equations: str
) -> Law:
    """One of the three laws of this kernel; a1 or n1 is zero where the law has none."""
    names = tuple(parameter.name for parameter in parameters)

    def coefficients(braid: Braid, q: Values) -> Coefficients:
        a, n = q["a0" if "a0" in names else "a"], q["n0" if "n0" in names else "n"]
        a1, n1 = (q[name] if name in names else 0.0 for name in ("a1", "n1"))
        return braid.nominal_radius, a, a1, q["b"], n, n1

    return Law(
        name=f"takosoglu_2016{suffix}",
        native_id=7,
        kernel=takosoglu_2016,
        parameters=parameters,
        coefficients=coefficients,
        fitted=names,
        formula=formula,
        pressure_range=CHARACTERISTIC,
        contraction_range=(0.0, 0.25),
        validity=validity,
        source=f"Takosoglu et al. 2016, S3 eq. {equations}",
        force_powers=(0.5, *[0.0] * 5),
    )


TAKOSOGLU_2016 = _law("", (A, B, N), "π r0² p [a (1 − κ)^n − b]", "fluidic muscle near one pressure", "5")
TAKOSOGLU_2016_N = _law(
    "_n", (A, B, N0, N1), "π r0² p [a (1 − κ)^n(p) − b], n = n0 + n1/p", f"fluidic muscle; {DERIVED}", "6–7",
)  # fmt: skip
TAKOSOGLU_2016_AN = _law(
    "_an",
    (A0, A1, B, N0, N1),
    "π r0² p [a(p) (1 − κ)^n(p) − b], a = a0 + a1/p, n = n0 + n1/p",
    f"fluidic muscle; {DERIVED}",
    "8–9",
)
