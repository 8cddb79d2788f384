"""Gases that drive an orthosis: air, and carbon dioxide out of a cartridge."""

import math
from dataclasses import dataclass

from afo_sim.common import AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO, STANDARD_DENSITY

Row = tuple[float, float, float, float, float, float, float]  # (R, c_v, b0, b1, c0, c1, liquefies)
REFERENCE_PRESSURE = 1e5  # of the ISO 8778 reference atmosphere [Pa]


@dataclass(frozen=True)
class Gas:
    """A gas: ideal in the muscles, with its real pressure in a bottle.

    The virial coefficients B = b0 + b1/T and C = c0 + c1/T are those of `physics/store.py`.
    """

    name: str  # such as "air"
    constant: float  # R [J/(kg·K)]
    heat_capacity_ratio: float  # γ [-]
    free_density: float  # at 20 °C and 1 bar [kg/m³], by which litres of free gas (ANR) are counted
    second: tuple[float, float] = (0.0, 0.0)  # b0 [m³/kg], b1 [m³·K/kg] of B = b0 + b1/T
    third: tuple[float, float] = (0.0, 0.0)  # c0 [m⁶/kg²], c1 [m⁶·K/kg²] of C = c0 + c1/T
    liquefies: bool = False  # a store of it can hold liquid
    source: str = ""  # of the numbers

    @property
    def heat_capacity(self) -> float:
        """At constant volume, c_v = R/(γ − 1) [J/(kg·K)]."""
        return self.constant / (self.heat_capacity_ratio - 1.0)

    @property
    def flow_factor(self) -> float:
        """Choked mass flow through a hole by that of air, from the same pressure and temperature [-].

        ṁ ∝ √(γ/R) (2/(γ + 1))^((γ + 1)/(2 (γ − 1))): 1 of air, 1.198 of carbon dioxide.
        """
        air = _choked(GAS_CONSTANT, HEAT_CAPACITY_RATIO)
        return _choked(self.constant, self.heat_capacity_ratio) / air

    @property
    def litres_per_gram(self) -> float:
        """Litres of free gas (ANR: 20 °C, 1 bar) that a gram is."""
        return 1.0 / self.free_density

    @property
    def row(self) -> Row:
        """The gas as the kernels of `physics/store.py` take it: (R, c_v, b0, b1, c0, c1, liquefies)."""
        return (self.constant, self.heat_capacity, *self.second, *self.third, float(self.liquefies))


def _choked(constant: float, ratio: float) -> float:
    """Choked flow by pressure and area, but for the temperature: √(γ/R) (2/(γ+1))^((γ+1)/(2(γ−1)))."""
    power = (ratio + 1.0) / (2.0 * (ratio - 1.0))
    return math.sqrt(ratio / constant) * float((2.0 / (ratio + 1.0)) ** power)


AIR = Gas(
    "air",
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
    second=(2.1467646e-3, -0.73701083),
    third=(1.0418722e-8, 6.1664402e-4),
    source=(
        "virial coefficients fitted here: at 20 °C to COMPRESSIBILITY of metrics/bottle.py, 0 to 300 bar, "
        "within 0.24 % of the pressure; their slopes by temperature to CoolProp 8.0 (Lemmon et al. 2000), "
        "10 to 350 bar, within 1.8 % from 220 to 330 K"
    ),
)
_CO2_CONSTANT = 188.92  # 8.314462 J/(mol·K) by 44.0095 g/mol
CO2 = Gas(
    "co2",
    _CO2_CONSTANT,
    1.29,
    REFERENCE_PRESSURE / (_CO2_CONSTANT * AMBIENT_TEMPERATURE),
    second=(4.87210074e-3, -2.28181942),
    third=(-6.3599541e-6, 2.63352392e-3),
    liquefies=True,
    source=(
        "γ of the gas at some 20 °C and 1 bar; virial coefficients fitted here to CoolProp 8.0 (Span & "
        "Wagner 1996, doi 10.1063/1.555991), 220 to 300 K, up to saturation, within 0.34 % of the pressure"
    ),
)
GASES = {gas.name: gas for gas in (AIR, CO2)}
