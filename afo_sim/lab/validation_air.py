"""Flows that makers print beside C and b of their valves, and a printed line, against the flow laws."""

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.description import reader
from afo_sim.lab.validation_row import Row, compared, contradicted, number
from afo_sim.physics import nominal_flow, tube_conductance, tube_critical_ratio

SOURCE = "Abed 2025, doi 10.1109/IC2AI62984.2025.10932214"
BORE, LENGTH = 4e-3, 10.0  # [m]
CONDUCTANCE, RATIO = 0.45, 0.21
SECOND_HAND = "printed, read second-hand"


def _line() -> list[Row]:
    ours = tube_conductance(BORE, LENGTH) / SONIC
    return [
        number(
            SOURCE,
            "tube of 4 mm and 10 m, sonic conductance",
            CONDUCTANCE,
            ours,
            0.02 * CONDUCTANCE,
            "dm³/(s·bar)",
            sourcing=SECOND_HAND,
            why="2 %: it is printed to two digits",
        ),
        compared(
            SOURCE,
            "tube of 4 mm and 10 m, critical pressure ratio",
            RATIO,
            tube_critical_ratio(BORE, LENGTH),
            "",
            sourcing=SECOND_HAND,
            why="the formula for tubes gives a lower critical pressure ratio than the printed line has",
        ),
    ]


TUBE_PARTS = (_line,)
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


def _smc() -> list[Row]:
    found = [
        number(
            SMC,
            f"{name.upper()}: flow from 6 to 5 bar gauge, ANR",
            printed,
            _shipped_flow(name, STANDARD_DENSITY),
            0.002 * printed,
            "l/min",
            sourcing=PRINTED,
            why=WHY_SY,
        )
        for name, printed in SY.items()
    ]
    example = LITRES * nominal_flow(2.0 * SONIC, 0.3, 4e5, 3e5, STANDARD_DENSITY)
    quantity = "worked example, C = 2, b = 0.3: flow from 4 to 3 bar gauge, ANR"
    return [*found, number("SMC", quantity, 420.0, example, 0.42, "l/min", sourcing=PRINTED, why=WHY_EXAMPLE)]


def _festo() -> list[Row]:
    mpye, vuvs = (_shipped_flow(name, NORMAL_DENSITY) for name in ("mpye_1_4", "vuvs_lt25"))
    quantity = "{}: flow from 6 to 5 bar gauge, DIN 1343"
    return [
        number(
            "Festo MPYE 2025/03",
            quantity.format("MPYE-5-1/4"),
            1400.0,
            mpye,
            7.0,
            "l/min",
            sourcing=PRINTED,
            why=WHY_MPYE,
        ),
        contradicted(
            "disagrees",
            "Festo 8035170",
            quantity.format("VUVS-LT25"),
            VUVS,
            VUVS_IMPLIED,
            vuvs,
            1.0,
            "l/min",
            sourcing=PRINTED,
            why=WHY_VUVS,
        ),
    ]


VALVE_PARTS = (_smc, _festo)
