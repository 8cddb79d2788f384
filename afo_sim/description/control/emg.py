"""Control by muscle activation, as it is described."""

from typing import Annotated, Literal, Self

from pydantic import model_validator

from afo_sim.description.control.threshold import Threshold, in_si
from afo_sim.description.muscle import Pressure
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.walking import Share

LagTime = Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)]


class Emg(Described):
    """Pressure in proportion to an activation, delayed and low-passed as an electromyogram's envelope is.

    There is no model of electrodes: no noise, no crosstalk, no motion artefact.

    Source
    ------
    activation_time, deactivation_time: Thelen 2003, J. Biomech. Eng. 125, 70-77. The rest is assumed.
    """

    column: str = "ankle/moment/biological"
    """What stands for the activation: a column, or "sensor/<name>"."""
    side: Literal["dorsiflexor", "plantarflexor"] = "dorsiflexor"
    """Muscles that it is of: those of positive values of the column, or of negative ones."""
    full: Threshold = "10 N*m"
    """Value of the column at full activation."""
    delay: LagTime = 0.0
    """Time from the column to the activation, to whole control periods."""
    activation_time: LagTime = 0.015
    """Time constant with which the activation rises."""
    deactivation_time: LagTime = 0.05
    """Time constant with which it falls."""
    chamber: str = "dorsiflexor"
    """Chamber that is commanded."""
    pressure: Pressure | None = None
    """Pressure that its drive is asked for at full activation; by default its valves are switched."""
    fill_above: Share = 0.3
    """Activation from which on its inlet is open, where its valves are switched."""
    vent_below: Share = 0.15
    """Activation below which its outlet is open."""

    @property
    def named(self) -> dict[str, str]:
        """The chamber by the key that names it."""
        return {"chamber": self.chamber}

    @property
    def pressed(self) -> dict[str, str]:
        """The same where its drive is asked for a pressure."""
        return self.named if self.pressure is not None else {}

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if in_si(self.full) <= 0.0:
            raise refusal("is not positive", "a value above 0; side tells the sign", "full")
        if self.vent_below > self.fill_above:
            raise refusal("is above fill_above", f"at most {self.fill_above:g}", "vent_below")
        return self
