"""One function over all static force laws, and the law as a muscle asks it.

A law gives the force that the braid would exert at a contraction ratio and gauge pressure. It is
*signed*: negative beyond its first zero, from where it brings a slack muscle back, and never positive
again beyond that zero.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from afo_sim.physics.hill import braid_force
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Law
from afo_sim.physics.laws import LAWS
from afo_sim.physics.registry import Branch, check_branches, dispatcher, items, typical_coefficients

SLACK_BLEND = 5e-4  # stretch over which a bladder that pushes leaves the braid [-]
RETURN_PRESSURE = 1e5  # gauge pressure from which no return force acts [Pa]

StaticForce = Callable[[float, float, float, Any, int], float]


def over(laws: Iterable[Law]) -> StaticForce:
    """A function over laws: (native id, κ [-], p gauge [Pa], u, c) → signed force [N].

    The coefficients of the law start at u[c]. The force of an unknown id is not a number.
    """
    branches = []
    for law in laws:
        taken = ["contraction", "pressure", *items("u", "c", len(typical_coefficients(law)))]
        branches.append(Branch(law.native_id, law.kernel, (f"return {{kernel}}({', '.join(taken)})",)))
    return dispatcher(
        "static_force",
        ("law", "contraction", "pressure", "u", "c"),
        branches,
        description="Signed force of the law with a native id, whose coefficients start at u[c] [N].",
    )


def check(function: StaticForce, laws: Mapping[str, Law]) -> None:
    """Refuse a `static_force` without a branch for one of the laws (ValueError)."""

    def asked(law: Law) -> float:
        return function(float(law.native_id), 0.1, 3e5, typical_coefficients(law), 0)

    def own(law: Law) -> float:
        return law.kernel(0.1, 3e5, *typical_coefficients(law))

    check_branches(laws, asked, own, "static_force")


static_force: StaticForce = over(LAWS.values())
check(static_force, LAWS)


@register_jitable
def muscle_static_force(
    law: float, contraction: float, pressure: float, lowest_pressure: float, u: Sequence[float], c: int
) -> float:
    """The law as a muscle asks it: at κ ≥ 0 and p ≥ 0, and no pull without air.

    Stretched, the braid carries (`hill.braid_force`). A bladder below ambient leaves the braid. Below
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
    float : signed force [N]
    """
    kappa = 0.0 if contraction < 0.0 else contraction
    if pressure < 0.0:
        pressure = 0.0
    force = static_force(law, kappa, pressure, u, c)
    if pressure < lowest_pressure:
        most = static_force(law, kappa, lowest_pressure, u, c) * pressure / lowest_pressure
        if most < force:
            return most
    return force + 0.0 * lowest_pressure  # a NaN stays one


@register_jitable
def signed_force(
    law: float,
    contraction: float,
    pressure: float,
    lowest_pressure: float,
    return_stiffness: float,
    braid_stiffness: float,
    nominal_radius: float,
    b: float,
    braids: float,
    u: Sequence[float],
    c: int,
) -> float:
    """Static force of a muscle at its own length: law, braid and return force.

    Negative, it brings a slack muscle back.

    κ ≥ 0:  F = law(κ, p)
    κ < 0:  F = law(0, p)⁺ − law(0, p)⁻ max(0, 1 + κ/κ_b) + f p π r0² 3 (b − 1) [(1 − κ)² − 1] + braid(κ)

    and − k_r κ (1 − p/1 bar) below 1 bar. Stretched, the pressure pulls on a braid by virtual work,
    p [V'(κ) − V'(0)]/L0. A measured fluidic muscle of 20 mm does not show it, so that other laws are held at
    κ = 0. A bladder that pushes leaves the braid over κ_b = 0.05 % of stretch. The return force gives a
    muscle without air its nominal length; above 1 bar the law is untouched.

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
    u, c : the law's coefficients start at u[c]

    Returns
    -------
    float : signed force [N]; it falls as κ rises

    Source
    ------
    The laws' own; stretch and return force are this project's.
    """
    if pressure < 0.0:
        pressure = 0.0
    force = muscle_static_force(law, contraction, pressure, lowest_pressure, u, c)
    if contraction < 0.0:
        x = 1.0 - contraction
        if force < 0.0:
            left = 1.0 + contraction / SLACK_BLEND
            force = force * left if left > 0.0 else 0.0
        area = math.pi * nominal_radius * nominal_radius
        force += braids * pressure * area * 3.0 * (b - 1.0) * (x * x - 1.0)
        force += braid_force(contraction, braid_stiffness)
    if pressure < RETURN_PRESSURE:
        force -= return_stiffness * contraction * (1.0 - pressure / RETURN_PRESSURE)
    return force
