"""A state machine in a board's whole control periods."""

import math
from collections.abc import Mapping, Sequence

from afo_sim.common.errors import InputError
from afo_sim.control.state_machine import DIGITS, Machine, Transition
from afo_sim.description.control.switching import STATE_TIME
from afo_sim.export.electronics.board import MOST_NAMES, MOST_TICKS, Rule, States, check_names

FIELD = "controller.state_machine"


def states_of(machine: Machine, period: float, chambers: Sequence[str]) -> States:
    """The machine's tables.

    Units: period [s].
    """
    names = check_names(machine.states, "state", MOST_NAMES)
    masks = [
        _masks(commands, chambers, f"{FIELD}.state.{name}")
        for name, commands in zip(names, machine.commands, strict=True)
    ]
    columns = machine.columns()
    return States(
        names=names,
        start=machine.start,
        named=tuple(named for named, _ in masks),
        coils=tuple(coils for _, coils in masks),
        rules=tuple(_rule(transition, period, columns) for transition in machine.transitions),
    )


def _masks(
    commands: Mapping[str, tuple[float, float] | float], chambers: Sequence[str], field: str
) -> tuple[int, int]:
    """Bits of the coils that a state commands, and of those that have current."""
    named = coils = 0
    for chamber, command in commands.items():
        place = 2 * chambers.index(chamber)
        if isinstance(command, float):
            problem = "is a pressure, and the export switches coils on and off"
            raise InputError(problem, field=f"{field}.{chamber}", value=f"{command:g} Pa", allowed=_ALLOWED)
        if not all(coil in (0.0, 1.0) for coil in command):
            problem = "is a share of a coil's current, and the export switches coils on and off"
            raise InputError(problem, field=f"{field}.{chamber}", value=list(command), allowed=_ALLOWED)
        named |= 3 << place
        coils |= (int(command[0]) | int(command[1]) << 1) << place
    return named, coils


_ALLOWED = "inlet, outlet, both or shut"


def _rule(transition: Transition, period: float, columns: Sequence[str]) -> Rule:
    timed = transition.column == STATE_TIME
    return Rule(
        source=transition.source,
        to=transition.to,
        input=None if timed else columns.index(transition.column),
        above=transition.above,
        threshold=float(_periods(transition.threshold, period)) if timed else transition.threshold,
        after=_periods(transition.after, period),
    )


def _periods(time: float, period: float) -> int:
    """The fewest control periods after which the time in a state is not below a time [s].

    The simulated controller compares ticks · period, rounded to a nanosecond; so does this.
    """
    if time > MOST_TICKS * period:
        allowed = f"at most {MOST_TICKS * period:.0f} s"
        raise InputError(
            "does not fit a 32-bit count of periods", field=FIELD, value=f"{time:g} s", allowed=allowed
        )
    count = max(math.floor(time / period) - 1, 0)
    while round(count * period, DIGITS) < time:
        count += 1
    return count
