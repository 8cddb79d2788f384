"""Functions over all frictions by native id, generated from FRICTIONS; compiled code calls them."""

from collections.abc import Callable, Iterable, Sequence

from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.friction.law import MOTION, Friction
from afo_sim.physics.registry import Branch, dispatcher, items

Answer = Callable[..., tuple[float, float]]


def _call(friction: Friction, motion: Sequence[str]) -> str:
    """A kernel's call; its states start at act[a] and its coefficients at u[c]."""
    states = items("act", "a", friction.n_state)
    coefficients = items("u", "c", len(friction.typical))
    memory = ["step"] if friction.n_state else []
    return f"({', '.join([*motion, *states, *coefficients, *memory])})"


def answers_over(frictions: Iterable[Friction], unit: str) -> Answer:
    """(id, *MOTION, act, a, u, c, h) → (friction, its derivative by κ̇) of the frictions in a unit."""
    name = "force" if unit == "N" else "pressure"
    return dispatcher(
        f"friction_{name}",
        ("model", *MOTION[unit], "act", "a", "u", "c", "step"),
        [
            Branch(f.native_id, f.kernel, (f"return {{kernel}}{_call(f, MOTION[unit])}",))
            for f in frictions
            if f.unit == unit
        ],
        otherwise="math.nan, math.nan",
        description=f"Friction {name} at the end of the step [{unit}], and its derivative by κ̇ [{unit}·s].",
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


friction_force = answers_over(FRICTIONS.values(), "N")
friction_pressure = answers_over(FRICTIONS.values(), "Pa")
friction_rates = rates_over(FRICTIONS.values())
is_force = which_are_forces(FRICTIONS.values())
