"""A source of gas as it is described: a bottle, a cartridge of liquid carbon dioxide, a compressor."""

import math
from typing import Annotated, Literal

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.description.quantity import Named, Quantity, amount, refusal
from afo_sim.physics import CO2, GASES, Gas, compressor_flow, gas_mass, mass_given, mass_given_at, saturation

Gauge = Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
Flow = Annotated[float, Quantity("m^3/s", above=0.0, at_most=0.1)]

FULLEST = 750.0  # of a cartridge [kg/m³]: liquid alone would fill it at 22 °C
# Fields that a source of each kind needs, and those that it may have besides; it has no others.
NEEDED = {
    "bottle": ("filling_pressure",),
    "cartridge": ("content",),
    "compressor": ("switch_on", "switch_off", "free_air_delivery", "stall_pressure"),
}
MAY_HAVE = {
    "bottle": ("shell_heat_capacity",),
    "cartridge": ("shell_heat_capacity",),
    "compressor": ("delivery_pressure", "electric_power"),
}
OF_ONE_KIND = {name for table in (NEEDED, MAY_HAVE) for names in table.values() for name in names}


class Source(Named):
    """A source of gas that is not endless: it runs empty, cools, or delivers only so much."""

    kind: Literal["bottle", "cartridge", "compressor"]
    """A bottle of gas, a cartridge of liquid carbon dioxide below its vapour, or a compressor with a tank."""
    gas: Literal["air", "co2"] = "air"
    """Gas that it gives."""
    volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    """Volume of the bottle, cartridge, or the compressor's tank."""
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e3)] = 0.0
    """Heat conductance hA from its surroundings to the gas; 0 lets no heat in."""
    mass: Annotated[float, Quantity("kg", above=0.0, at_most=100.0)] | None = None
    """Mass of all of it, full."""
    filling_pressure: Annotated[float, Quantity("Pa", above=0.0, at_most=3.5e7)] | None = None
    """Of a bottle: gauge pressure when full, at 20 °C."""
    content: Annotated[float, Quantity("kg", above=0.0, at_most=50.0)] | None = None
    """Of a cartridge: mass of the carbon dioxide in a full one."""
    shell_heat_capacity: Annotated[float, Quantity("J/K", at_least=0.0, at_most=1e5)] | None = None
    """Of a bottle or cartridge: heat capacity of the shell, which is as warm as its content; none by
    default."""
    switch_on: Gauge | None = None
    """Of a compressor: gauge pressure in its tank at which it starts."""
    switch_off: Gauge | None = None
    """Of a compressor: gauge pressure in its tank at which it stops."""
    free_air_delivery: Flow | None = None
    """Of a compressor: flow of free air (ANR: 20 °C, 1 bar) at its delivery pressure."""
    delivery_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)] | None = None
    """Of a compressor: gauge pressure at which it gives its free air delivery; 0 by default."""
    stall_pressure: Gauge | None = None
    """Of a compressor: gauge pressure at which it gives nothing; its flow falls linearly to there."""
    electric_power: Annotated[float, Quantity("W", above=0.0, at_most=1e5)] | None = None
    """Of a compressor: electric power while it runs; without it no energy is reported."""

    @property
    def real_gas(self) -> Gas:
        """What is known of its gas."""
        return GASES[self.gas]

    @property
    def shell(self) -> float:
        """Heat capacity of the shell [J/K]."""
        return self.shell_heat_capacity or 0.0

    @property
    def full_mass(self) -> float:
        """Gas, and liquid, in the full bottle or cartridge, or in the tank as the compressor stops [kg]."""
        if self.content is not None:
            return self.content
        return gas_mass(self.real_gas, self.volume, AMBIENT_PRESSURE + self._full_pressure)

    def given(self, pressure: float) -> float:
        """Gas that the full one gives, slowly, down to a gauge pressure [Pa] that is needed [kg]."""
        return mass_given(self.real_gas, self.volume, self.full_mass, AMBIENT_PRESSURE + pressure)

    def given_at(self, pressure: float, flow: float, content: float | None = None) -> float:
        """Gas that it gives at a steady flow, cooling, until it is down to a needed gauge pressure."""
        return mass_given_at(
            self.real_gas, self.volume, self.full_mass if content is None else content,
            AMBIENT_PRESSURE + pressure, flow, shell=self.shell, conductance=self.wall_conductance,
        )  # fmt: skip

    def free_litres(self, pressure: float) -> float:
        """`given` as litres of free gas (ANR)."""
        return 1e3 * self.given(pressure) * self.real_gas.litres_per_gram

    def delivery(self, pressure: float) -> float:
        """Mass flow [kg/s] of the running compressor against a gauge pressure [Pa]; 0 of other kinds."""
        if self.free_air_delivery is None or self.stall_pressure is None:
            return 0.0
        return compressor_flow(
            pressure, self.free_air_delivery, self.delivery_pressure or 0.0, self.stall_pressure
        )

    def duty(self, flow: float) -> float:
        """Share of time that the compressor runs while a mass flow [kg/s] is taken [-]; 0 of other kinds."""
        if self.switch_on is None or self.switch_off is None or flow <= 0.0:
            return 0.0
        least, most = self.delivery(self.switch_off), self.delivery(self.switch_on)
        if flow >= least:
            return 1.0
        span = self.switch_off - self.switch_on
        runs = span / (most - least) * math.log((most - flow) / (least - flow))
        return runs / (runs + span / flow)

    @property
    def highest(self) -> str:
        """Gauge pressure when full, in words; that of a cartridge is its vapour's."""
        liquid = self.content is not None
        pressure = saturation(AMBIENT_TEMPERATURE)[0] - AMBIENT_PRESSURE if liquid else self._full_pressure
        return f"{'at most ' if liquid else ''}{amount(pressure, 'Pa', 3)}"

    @property
    def _full_pressure(self) -> float:
        """Gauge pressure when full [Pa]."""
        return self.filling_pressure or self.switch_off or 0.0

    def _must_have_and_hold_what_its_kind_does(self) -> None:
        own = (*NEEDED[self.kind], *MAY_HAVE[self.kind])
        for name in sorted(OF_ONE_KIND - {*own}):
            if getattr(self, name) is not None:
                problem = f"is not a valid key of a {self.kind}"
                raise refusal(problem, f"{', '.join(own)} besides those of all", name)
        for name in NEEDED[self.kind]:
            if getattr(self, name) is None:
                raise refusal(f"is missing; a {self.kind} needs it", ", ".join(NEEDED[self.kind]), name)
        if self.kind == "cartridge" and self.gas != "co2":
            raise refusal("cannot be liquid at ambient temperature", '"co2" of a cartridge', "gas")
        if self.kind == "compressor" and self.gas != "air":
            raise refusal("is not what a compressor takes in", '"air" of a compressor', "gas")
        if self.content is not None and self.content > FULLEST * self.volume:
            most = f"at most {amount(FULLEST * self.volume, 'kg', 4)} in this volume (0.75 kg/l)"
            raise refusal(
                "would burst it when it warms up: the liquid has no room to expand", most, "content"
            )
        liquid = saturation(AMBIENT_TEMPERATURE)[0] - AMBIENT_PRESSURE
        if self.gas == CO2.name and (self.filling_pressure or 0.0) >= liquid:
            most = f"below {1e-5 * liquid:.1f} bar, or a cartridge with its content"
            raise refusal("would make it liquid", most, "filling_pressure")

    def _must_switch_in_order(self) -> None:
        on, off, stall = self.switch_on, self.switch_off, self.stall_pressure
        if on is None or off is None or stall is None:
            return
        if on >= off:
            least = f"below the {1e-5 * off:g} bar at which it stops"
            raise refusal("is not below the pressure at which it stops", least, "switch_on")
        if off >= stall:
            most = f"below the {1e-5 * stall:g} bar at which it delivers nothing"
            raise refusal("would never be reached: the compressor stalls before", most, "switch_off")
        if (self.delivery_pressure or 0.0) >= stall:
            most = f"below the {1e-5 * stall:g} bar at which it delivers nothing"
            raise refusal("is not below the stall pressure", most, "delivery_pressure")
