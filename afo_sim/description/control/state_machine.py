"""A state machine that switches valves, as it is described."""

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from afo_sim.common.errors import nearest_name
from afo_sim.description.control.command import ChamberCommand
from afo_sim.description.control.threshold import Threshold
from afo_sim.description.quantity import Described, Quantity, refusal

STATE_TIME = "state_time"  # column of a transition: time since the state was entered


class MachineState(Described):
    """Commands of a state; every key is a chamber, and one that is not named keeps its command."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, ChamberCommand] = Field(init=False)

    @property
    def chambers(self) -> dict[str, str | tuple[float, float] | float]:
        """The commands by chamber."""
        return dict(self.__pydantic_extra__ or {})


class MachineTransition(Described):
    """A condition on a column that leads from one state to another."""

    state: str
    """State in which the condition is looked at."""
    to: str
    """State that it leads to."""
    column: str
    """What is compared: a column, "sensor/<name>", or "state_time", the time in the state."""
    above: Threshold | None = None
    """The condition holds at this value and above it."""
    below: Threshold | None = None
    """The condition holds below this value."""
    after: Annotated[float, Quantity("s", at_least=0.0, at_most=1e3)] = 0.0
    """Least time in the state before the condition is looked at."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.above is None) == (self.below is None):
            raise refusal("needs one of the two", "above or below", "above")
        if self.state == self.to:
            raise refusal("leads to the state that it leaves", "another state", "to")
        return self


class StateMachine(Described):
    """States with commands, and conditions on columns that lead from one to another."""

    start: str
    """State in which it begins."""
    state: dict[str, MachineState] = Field(min_length=1)
    """The states by name."""
    transition: tuple[MachineTransition, ...] = ()
    """Transitions; in each control period the first that holds is taken, and no second one."""

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {
            f"state.{state}.{chamber}": chamber
            for state, told in self.state.items()
            for chamber in told.chambers
        }

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them whose drive is asked for a pressure."""
        return {
            f"state.{state}.{chamber}": chamber
            for state, told in self.state.items()
            for chamber, command in told.chambers.items()
            if isinstance(command, float)
        }

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        told = {"start": self.start}
        for number, transition in enumerate(self.transition):
            told |= {f"transition.{number}.{end}": getattr(transition, end) for end in ("state", "to")}
        for key, name in told.items():
            if name not in self.state:
                known = ", ".join(self.state)
                raise refusal("there is no such state", known, key, nearest_name(name, self.state) or "")
        reached = {self.start}
        for _ in self.state:
            reached |= {transition.to for transition in self.transition if transition.state in reached}
        for name in self.state:
            if name not in reached:
                allowed = f"states that transitions lead to from {self.start!r}"
                raise refusal("is never reached", allowed, f"state.{name}")
        return self
