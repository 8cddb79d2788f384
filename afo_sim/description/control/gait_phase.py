"""Valves by estimated gait phase, as they are described."""

import itertools
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from afo_sim.description.muscle import GaugePressure
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.walking import Phase, ValvePhases

Load = Annotated[float, Quantity("N", above=0.0, at_most=1e4)]


class ChamberPhases(ValvePhases):
    """What a chamber is commanded over the estimated gait phase: intervals of its valves, or pressures."""

    pressure: tuple[tuple[Phase, GaugePressure], ...] = ()
    """Points [phase, pressure] that its drive is asked for, linear between them and over heel strike."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if self.pressure and (self.inlet or self.outlet):
            raise refusal(
                "stands beside intervals of the valves", "pressure, or inlet and outlet", "pressure"
            )
        phases = [phase for phase, _ in self.pressure]
        if any(after <= before for before, after in itertools.pairwise(phases)):
            raise refusal("its phases do not rise", "points in the order of their phases", "pressure")
        return self


class GaitPhase(Described):
    """Commands by a gait phase that is estimated from a sensor; every other key is a chamber."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, ChamberPhases] = Field(init=False)

    estimator: Literal["oscillator", "foot_switch"] = "oscillator"
    """An oscillator on the shank's angle, or time since heel strike over the mean of the last strides."""
    column: str | None = None
    """Column or "sensor/<name>" of an oscillator; "shank/angle" by default."""
    switch: str | None = None
    """Column or "sensor/<name>" of a foot switch; "foot/heel_load" by default, beside an oscillator none."""
    heel_strike: Load = 50.0
    """Load from which on the foot switch is closed; it opens below half of it."""
    strides: Annotated[int, Field(ge=1, le=20)] = 3
    """Strides whose mean duration a foot switch counts with."""
    waiting: Literal["shut", "outlet"] = "shut"
    """Command of all its chambers while the phase is not known: at first, and where the walker stands."""

    @property
    def chambers(self) -> dict[str, ChamberPhases]:
        """What is told of each chamber."""
        return dict(self.__pydantic_extra__ or {})

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {chamber: chamber for chamber in self.chambers}

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them whose drive is asked for a pressure."""
        return {chamber: chamber for chamber, told in self.chambers.items() if told.pressure}

    @property
    def angle(self) -> str:
        """Column of the shank's angle, "" where no oscillator sees one."""
        return (self.column or "shank/angle") if self.estimator == "oscillator" else ""

    @property
    def load(self) -> str:
        """Column of the foot switch, "" where there is none."""
        return self.switch or ("foot/heel_load" if self.estimator == "foot_switch" else "")

    @model_validator(mode="after")
    def _switches_something(self) -> Self:
        if not self.chambers:
            raise refusal("names no chamber", "a table for each chamber, such as [dorsiflexor]")
        if self.estimator == "foot_switch" and self.column is not None:
            raise refusal("is for an oscillator; a foot switch has its own key", "switch", "column")
        return self
