"""The time step of a run, controlled: its numbers count where twice the step gives the same.

A run at a step h stands beside one at 2 h. Where a number differs by more than it may be off, both halve,
until all agree or a floor is reached; then a warning names those that do not. The whole difference counts as
the numerical error of the finer run: of a scheme of second order it is three times as much, of first order
as much. A first pair must agree within half of each bound, since two steps may agree by chance.
"""

import dataclasses
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, cast, get_args

from afo_sim.common import InputError, Json, JsonMapping, Keywords, Lazy, Notice, in_unit, unknown
from afo_sim.control import OwnController
from afo_sim.description import Scenario
from afo_sim.metrics import Metric, Metrics, failures
from afo_sim.model import as_run, with_person
from afo_sim.simulation.recording import Later, Recording

Step = Literal["controlled", "fixed"]
# Of a scenario: what is done, for the progress, and whether its start is walked at once to see that it can be
Simulated = Callable[[Scenario, str, bool], Recording]

STEP_STUDY = "time_step"  # key of `Recording.studies`
HALVINGS, SHORT = 3, 2e-4  # of the asked step, at most, or as many as lead down to so many seconds
BY_CHANCE = 0.5  # of each bound, within which a first pair must agree
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
PATTERN = "air-coarse"  # the warning that suspects the step unseen; beside an estimate it says nothing more


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


def step_errors(run: Mapping[str, Metric], longer: Mapping[str, Metric]) -> dict[str, StepError]:
    """Errors of a run's metrics: those at twice its step less its own; those of the method have none."""
    found = {}
    for name, metric in run.items():
        if name in OF_METHOD:
            continue
        value, before = float(metric), float(longer.get(name, math.nan))
        floor = FLOORS.get(metric.unit, 0.0)
        same = value == before or (math.isnan(value) and math.isnan(before))
        scale = 0.0 if metric.unit in ABSOLUTE or not math.isfinite(value) else SHARE * abs(value)
        found[name] = StepError(0.0 if same else before - value, max(floor, scale), metric.unit)
    return found


def at_step(scenario: Scenario, step: float) -> Scenario:
    """The scenario at another time step [s], with the rows of its own where that is a multiple."""
    own = as_run(scenario)
    rate = 1.0 / (own.record_stride * own.timestep)
    return scenario.with_values(timestep=step, record_rate=rate if step <= own.timestep else None)


@failures(raised=True)
def controlled(scenario: Scenario, simulate: Simulated, halvings: int | None = HALVINGS) -> Recording:
    """A run at the step at which its metrics agree with those at twice that step, or at the shortest one."""
    # Metrics that wait for being read, of first strides and of walks beside, do not decide. The step that was
    # taken and the error of each metric are in `studies`; what is beyond its bound is named by a warning.
    # Rows stay those of the asked step. A run that fails is returned as it is; without `halvings` the step is
    # the asked one, and no error is known. The start is walked at once at the longest step alone: what goes
    # there goes at shorter ones.
    asked = as_run(scenario).timestep
    if halvings is None:
        return _with_errors(simulate(scenario, "simulating", True), None, asked, asked)
    longer, most = _tried(scenario, 2.0 * asked, simulate, True), BY_CHANCE
    run, step = simulate(scenario, "simulating", longer is None), asked
    shortest = min(asked / 2**halvings, SHORT) if halvings else asked
    while run.ok:
        if longer is not None:
            errors = step_errors(*(cast(Metrics, each.metrics).known for each in (run, longer)))
            if all(error.times <= most for error in errors.values()):
                break
            most = 1.0
        if step < 2.0 * shortest * (1.0 - 1e-9):
            break
        finer = _tried(scenario, 0.5 * step, simulate, False)
        if finer is None:
            break
        longer, run, step = run, finer, 0.5 * step
    run = run.changed(described=Later(lambda: with_person(scenario).resolved()))
    return _with_errors(run, longer if run.ok else None, step, asked)


def _tried(scenario: Scenario, step: float, simulate: Simulated, start: bool) -> Recording | None:
    """A run at another step; None where that is refused or fails."""
    try:
        run = simulate(at_step(scenario, step), f"at a step of {in_unit(step, 's', 'ms'):.3g} ms", start)
    except InputError:
        return None
    return run if run.ok else None


def _with_errors(run: Recording, longer: Recording | None, step: float, asked: float) -> Recording:
    """A run with its step [s] and the errors of its metrics beside another's, read later, in `studies`."""
    errors = Later(lambda: {} if longer is None else step_errors(run.metrics, longer.metrics))
    study = Lazy[str, Json](
        {"step": step, "asked": asked},
        lambda: {"metrics": {name: dataclasses.asdict(error) for name, error in errors().items()}},
    )
    return run.changed(
        studies={**run.studies, STEP_STUDY: study}, warnings=Later(lambda: _told(run, errors(), step))
    )


def _told(run: Recording, errors: Mapping[str, StepError], step: float) -> tuple[str, ...]:
    """A run's warnings, and one that names metrics beyond their bounds; what was suspected is known then."""
    if not errors:
        return run.warnings
    kept: list[str] = [one for one in run.warnings if not (isinstance(one, Notice) and one.code == PATTERN)]
    beyond = sorted(
        (name for name, e in errors.items() if e.times > 1.0), key=lambda name: -errors[name].times
    )
    if beyond:
        named = ", ".join(
            f"{name} by {Metric(errors[name].error, errors[name].unit)} ({errors[name].bound:.2g} allowed)"
            for name in beyond
        )
        text = (
            "{count} of {among} numbers still depend on the time step at {step:.3g} ms, compared with twice "
        )
        text += "that step: {named}"
        data: Keywords = {"count": len(beyond), "among": len(errors), "step": 1e3 * step}
        kept.append(Notice("step-matters", text, named=named, names=beyond, **data))
    return tuple(kept)


def as_taken(scenario: Scenario, recording: Recording) -> Scenario:
    """The scenario at the step that a recording of it was taken with, for what is compared with that."""
    study = recording.studies.get(STEP_STUDY, {})
    return at_step(scenario, study["step"]) if study.get("step", 1.0) < study.get("asked", 0.0) else scenario


def found_step_errors(recording: Recording) -> dict[str, StepError]:
    """Errors of the metrics that a recording holds; none where none are known."""
    return errors_of(recording.studies.get(STEP_STUDY, {}).get("metrics", {}))


def errors_of(table: Mapping[str, JsonMapping]) -> dict[str, StepError]:
    """Errors as a file has them."""
    return {
        name: StepError(math.nan if each["error"] is None else each["error"], each["bound"], each["unit"])
        for name, each in table.items()
    }


def step_line(recording: Recording) -> str:
    """The step that a run was taken with, in words."""
    study = recording.studies.get(STEP_STUDY)
    if study is None:
        return "time step as described, not checked"
    step, asked = in_unit(study["step"], "s", "ms"), in_unit(study["asked"], "s", "ms")
    halved = f", halved from {asked:.3g} ms" if study["step"] < study["asked"] else ""
    return f"time step {step:.3g} ms{halved}{'' if study['metrics'] else ', not checked'}"


def check_step(step: str) -> None:
    """Refuse a word that is no way to choose the step (InputError)."""
    if step not in get_args(Step):
        raise unknown(step, get_args(Step), field="step", problem="is no way to choose the time step")


def forgets(controller: object, policy: object) -> bool:
    """Whether a controller can run again at another step: one that may remember the first run can not."""
    plain = inspect.isfunction(controller) and not controller.__closure__
    again = plain or isinstance(controller, OwnController) or hasattr(controller, "reset")
    return policy is None and (controller is None or again)
