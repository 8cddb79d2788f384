"""The time step of a sweep, checked on a sample of its cases: each again at twice or half its step."""

import json
import pathlib
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from afo_sim.common import JsonDict, JsonMapping, write_json
from afo_sim.description import load
from afo_sim.metrics import Metric
from afo_sim.model import as_run
from afo_sim.simulation import Asked, StepError, errors_of, step_errors
from afo_sim.study.engine import OK, Outcome
from afo_sim.study.folder import told_in
from afo_sim.study.pool import Pool
from afo_sim.study.results import STEPS, Results

EVERY, MOST = 4, 100  # one case of so many is checked, and no more than so many


def check_sample(results: Results, scenario: JsonMapping, asked: Asked, who: Pool) -> None:
    """Write which of a sample of cases have numbers beyond what their time step may change, and the worst."""
    there = np.flatnonzero(results.ok)
    rows = there[:: max(EVERY, -(-len(there) // MOST))]
    sets = [json.loads(results["overrides"][row]) for row in rows]
    described = load("scenario", scenario)

    def again(places: list[int], times: float) -> list[Outcome]:
        cases = [longer(scenario, sets[place], times) for place in places]
        return who.in_order(described, cases, asked, "checking the time step", None)

    found = dict(enumerate(again([*range(len(rows))], 2.0)))
    refused = [place for place, outcome in found.items() if outcome.status != OK]
    found |= dict(zip(refused, again(refused, 0.5), strict=True))
    beyond: dict[str, list[str]] = {}
    worst: dict[str, tuple[int, StepError]] = {}  # of each metric, with the case that it is of
    for place, row in enumerate(rows):
        if found[place].status != OK:
            continue
        case = int(results["case"][row])
        own = {name: Metric(float(results[name][row]), unit) for name, unit in results.metrics.items()}
        for name, error in step_errors(own, found[place].metrics).items():
            if name not in worst or error.times > worst[name][1].times:
                worst[name] = case, error
            if error.times > 1.0:
                beyond.setdefault(str(case), []).append(name)
    told = {
        "sample": len(rows),
        "checked": sum(outcome.status == OK for outcome in found.values()),
        "beyond": beyond,
        "worst": {name: {"case": case, **asdict(error)} for name, (case, error) in worst.items()},
    }
    write_json(results.folder / STEPS, told, "time step")


def longer(scenario: JsonMapping, sets: Mapping[str, object], times: float) -> JsonDict:
    """What a case sets, with so many times its time step."""
    step = times * as_run(load("scenario", scenario, sets)).timestep
    return {**sets, "timestep": f"{step!r} s", "record_rate": None}


def remark(folder: pathlib.Path) -> str:
    """The sample's result on a sweep's time step; "" if none was taken."""
    told = told_in(folder / STEPS, "to delete it")
    if told is None:
        return ""
    begun = f"time step: of {told['checked']} cases in a sample, "
    if not told["checked"]:
        return "time step: not checked, since no case of a sample runs at another step"
    if not told["beyond"]:
        return f"{begun}none has a number that twice the step puts beyond its bound"
    errors = errors_of(told["worst"])
    name, most = max(errors.items(), key=lambda item: item[1].times)
    off = [name for name, error in errors.items() if error.times > 1.0]
    text = f"{begun}{len(told['beyond'])} have numbers that twice the step puts beyond their bounds, most "
    text += f"{name} of case {told['worst'][name]['case']} by {Metric(most.error, most.unit)} "
    text += f"({most.bound:.2g} allowed): set a shorter timestep, or run such a case alone, "
    text += f"which controls its step; do not decide by {', '.join(off)} where cases differ by less"
    return f"{text}; the other {len(errors) - len(off)} numbers hold in the sample"
