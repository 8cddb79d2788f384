"""Keerthana et al. (S1): bench and simulation tables, each beside two models that must do worse."""

import math

import numpy as np

from afo_sim.common import GRAVITY, JsonDict, JsonMapping, Mixed, assets
from afo_sim.description import load
from afo_sim.lab.identifiability import rms
from afo_sim.lab.law_fit import fit_law, held_out
from afo_sim.lab.law_problem import pose
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.stand import stand
from afo_sim.physics import LAWS, Braid, contractions

CM = 100.0  # per metre
# Table → the muscle it is about. I and II were measured, III and IV simulated by S1.
TABLES = {1: "s1_215mm", 2: "s1_120mm", 3: "s1_215mm", 4: "s1_120mm"}
PRINT = 0.05  # half of the last printed digit [cm]
STILL = "a muscle that never moves"
MISPRINT = 8  # row of table IV: 2 kg, 4 bar
REST = 10.0  # in which hung masses come to rest [s]


def table(number: int) -> Measured:
    """One of S1's tables I to IV, as it is printed."""
    return read_measured(assets.folder("models") / "muscles" / TABLES[number] / f"table_{number}.csv")


def model(number: int, force: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Change of length at forces [N] and gauge pressures [Pa], statically, of a table's model [cm]."""
    # of I and II the muscle fitted to both; of III and IV the braid of their headers: 37°, 5 mm, no ends
    muscle = load("muscle", TABLES[number])
    law, coefficients, length = LAWS[muscle.law], muscle.coefficients, muscle.nominal_length
    if number > 2:
        facts, law = table(number).facts, LAWS["tondu_lopez_2000"]
        length = facts["total_length"]
        coefficients = law.coefficients(Braid(length, facts["bore"] / 2.0, facts["braid_angle"]), {"k": 1.0})
    return CM * length * contractions(law.native_id, coefficients, force, pressure)


def _change(number: int) -> np.ndarray:
    change = table(number).change
    assert change is not None
    return CM * change


def scatter(data: Measured, change: np.ndarray) -> float:
    """Deviation of cells from the means of their loads and pressures [cm]: S1 repeats no cell."""
    at = [np.unique(values, return_inverse=True)[1] for values in (data.force, data.pressure)]
    ways = np.concatenate([np.eye(each.max() + 1)[each] for each in at], axis=1)
    left = change - ways @ np.linalg.lstsq(ways, change, rcond=None)[0]
    return float(np.sqrt((left**2).sum() / (len(data) - np.linalg.matrix_rank(ways))))


def of_table(told: JsonMapping) -> Mixed:
    """Of a `table` its errors, its cells, how many are `within` the limit, relative error, bias, misprint."""
    number, data = told["table"], table(told["table"])
    printed, simulated = _change(number), model(number, data.force, data.pressure)
    good = np.arange(len(data)) != (MISPRINT if number == 4 else -1)
    error = (simulated - printed)[good]
    limit = told["limit"] if "limit" in told else math.hypot(PRINT, 2.0 * scatter(data, printed))

    def cell(k: int, **more: float) -> dict[str, float]:
        mass, bar = data.force[k] / GRAVITY - data.facts.get("hanger", 0.0), data.pressure[k] * 1e-5
        return {"mass": mass, "bar": bar, "published": float(printed[k]), "simulated": simulated[k], **more}

    def measure(errors: np.ndarray) -> float:
        if told["take"] == "within":
            return int((abs(errors) <= limit).sum())
        return 100.0 * float(np.mean(abs(errors) / printed[good]))

    match told["take"]:
        case "errors":
            return error
        case "cells":
            return [cell(k, tolerance=limit) for k in np.flatnonzero(good).tolist()]
        case "bias":
            levels = [(bar, error[(data.pressure == bar)[good]]) for bar in np.unique(data.pressure)]
            return [
                {"bar": bar * 1e-5, "simulated": each.mean(), "tolerance": limit / math.sqrt(len(each))}
                for bar, each in levels
            ]
        case "against the bench":
            own, theirs = (rms((each - _change(number - 2))[good]) for each in (simulated, printed))
            return {"simulated": own, "expected": theirs, "cells": good.sum()}
        case "misprint":
            ratio = data.facts["total_length"] / table(3).facts["total_length"]
            return cell(MISPRINT, expected=float(ratio * _change(3)[MISPRINT]))
    other = _change(number + 2) if number < 3 else model(number - 2, data.force, data.pressure)
    foils = {told["foil"]: measure((other - printed)[good]), STILL: measure(-printed[good])}
    found = {"simulated": measure(error), "foils": foils, "limit": limit}
    return found | ({"expected": int(good.sum())} if told["take"] == "within" else {})


def joint(told: JsonMapping) -> JsonDict:
    """Errors of tables I and II together [cm], and those of cells that a fit did not see."""
    tables = [table(1), table(2)]
    errors = [model(k, data.force, data.pressure) - _change(k) for k, data in enumerate(tables, 1)]
    result = held_out(fit_law(pose("tondu_lopez_2000_bladder", tables), starts=4)).held_out
    found = {kind: CM * result[kind].rms for kind in ("load", "pressure")}
    for left_out, each in result["muscle"].errors.items():
        found[f"the {'12 cm' if '120' in left_out else '21.5 cm'} muscle"] = CM * rms(each)
    return {"simulated": np.concatenate(errors), "held_out": found}


def hung(told: JsonMapping) -> np.ndarray:
    """Change of length under the loads of tables I and II on the stand at rest, minus the static one [cm]."""
    errors = []
    for number in (1, 2):
        data, muscle = table(number), load("muscle", TABLES[number])
        for force in np.unique(data.force):
            pressure = data.pressure[data.force == force]
            (trial,) = stand("step", muscle, load=force, pressure=pressure.tolist(), time=REST).trials
            found = np.array([each["filled_contraction"].value for each in trial.metrics])
            static = model(number, np.full(len(pressure), force), pressure)
            errors.append(CM * muscle.nominal_length * found - static)
    return np.concatenate(errors)
