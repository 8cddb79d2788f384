"""Hill's muscle: a static spring beside a damper, and the spring over all static force laws.

    F_static(κ, p) − R p_abs κ̇ − F_friction = T

κ is the muscle's own contraction, and T the tension of the cable in series with it. The damper acts on a
slack muscle too: it returns to its free length at the speed that the damper allows. Only the cable cannot
push.

A law gives the force that the braid would exert at a contraction ratio and gauge pressure. It is
*signed*: negative beyond its first zero, from where it brings a slack muscle back, and never positive
again beyond that zero.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Law
from afo_sim.physics.law_slope import Slopes, slopes_of
from afo_sim.physics.laws import SHIPPED
from afo_sim.physics.registry import Branch, dispatcher, items
from afo_sim.physics.rubber import rubber_force
from afo_sim.physics.user_kernels import FORCE, user_kernel, user_slopes

BRAID_BLEND = 0.005  # stretch over which the braid's stiffness sets in [-]
DAMPER_COEFFICIENTS = 7


@register_jitable
def braid_force(contraction: float, braid_stiffness: float) -> float:
    """Tension of the braid's own fibres when it is stretched beyond its nominal length.

    Parameters
    ----------
    contraction : κ [-]; acts below zero
    braid_stiffness : force per unit of stretch [N]

    Returns
    -------
    float : tension [N], quadratic over the first `BRAID_BLEND` of stretch, then linear.
    """
    stretch = -contraction
    if stretch <= 0.0:
        return 0.0
    if stretch < BRAID_BLEND:
        return braid_stiffness * stretch * stretch / (2.0 * BRAID_BLEND)
    return braid_stiffness * (stretch - 0.5 * BRAID_BLEND)


@register_jitable
def three_element_damping(
    pressure: float, contraction_rate: float, b0: float, b1: float, switch_pressure: float, r0: float,
    r1: float, r2: float, r3: float,
) -> float:  # fmt: skip
    """Damping of the three-element model, another while contracting than while relaxing.

    B = b0 + b1 p contracting; relaxing r0 + r1 p below the switch pressure, r2 + r3 p from there. Never
    negative: Reynolds' line for deflation would be, beyond 747 kPa.

    Parameters
    ----------
    pressure : p, gauge [Pa]
    contraction_rate : κ̇ [1/s], shortening positive
    b0, b1, r0, r1, r2, r3 : [N·s/m] and [N·s/(m·Pa)] in turn
    switch_pressure : [Pa]

    Returns
    -------
    float : B [N·s/m], force per shortening velocity of the muscle

    Source
    ------
    Reynolds et al. 2003, doi 10.1114/1.1554921 (as quoted by Lilly & Quesada 2004); Serres et al. 2009; S0.
    Code in circulation has + where Reynolds' line for deflation falls with pressure.
    """
    if contraction_rate > 0.0:
        damping = b0 + b1 * pressure
    elif pressure < switch_pressure:
        damping = r0 + r1 * pressure
    else:
        damping = r2 + r3 * pressure + 0.0 * switch_pressure
    if damping < 0.0:
        return 0.0
    return damping + 0.0 * contraction_rate  # a NaN stays one


SLACK_BLEND = 5e-4  # stretch over which a bladder that pushes leaves the braid [-]
RETURN_PRESSURE = 1e5  # gauge pressure from which no return force acts [Pa]

_StaticForce = Callable[[float, float, float, Any, int], float]


def over(laws: Iterable[Law], slopes: bool = False) -> Callable[[float, float, float, Any, int], Any]:
    """A function over laws: (native id, κ [-], p gauge [Pa], u, c) → signed force [N], or `Slopes`.

    The coefficients of the law start at u[c]. The force of an unknown id is not a number.
    """
    branches = []
    for law in laws:
        taken = ["contraction", "pressure", *items("u", "c", len(law.typical))]
        kernel = slopes_of(law.kernel) if slopes else law.kernel
        branches.append(Branch(law.native_id, kernel, (f"return {{kernel}}({', '.join(taken)})",)))
    return dispatcher(
        "static_slopes" if slopes else "static_force",
        ("law", "contraction", "pressure", "u", "c"),
        branches,
        otherwise="user_slopes(law, contraction, pressure, u, c)"
        if slopes
        else f"user_kernel(law, {FORCE}, contraction, pressure, 0.0, u, c, u, 0, u)",
        description="Signed force of the law with a native id, whose coefficients start at u[c] [N].",
        names={"user_slopes": user_slopes, "user_kernel": user_kernel},
    )


static_force: _StaticForce = over(SHIPPED)
static_slopes: Callable[[float, float, float, Any, int], Slopes] = over(SHIPPED, slopes=True)


@register_jitable
def muscle_static_force(
    law: float, contraction: float, pressure: float, lowest_pressure: float, u: Sequence[float], c: int
) -> Slopes:
    """The law as a muscle asks it: at κ ≥ 0 and p ≥ 0, and no pull without air.

    Stretched, the braid carries (`braid_force`). A bladder below ambient leaves the braid. Below
    the lowest pressure that the law was shown at, the force is at most in proportion to the pressure: most
    empirical laws would pull a little, or a lot, without any air.

    Parameters
    ----------
    law : native id
    contraction : κ [-]
    pressure : p, gauge [Pa]
    lowest_pressure : of the law's range, gauge [Pa]; 0 for none
    u, c : the law's coefficients start at u[c]

    Returns
    -------
    (signed force [N], its slopes by κ [N] and p [N/Pa]); those of κ ≥ 0 at κ = 0, of p ≥ 0 at p = 0
    """
    kappa, stretched = (0.0, 0.0) if contraction < 0.0 else (contraction, 1.0)
    pressure, below = (0.0, 0.0) if pressure < 0.0 else (pressure, 1.0)
    force, by_contraction, by_pressure = static_slopes(law, kappa, pressure, u, c)
    if pressure < lowest_pressure:
        full, full_by, _ = static_slopes(law, kappa, lowest_pressure, u, c)
        if full * pressure / lowest_pressure < force:
            force, by_pressure = full * pressure / lowest_pressure, full / lowest_pressure
            by_contraction = full_by * pressure / lowest_pressure
    # a NaN stays one
    return force + 0.0 * lowest_pressure, stretched * by_contraction, below * by_pressure


@register_jitable
def signed_force(
    law: float, contraction: float, pressure: float, lowest_pressure: float, return_stiffness: float,
    braid_stiffness: float, nominal_radius: float, b: float, braids: float, contraction_scale: float,
    rubber: float, bore: float, turn: float, u: Sequence[float], c: int,
) -> Slopes:  # fmt: skip
    """Static force of a muscle at its own length: law, braid, rubber and return force; and its slopes.

    Negative, it brings a slack muscle back.

    κ ≥ 0:  F = law(s κ, p)
    κ < 0:  F = law(0, p)⁺ − law(0, p)⁻ max(0, 1 + κ/κ_b) + f p π r0² 3 (b − 1) [(1 − κ)² − 1] + braid(κ)

    and the `rubber_force` of a tube, and − k_r κ (1 − p/1 bar)² below 1 bar. Stretched, the pressure pulls
    on a braid by virtual work, p [V'(κ) − V'(0)]/L0. A measured fluidic muscle of 20 mm does not show it, so
    that other laws are held at κ = 0. A bladder that pushes leaves the braid over κ_b = 0.05 % of stretch.
    The return force gives a muscle without air its nominal length; above 1 bar the law is untouched. A muscle
    that contracts less without load than its law says has s > 1; stretch is not scaled.

    Parameters
    ----------
    law : native id
    contraction : κ [-], the muscle's own
    pressure : p, gauge [Pa]; below zero it counts as zero
    lowest_pressure : of the law's range, gauge [Pa]
    return_stiffness : k_r [N] per unit of contraction
    braid_stiffness : [N] per unit of stretch
    nominal_radius, b : r0 [m], 1/sin²α0 [-]
    braids : f, 1 for a law that is the braid's own formula, else 0
    contraction_scale : s, the law's free contraction over the muscle's own [-]
    rubber, bore, turn : of a tube that the law does not know, as `rubber_force` takes them; 0 N for none
    u, c : the law's coefficients start at u[c]

    Returns
    -------
    (signed force [N], which falls as κ rises, its slopes by κ [N] and p [N/Pa])

    Source
    ------
    The laws' own; stretch, rubber and return force are this project's.
    """
    pressure, below = (0.0, 0.0) if pressure < 0.0 else (pressure, 1.0)
    force, by_contraction, by_pressure = muscle_static_force(
        law, contraction_scale * contraction, pressure, lowest_pressure, u, c
    )
    by_contraction *= contraction_scale
    if contraction < 0.0:
        x = 1.0 - contraction
        if force < 0.0:
            left = 1.0 + contraction / SLACK_BLEND
            left, by_left = (left, force / SLACK_BLEND) if left > 0.0 else (0.0, 0.0)
            force, by_contraction, by_pressure = force * left, by_left, by_pressure * left
        area = math.pi * nominal_radius * nominal_radius
        force += braids * pressure * area * 3.0 * (b - 1.0) * (x * x - 1.0)
        by_contraction -= braids * pressure * area * 6.0 * (b - 1.0) * x
        by_pressure += braids * area * 3.0 * (b - 1.0) * (x * x - 1.0)
        force += braid_force(contraction, braid_stiffness)
        by_contraction -= braid_stiffness * min(-contraction / BRAID_BLEND, 1.0)
    if rubber != 0.0:
        tension, slope = rubber_force(contraction, rubber, bore, b, turn)
        force, by_contraction = force + tension, by_contraction + slope
    if pressure < RETURN_PRESSURE:
        left = 1.0 - pressure / RETURN_PRESSURE
        force -= return_stiffness * contraction * left * left
        by_contraction -= return_stiffness * left * left
        by_pressure += 2.0 * return_stiffness * contraction * left / RETURN_PRESSURE
    return force, by_contraction, below * by_pressure
