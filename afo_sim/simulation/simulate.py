"""A compiled scenario rolled out from rest, or from the first step of its walking; one, or many together."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from afo_sim import native
from afo_sim.common.errors import SimulationError
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built
from afo_sim.model.mounting import ANKLE
from afo_sim.model.start import Guess, equilibrium, walking_start
from afo_sim.simulation.policy import Policy, fixed
from afo_sim.simulation.rollout import (
    BLOCK,
    METRIC_FIELDS,
    Case,
    Recipe,
    Rollout,
    Workspace,
    failed,
    not_begun,
    roll_out,
)
from afo_sim.simulation.stepping import FAILURES

GONE = "the ankle has gone through its stops"
PLAY = 0.5  # beyond a stop, where no stop gives way by that much [rad]
WATCHED_BLOCK = 250  # steps between two stretches that somebody watches, and in Python mode

Progress = Callable[[int, int], None]


def simulate(
    built: Built,
    control: np.ndarray | Policy,
    *,
    n_step: int | None = None,
    state: np.ndarray | None = None,
    progress: Progress | None = None,
    see: Callable[[Rollout], None] | None = None,
) -> Rollout:
    """Roll a compiled scenario out.

    Parameters
    ----------
    built : compiled scenario
    control : inputs (n_step, nu), as `controls.controls` makes them, or what chooses them as it goes
    n_step : number of steps of a policy; the scenario's own by default
    state : mjSTATE_INTEGRATION row to start from; the static equilibrium by default
    progress : called with (steps done, steps in all)
    see : called with each new stretch

    Returns
    -------
    Rollout, shorter than asked for when the simulation failed

    Raises
    ------
    CallbackError
        The muscle callbacks cannot be installed or are not in force.
    InputError
        There is no static equilibrium.
    """
    mode = built.scenario.callback
    policy, first, count = _inputs(built, control, n_step)
    with native.installed(mode):
        case = case_of(built, policy, first, state)
        if isinstance(case, Rollout):
            return case
        block = WATCHED_BLOCK if see is not None or mode == "python" else BLOCK
        (rollout,) = roll_out(
            [case],
            count,
            Recipe(mode=mode, block=block),
            progress=progress,
            see=None if see is None else lambda k, stretch: see(stretch),
        )
    if rollout.failure is not None and not isinstance(rollout.failure, SimulationError):
        raise rollout.failure
    return _within_stops(built, rollout)


def simulate_together(
    builts: Sequence[Built],
    controls: Sequence[np.ndarray],
    workspace: Workspace | None = None,
    *,
    policies: Sequence[Policy | None] | None = None,
) -> list[Rollout]:
    """Roll compiled scenarios out in one call, each exactly as `simulate` does it alone.

    Only what metrics need is recorded: the state and METRIC_FIELDS.

    Parameters
    ----------
    builts : compiled scenarios whose MjData are of one layout; they may differ in every number
    controls : inputs of each (n_step, nu), all of one length
    workspace : memory for the rows, which are then good until it is used again
    policies : what chooses the inputs of each as it goes, all at one period; None for those of `controls`

    Returns
    -------
    list of Rollout, in order. What fails in one does not touch the others: of one that cannot even start,
    `failure` is what `simulate` would raise.
    """
    recipe = Recipe(fields=METRIC_FIELDS, block=len(controls[0]))
    with native.installed("native"):
        chosen = policies or [None] * len(builts)
        begun = [_begun(*each, recipe) for each in zip(builts, controls, chosen, strict=True)]
        ready = [case for case in begun if isinstance(case, Case)]
        ended = iter(roll_out(ready, len(controls[0]), recipe, workspace=workspace))
    return [
        case if isinstance(case, Rollout) else _within_stops(built, next(ended))
        for built, case in zip(builts, begun, strict=True)
    ]


def _inputs(built: Built, control: np.ndarray | Policy, n_step: int | None) -> tuple[Policy, np.ndarray, int]:
    """The policy, the inputs that the start is sought with, and the number of steps."""
    if isinstance(control, Policy):
        return control, schedule.controls(built, 1)[0], n_step or built.scenario.n_step
    return fixed(control), control[0], n_step or len(control)


def case_of(
    built: Built,
    policy: Policy,
    first: np.ndarray,
    state: np.ndarray | None = None,
    air: Guess | None = None,
) -> Case | Rollout:
    """The case to roll out, or an empty Rollout where a kernel refuses the start.

    Units: first (nu,).
    """
    try:
        native.assert_rows(built.model)
        if state is None:
            state = equilibrium(built, first) if built.walk is None else walking_start(built, first, air)
    except FAILURES as error:
        return not_begun(built.model, failed(built.model, str(error), 0))
    return Case(built.model, state, policy)


def _begun(built: Built, control: np.ndarray, policy: Policy | None, recipe: Recipe) -> Case | Rollout:
    """As `case_of`, but an error is this simulation's own."""
    try:
        return case_of(built, policy or fixed(control), control[0])
    except Exception as error:
        return not_begun(built.model, error, recipe)


def first_beyond(built: Built, angle: np.ndarray) -> int | None:
    """First of some ankle angles [rad] (n,) that is far beyond the ankle's stops; None where none is."""
    lower, upper = built.model.joint(ANKLE).range
    beyond = np.flatnonzero((angle < lower - PLAY) | (angle > upper + PLAY))
    return int(beyond[0]) if len(beyond) else None


def _within_stops(built: Built, rollout: Rollout) -> Rollout:
    """The roll-out up to where the ankle has gone far beyond its stops, if it has."""
    if not len(rollout.rows["time"]):
        return rollout
    ankle = built.index.ankle_qpos
    angle = np.append(rollout.rows["qpos"][1:, ankle], rollout.final["qpos"][ankle])  # after each step
    end = first_beyond(built, angle)
    if end is None:
        return rollout
    return dataclasses.replace(
        rollout,
        rows={name: values[:end] for name, values in rollout.rows.items()},
        control=rollout.control[:end],
        failure=failed(built.model, GONE, end),
    )
