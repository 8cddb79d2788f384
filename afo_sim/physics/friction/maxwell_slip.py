"""Four Maxwell-slip elements whose springs do not know the pressure and whose blocks do."""

import math

from afo_sim.physics.friction.law import DEAD_BAND, Friction
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Braid, LawParameter

ELEMENT_SHARES = (0.1, 0.2, 0.3, 0.4)  # of the yield force, for each element


def presliding_stiffness(braid: Braid, dead_band: float, presliding_contraction: float) -> float:
    """Stiffness of one of four Maxwell-slip elements [N per unit of κ], K = A0 Q/(2.5 s).

    At rest a braid's force rises by A0 = π r0² (2 b − 3) with its pressure, so that there element i slips at
    i/4 of s, and together the four make up A0 Q: from rest the friction rises through 0.4, 0.7, 0.9 and 1 of
    that at 1/4, 2/4, 3/4 and 4/4 of s, straight in between.

    Parameters
    ----------
    braid : geometry of the muscle
    dead_band : Q [Pa]
    presliding_contraction : s [-], above zero; the travel from rest until all four slip
    """
    area = math.pi * braid.nominal_radius**2 * (2.0 * braid.b - 3.0)
    return 4.0 * ELEMENT_SHARES[0] * area * dead_band / presliding_contraction


@register_jitable
def _slip(force: float, pull: float, limit: float) -> tuple[float, float]:
    """Force of one element after its spring is pulled by `pull` [N], and 1 if it sticks, 0 if it slips."""
    moved = force + pull
    if moved >= limit:
        return limit, 0.0
    if moved <= -limit:
        return -limit, 0.0
    return moved + 0.0 * limit, 1.0  # a NaN, also one of the limit, comes out here


@register_jitable
def maxwell_slip_elements(
    yields: float, travel: float, f1: float, f2: float, f3: float, f4: float, stiffness: float
) -> tuple[float, float, float, float, float]:
    """Forces of four Maxwell-slip elements at the end of a step, and how many of them stick.

    f_i ← clamp(f_i + K Δκ, ±W_i): springs in series with sliding blocks, all side by side. Exact whatever the
    step, as long as κ goes one way in it and W stays; rate-independent, with non-local memory (a closed minor
    loop leaves no trace) and Masing's rule (a branch after a turning point is the virgin curve at twice its
    size). W_i is the share i of the yield force W, which falls with the pressure: a block then slips back and
    turns what its spring has stored into heat. The springs are alike at every pressure. So over any path of κ
    and p, and with any steps, Σ F Δκ is at least what they have stored, Σ f_i²/(2 K): friction never gives
    energy that it was not given.

    Parameters
    ----------
    yields : W, force by which the dead band Q of pressure weakens the muscle now [N], not negative
    travel : Δκ over the step [-]
    f1, f2, f3, f4 : forces of the elements, the states [N]; 0 is a muscle never moved
    stiffness : K [N per unit of κ], `presliding_stiffness`

    Source
    ------
    Vo-Minh, Tjahjowidodo, Ramon & Van Brussel 2011, IEEE/ASME Trans. Mechatronics 16(1): N = 4. That blocks
    feel the pressure and springs do not, and the division of the dead band, are this project's.
    """
    pull = stiffness * travel
    e1, stuck1 = _slip(f1, pull, ELEMENT_SHARES[0] * yields)
    e2, stuck2 = _slip(f2, pull, ELEMENT_SHARES[1] * yields)
    e3, stuck3 = _slip(f3, pull, ELEMENT_SHARES[2] * yields)
    e4, stuck4 = _slip(f4, pull, ELEMENT_SHARES[3] * yields)
    return e1, e2, e3, e4, stuck1 + stuck2 + stuck3 + stuck4


@register_jitable
def maxwell_slip_rates(
    yields: float, travel: float, f1: float, f2: float, f3: float, f4: float, band: float, k: float,
    step: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Rates of the elements [N/s], such that an Euler step is exact; dead band, K and time step last."""
    e1, e2, e3, e4, _ = maxwell_slip_elements(yields, travel, f1, f2, f3, f4, k)
    return (e1 - f1) / step, (e2 - f2) / step, (e3 - f3) / step, (e4 - f4) / step


@register_jitable
def maxwell_slip_force(
    yields: float, travel: float, f1: float, f2: float, f3: float, f4: float, band: float, k: float
) -> tuple[float, float]:
    """F = Σ f_i at the end of a step [N], and its derivative by Δκ [N]; dead band and K last."""
    e1, e2, e3, e4, stuck = maxwell_slip_elements(yields, travel, f1, f2, f3, f4, k)
    return e1 + e2 + e3 + e4, stuck * k


PARAMETERS = (
    DEAD_BAND,
    LawParameter(
        "presliding_contraction", "s", "", 1e-5, 0.3, "contraction from rest to full friction", (0.01, 0.03)
    ),
)

MAXWELL_SLIP = Friction(
    name="maxwell_slip",
    native_id=5,
    unit="Pa",
    n_state=4,
    sticks=True,
    parameters=PARAMETERS,
    coefficients=lambda braid, q: (
        q["dead_band"],
        presliding_stiffness(braid, q["dead_band"], q["presliding_contraction"]),
    ),
    kernel=maxwell_slip_force,
    rate_kernel=maxwell_slip_rates,
    formula="F = Σ f_i, f_i ← clamp(f_i + K Δκ, ±W_i(p)), four elements of one stiffness (Maxwell-slip)",
    validity="rate-independent, holds at rest; "
    "Q about 0.16 bar for a Festo Ø10, to 0.45 bar with much rubber",
    source="Vo-Minh, Tjahjowidodo, Ramon & Van Brussel 2011; springs that do not know the pressure here",
)
