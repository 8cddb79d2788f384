"""A scenario simulated from beginning to end: `afo_sim.run`.

A walk whose strides repeat has two parts: strides from the start, and the settled stride, which is solved.
Between them the air jumps. The column `gait/solved` says which rows are which.
"""

import dataclasses
import functools
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from afo_sim.common import InputError, JsonMapping, Keywords, Notice, identities, shown, unique
from afo_sim.control import Controller, OwnController, make
from afo_sim.description import Scenario, load
from afo_sim.metrics import (
    METRICS,
    SOLVED,
    LazyColumns,
    Metric,
    Metrics,
    OwnMetric,
    WalkMetrics,
    emptied,
    known,
    named,
    no_metric,
    sag_of_both,
    settling_metrics,
    until_empty,
)
from afo_sim.model import AFTER, Built, brings_files, start_up, two_strides, why_walked, with_person
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.native.between_strides import AIR, ANGLE
from afo_sim.simulation.examine import (
    Examined,
    described_cycle,
    examine,
    first_strides,
    make_recording,
    recording_of,
    timing_of,
    until_near,
    with_limits,
)
from afo_sim.simulation.loop import RATE, TIME_LIMIT, Loop
from afo_sim.simulation.own_column import OWN, OwnColumn
from afo_sim.simulation.recording import Later, Recording
from afo_sim.simulation.reference_walk import compared, reference_of
from afo_sim.simulation.rollout import FIELDS, Rollout
from afo_sim.simulation.sensed import check_sensors, sensor_columns
from afo_sim.simulation.settle import Settled, settle
from afo_sim.simulation.simulate import Progress, simulate
from afo_sim.simulation.step_control import HALVINGS, Step, check_step, controlled, forgets
from afo_sim.simulation.stepping import Policy
from afo_sim.simulation.validity_checks import empty_warnings

Watch = Callable[[Recording], None]  # takes each new stretch of a run while it is computed


def run(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None,
    *,
    controller: Controller | None = None,
    rate: float | str = RATE,
    time_limit: float | str = TIME_LIMIT,
    policy: Policy | None = None,
    progress: Progress | None = None,
    step: Step = "controlled",
    uncertainty: int = 0,
    metrics: Iterable[OwnMetric] = (),
) -> Recording:
    """Simulate a scenario from static equilibrium.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}
    controller : commands the chambers during the simulation: a function of the observation; by default the
        scenario's own controller or timing (docs/controllers.md). `run` raises what it raises, and the
        error's `recording` has the rows until then
    rate : of the controller's commands [Hz], or "100 Hz"
    time_limit : wall time that the controller may take for one command [s], or "10 s"
    policy : sets all inputs during the simulation, for experts on the model's actuators
    progress : called with (steps done, steps in all)
    step : "controlled", by default: the time step is halved until the metrics agree with those at twice the
        step, and a warning names those that do not at an eighth; "fixed" takes the scenario's step as it
        is, as do a policy and a controller that may remember an earlier run. `studies["time_step"]` holds the
        step that was taken and each metric's numerical error (docs/accuracy.md)
    uncertainty : draws of the uncertain inputs, at least 20, for bands of a walk's numbers and curves:
        `studies["uncertainty"]`, those of `afo-sim run --uncertainty`; 0 for none (docs/uncertainty.md)
    metrics : your own (`metric`), registered from here on; a run has all registered ones and the package's

    Returns
    -------
    Recording; its `status` is "ok", or states why the simulation stopped early. If walking strides repeat,
    it ends with the settled stride, which is solved for, and `metrics` are for that stride
    (`gait.settled = "walked"` walks until strides settle). A `reference` of the scenario is walked too:
    `lift_over_reference` and `reference_toe_clearance` compare the two.

    Raises
    ------
    InputError
        The description is wrong; `step` is another text; bands are asked of a controller in Python, of a
        policy, where nobody walks, or of too few draws; a controller commands what is not allowed.
    CallbackError
        The muscle callbacks cannot be installed or are not in force.

    Examples
    --------
    >>> low = run("seated", {"supply.pressure": "2 bar", "duration": "1 s"})
    >>> low.ok, low["ankle/angle"].shape
    (True, (500,))
    >>> high = run(load("scenario", "seated"), {"duration": "1 s"})
    >>> high.metrics["peak_dorsiflexion_angle"] > low.metrics["peak_dorsiflexion_angle"]
    True
    """
    description = load("scenario", scenario, sets)
    check_step(step)
    for name in named(metrics):
        if known(name) is None:
            raise no_metric("is an unknown metric", name, METRICS, field="metrics")
    if uncertainty and not (controller is None and policy is None):
        problem = "does not go with a controller in Python or a policy: the draws would run without it"
        raise InputError(problem, field="uncertainty", value=uncertainty, allowed="0")
    if policy is not None and not isinstance(policy, Policy):
        problem, allowed = "is not a Policy", "a function of what is measured goes into controller="
        raise InputError(problem, field="policy", value=type(policy).__name__, allowed=allowed)
    with_bands = shown().bands(description, uncertainty, progress) if uncertainty else None

    def simulated(at: Scenario, what: str, start: bool) -> Recording:
        if controller is None:
            return run_scenario(at, policy=policy, progress=progress, start=start)
        own = at is description  # at another step, which nobody has asked for, nothing is raised
        made = controller.fresh(at) if isinstance(controller, OwnController) else controller
        return run_controlled(at, made, rate, time_limit, progress=progress, keeps=True, raises=own)

    halvings = HALVINGS if step == "controlled" and forgets(controller, policy) else None
    recording = controlled(description, simulated, halvings)
    if brings_files(description) or identities():  # which may be others, or gone, when it is read
        recording.whole()
    return recording if with_bands is None else with_bands(recording)


def run_controlled(
    scenario: Scenario, controller: Controller, rate: float | str, time_limit: float | str = TIME_LIMIT, *,
    progress: Progress | None = None, watch: Watch | None = None, keeps: bool = False, raises: bool = False,
) -> Recording:  # fmt: skip
    """Simulate with a controller in the loop, from the start; with `keeps` Ctrl-C ends the recording."""
    # With `raises` what the controller raises is raised; else it is the recording's status.
    if scenario.reference is not None:
        reference_of(scenario)
    built = build(scenario)
    loop = Loop(built, controller, rate, time_limit)
    recording = run_built(built, policy=loop.policy(keeps), progress=progress, watch=watch)
    recording = recording.changed(warnings=(*recording.warnings, *_loop_warnings(scenario)))
    if raises and loop.raised is not None:
        vars(loop.raised)["recording"] = recording
        loop.raised.add_note(
            f"in a run of {scenario.name!r}; `recording` of this error has the rows until then"
        )
        raise loop.raised
    return compared(recording, scenario)


def _loop_warnings(scenario: Scenario) -> Iterator[Notice]:
    """What to mind of a run with a controller."""
    if scenario.controller is None:
        yield Notice(
            "controller-in-python",
            "a controller in Python commanded the chambers: the scenario lacks it, and all strides "
            "were walked from the start",
        )
    if scenario.walking:
        return
    cycle = described_cycle(scenario)
    if cycle is None:
        text = "no cycle is described: numbers per cycle are for the whole run of {duration:g} s"
        yield Notice("no-cycle", text, duration=scenario.duration)
    elif scenario.controller is None:
        text = "numbers per cycle are for the timer's period of {cycle:g} s, whatever the controller did"
        yield Notice("timer-cycle", text, cycle=cycle)


def run_scenario(
    scenario: Scenario, *, policy: Policy | None = None, progress: Progress | None = None,
    watch: Watch | None = None, keeps: bool = False, start: bool = True,
) -> Recording:  # fmt: skip
    """Simulate a description as `run` does; `watch` sees it grow, `keeps` is of a controller."""
    # `start` is of a settled stride: whether its start is walked at once, to see that it can be.
    if scenario.controller is not None and policy is None:
        made, rate = make(scenario.controller, scenario), scenario.controller.rate
        return run_controlled(scenario, made, rate, progress=progress, watch=watch, keeps=keeps)
    if scenario.reference is not None and start:
        reference_of(scenario)  # refused before anything is walked
    if policy is None and not why_walked(scenario):
        recording = run_settled(scenario, progress=progress, watch=watch, start=start)
    else:
        recording = run_built(build(scenario), policy=policy, progress=progress, watch=watch)
    return compared(recording, scenario)


def run_at_step(
    scenario: Scenario, step: str = "controlled", *, halvings: int = HALVINGS,
    report: Callable[..., None] | None = None, watch: Watch | None = None, keeps: bool = False,
) -> Recording:  # fmt: skip
    """Simulate as `run` does, the step halved so often at most; `report` gets (done, in all, what)."""

    def simulate(at: Scenario, what: str, start: bool) -> Recording:
        progress = None if report is None else functools.partial(report, what=what)
        asked = at is scenario
        see, keep = watch if asked else None, keeps and asked
        return run_scenario(at, progress=progress, watch=see, keeps=keep, start=start)

    return controlled(scenario, simulate, halvings if step == "controlled" else None)


def run_built(
    built: Built,
    *,
    policy: Policy | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Recording:
    """Simulate a compiled scenario from static equilibrium, as `run` does; `watch` sees it grow."""
    check_sensors(built)  # before anything is simulated
    if watch is not None:
        _ = built.full_model, built.xml  # now: MuJoCo cannot compile beside Python callbacks
    rollout = simulate(
        built,
        schedule.controls(built) if policy is None else policy,
        progress=progress,
        see=None if watch is None else lambda stretch: watch(make_recording(built, stretch)),
    )
    return make_recording(built, rollout)


SAGS = "lowest_supply_pressure"  # a metric of supplies that can
SLOW, LEFT = 0.8, 0.05  # share that a stride leaves, from which on there is a warning; of the way [-]
FORWARD = ("ankle/position/x", "ground/position/x", "qpos/shank_x")  # what goes on from stride to stride


def settled_metrics(settled: Settled) -> dict[str, Metric]:
    """How the settled stride was found, as metrics."""
    return settling_metrics(settled.strides, settled.air, settled.angle)


def unsettled_warning(settled: Settled) -> tuple[Notice, ...]:
    """A warning where no stride was found that repeats, or where it takes many to get there."""
    if settled.found and not settled.slowest > SLOW:
        return ()
    if settled.found:
        text = (
            "the air settles slowly: it takes {strides:.0f} strides or more after a stop until {left:.0f} % "
        )
        text += "of the change remains; the numbers are for the settled state"
        strides = math.log(LEFT) / math.log(settled.slowest) if settled.slowest < 1.0 else math.inf
        return (Notice("air-settles-slowly", text, strides=strides, left=100.0 * LEFT),)
    text = "no repeating stride was found: after {strides} strides the air still changes by {air:.2g} % "
    text += "per stride and the ankle angle by {angle:.2g}° (limits {air_limit:g} % and {angle_limit:.2g}°); "
    text += "the numbers are from the last stride"
    still: Keywords = {"air": 100.0 * settled.air, "angle": float(np.degrees(settled.angle))}
    still |= {"air_limit": 100.0 * AIR, "angle_limit": float(np.degrees(ANGLE))}
    return (Notice("strides-unsettled", text, strides=settled.strides, **still),)


def run_settled(
    scenario: Scenario, *, progress: Progress | None = None, watch: Watch | None = None, start: bool = True
) -> Recording:
    """Solve for the settled stride; the strides from the start are walked when they are read."""
    # Who watches, or sees the progress, has them walked before. Else, with `start`, as many are walked at
    # once as show that they near the settled one.
    begins, own = Later(lambda: build(start_up(scenario))), tuple(OWN.values())
    seen = progress is not None or watch is not None
    if seen or start:
        _ = begins()  # before anything is walked, as the sensors are checked
    second, walked = build(two_strides(scenario)), None
    check_sensors(second)
    resolved = Later(lambda: with_person(scenario).resolved())
    if seen:
        first = begins()
        see = None if watch is None else lambda stretch: watch(make_recording(first, stretch))
        if watch is not None:
            _ = first.xml, second.xml  # compiled now: MuJoCo cannot compile beside Python callbacks
        walked = simulate(first, schedule.controls(first), progress=progress, see=see)
        if walked.failure is not None:
            return make_recording(first, walked).changed(described=resolved)
    begun = time.perf_counter()
    settled = settle([second], [schedule.controls(second)], mode=scenario.callback, fields=FIELDS)[0]
    seconds, failure = time.perf_counter() - begun, settled.rollout.failure
    parts = _Parts(begins, second, settled, seconds, walked)
    if walked is None and (start or failure is not None):
        control = schedule.controls(parts.first)
        near = until_near(parts.first, control, settled.rollout)
        walked = simulate(parts.first, control if near is None else near)
        if walked.failure is not None:
            return make_recording(parts.first, walked).changed(described=resolved)
        parts = parts if near is not None else dataclasses.replace(parts, begun=walked)
    if failure is not None and walked is not None:
        status = f"failed: while the settled stride was sought: {failure}"
        return make_recording(parts.first, walked).changed(described=resolved, status=status, metrics={})
    found = parts.examined[1].totals
    sags = scenario.supply.source is not None or SAGS in found  # which is of the first strides too
    known = parts.found.totals if sags else found | settled_metrics(settled)
    recording = recording_of(
        begins,
        scenario,
        columns=Later(lambda: _joined(parts.first, parts.before, second, parts.after, own)),
        metrics=Metrics(known, lambda: parts.found.totals),
        strides=Later(lambda: parts.found.strides),
        warnings=Later(lambda: parts.warnings),
        timing=Later(lambda: parts.timing),
    )
    if watch is not None:
        solved = {name: values[recording[SOLVED] == 1.0] for name, values in recording.columns.items()}
        watch(recording.changed(columns=solved))
    return recording


@dataclasses.dataclass(frozen=True, eq=False)
class _Parts:
    """The settled stride of a walk and, walked when they are asked for, the strides before it."""

    begins: Later
    second: Built
    settled: Settled
    seconds: float
    begun: Rollout | None

    @property
    def first(self) -> Built:
        """What walks from the start."""
        return self.begins()

    @functools.cached_property
    def walked(self) -> Rollout:
        """The strides from the start."""
        walked = self.begun or simulate(self.first, schedule.controls(self.first))
        if walked.failure is not None:  # not at twice the step, nor until they near the settled one
            raise walked.failure
        return walked

    @functools.cached_property
    def before(self) -> Examined:
        """Results of the strides from the start."""
        return with_limits(self.first, self.walked, *examine(self.first, self.walked))

    @functools.cached_property
    def examined(self) -> tuple[Mapping[str, np.ndarray], WalkMetrics]:
        """Columns of the settled stride, computed as they are read, and its metrics."""
        return examine(self.second, self.settled.rollout, solved=True)

    @functools.cached_property
    def after(self) -> Examined:
        """Results of the settled stride."""
        return with_limits(self.second, self.settled.rollout, *self.examined)

    @functools.cached_property
    def stops(self) -> tuple[dict[str, Metric], tuple[Notice, ...]]:
        """Metrics of the strides after a stop, and warnings of them."""
        columns, totals = self.before.columns, self.after.found.totals
        return first_strides(self.first, self.walked, columns, totals, near=self.settled.rollout)

    @functools.cached_property
    def found(self) -> WalkMetrics:
        """Totals of the settled stride, further numbers, and the metrics of every stride."""
        first, solved, end = self.first, self.after.found.totals, _end(self.first)
        strides = self.before.found.strides | {end + k: m for k, m in self.after.found.strides.items()}
        totals = solved | emptied(first.scenario.supply.source, solved, end + 2)
        totals |= sag_of_both(self.before.columns, solved)
        said = tuple(empty_warnings(first.scenario, totals, "the settled stride on a full source"))
        beside = settled_metrics(self.settled) | self.stops[0]
        return WalkMetrics(totals | until_empty(totals) | beside, strides, said)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to mind of both."""
        said = _warnings(self.first, self.before, self.after, self.settled, self.found.warnings)
        return *said, *self.stops[1]

    @property
    def timing(self) -> dict[str, float]:
        """Facts of its speed."""
        steps = self.first.scenario.n_step + self.settled.steps
        return timing_of(self.first, steps, self.walked.wall_seconds + self.seconds)


def _joined(
    first: Built, before: Examined, second: Built, after: Examined, own: tuple[OwnColumn, ...]
) -> dict[str, np.ndarray]:
    """Columns of both parts, one behind the other, at the recording's rate."""
    assert first.walk is not None and second.walk is not None
    n, stride = first.scenario.n_step, first.scenario.record_stride
    shifts = dict.fromkeys(FORWARD, float(first.walk.pose[n + 1, 0] - second.walk.pose[1, 0]))
    shifts |= {"time": n * first.scenario.timestep, "gait/stride": float(_end(first))}
    found = {}
    for name, values in before.columns.items():
        behind = after.columns[name][-n % stride : -AFTER : stride]
        found[name] = np.concatenate([values[::stride], behind + shifts.get(name, 0.0)])
    of_user = {column.name: column for column in own if column.name in found}

    def over_both(name: str) -> np.ndarray:
        if name in of_user:  # of what goes on from stride to stride
            return of_user[name].of(whole)
        return np.concatenate([before.columns[name], after.columns[name][:-AFTER] + shifts.get(name, 0.0)])

    # as of one run: the sensors remember what came before the air jumps
    whole = LazyColumns(before.columns, over_both)
    found |= {name: whole[name][::stride] for name in of_user}
    found |= {name: values[::stride] for name, values in sensor_columns(first, whole).items()}
    kept = len(before.columns["time"][::stride])
    found[SOLVED] = (np.arange(len(found["time"])) >= kept).astype(float)
    return found


def _end(first: Built) -> int:
    """Number of the stride that follows those walked from the start."""
    assert first.walk is not None
    return round(float(first.walk.phase[first.scenario.n_step + 1]))


def _warnings(
    first: Built, before: Examined, after: Examined, settled: Settled, empty: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Of the description, of the settled stride, and of the strides before it what is not said twice."""
    of_both = *first.warnings, *unsettled_warning(settled), *empty
    said = unique((*of_both, *after.limits, *after.found.warnings))
    settled_ones = [one for one in said if isinstance(one, Notice)]
    doubts = [one for one in before.found.warnings if isinstance(one, Notice) and "beyond" in one.data]
    passed = (*before.limits, *doubts)  # that metrics are undefined is said of the settled stride
    new = (one for one in passed if not any(one.repeats(each) for each in settled_ones))
    return (*said, *(one.after("before it settles: ") for one in new))
