"""The state machine: states with commands, and conditions on what is seen that lead from one to another."""

from collections.abc import Mapping
from dataclasses import dataclass

from afo_sim.control.command import COILS, Command
from afo_sim.control.controller import Observation
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.description import STATE_TIME, Scenario, StateMachine, in_si

DIGITS = 9  # to which the time in a state is rounded: to a nanosecond, so that a tick on a threshold counts


@dataclass(frozen=True)
class Transition:
    """A condition that leads from a state to another; states by their number."""

    source: int
    to: int
    column: str
    above: bool
    threshold: float
    after: float

    def holds(self, state_time: float, values: Mapping[str, float]) -> bool:
        """Whether it fires at this time in its state [s], with these values by column [SI]."""
        if state_time < self.after:
            return False
        value = state_time if self.column == STATE_TIME else values[self.column]
        return value >= self.threshold if self.above else value < self.threshold


@dataclass(frozen=True)
class Machine:
    """A state machine, whole: what a microcontroller needs to be the same."""

    states: tuple[str, ...]
    start: int
    commands: tuple[Mapping[str, tuple[float, float] | float], ...]
    transitions: tuple[Transition, ...]

    def columns(self, state: int | None = None) -> list[str]:
        """Columns that its transitions compare, each once; those of one state where it is given."""
        asked = (t.column for t in self.transitions if state is None or t.source == state)
        return [column for column in dict.fromkeys(asked) if column != STATE_TIME]


def advance(machine: Machine, state: int, state_time: float, values: Mapping[str, float]) -> int:
    """The state of the next control period: that of the first transition that fires, or the same."""
    for transition in machine.transitions:
        if transition.source == state and transition.holds(state_time, values):
            return transition.to
    return state


def machine_of(description: StateMachine, scenario: Scenario) -> Machine:
    """The machine that is described."""
    names = list(description.state)
    return Machine(
        states=tuple(names),
        start=names.index(description.start),
        commands=tuple(
            {name: COILS[each] if isinstance(each, str) else each for name, each in state.chambers.items()}
            for state in description.state.values()
        ),
        transitions=tuple(
            Transition(
                source=names.index(described.state),
                to=names.index(described.to),
                column=described.column,
                above=described.above is not None,
                threshold=in_si(described.above if described.above is not None else str(described.below)),
                after=described.after,
            )
            for described in description.transition
        ),
    )


class StateMachineController:
    """A controller: looks at the transitions of its state once in each control period."""

    def __init__(self, description: StateMachine, scenario: Scenario):
        self.machine = machine_of(description, scenario)
        self.asks: list[RequiredInput] = []
        for number, each in enumerate(description.transition):
            table = f"controller.state_machine.transition.{number}"
            kind = "below" if each.above is None else "above"
            self.asks.append(RequiredInput(each.column, table, kind, getattr(each, kind)))
        self.reset()

    def reset(self) -> None:
        """Restart in the first state."""
        self.state, self.ticks = self.machine.start, 0  # periods since the state was entered

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The commands of the state that it comes to."""
        values = {column: seen[column] for column in self.machine.columns(self.state)}
        state = advance(self.machine, self.state, round(self.ticks * seen.period, DIGITS), values)
        self.ticks = 1 if state != self.state else self.ticks + 1
        self.state = state
        return self.machine.commands[state]

    def tell(self) -> dict[str, float]:
        """The number of its state."""
        return {"state": float(self.state)}


CONTROLLER = StateMachineController
