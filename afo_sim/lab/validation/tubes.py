"""The flow of a printed pneumatic line against the formula for tubes."""

from afo_sim.lab.validation.row import Row, compared, number
from afo_sim.physics.tube import tube_conductance, tube_critical_ratio

UNIT = 1e-8  # dm³/(s·bar) in m³/(s·Pa)
SOURCE = "Abed 2025, doi 10.1109/IC2AI62984.2025.10932214"
BORE, LENGTH = 4e-3, 10.0  # [m]
CONDUCTANCE, RATIO = 0.45, 0.21
SECOND_HAND = "printed, read second-hand"


def _line() -> list[Row]:
    ours = tube_conductance(BORE, LENGTH) / UNIT
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


PARTS = (_line,)
