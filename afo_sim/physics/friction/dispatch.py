"""Functions over all frictions by native id, generated from FRICTIONS; compiled code calls them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.friction.law import MOTION, Friction
from afo_sim.physics.registry import Branch, check_branches, dispatcher, items, typical_coefficients

Answer = Callable[..., tuple[float, float]]
STEP = 1e-3  # [s] at which dispatchers are tried


def _call(friction: Friction, motion: Sequence[str]) -> str:
    """A kernel's call; its states start at act[a] and its coefficients at u[c]."""
    states = items("act", "a", friction.n_state)
    coefficients = items("u", "c", len(typical_coefficients(friction)))
    memory = ["step"] if friction.n_state else []
    return f"({', '.join([*motion, *states, *coefficients, *memory])})"


def forces_over(frictions: Iterable[Friction]) -> Answer:
    """(id, κ, κ̇, p, act, a, u, c, h) → (force [N], derivative by κ̇ [N·s]) of frictions that are forces."""
    return dispatcher(
        "friction_force",
        ("model", *MOTION["N"], "act", "a", "u", "c", "step"),
        [
            Branch(f.native_id, f.kernel, (f"return {{kernel}}{_call(f, MOTION['N'])}",))
            for f in frictions
            if f.unit == "N"
        ],
        otherwise="math.nan, math.nan",
        description="Friction force at the end of the step [N], and its derivative by κ̇ [N·s].",
    )


def pressures_over(frictions: Iterable[Friction]) -> Answer:
    """(id, κ̇, act, a, u, c, h) → (q [Pa], derivative by κ̇ [Pa·s]) of frictions in pressure units."""
    return dispatcher(
        "friction_pressure",
        ("model", *MOTION["Pa"], "act", "a", "u", "c", "step"),
        [
            Branch(f.native_id, f.kernel, (f"return {{kernel}}{_call(f, MOTION['Pa'])}",))
            for f in frictions
            if f.unit == "Pa"
        ],
        otherwise="math.nan, math.nan",
        description="Friction pressure at the end of the step [Pa], and its derivative by κ̇ [Pa·s].",
    )


def rates_over(frictions: Iterable[Friction]) -> Callable[..., float]:
    """(id, κ̇, act, a, u, c, h, act_dot) → the rate of one state; of several they go to act_dot, from a on.

    Of an actuator with one state MuJoCo takes what the callback returns.
    """
    branches = []
    for friction in frictions:
        if friction.rate_kernel is None:
            continue
        call = f"{{kernel}}{_call(friction, ('rate',))}"
        lines: tuple[str, ...] = (f"return {call}",)
        if friction.n_state > 1:
            targets = ", ".join(items("act_dot", "a", friction.n_state))
            lines = (f"{targets} = {call}", "return 0.0")
        branches.append(Branch(friction.native_id, friction.rate_kernel, lines))
    return dispatcher(
        "friction_rates",
        ("model", "rate", "act", "a", "u", "c", "step", "act_dot"),
        branches,
        description="Rate of a friction's one state [Pa/s]; the rates of several are written to act_dot.",
    )


def which_are_forces(frictions: Iterable[Friction]) -> Callable[[float], bool]:
    """(id) → the friction is a force, not a pressure."""
    return dispatcher(
        "is_force",
        ("model",),
        [Branch(f.native_id, f.kernel, ("return True",)) for f in frictions if f.unit == "N"],
        otherwise="False",
        description="The friction with a native id is a force, not a pressure.",
    )


def check(
    forces: Answer, pressures: Answer, rates: Callable[..., float], frictions: Mapping[str, Friction]
) -> None:
    """Refuse dispatchers without a branch for one of the frictions (ValueError)."""

    def asked(f: Friction) -> tuple[Any, ...]:
        row, act, act_dot = typical_coefficients(f), [0.0] * f.n_state, [0.0] * f.n_state
        value = (
            forces(float(f.native_id), 0.1, 0.2, 3e5, act, 0, row, 0, STEP)
            if f.unit == "N"
            else pressures(float(f.native_id), 0.2, act, 0, row, 0, STEP)
        )
        if not f.n_state:
            return (*value,)
        one = rates(float(f.native_id), 0.2, act, 0, row, 0, STEP, act_dot)
        return (*value, *(act_dot if f.n_state > 1 else [one]))

    def own(f: Friction) -> tuple[Any, ...]:
        row, state = typical_coefficients(f), [0.0] * f.n_state
        return (*f.evaluate(0.1, 0.2, 3e5, state, row, STEP), *f.rates(0.2, state, row, STEP))

    check_branches(frictions, asked, own, "the dispatchers of friction")


friction_force = forces_over(FRICTIONS.values())
friction_pressure = pressures_over(FRICTIONS.values())
friction_rates = rates_over(FRICTIONS.values())
is_force = which_are_forces(FRICTIONS.values())
check(friction_force, friction_pressure, friction_rates, FRICTIONS)
