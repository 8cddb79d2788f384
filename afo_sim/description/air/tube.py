"""A tube as it is described: its bore, from which its flow follows for any length."""

from typing import Annotated

from afo_sim.description.quantity import Named, Quantity, refusal
from afo_sim.physics import AIR, sound_delay, tube_conductance, tube_critical_ratio, tube_volume

Diameter = Annotated[float, Quantity("m", above=0.0, at_most=0.05)]


class Tube(Named):
    """A tube of a kind that one can buy by the metre."""

    bore: Diameter
    """Inner diameter, which its flow follows from."""
    outer_diameter: Diameter | None = None
    """Outer diameter, which fittings are chosen by; no flow depends on it."""

    def conductance(self, length: float) -> float:
        """Sonic conductance C [m³/(s·Pa)] of a length [m]; formula and source: `physics/tube.py`."""
        return tube_conductance(self.bore, length)

    def critical_ratio(self, length: float) -> float:
        """Critical pressure ratio b [-] of a length [m]."""
        return tube_critical_ratio(self.bore, length)

    def volume(self, length: float) -> float:
        """Air volume [m³] of a length [m]."""
        return tube_volume(self.bore, length)

    def delay(self, length: float) -> float:
        """Time that sound takes through a length [m] at 20 °C [s]."""
        return sound_delay(length, gas_constant=AIR.constant, heat_capacity_ratio=AIR.heat_capacity_ratio)

    def _must_have_a_wall(self) -> None:
        if self.outer_diameter is not None and self.outer_diameter <= self.bore:
            least = f"more than the bore's {1e3 * self.bore:g} mm"
            raise refusal("is not above the bore: the tube would have no wall", least, "outer_diameter")
