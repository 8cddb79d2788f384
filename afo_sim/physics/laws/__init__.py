"""The registry LAWS of static force laws: one file a family, found here.

A shipped law is a file in this folder: its kernel, its parameters, and a `Law` at the top level with a native
id that no other kernel has. LAWS and the dispatcher of `static_force` follow. One of a user's is registered.
"""

import inspect
import itertools
import math
from dataclasses import replace

from afo_sim.common import InputError
from afo_sim.physics import user_kernels
from afo_sim.physics.law import MAX_COEFFICIENTS, Law, without_default
from afo_sim.physics.law_slope import slopes_of
from afo_sim.physics.registry import check_coefficients, collect


def collected() -> dict[str, Law]:
    """The laws of this folder by name, as their native ids rise; a wrong entry is a ValueError."""
    laws = collect(__name__, Law)
    for law in laws.values():
        _checked(law)
    return laws


def _checked(law: Law) -> int:
    """Number of a law's coefficients; ValueError where it is wrong."""
    number = check_coefficients(law, 2, MAX_COEFFICIENTS)
    if law.force_powers and len(law.force_powers) != number:
        raise ValueError(f"{law.name!r} has {number} coefficients and {len(law.force_powers)} powers")
    return number


LAWS: dict[str, Law] = collected()
SHIPPED = tuple(LAWS.values())  # whose kernels are compiled together
PULLS = 60  # contractions of 1 % over which a law that pulls no more may not pull again
KINKS = 3  # places of 24 at which a force may bend, and its slope be another
CLOSE = 1e-3  # share of the blocked force by which a law's slopes may miss its difference quotients


def add(law: Law) -> None:
    """Add a law of a user's own; InputError where it is wrong, or its slopes are not those of its force."""
    fitted = law.fitted or without_default(law.parameters)
    law = replace(law, fitted=fitted, kernel=user_kernels.anew(law.kernel))
    names = [parameter.name for parameter in law.parameters]
    taken = [*inspect.signature(getattr(law.kernel, "slopes", law.kernel)).parameters][2:]
    try:
        number = _checked(law)
        if names != taken and sorted(names) == sorted(taken) and len(law.typical) == len(names):
            took, are = ", ".join(taken), ", ".join(names)
            raise ValueError(f"its function takes {took} in this order, and its parameters are {are}")
        _check_slopes(law)
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"is wrong: {error}", field="Law", value=law.name) from error
    user_kernels.add(law, LAWS, user_kernels.law_bodies(law.kernel, slopes_of(law.kernel), number))


def _check_slopes(law: Law) -> None:
    """Refuse a force that is no number or pulls again when slack, and slopes of another (ValueError)."""
    (_, end), (low, high) = law.contraction_range, law.pressure_range
    typical, steps = law.typical, (1e-4 * end, 1e-4 * high)
    blocked, slopes_at = abs(law.kernel(0.0, high, *typical)), slopes_of(law.kernel)
    forces = [law.kernel(0.01 * k, high, *typical) for k in range(PULLS)]
    slack = next((k for k, force in enumerate(forces) if force <= 0.0), PULLS)
    if again := [k for k in range(slack, PULLS) if forces[k] > CLOSE * blocked]:
        raise ValueError(f"it pulls again at κ = {0.01 * again[0]:.2f}, beyond its free contraction")
    wrong: list[str] = []
    for k, share in itertools.product(range(1, 12, 3), (0.13, 0.52, 0.91)):
        kappa, pressure = k / 11.0 * end, low + share * (high - low)
        force, *slopes = slopes_at(kappa, pressure, *typical)
        if not all(map(math.isfinite, (blocked, force, *slopes))):
            raise ValueError(
                f"its force at κ = {kappa:.3g} and {pressure:.3g} Pa is {force}, slopes {slopes}"
            )
        for name, (moved, pressed) in {"κ": (steps[0], 0.0), "p": (0.0, steps[1])}.items():
            ends = [law.kernel(kappa + s * moved, pressure + s * pressed, *typical) for s in (-1.0, 1.0)]
            quotient = (ends[1] - ends[0]) / (2.0 * (moved + pressed))
            slope, scale = (slopes[0], end) if moved else (slopes[1], high)
            if not abs(slope - quotient) * scale <= CLOSE * blocked:
                wrong.append(f"its slope by {name} is {slope:.4g}, and that of its force {quotient:.4g}")
    if len(wrong) > KINKS:
        raise ValueError(wrong[0])
