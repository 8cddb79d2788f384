"""A pressure regulator as it is described: its droop, its full opening, its relief."""

from typing import Annotated

from afo_sim.common import STANDARD_DENSITY
from afo_sim.description.quantity import Named, Quantity, refusal

Gauge = Annotated[float, Quantity("Pa", at_least=0.0, at_most=3.5e6)]
Conductance = Annotated[float, Quantity("m^3/(s*Pa)", above=0.0, at_most=1e-6)]
Ratio = Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]


class Regulator(Named):
    """A pressure regulator: the more flow is taken, the further its outlet falls below what is set."""

    droop: Annotated[float, Quantity("Pa", above=0.0, at_most=1e6)]
    """Fall of the outlet's pressure below the set one at the rated flow; linear in the flow."""
    rated_flow: Annotated[float, Quantity("m^3/s", above=0.0, at_most=1.0)]
    """Flow of free air (ANR: 20 °C, 1 bar) at which the droop is stated."""
    conductance: Conductance
    """Sonic conductance C (ISO 6358) of the fully open regulator, which bounds its flow."""
    critical_ratio: Ratio = 0.3
    """Critical pressure ratio b (ISO 6358) of the fully open regulator, and of its relief."""
    relief: Annotated[float, Quantity("Pa", at_least=0.0, at_most=1e6)] | None = None
    """Pressure above the set one from which it lets air out of its outlet; without it it never does."""
    relief_conductance: Conductance | None = None
    """Sonic conductance C of the fully open relief; that of the regulator by default."""
    outlet_volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    """Air volume behind the seat, up to the next part."""
    bleed: Annotated[float, Quantity("m^3/s", at_least=0.0, at_most=0.01)] = 0.0
    """Flow of free air (ANR) that it always takes from the source and lets go."""
    set_range: tuple[Gauge, Gauge]
    """Lowest and highest gauge pressure that can be set."""

    @property
    def gain(self) -> float:
        """Mass flow by droop [kg/(s·Pa)]."""
        return STANDARD_DENSITY * self.rated_flow / self.droop

    @property
    def bleed_flow(self) -> float:
        """Mass flow of the bleed [kg/s]."""
        return STANDARD_DENSITY * self.bleed

    @property
    def opens_to_ambient(self) -> float:
        """Sonic conductance of its relief [m³/(s·Pa)]; 0 without one."""
        if self.relief is None:
            return 0.0
        return self.conductance if self.relief_conductance is None else self.relief_conductance

    def _must_fit_together(self) -> None:
        low, high = self.set_range
        if low >= high:
            raise refusal("is not a valid range: its first pressure is not below its second", "", "set_range")
        if self.droop >= high:
            most = f"below the highest set pressure, {1e-5 * high:g} bar"
            raise refusal("is more than can be set", most, "droop")
        if self.relief is None and self.relief_conductance is not None:
            raise refusal("has no relief that it is of", "nothing without `relief`", "relief_conductance")
