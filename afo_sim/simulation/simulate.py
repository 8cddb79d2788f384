"""Compiled scenarios rolled out from rest or from the first step: at once, or as somebody steps them."""

import dataclasses
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, Mixed, SimulationError
from afo_sim.model import Built, Guess, equilibrium, walking_start
from afo_sim.model import supply_and_timer as schedule
from afo_sim.simulation.rollout import (
    BLOCK,
    FIELDS,
    METRIC_FIELDS,
    STATE,
    Case,
    Recipe,
    Rollout,
    Workspace,
    failed,
    roll_out,
    state_parts,
    widths,
)
from afo_sim.simulation.stepping import FAILURES, Policy, Rows, fixed, stepper_of

GONE = "the ankle moved beyond its stops"
PLAY = 0.5  # beyond a stop, where no stop yields by that much [rad]
WATCHED_BLOCK = 250  # steps between two stretches that somebody watches, and in Python mode

Progress = Callable[[int, int], None]


def simulate(
    built: Built, control: np.ndarray | Policy, *, n_step: int | None = None, state: np.ndarray | None = None,
    progress: Progress | None = None, see: Callable[[Rollout], None] | None = None,
) -> Rollout:  # fmt: skip
    """Roll a compiled scenario out."""
    mode = built.scenario.callback
    if isinstance(control, Policy):
        policy, first, count = control, schedule.controls(built, 1)[0], n_step or built.scenario.n_step
    else:
        policy, first, count = fixed(control), control[0], n_step or len(control)
    with native.installed(mode):
        case = case_of(built, policy, first, state)
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
    """Roll compiled scenarios out in one call, each exactly as `simulate` does it alone."""
    recipe = Recipe(fields=METRIC_FIELDS, block=len(controls[0]))
    with native.installed("native"):
        chosen = policies or [None] * len(builts)
        cases = [begun_case(*each) for each in zip(builts, controls, chosen, strict=True)]
        ended = roll_out(cases, len(controls[0]), recipe, workspace=workspace)
    return [_within_stops(built, rollout) for built, rollout in zip(builts, ended, strict=True)]


def case_of(
    built: Built, policy: Policy, first: np.ndarray, state: np.ndarray | None = None, air: Guess | None = None
) -> Case:
    """The case to roll out; a failed one where a kernel refuses the start."""
    try:
        native.assert_rows(built.model)
        if state is None:
            state = equilibrium(built, first) if built.walk is None else walking_start(built, first, air)
    except FAILURES as error:
        return Case(built.model, np.empty(0), policy, failure=failed(built.model, str(error), 0))
    return Case(built.model, state, policy)


def begun_case(
    built: Built, control: np.ndarray, policy: Policy | None = None, air: Guess | None = None
) -> Case:
    """As `case_of`, but an error is this simulation's own."""
    policy = policy or fixed(control)
    try:
        return case_of(built, policy, control[0], air=air)
    except Exception as error:  # of its description or controller: the others go on
        return Case(built.model, np.empty(0), policy, failure=error)


def _within_stops(built: Built, rollout: Rollout) -> Rollout:
    """The roll-out up to where the ankle has gone far beyond its stops, if it has."""
    if not len(rollout.rows["time"]):
        return rollout
    ankle = built.index.ankle_qpos
    angle = np.append(rollout.rows["qpos"][1:, ankle], rollout.final["qpos"][ankle])  # after each step
    lower, upper = built.model.jnt_range[built.model.dof_jntid[built.index.ankle_dof]]
    beyond = np.flatnonzero((angle < lower - PLAY) | (angle > upper + PLAY))
    end = int(beyond[0]) if len(beyond) else None
    if end is None:
        return rollout
    return dataclasses.replace(
        rollout,
        rows={name: values[:end] for name, values in rollout.rows.items()},
        control=rollout.control[:end],
        failure=failed(built.model, GONE, end),
    )


class Stepped:
    """Compiled scenarios that are stepped together through `mujoco.batch`, with the callbacks held."""

    def __init__(
        self, builts: Sequence[Built], *, count: int = 1, fields: tuple[str, ...] = FIELDS, threads: int = 1
    ):
        self.builts = list(builts) * (count if len(builts) == 1 else 1)
        self.fields = fields
        mode = self.builts[0].scenario.callback
        self.hold = native.Hold(mode)
        try:
            # of one scenario many times, schedule and start are computed once
            own = {id(built): built for built in self.builts}
            schedules = {key: schedule.controls(built) for key, built in own.items()}
            cases, begun = {}, {}  # of these their one row of the start (1, width)
            for key, built in own.items():
                native.assert_rows(built.model)
                cases[key] = case = case_of(built, fixed(schedules[key]), schedules[key][0])
                if case.failure is not None:
                    raise case.failure
                native.assert_muscles_pull(case.model, case.state)
                data = native.scratch(case.model)
                mujoco.mj_setState(case.model, data, case.state, mujoco.mjtState.mjSTATE_INTEGRATION)
                begun[key] = forces_of(case.model, data, schedules[key][0], fields)
            self.schedules = [schedules[id(built)] for built in self.builts]
            self.cases = [cases[id(built)] for built in self.builts]
            models, states = [case.model for case in self.cases], [case.state for case in self.cases]
            self.stepper = stepper_of(models, states, mode, threads=threads)
            self.now = state_parts(models[0], states)
            self.begun = {
                name: np.stack([begun[id(built)][name] for built in self.builts])
                for name in next(iter(begun.values()))
            }
        except BaseException:  # whatever ends it, the callbacks are given back
            self.hold.close()
            raise
        self.taken = np.zeros(len(self.builts), int)
        self.failures: dict[int, SimulationError] = {}
        self.done: dict[int, int] = {}  # good steps of the block in which a simulation failed
        self._blocks: dict[tuple[int, int], Rows] = {}

    def __len__(self) -> int:
        return len(self.builts)

    def reset(self, numbers: Sequence[int]) -> None:
        """Take simulations back to their start."""
        self.begin(numbers, [self.cases[k].state for k in numbers], [0] * len(numbers))

    def begin(self, numbers: Sequence[int], states: Sequence[np.ndarray], steps: Sequence[int]) -> None:
        """Take simulations to states in the midst of a run."""
        self.hold.check()
        for k, state, step in zip(numbers, states, steps, strict=True):
            self.stepper.restart(k, state)
            self.failures.pop(k, None)
            self.taken[k] = step
            for name, values in state_parts(self.cases[k].model, [state]).items():
                self.now[name][k] = values[0]

    @property
    def moment(self) -> tuple[Mixed, ...]:
        """All that decides what follows, but inputs; it may be assigned again."""
        states = tuple(self.stepper.state(k) for k in range(len(self)))
        return states, tuple(self.taken.tolist()), self.failures.copy()

    @moment.setter
    def moment(self, moment: tuple[Mixed, ...]) -> None:
        self.begin(range(len(self)), *moment[:2])
        self.failures = moment[2].copy()

    def state(self, k: int) -> np.ndarray:
        """The present state of a simulation, an mjSTATE_INTEGRATION row."""
        return self.stepper.state(k)

    def inputs(self, k: int, steps: int) -> np.ndarray:
        """The scenario's own inputs of a simulation's next steps (steps, nu); a timer continues forever."""
        first = int(self.taken[k])
        while first + steps > len(self.schedules[k]):
            scenario = self.builts[k].scenario
            if scenario.walking:
                end = scenario.n_step * scenario.timestep
                raise InputError(
                    f"the recorded walking ends at t = {end:.6g} s: reset(), or take a longer duration",
                    field="duration",
                    value=f"{len(self.schedules[k]) - first} steps are left",
                )
            self.schedules[k] = schedule.controls(self.builts[k], 2 * (first + steps))
        return self.schedules[k][first : first + steps].copy()

    def advance(self, alive: Sequence[int], inputs: np.ndarray) -> Rows:
        """Step, and return aligned rows of these steps, good until the next call with as many steps."""
        self.hold.check()
        n, steps = inputs.shape[:2]
        out = self._block(n, steps)
        out["time"][:] = np.nan
        try:
            with self.hold.calling("step"):
                stopped = self.stepper.advance(list(alive), np.ascontiguousarray(inputs), out)
        except BaseException as error:  # of a Python callback, or Ctrl-C, in the midst of a step
            reason = f"{type(error).__name__} broke a step off: {error}"
            self.failures |= {k: failed(self.cases[k].model, reason, int(self.taken[k]), k) for k in alive}
            raise
        for place, k in enumerate(alive):
            if k in stopped:
                self._stop(place, k, out, stopped[k].reason, stopped[k].spoilt)
        ids = list(alive)
        for name in STATE:
            values = out[name]
            after = values[:, -1].copy()
            values[:, 1:] = values[:, :-1]
            values[:, 0] = self.now[name][ids]
            self.now[name][ids] = after
        self.taken[ids] += steps
        return out

    def _stop(self, place: int, k: int, out: Rows, reason: str, spoilt: bool) -> None:
        model = self.cases[k].model
        stamps = out["time"][place, :, 0]
        due = self.now["time"][k, 0] + (np.arange(len(stamps)) + 0.5) * model.opt.timestep
        done = max(int(np.sum(stamps > due)) - spoilt, 0)
        self.failures[k] = failed(model, reason, int(self.taken[k]) + done, k)
        self.done[k] = done
        for name, values in out.items():
            last = values[place, done - 1] if done else (self.now[name][k] if name in STATE else 0.0)
            values[place, done:] = last

    def _block(self, n: int, steps: int) -> Rows:
        if (n, steps) not in self._blocks:
            if len(self._blocks) > 8:
                self._blocks.clear()
            model = self.cases[0].model
            self._blocks[n, steps] = {
                name: np.empty((n, steps, width)) for name, width in widths(model, self.fields).items()
            }
        return self._blocks[n, steps]

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self.hold.close()


def forces_of(
    model: mujoco.MjModel, data: mujoco.MjData, control: np.ndarray, fields: tuple[str, ...]
) -> Rows:
    """The row of the state in `data`, solved there (1, width). The callbacks must be installed."""
    data.ctrl[:] = control
    mujoco.mj_forward(model, data)
    return {name: np.array(getattr(data, name), float).reshape(1, -1) for name in (*STATE, *fields)}
