"""Functions over all frictions by native id, generated from the shipped ones; compiled code calls them."""

from collections.abc import Callable, Iterable, Sequence

from afo_sim.physics.friction import SHIPPED
from afo_sim.physics.friction.law import MOTION, Friction
from afo_sim.physics.registry import Branch, dispatcher, items
from afo_sim.physics.user_kernels import (
    OF_DEAD_BAND,
    OF_MOTION,
    RATES,
    has_kernel,
    user_friction,
    user_kernel,
)

GIVES = {"N": OF_MOTION, "Pa": OF_DEAD_BAND}
Answer = Callable[..., tuple[float, float]]


def _call(friction: Friction, motion: Sequence[str], *memory: str) -> str:
    """A kernel's call; its states start at act[a] and its coefficients at u[c]."""
    states = items("act", "a", friction.n_state)
    coefficients = items("u", "c", len(friction.typical))
    return f"({', '.join([*motion, *states, *coefficients, *memory])})"


def answers_over(frictions: Iterable[Friction], unit: str) -> Answer:
    """(id, *MOTION, act, a, u, c) → (friction, its derivative by what moves) of the frictions of a unit."""
    name = "of_motion" if unit == "N" else "of_dead_band"
    moves = ", ".join((*MOTION[unit], "0.0")[:3])
    return dispatcher(
        f"friction_{name}",
        ("model", *MOTION[unit], "act", "a", "u", "c"),
        [
            Branch(f.native_id, f.kernel, (f"return {{kernel}}{_call(f, MOTION[unit])}",))
            for f in frictions
            if f.unit == unit
        ],
        otherwise=f"user_friction(model, {GIVES[unit]}, {moves}, act, a, u, c)",
        names={"user_friction": user_friction},
        description="Friction at the end of the step [N], and its derivative by what moves.",
    )


def rates_over(frictions: Iterable[Friction]) -> Callable[..., float]:
    """(id, W, Δκ, act, a, u, c, h, act_dot) → the rate of one state; of several they go to act_dot.

    Of an actuator with one state MuJoCo takes what the callback returns.
    """
    branches = []
    for friction in frictions:
        if friction.rate_kernel is None:
            continue
        call = f"{{kernel}}{_call(friction, MOTION['Pa'], 'step')}"
        lines: tuple[str, ...] = (f"return {call}",)
        if friction.n_state > 1:
            targets = ", ".join(items("act_dot", "a", friction.n_state))
            lines = (f"{targets} = {call}", "return 0.0")
        branches.append(Branch(friction.native_id, friction.rate_kernel, lines))
    return dispatcher(
        "friction_rates",
        ("model", *MOTION["Pa"], "act", "a", "u", "c", "step", "act_dot"),
        branches,
        otherwise=f"user_kernel(model, {RATES}, yields, moved, step, u, c, act, a, act_dot)",
        names={"user_kernel": user_kernel},
        description="Rate of a friction's one state [N/s]; the rates of several are written to act_dot.",
    )


def which_are_forces(frictions: Iterable[Friction]) -> Callable[[float], bool]:
    """(id) → the friction follows from the motion alone, not from a dead band."""
    return dispatcher(
        "is_force",
        ("model",),
        [Branch(f.native_id, f.kernel, ("return True",)) for f in frictions if f.unit == "N"],
        otherwise=f"has_kernel(model, {OF_MOTION})",
        names={"has_kernel": has_kernel},
        description="The friction with a native id follows from the motion alone.",
    )


friction_of_motion = answers_over(SHIPPED, "N")
friction_of_dead_band = answers_over(SHIPPED, "Pa")
friction_rates = rates_over(SHIPPED)
is_force = which_are_forces(SHIPPED)
