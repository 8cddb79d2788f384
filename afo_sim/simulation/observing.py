"""What a controller sees of a simulation: columns of the rows since its last command."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.description.scenario import Scenario
from afo_sim.model.build import Built
from afo_sim.simulation.columns import formulas
from afo_sim.simulation.describing import SENSOR, describe
from afo_sim.simulation.frame import Frame
from afo_sim.simulation.walk_columns import WalkFrame

Readings = Mapping[str, np.ndarray]  # of sensors, by name (n,)


@dataclass(frozen=True, eq=False)
class Seen:
    """An Observation: see `control/observation.py`.

    frame : rows since the last command; at the start the one row of the start
    readings : of the sensors at these rows
    time, period : present time and time to the next command [s]
    """

    frame: Frame
    readings: Readings
    time: float
    period: float
    columns: Mapping[str, Callable[[Frame], np.ndarray]]
    found: dict[str, np.ndarray] = field(default_factory=dict)

    def rows(self, column: str) -> np.ndarray:
        """All samples of a column since the last command (n,)."""
        if column not in self.found:
            self.found[column] = self._rows(column)
        return self.found[column]

    def __getitem__(self, column: str) -> float:
        return float(self.rows(column)[-1])

    def _rows(self, column: str) -> np.ndarray:
        if column.startswith(SENSOR):
            name = column.removeprefix(SENSOR)
            if name not in self.readings:
                raise _no_column(column, [f"{SENSOR}{known}" for known in self.readings])
            return self.readings[name]
        if column not in self.columns:
            raise _no_column(column, [*self.columns, *(f"{SENSOR}{known}" for known in self.readings)])
        return np.asarray(self.columns[column](self.frame))


def _no_column(column: str, known: list[str]) -> InputError:
    return unknown(column, known, field="column", problem="a controller sees no such column")


def seen_columns(built: Built) -> dict[str, Callable[[Any], np.ndarray]]:
    """Columns that a controller or a sensor can see: those that every roll-out records what they need for."""
    return formulas(built, whole=False)


def known_columns(built: Built) -> list[str]:
    """Names of all that a controller sees in a scenario: columns, and its sensors."""
    return [*seen_columns(built), *(f"{SENSOR}{name}" for name in built.scenario.sensor)]


def unit_of(scenario: Scenario, column: str) -> str:
    """SI unit of what a controller sees; a sensor's is that of its column, and a switch has none."""
    if column.startswith(SENSOR):
        sensor = scenario.sensor[column.removeprefix(SENSOR)]
        return "" if sensor.is_switch else describe(sensor.column)[0]
    return describe(column)[0]


def frame_of(built: Built, rows: dict[str, np.ndarray], control: np.ndarray, first_step: int) -> Frame:
    """A stretch as the columns of this scenario take it."""
    kind = Frame if built.walk is None else WalkFrame
    return kind(built, rows, control, first_step)
