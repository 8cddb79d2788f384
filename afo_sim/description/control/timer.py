"""A fixed clock in a microcontroller's loop, as it is described."""

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from afo_sim.description.control.threshold import Threshold
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.valve_timer import Timer, ValveTimes


class Restart(Described):
    """A foot switch that starts the clock anew at each heel strike."""

    column: str = "foot/heel_load"
    """What the foot switch sees: a column, or "sensor/<name>"."""
    above: Threshold = "50 N"
    """Value from which on the foot switch is closed; it is a heel strike where it closes."""
    after: Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)] = 0.4
    """Least time from one restart to the next: a switch bounces."""


class ClockTimer(Timer):
    """A repeating clock; every key but `period` and `restart` is a chamber."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, ValveTimes] = Field(init=False)  # type: ignore[assignment]  # no `open`

    restart: Restart | None = None
    """Foot switch that starts the clock anew; it then stops at its period and waits. Else it repeats."""

    @property
    def cycle(self) -> float | None:
        """Period of a clock that repeats [s]; None of one that a foot switch starts."""
        return self.period if self.restart is None else None

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {chamber: chamber for chamber in self.chambers}

    @model_validator(mode="after")
    def _switches_something(self) -> Self:
        if not self.chambers:
            raise refusal("names no chamber", "a table for each chamber, such as [dorsiflexor]")
        return self
