"""What the program says to a row of a paper: the ways in which a number in `models/papers` is computed.

A row's table names one of VALUES under `by`, and what that takes:

    validation  rows of a part of `models/validation`: part, source, and quantity as it begins
    run         of a scenario (with `set`): a metric; a column's min, max, range, last, or its switchings; or
                how many columns match a pattern
    apart       angle between a scenario's runs with two laws, RMS [deg]; `refit` fits one to the maker's
                points; of_swing = true for percent of the last one's swing
    stand       of a test of a muscle (with `given`): a metric, by default of the first curve; or static_load
    force       of a muscle's law at a contraction and a pressure [N]
    described   a key of a description
    repeats     standard deviation of a sensor over ten fillings
    calf_share  of a recorded stride's positive work [%]
    torque_map  of a phase of a walk: torque needed, most that is lacking of it [N·m], or share of the time in
                which there is enough [%], at the supply's pressure
"""

import fnmatch
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from afo_sim.common import format_quantity
from afo_sim.description import load
from afo_sim.lab import stand_trial, validation
from afo_sim.lab.calf_share import calf_share
from afo_sim.lab.law_fit import fit_law
from afo_sim.lab.law_problem import pose, select
from afo_sim.lab.stand import stand
from afo_sim.lab.validation_laws import characteristic, law_force
from afo_sim.lab.validation_row import Row
from afo_sim.model.build import build
from afo_sim.physics import LAWS
from afo_sim.simulation import Recording, angle_differences, compare_laws, sensor_columns, torque_map
from afo_sim.simulation.run import run

Told = Mapping[str, Any]
TAKE: dict[str, Callable[[np.ndarray], float]] = {
    "min": np.min,
    "max": np.max,
    "range": np.ptp,
    "last": lambda values: values[-1],
}
REPEATS = 10


@functools.cache
def _recorded(scenario: str, sets: tuple[tuple[str, Any], ...]) -> Recording:
    return run(scenario, dict(sets))


def recorded(told: Told) -> Recording:
    """The run that a row asks for; rows of one page share it."""
    return _recorded(told["scenario"], tuple(told.get("set", {}).items()))


def _of_run(told: Told) -> Any:
    found = recorded(told)
    if "metric" in told:
        return told.get("times", 1.0) * found.metrics[told["metric"]].value
    if "columns" in told:
        return len(fnmatch.filter(found.columns, told["columns"]))
    values = found[told["column"]]
    if told["take"] == "switchings":  # [s]
        return [float(found["time"][k]) for k in np.flatnonzero(np.diff(values > 0.5, prepend=False))]
    value = float(TAKE[told["take"]](values))
    return math.degrees(value) if told["unit"] == "°" else told.get("times", 1.0) * value


@functools.cache
def compared(scenario: str, laws: tuple[str, ...], refit: str = "") -> dict[str, Recording]:
    """A scenario's runs with several laws, one of them fitted freely to the maker's points."""
    runs = compare_laws(scenario, laws)
    if refit:
        points, _ = select(characteristic(20))
        geometry = {"braid_angle": load("muscle", "dmsp_20").braid_angle}
        values = fit_law(pose(refit, [points], fixed=geometry)).values
        sets = {
            f"orthosis.muscle.{group}.type.laws.{refit}.{parameter.name}": format_quantity(
                float(values[parameter.name]), parameter.unit
            )
            for group in ("flexor", "extensor")
            for parameter in LAWS[refit].parameters
            if parameter.name in values
        }
        runs |= compare_laws(scenario, [refit], sets)
    return runs


def _apart(told: Told) -> float:
    runs = compared(told["scenario"], tuple(told["laws"]), told.get("refit", ""))
    pair = {law: runs[law] for law in told["laws"]}
    (apart,) = angle_differences(pair).values()
    swing = np.ptp(pair[told["laws"][-1]]["ankle/angle"])
    return float(100.0 * apart / swing if told.get("of_swing") else np.degrees(apart))


def _on_stand(told: Told) -> Any:
    (trial,) = stand(told["test"], told["muscle"], **told.get("given", {})).trials
    if "column" in told:
        return told.get("times", 1.0) * float(TAKE[told["take"]](trial.curves[0][told["column"]]))
    if told["metric"] == "static_load":
        found = stand_trial.static_load(trial)
        return [found.start, found.slope * 1e3]  # [N, N/kPa]
    return told.get("times", 1.0) * trial.metrics[told.get("curve", 0)][told["metric"]].value


def _force(told: Told) -> float:
    muscle = load("muscle", told["muscle"])
    at = (np.array([told["contraction"]]), np.array([told["bar"] * 1e5]))
    return float(law_force(muscle, told.get("law", muscle.law), *at)[0])


def _described(told: Told) -> float:
    found: Any = load(told["kind"], told["name"])
    for part in told["key"].split("."):
        found = found[part] if isinstance(found, Mapping) else getattr(found, part)
    return told.get("times", 1.0) * (len(found) if isinstance(found, tuple | Mapping) else float(found))


def _torque_map(told: Told) -> float:
    found = torque_map(told["scenario"], told.get("set"), angles=[0.0]).lacking
    ((need, lacking),) = ((need, short) for _, need, short in found if need.phase == told["phase"])
    if told["take"] == "enough":
        return 100.0 * float(np.mean(lacking[need.torque > 0.0] <= 0.0))
    return need.peak if told["take"] == "needed" else float(lacking.max())


def _repeats(told: Told) -> float:
    sensor = {"x": {"column": told["column"], "type": told["sensor"]}}
    scenario = load("scenario", told["scenario"], {**told.get("set", {}), "sensor": sensor})
    built, columns = build(scenario), run(scenario, step="fixed").columns
    read = [float(sensor_columns(built, columns, seed)["sensor/x"][-1]) for seed in range(REPEATS)]
    return told["times"] * float(np.std(read, ddof=1))


@functools.cache
def _part(name: str) -> list[Row]:
    return validation.PARTS[name]()


def _validation(told: Told) -> list[Row]:
    begins = told.get("quantity", "")
    return [
        row for row in _part(told["part"]) if row.source == told["source"] and row.quantity.startswith(begins)
    ]


VALUES: dict[str, Callable[[Told], Any]] = {
    "validation": _validation,
    "run": _of_run,
    "apart": _apart,
    "stand": _on_stand,
    "force": _force,
    "described": _described,
    "repeats": _repeats,
    "torque_map": _torque_map,
    "calf_share": lambda told: calf_share(told["stride"]),
}


def rows_of(told: Told) -> list[Row]:
    """The rows of one number of a paper: what is told of it, beside what is computed."""
    found = VALUES[told["by"]](told)
    if told["by"] == "validation":
        return list(found)
    several = found if isinstance(found, list) else [found]
    alike = [dict(told, **one) for one in told.get("each", [{}] * len(several))]
    return [Row.of({"sourcing": "", **one}, value) for one, value in zip(alike, several, strict=True)]
