"""Flows that makers print beside C and b of their valves, and a printed line, against the flow laws."""

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.description import reader
from afo_sim.lab.validation_row import Row, rows
from afo_sim.physics import nominal_flow, tube_conductance, tube_critical_ratio

BORE, LENGTH = 4e-3, 10.0  # [m]
LITRES = 6e4  # m³/s in l/min
SONIC = 1e-8  # dm³/(s·bar) in m³/(s·Pa)


def tube() -> list[Row]:
    conductance = tube_conductance(BORE, LENGTH) / SONIC
    return rows("valves", "tube", conductance, tube_critical_ratio(BORE, LENGTH))


def _shipped_flow(name: str, density: float) -> float:
    """Flow of a shipped valve from 6 to 5 bar gauge [l/min of a norm]."""
    valve = reader.load("valve", name)
    return LITRES * nominal_flow(valve.conductance, valve.critical_ratio, 6e5, 5e5, density)


def smc() -> list[Row]:
    flows = [_shipped_flow(f"sy{k}000", STANDARD_DENSITY) for k in (3, 5, 7, 9)]
    return rows("valves", "smc", *flows, LITRES * nominal_flow(2.0 * SONIC, 0.3, 4e5, 3e5, STANDARD_DENSITY))


def festo() -> list[Row]:
    return rows(
        "valves", "festo", *(_shipped_flow(name, NORMAL_DENSITY) for name in ("mpye_1_4", "vuvs_lt25"))
    )
