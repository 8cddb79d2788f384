"""How a published number is computed: what a row of `models/papers` or `models/validation` names under `by`.

That is one of VALUES, beside what it takes; `times` multiplies what is found. In a paper it may be
"validation": rows of a part of `models/validation`, by their source and as their quantity begins.

    run         of a scenario (with `set`): a metric; a column's min, max, range, first, last, or its
                switchings; or how many columns match a pattern
    apart       angle between a scenario's runs with two laws, RMS [deg]; `refit` fits one to the maker's
                points; of_swing = true for percent of the last one's swing
    stand       of a test of a muscle (with `given`): a metric, by default of the first curve; or static_load
    described   a key of a description
    repeats     standard deviation of a sensor over ten fillings
    calf_share  of a recorded stride's positive work [%]
    sensitivity  of a muscle's number, what 10 % more of a dimension change [%]
    torque_map  of a phase of a walk: torque needed, most that is lacking of it [N·m], or share of the time in
                which there is enough [%], at the supply's pressure
    force, contraction, line, laws_apart, along, curve, fit, tube, flow: see `validation_laws.py`
    s1_…        of S1's tables: see `validation_s1.py`
    knee, knee_muscles: torques on the pin knee: see `validation_knee.py`
"""

import fnmatch
import functools
import math
from collections.abc import Callable, Mapping

import numpy as np

from afo_sim.common import JsonDict, Mixed, assets, format_quantity
from afo_sim.description import load
from afo_sim.lab import stand_trial, validation_knee, validation_laws, validation_s1
from afo_sim.lab.calf_share import calf_share
from afo_sim.lab.law_fit import fit_law
from afo_sim.lab.law_problem import pose, select
from afo_sim.lab.stand import sensitivity, stand
from afo_sim.lab.validation_laws import Told, characteristic
from afo_sim.lab.validation_row import Row
from afo_sim.model.build import build
from afo_sim.physics import LAWS
from afo_sim.simulation import Recording, angle_differences, compare_laws, sensor_columns, torque_map
from afo_sim.simulation.run import run

TAKE: dict[str, Callable[[np.ndarray], float]] = {
    "min": np.min,
    "max": np.max,
    "range": np.ptp,
    "first": lambda values: values[0],
    "last": lambda values: values[-1],
}
REPEATS = 10
_lacking = functools.cache(lambda name, sets: torque_map(name, dict(sets), angles=[0.0]).lacking)


@functools.cache
def _recorded(scenario: str, sets: tuple[tuple[str, object], ...]) -> Recording:
    return run(scenario, dict(sets))


def recorded(told: Told) -> Recording:
    """The run that a row asks for; rows of one page share it."""
    return _recorded(told["scenario"], tuple(told.get("set", {}).items()))


def _of_run(told: Told) -> float | list[float]:
    found = recorded(told)
    if "metric" in told:
        return found.metrics[told["metric"]].value
    if "columns" in told:
        return len(fnmatch.filter(found.columns, told["columns"]))
    values = found[told["column"]]
    if told["take"] == "switchings":  # [s]
        return [float(found["time"][k]) for k in np.flatnonzero(np.diff(values > 0.5, prepend=False))]
    value = float(TAKE[told["take"]](values))
    return math.degrees(value) if told["unit"] in ("°", "deg") else value


@functools.cache
def compared(scenario: str, laws: tuple[str, ...], refit: str = "") -> dict[str, Recording]:
    """A scenario's runs with several laws, one of them fitted freely to the maker's points."""
    runs = compare_laws(scenario, laws)
    if refit:
        points, _ = select(characteristic("dmsp_20"))
        geometry = {"braid_angle": load("muscle", "dmsp_20").braid_angle}
        values = fit_law(pose(refit, [points], fixed=geometry)).values
        fitted = [p for p in LAWS[refit].parameters if p.name in values]
        texts = {p.name: format_quantity(float(values[p.name]), p.unit) for p in fitted}
        places = [f"orthosis.muscle.{group}.type.laws.{refit}" for group in ("flexor", "extensor")]
        sets = {f"{at}.{name}": text for at in places for name, text in texts.items()}
        runs |= compare_laws(scenario, [refit], sets)
    return runs


def _apart(told: Told) -> float:
    runs = compared(told["scenario"], tuple(told["laws"]), told.get("refit", ""))
    pair = {law: runs[law] for law in told["laws"]}
    (apart,) = angle_differences(pair).values()
    swing = np.ptp(pair[told["laws"][-1]]["ankle/angle"])
    return float(100.0 * apart / swing if told.get("of_swing") else np.degrees(apart))


def _on_stand(told: Told) -> float | list[float]:
    (trial,) = stand(told["test"], told["muscle"], **told.get("given", {})).trials
    if "column" in told:
        return float(TAKE[told["take"]](trial.curves[0][told["column"]]))
    if told["metric"] == "static_load":
        found = stand_trial.static_load(trial)
        return [found.start, found.slope * 1e3]  # [N, N/kPa]
    return trial.metrics[told.get("curve", 0)][told["metric"]].value


def _described(told: Told) -> float:
    found: Mixed = load(told["kind"], told["name"])
    for part in told["key"].split("."):
        found = found[part] if isinstance(found, Mapping) else getattr(found, part)
    return len(found) if isinstance(found, tuple | Mapping) else float(found)


def _torque_map(told: Told) -> float:
    found = _lacking(told["scenario"], tuple(told.get("set", {}).items()))
    ((need, lacking),) = ((need, short) for _, need, short in found if need.phase == told["phase"])
    if told["take"] == "enough":
        return 100.0 * float(np.mean(lacking[need.torque > 0.0] <= 0.0))
    return need.peak if told["take"] == "needed" else float(lacking.max())


def _sensitivity(told: Told) -> float:
    _, own, more = sensitivity(load("muscle", told["muscle"]), 1e5 * told["bar"])[told["of"]]
    return 100.0 * float(more / own - 1.0)


def _repeats(told: Told) -> float:
    sensor = {"x": {"column": told["column"], "type": told["sensor"]}}
    scenario = load("scenario", told["scenario"], {**told.get("set", {}), "sensor": sensor})
    built, columns = build(scenario), run(scenario, step="fixed").columns
    read = [float(sensor_columns(built, columns, seed)["sensor/x"][-1]) for seed in range(REPEATS)]
    return float(np.std(read, ddof=1))


VALUES: dict[str, Callable[[Told], Mixed]] = {
    "run": _of_run,
    "apart": _apart,
    "stand": _on_stand,
    "described": _described,
    "repeats": _repeats,
    "torque_map": _torque_map,
    "sensitivity": _sensitivity,
    "calf_share": lambda told: calf_share(told["stride"]),
    **{each.__name__: each for each in validation_laws.ASKED},
    "s1_table": validation_s1.of_table,
    "s1_joint": validation_s1.joint,
    "s1_hung": validation_s1.hung,
    "knee": validation_knee.of_test,
    "knee_muscles": validation_knee.muscles,
}


@functools.cache
def validated() -> tuple[JsonDict, ...]:
    """The rows of `models/validation`, in the order of its files."""
    return tuple(
        {"part": part} | group | row
        for file in sorted((assets.folder("models") / "validation").glob("*.toml"))
        for part, groups in assets.read_toml(file).items()
        for group in groups
        for row in group.get("rows", ({},))
    )


def rows_of(told: Told) -> list[Row]:
    """The rows of one published number, with what is computed for it."""
    if told.get("by") == "validation":
        named = [one for one in validated() if (one["part"], one["source"]) == (told["part"], told["source"])]
        begins = told["quantity"]
        return [row for one in named if one["quantity"].startswith(begins) for row in rows_of(one)]
    found = VALUES[told["by"]](told) if "by" in told else None  # a lost one
    several = found if isinstance(found, list) else [found]
    several = [value * told["times"] for value in several] if "times" in told else several
    alike = [told | one for one in told.get("each", [{}] * len(several))]
    return [Row.of(one, value) for one, value in zip(alike, several, strict=True)]
