"""Unit and sign of each column of a recording, by its name."""

from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import unknown
from afo_sim.control.controller import TOLD
from afo_sim.metrics.strides import SOLVED
from afo_sim.model.walk import JOINTS
from afo_sim.model.walk_bodies import SINK
from afo_sim.simulation.columns import COLUMNS

DESCRIBED = {column.name: (column.unit, column.sign) for column in COLUMNS}
DESCRIBED |= {f"qpos/{name}": ("m", "MuJoCo coordinate") for name in (*JOINTS[:2], SINK)}  # those that slide
DESCRIBED[SOLVED] = (
    "",
    "1 in settled strides, whose air was solved for; 0 in those walked from the start",
)
DESCRIBED |= {f"controller/{name}": told for name, told in TOLD.items()}
SENSOR = "sensor/"


def describe(column: str, scenario: Mapping[str, Any] | None = None) -> tuple[str, str]:
    """(unit, sign) of a column; a sensor's are those of the column that it reads.

    Parameters
    ----------
    column : its name
    scenario : resolved, of the run; needed for "sensor/<name>"

    Raises
    ------
    InputError
        The scenario has no such sensor.
    """
    if column.startswith(SENSOR):
        return _of_sensor(column, (scenario or {}).get("sensor") or {})
    if column in DESCRIBED:
        return DESCRIBED[column]
    kind, _, *last = column.split("/")
    return DESCRIBED["/".join([kind, "*", *last])]


def _of_sensor(column: str, sensors: Mapping[str, Any]) -> tuple[str, str]:
    name, _, output = column.removeprefix(SENSOR).partition("/")
    if name not in sensors:
        problem = "is no sensor of the scenario, which tells its unit"
        raise unknown(column, [f"{SENSOR}{known}" for known in sensors], field="column", problem=problem)
    if output:
        return "V", "physical output"
    sensor = sensors[name]
    bought = sensor.get("type") or {}
    if any(table.get("threshold") is not None for table in (sensor, bought)):
        return "", "1 above the threshold, 0 below"
    unit, sign = describe(sensor["column"])
    return unit, f"reading of {sensor['column']}: {sign}"
