"""Whether a run's numbers depend on its time step: the run beside the same at a quarter of it.

A scheme of second order leaves a sixteenth of its error there, one of first order a quarter.
"""

import dataclasses
import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from afo_sim.common import InputError, Notice, in_unit
from afo_sim.description import Scenario
from afo_sim.metrics import Metric
from afo_sim.model import as_run
from afo_sim.simulation.recording import Recording

STEP_STUDY = "time_step"  # key of `Recording.studies`
FINER = 4  # times as many steps
SHARE = 0.01  # of its value, that a metric may be off by [-]
ABSOLUTE = ("deg", "mm")  # units of angles and heights, which may be off by their floor and no more
_FLOORS = (  # what is too little to matter, in each of these units
    (2.0, "deg/s"),
    (3.0, "g/h l/h"),
    (1.0, "N percent"),
    (0.5, "W"),
    (0.3, "mm"),
    (0.1, "deg kPa"),
    (0.05, "l/min"),
    (0.02, "N*m J"),
    (0.01, "bar"),
    (0.005, "s W/kg"),
    (0.001, "g l"),
    (3e-4, "N*m/kg J/kg"),
)
FLOORS = {unit: floor for floor, units in _FLOORS for unit in units.split()}
# How the settled stride was found; what balance and laws leave, which are shares of next to nothing.
OF_METHOD = {"strides_solved", "settled_air_change", "settled_angle_change", "walked_air_change"}
OF_METHOD |= {"walked_clearance_change", "energy_error", "law_mismatch", "law_mismatch_share"}


@dataclass(frozen=True)
class StepError:
    """Numerical error of a metric, and what it may be, in its unit; nan where one run alone defines it."""

    error: float
    bound: float
    unit: str

    @property
    def times(self) -> float:
        """How many times its bound it is; infinite where one run alone defines it."""
        if self.error == 0.0:
            return 0.0
        return abs(self.error) / self.bound if self.bound > 0.0 and math.isfinite(self.error) else math.inf


def quarter_step(scenario: Scenario) -> Scenario:
    """The scenario at a quarter of the step that it runs with."""
    step = as_run(scenario).timestep / FINER
    try:
        return scenario.with_values(timestep=step, record_rate=None)
    except InputError as error:
        problem = f"has no quarter to check it with: {error.problem}"
        value = f"{in_unit(step, 's', 'ms'):g} ms"
        raise InputError(problem, field="timestep", value=value, allowed=error.allowed) from None


def check_forgets(controller: object, policy: object) -> None:
    """Refuse, with an InputError, what may remember the first run in the second."""
    if policy is not None:
        problem = "chooses inputs step by step, which two time steps do not share"
        raise InputError(problem, field="policy", allowed="a scenario's own timing, or a controller")
    plain = inspect.isfunction(controller) and not controller.__closure__
    if controller is not None and not plain and not hasattr(controller, "reset"):
        problem = "runs twice to check the time step, and may remember the first run"
        allowed = "a function without a memory, or an object whose reset() forgets"
        raise InputError(problem, field="controller", value=type(controller).__name__, allowed=allowed)


def step_errors(run: Mapping[str, Metric], fine: Mapping[str, Metric]) -> dict[str, StepError]:
    """Errors of a run's metrics, the run less the finer one; those of the method have none."""
    found = {}
    for name, metric in run.items():
        if name in OF_METHOD:
            continue
        value, finer, floor = float(metric), float(fine.get(name, math.nan)), FLOORS.get(metric.unit, 0.0)
        same = value == finer or (math.isnan(value) and math.isnan(finer))
        scale = 0.0 if metric.unit in ABSOLUTE or not math.isfinite(finer) else SHARE * abs(finer)
        found[name] = StepError(0.0 if same else value - finer, max(floor, scale), metric.unit)
    return found


def with_step_errors(run: Recording, fine: Recording, step: float) -> Recording:
    """A run with the errors of its metrics in `studies`, and a warning that names those beyond their
    bounds."""
    steps: dict[str, Any] = {"step": 1e3 * FINER * step, "finer": 1e3 * step}
    if not fine.ok:
        text = "no numerical errors are known: at a time step of {finer:.3g} ms the run {status}"
        ended = Notice("step-not-checked", text, status=fine.status, **steps)
        return dataclasses.replace(run, warnings=(*run.warnings, ended))
    errors = step_errors(run.metrics, fine.metrics)
    told = {name: dataclasses.asdict(error) for name, error in errors.items()}
    study = {"step": FINER * step, "finer": step, "metrics": told}
    beyond = sorted(
        (name for name, e in errors.items() if e.times > 1.0), key=lambda name: -errors[name].times
    )
    steps["named"] = ", ".join(
        f"{name} by {Metric(errors[name].error, errors[name].unit)} ({errors[name].bound:.2g} allowed)"
        for name in beyond
    )
    text = (
        "{count} of {among} numbers depend on the time step of {step:.3g} ms, beside {finer:.3g} ms: "
        "{named}; take a smaller timestep"
    )
    warned = [Notice("step-matters", text, count=len(beyond), among=len(errors), **steps)] if beyond else []
    return dataclasses.replace(
        run, studies={**run.studies, STEP_STUDY: study}, warnings=(*run.warnings, *warned)
    )


def found_step_errors(recording: Recording) -> dict[str, float]:
    """Errors of the metrics that a recording holds, in their units; none where its step was not checked."""
    table = recording.studies.get(STEP_STUDY, {}).get("metrics", {})
    return {name: math.nan if each["error"] is None else each["error"] for name, each in table.items()}
