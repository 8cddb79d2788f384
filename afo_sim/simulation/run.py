"""A scenario simulated from beginning to end: `afo_sim.run`."""

import os
from collections.abc import Callable, Mapping
from typing import Any

from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built, build
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.policy import Policy
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.simulate import Progress, simulate

Watch = Callable[[Recording], None]  # takes each new stretch of a run while it is computed


def run(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    policy: Policy | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Simulate a scenario from static equilibrium.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}
    policy : what chooses the inputs as the simulation goes; the scenario's own timing by default
    progress : called with (steps done, steps in all)

    Returns
    -------
    Recording; its `status` is "ok", or says why the simulation stopped early.

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
    return run_built(build(description), policy=policy, progress=progress)


def run_built(
    built: Built,
    *,
    policy: Policy | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Recording:
    """Simulate a compiled scenario from static equilibrium, as `run` does; `watch` sees it grow."""
    if watch is not None:
        _ = built.xml  # compiled now: MuJoCo cannot compile beside Python callbacks
    rollout = simulate(
        built,
        schedule.controls(built) if policy is None else policy,
        progress=progress,
        see=None if watch is None else lambda stretch: watch(make_recording(built, stretch)),
    )
    return make_recording(built, rollout)
