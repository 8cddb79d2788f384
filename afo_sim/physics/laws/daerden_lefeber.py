"""The law of a pleated muscle, an inelastic membrane of meridians alone, Daerden & Lefeber 2001."""

import functools
import math
from typing import Any

from afo_sim.physics.law import Coefficients, Law, LawParameter
from afo_sim.physics.law_slope import Slopes, with_slopes

FIRST = 0.1  # of the free contraction, below which the force is bounded
POWERS = 5  # of √κ; misses the force by less than 2e-5 of the largest
_FREE = 49  # place of m = 0.5, where nothing pulls


@with_slopes
def daerden_lefeber_2001(
    contraction: float, pressure: float, area: float, first: float, last: float, bend: float, c0: float,
    c1: float, c2: float, c3: float, c4: float, c5: float,
) -> Slopes:  # fmt: skip
    """Pleated membrane: F = p η l² f(κ, R/l), with f = Σ c_i κ^((i − 1)/2) in place of elliptic integrals.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    area : η l² [m²]
    first, last : contractions between which f is that of the membrane; beyond `last` it is a straight line
    bend : f is a parabola below `first`, with this factor on (κ − first)²; it does the membrane's own work
    c0, c1, c2, c3, c4, c5 : of f [-], by `membrane`

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa]); that of the membrane has no bound as κ goes to 0

    Source
    ------
    Derived here from the equilibrium that Daerden & Lefeber 2001 describe, Int. J. Fluid Power 2(3): 41. The
    paper itself could not be read: no number or equation is taken from it.
    """
    kappa = last if contraction > last else contraction if contraction > first else first
    root = math.sqrt(kappa)
    by_root = c1 + root * (2.0 * c2 + root * (3.0 * c3 + root * (4.0 * c4 + root * 5.0 * c5)))
    shape = (c0 + root * (c1 + root * (c2 + root * (c3 + root * (c4 + root * c5))))) / root
    by_kappa = (by_root - shape) / (2.0 * kappa)
    shape += by_kappa * (contraction - kappa) + 0.0 * (first + last + bend)  # a NaN stays one
    if contraction < first:
        shape += bend * (contraction - first) * (contraction - first)
        by_kappa += 2.0 * bend * (contraction - first)
    return pressure * area * shape, pressure * area * by_kappa, area * shape


def _integrals(moduli: Any, end: Any) -> tuple[Any, Any, Any]:
    """∫ dθ/Δ, ∫ (1 − 2 m sin²θ) dθ/Δ and ∫ cos²θ (1 − 2 m sin²θ) dθ/Δ from 0 to each end, at each m."""
    import numpy as np

    nodes, weights = np.polynomial.legendre.leggauss(24)
    square = np.sin(0.5 * end[:, None] * (1.0 + nodes)) ** 2
    weights = 0.5 * end[:, None] * weights / np.sqrt(1.0 - moduli[:, None] * square)
    axial = weights * (1.0 - 2.0 * moduli[:, None] * square)
    return weights.sum(axis=1), axial.sum(axis=1), (axial * (1.0 - square)).sum(axis=1)


@functools.lru_cache(maxsize=256)
def membrane(radius: float) -> Coefficients:
    """Contractions between which f holds, and its coefficients.

    Meridians of length l carry all, N r = const, so that cos φ = (F/(π p) + r²)/(F/(π p) + r_m²). With
    r = r_m cos θ, r_m the largest radius, Δ² = 1 − m sin²θ, m = r_m²/(2 F/(π p) + 2 r_m²), cos Θ = R/r_m:

        I = ∫ dθ/Δ = √m cos Θ l/R    1 − κ = ∫ (1 − 2 m sin²θ) dθ/Δ/I    F = p l² π (½ − m)/I²
        V = l³ π m/I³ ∫ cos²θ (1 − 2 m sin²θ) dθ/Δ    from 0 to Θ

    Parameters
    ----------
    radius : R/l, of the ends over the length of a meridian [-]
    """
    import numpy as np  # a list of all laws asks for none

    moduli = 0.5 * (np.arange(1, 53) / 50.0) ** 2
    low, high = np.zeros_like(moduli), np.full_like(moduli, 0.5 * math.pi)
    for _ in range(50):
        middle = 0.5 * (low + high)
        beyond = radius * _integrals(moduli, middle)[0] > np.sqrt(moduli) * np.cos(middle)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    arc, height, around = _integrals(moduli, low)
    kappa, shape = 1.0 - height / arc, math.pi * (0.5 - moduli) / arc**2
    free = kappa[_FREE].item()
    root, shape = np.sqrt(kappa[kappa >= FIRST * free]), shape[kappa >= FIRST * free]
    found = np.polynomial.polynomial.polyfit(root, root * shape, POWERS).tolist()
    first, rises = FIRST * free, (math.pi * 0.5 * around / arc**3)[_FREE].item() - math.pi * radius**2
    for i, c in enumerate(found):
        rises -= c * 2.0 / (i + 1) * (free ** (0.5 * (i + 1)) - first ** (0.5 * (i + 1)))
    there, slope = daerden_lefeber_2001.slopes(first, 1.0, 1.0, first, free, 0.0, *found)[:2]  # type: ignore[attr-defined]  # of `with_slopes`
    bend = 3.0 * (rises - there * first + 0.5 * slope * first**2) / first**3
    return first, kappa[-1].item(), bend, *found


SHARE = LawParameter("share", "η", "", 0.1, 2.0, "force over that of the ideal membrane", (0.7, 1.1), 1.0)

DAERDEN_LEFEBER_2001 = Law(
    name="daerden_lefeber_2001",
    native_id=11,
    kernel=daerden_lefeber_2001,
    parameters=(SHARE,),
    coefficients=lambda braid, q: (
        q["share"] * braid.nominal_length**2,
        *membrane(braid.nominal_radius / braid.nominal_length),
    ),
    fitted=("share",),
    formula="p η l² f(κ, R/l), R the bore's radius and l the length of a pleat",
    pressure_range=(0.0, 4e5),
    contraction_range=(0.05, 0.45),
    validity="inelastic pleats that unfold without resistance; near κ = 0 a parabola bounds the force",
    source="Daerden & Lefeber 2001",
    force_powers=(1.0, *[0.0] * (POWERS + 4)),
    length="own",
    rubber=True,
    pleated=True,
    count=POWERS + 5,
)
