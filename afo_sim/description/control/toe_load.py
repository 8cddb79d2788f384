"""Control by the load under the toes, as it is described."""

from typing import Annotated, Self

from pydantic import model_validator

from afo_sim.description.muscle import Pressure
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.walking import Share


class ToeLoad(Described):
    """Push-off in proportion to the load under the toes, and a lifted foot while they bear little.

    Where both chambers have drives, thresholds should be so low that they do not work against each other.

    Source
    ------
    Proportional joint-moment control: Gasparri, Luque, Lerner 2019, IEEE Trans. Neural Syst. Rehabil. Eng.
    27(4), 751-759. They assist plantarflexion; thresholds, pressures and lifting here are assumed.
    """

    column: str = "foot/toe_load"
    """What is measured: a column, or "sensor/<name>"."""
    lifts: str | None = "dorsiflexor"
    """Chamber that is filled while the toes bear little, and vented while they bear much."""
    lift_pressure: Pressure | None = None
    """Pressure that its drive is asked for then; its inlet stays open by default."""
    unloaded: Share = 0.55
    """Share of the peak below which the lifting chamber is filled."""
    loaded: Share = 0.7
    """Share of the peak from which on it is vented, until the load falls below `unloaded`."""
    pushes: str | None = None
    """Chamber that pushes off; none by default."""
    peak: Annotated[float, Quantity("N", at_least=1.0, at_most=1e4)] = 700.0
    """Calibrated peak of the load, such as of the first minute of walking."""
    push_pressure: Pressure | None = None
    """Pressure that the drive of `pushes` is asked for at the peak; by default its valves are switched."""
    fill_above: Share = 0.5
    """Share of the peak from which on its inlet is open, where its valves are switched."""
    vent_below: Share = 0.3
    """Share of the peak below which its outlet is open."""

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        told = {"lifts": self.lifts, "pushes": self.pushes}
        return {key: chamber for key, chamber in told.items() if chamber is not None}

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them whose drive is asked for a pressure."""
        pressures = {"lifts": self.lift_pressure, "pushes": self.push_pressure}
        return {key: chamber for key, chamber in self.named.items() if pressures[key] is not None}

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if not self.named:
            raise refusal("commands no chamber", "lifts, pushes, or both", "lifts")
        if self.lifts == self.pushes:
            raise refusal("lifts and pushes with the same chamber", "two chambers", "pushes")
        for low, high in (("unloaded", "loaded"), ("vent_below", "fill_above")):
            if getattr(self, low) > getattr(self, high):
                raise refusal(f"is above {high}", f"at most {getattr(self, high):g}", low)
        for chamber, pressure in (("lifts", "lift_pressure"), ("pushes", "push_pressure")):
            if getattr(self, chamber) is None and getattr(self, pressure) is not None:
                raise refusal(f"has no effect without {chamber}", f"a chamber for {chamber}", pressure)
        return self
