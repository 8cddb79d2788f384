"""Compressed air before the orthosis: its pressure, where it comes from, what holds its pressure."""

from typing import Annotated

from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.source import Source
from afo_sim.description.quantity import Described, Quantity, amount, refusal

Pressure = Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]


class Supply(Described):
    """Compressed air at a set gauge pressure, endless unless a source is named."""

    pressure: Pressure
    """Gauge pressure before the inlet valves."""
    source: Source | None = None
    """Bottle, cartridge or compressor: a shipped name, or the path of a source's TOML file or folder; endless
    air by default."""
    regulator: Regulator | None = None
    """Regulator that holds the pressure: a shipped name, or the path of a regulator's TOML file or folder; an
    ideal one by default."""
    line_pressure: Pressure | None = None
    """Gauge pressure of endless air before the regulator."""

    @property
    def fixed(self) -> float:
        """Gauge pressure of the endless air, or the set one [Pa]."""
        return self.pressure if self.line_pressure is None else self.line_pressure

    def _must_fit_together(self) -> None:
        if self.regulator is None and self.line_pressure is not None:
            raise refusal("needs a regulator", "a regulator beside it", "line_pressure")
        if self.regulator is not None and self.source is None and self.line_pressure is None:
            problem = "is missing: the regulator has nothing before it"
            raise refusal(problem, "a line_pressure, or a source", "line_pressure")
        if self.source is not None and self.line_pressure is not None:
            problem = "conflicts with a source: only one of them may feed the regulator"
            raise refusal(problem, "line_pressure or source", "line_pressure")
        if self.line_pressure is not None and self.line_pressure <= self.pressure:
            most = f"above the set pressure, {amount(self.pressure, 'Pa')}"
            raise refusal("is not above what the regulator is set to", most, "line_pressure")
        if self.regulator is not None:
            low, high = self.regulator.set_range
            if not low <= self.pressure <= high:
                told = f"{amount(low, 'Pa')} to {amount(high, 'Pa')}, as of this regulator"
                raise refusal("cannot be set on its regulator", told, "pressure")
        if self.source is not None and not self.source.given(self.pressure) > 0.0:
            has = self.source.highest
            problem = f"is more than its full source has ({self.source.name or self.source.kind}, {has})"
            raise refusal(problem, f"less than {has.removeprefix('at most ')}, or another source", "pressure")
