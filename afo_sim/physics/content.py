"""How much gas is in a bottle or cartridge, and how much of it comes out before the pressure is too low."""

import math

from afo_sim.common import AMBIENT_TEMPERATURE
from afo_sim.physics.gas import Gas
from afo_sim.physics.store import (
    gas_pressure,
    saturation,
    store_pressure,
    store_temperature_rate,
    vapour_density,
)

SMALL = 1e-13  # share of a density to which it is found
# Of a store that cools: largest part of its first mass that a step takes, and of what is left, the share to
# which its end is found, and the kelvin over which a slope is taken
PART, PART_LEFT, CLOSE, WARMER = 0.01, 0.05, 1e-6, 1e-3


def gas_mass(gas: Gas, volume: float, pressure: float, temperature: float = AMBIENT_TEMPERATURE) -> float:
    """Mass of a real gas in a volume at a pressure, without liquid, by bisection of its density [kg].

    Parameters
    ----------
    gas : of `physics/gas.py`
    volume : [m³]
    pressure : absolute [Pa], to 350 bar; where the gas liquefies below it, that of saturation counts
    temperature : [K]
    """
    low, high = 0.0, 2.0 * pressure / (gas.constant * temperature)
    if gas.liquefies:
        high = vapour_density(temperature, gas.row)
        if pressure >= saturation(temperature)[0]:
            return volume * high
    while high - low > SMALL * high:
        middle = 0.5 * (low + high)
        if gas_pressure(middle, temperature, gas.row) < pressure:
            low = middle
        else:
            high = middle
    return volume * (0.5 * (low + high))


def mass_given(
    gas: Gas, volume: float, mass: float, pressure: float, temperature: float = AMBIENT_TEMPERATURE
) -> float:
    """Gas that a store gives until its pressure is down to one that is needed, and it stays warm [kg].

    Parameters
    ----------
    gas : of `physics/gas.py`
    volume : of the store [m³]
    mass : of what is in it, gas and liquid [kg]
    pressure : absolute, that is needed [Pa]
    temperature : [K]

    Returns
    -------
    float : 0 where the store is below that pressure from the first
    """
    if gas.liquefies and pressure >= saturation(temperature)[0]:
        return 0.0
    return max(0.0, mass - gas_mass(gas, volume, pressure, temperature))


def mass_given_at(
    gas: Gas, volume: float, mass: float, pressure: float, flow: float, *, shell: float = 0.0,
    conductance: float = 0.0, temperature: float = AMBIENT_TEMPERATURE,
) -> float:  # fmt: skip
    """Gas that a store gives at a steady flow until its pressure is down to one that is needed [kg].

    What leaves cools what stays: `store_temperature_rate`. A step h takes a share of the mass and is solved
    by the exponential midpoint rule T += h φ(h J) Ṫ(m − ṁ h/2, T), φ(z) = (eᶻ − 1)/z, J = ∂Ṫ/∂T, of second
    order and stable where the surroundings warm it faster than a step.

    Parameters
    ----------
    gas, volume, pressure : as in `mass_given`
    mass : of what is in it at first, gas and liquid [kg]
    flow : that is taken [kg/s], above 0
    shell : heat capacity of the shell, which is as warm as its content [J/K]
    conductance : hA to the surroundings [W/K]
    temperature : at first, and of the surroundings [K]

    Returns
    -------
    float : 0 where the store is below that pressure from the first. Below −56.6 °C of carbon dioxide it holds
        no more, as there is no dry ice in it
    """
    row = gas.row

    def stepped(held: float, warm: float, taken: float) -> float:
        """Temperature after a mass is taken."""

        def rate(at: float) -> float:
            middle = held - 0.5 * taken
            return store_temperature_rate(middle, at, volume, 0.0, flow, shell, conductance, temperature, row)

        here = rate(warm)
        exponent = (rate(warm + WARMER) - here) / WARMER * taken / flow
        return warm + taken / flow * here * (math.expm1(exponent) / exponent if exponent else 1.0)

    def enough(held: float, warm: float) -> bool:
        return store_pressure(held, warm, volume, row) >= pressure

    held, warm = mass, temperature
    if not enough(held, warm):
        return 0.0
    while True:
        taken = min(PART * mass, PART_LEFT * held)
        after = stepped(held, warm, taken)
        if not enough(held - taken, after):
            break
        held, warm = held - taken, after
    low, high = 0.0, taken
    while high - low > CLOSE * mass:
        middle = 0.5 * (low + high)
        if enough(held - middle, stepped(held, warm, middle)):
            low = middle
        else:
            high = middle
    return mass - held + low
