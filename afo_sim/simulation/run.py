"""A scenario simulated from beginning to end: `afo_sim.run`."""

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from afo_sim.control.controller import Controller
from afo_sim.control.making import make
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built, build
from afo_sim.model.periodic import why_walked
from afo_sim.simulation.examine import described_cycle, make_recording
from afo_sim.simulation.loop import TIME_LIMIT, Loop
from afo_sim.simulation.policy import Policy
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.reference import compared, reference_of
from afo_sim.simulation.sensed import check_sensors
from afo_sim.simulation.settled_run import run_settled
from afo_sim.simulation.simulate import Progress, simulate

RATE = 100.0  # of a controller's commands [Hz]
UNTOLD = (
    "a controller in Python commanded the chambers: the scenario does not hold it, and walking was walked "
    "from the start"
)
Watch = Callable[[Recording], None]  # takes each new stretch of a run while it is computed


def run(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    controller: Controller | None = None,
    rate: float = RATE,
    time_limit: float = TIME_LIMIT,
    policy: Policy | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Simulate a scenario from static equilibrium.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}
    controller : what commands the chambers as the simulation goes: a function of what it sees; by default the
        scenario's own controller or timing (docs/controllers.md)
    rate : of the controller's commands [Hz]
    time_limit : wall time that the controller may take for one command [s]
    policy : what chooses all inputs as the simulation goes, for those who know the model's actuators
    progress : called with (steps done, steps in all)

    Returns
    -------
    Recording; its `status` is "ok", or says why the simulation stopped early. Of walking whose strides repeat
    it ends with the settled stride, which is solved for, and `metrics` are of that stride
    (`gait.settled = "walked"` walks there instead). Where the scenario has a `reference`, that is walked too:
    `lift_over_reference` and `reference_toe_clearance` compare the two.

    Raises
    ------
    InputError
        The description is wrong.
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
    if isinstance(scenario, Scenario):
        description = scenario.set(sets) if sets else scenario
    else:
        description = load("scenario", scenario, sets)
    if controller is not None:
        return run_controlled(description, controller, rate, time_limit, progress=progress)
    return run_scenario(description, policy=policy, progress=progress)


def run_controlled(
    scenario: Scenario,
    controller: Controller,
    rate: float,
    time_limit: float = TIME_LIMIT,
    *,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Recording:
    """Simulate a description with a controller in the loop; walking is walked from the start."""
    if scenario.reference is not None:
        reference_of(scenario)
    built = build(scenario)
    loop = Loop(built, controller, rate, time_limit)
    recording = run_built(built, policy=loop.policy(), progress=progress, watch=watch)
    told = tuple(_told(scenario))
    return compared(dataclasses.replace(recording, warnings=(*recording.warnings, *told)), scenario)


def _told(scenario: Scenario) -> Iterator[str]:
    """What to mind of a run with a controller."""
    if scenario.controller is None:
        yield UNTOLD
    if scenario.walking:
        return
    cycle = described_cycle(scenario)
    if cycle is None:
        yield f"no cycle is described: numbers per cycle are of the whole run of {scenario.duration:g} s"
    elif scenario.controller is None:
        yield f"numbers per cycle are over the timer's period of {cycle:g} s, whatever the controller did"


def run_scenario(
    scenario: Scenario,
    *,
    policy: Policy | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Recording:
    """Simulate a description as `run` does; `watch` sees it grow."""
    if scenario.controller is not None and policy is None:
        made = make(scenario.controller, scenario)
        return run_controlled(scenario, made, scenario.controller.rate, progress=progress, watch=watch)
    if scenario.reference is not None:
        reference_of(scenario)  # refused before anything is walked
    return compared(_alone(scenario, policy, progress, watch), scenario)


def _alone(
    scenario: Scenario, policy: Policy | None, progress: Progress | None, watch: Watch | None
) -> Recording:
    """The run without its reference."""
    if policy is None and scenario.walking and not why_walked(scenario):
        return run_settled(scenario, progress=progress, watch=watch)
    return run_built(build(scenario), policy=policy, progress=progress, watch=watch)


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
