"""Flows that makers print beside C and b of their valves, and a printed line, against the flow laws."""

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.description import reader
from afo_sim.lab.validation_row import About, Row
from afo_sim.physics import nominal_flow, tube_conductance, tube_critical_ratio

SOURCE = "Abed 2025, doi 10.1109/IC2AI62984.2025.10932214"
BORE, LENGTH = 4e-3, 10.0  # [m]
CONDUCTANCE, RATIO = 0.45, 0.21
SECOND_HAND = "printed, read second-hand"
WHY_RATIO = "the formula for tubes gives a lower critical pressure ratio than the printed line has"


def tube() -> list[Row]:
    ours, what = tube_conductance(BORE, LENGTH) / SONIC, "tube of 4 mm and 10 m"
    printed = About(SOURCE, "dm³/(s·bar)", SECOND_HAND, "2 %: it is printed to two digits")
    ratio = About(SOURCE, "", SECOND_HAND, WHY_RATIO)
    return [
        printed.number(f"{what}, sonic conductance", CONDUCTANCE, ours, 0.02 * CONDUCTANCE),
        ratio.compared(f"{what}, critical pressure ratio", RATIO, tube_critical_ratio(BORE, LENGTH)),
    ]


LITRES = 6e4  # m³/s in l/min
SONIC = 1e-8  # dm³/(s·bar) in m³/(s·Pa)
SMC = "SMC EUS11-83B-UK"
PRINTED = "printed with C and b"
SY = {"sy3000": 276.0, "sy5000": 746.0, "sy7000": 1130.0, "sy9000": 2527.0}  # l/min ANR
WHY_SY = "0.2 %: C is printed to two digits"
WHY_MPYE = "0.5 %: the flow is printed to two digits"
WHY_EXAMPLE = "0.1 %: a worked example"
# By hand: 60·4.4·7·√(1 − ((6/7 − 0.4)/0.6)²)·1.185/1.293
VUVS, VUVS_IMPLIED = 1000.0, 1096.95
WHY_VUVS = (
    "its own C and b give 10 % more than the flow beside them, which is rounded or guaranteed: this maker's "
    "nominal flow gives a conductance to ±10 %"
)


def _shipped_flow(name: str, density: float) -> float:
    """Flow of a shipped valve from 6 to 5 bar gauge [l/min of a norm]."""
    valve = reader.load("valve", name)
    return LITRES * nominal_flow(valve.conductance, valve.critical_ratio, 6e5, 5e5, density)


def smc() -> list[Row]:
    valve = About(SMC, "l/min", PRINTED, WHY_SY)
    found = [
        valve.number(
            f"{name.upper()}: flow from 6 to 5 bar gauge, ANR",
            printed,
            _shipped_flow(name, STANDARD_DENSITY),
            0.002 * printed,
        )
        for name, printed in SY.items()
    ]
    example = LITRES * nominal_flow(2.0 * SONIC, 0.3, 4e5, 3e5, STANDARD_DENSITY)
    quantity = "worked example, C = 2, b = 0.3: flow from 4 to 3 bar gauge, ANR"
    return [*found, About("SMC", "l/min", PRINTED, WHY_EXAMPLE).number(quantity, 420.0, example, 0.42)]


def festo() -> list[Row]:
    mpye, vuvs = (_shipped_flow(name, NORMAL_DENSITY) for name in ("mpye_1_4", "vuvs_lt25"))
    quantity = "{}: flow from 6 to 5 bar gauge, DIN 1343"
    proportional = About("Festo MPYE 2025/03", "l/min", PRINTED, WHY_MPYE)
    solenoid = About("Festo 8035170", "l/min", PRINTED, WHY_VUVS)
    numbers = (VUVS, VUVS_IMPLIED, vuvs, 1.0)
    return [
        proportional.number(quantity.format("MPYE-5-1/4"), 1400.0, mpye, 7.0),
        solenoid.contradicted("disagrees", quantity.format("VUVS-LT25"), *numbers),
    ]
