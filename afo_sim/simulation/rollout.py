"""The roll-out: 1…N simulations from their first states through all steps, recorded in aligned rows.

Every simulation of this package is stepped here: runs, sweeps, fits, the test stand, hanging masses. Row k
is the state before step k, with the forces of that same step.
"""

import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import ControllerError, SimulationError
from afo_sim.simulation.stepping import (
    CONTROL,
    FAILURES,
    Moment,
    Policy,
    PolicyFault,
    Rows,
    Stepper,
    StopEarly,
    one_of,
    stepper_of,
)

STATE = ("time", "qpos", "qvel", "act")  # recorded after each step, the rest is of the state before it
METRIC_FIELDS = ("actuator_force", "actuator_length", "qfrc_actuator", "userdata")  # for metrics
FIELDS = (*METRIC_FIELDS, "qacc", "qfrc_bias", "qfrc_passive", "qfrc_constraint", "ten_J")
BLOCK = 10_000  # steps between two reports of progress


@dataclass(frozen=True)
class Rollout:
    """One simulation, as far as it came."""

    rows: Rows
    control: np.ndarray
    failure: Exception | None = None
    wall_seconds: float = 0.0
    first_step: int = 0
    final: Rows = field(default_factory=dict)
    reported: Rows = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A simulation to roll out: model, mjSTATE_INTEGRATION row (None if it failed before), inputs; number."""

    model: mujoco.MjModel
    state: np.ndarray
    policy: Policy
    number: int = 0
    failure: Exception | None = None


See = Callable[[int, Rollout], None]  # a case's number, and a new stretch of it


@dataclass
class Workspace:
    """Memory that roll-outs record into, one after the other: new memory costs as much as some stepping."""

    arrays: dict[str, np.ndarray] = field(default_factory=dict)

    def take(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        """An array of this shape, with what was left in it."""
        size = math.prod(shape)
        if name not in self.arrays or self.arrays[name].size < size:
            self.arrays[name] = np.empty(size)
        return self.arrays[name][:size].reshape(shape)

    def rows(self, of: str, shape: tuple[int, ...], widths: Mapping[str, int]) -> Rows:
        """Arrays (*shape, width) of recorded fields by name; `of` what."""
        return {name: self.take(of + name, (*shape, width)) for name, width in widths.items()}


@dataclass(frozen=True)
class Recipe:
    """Settings of a roll-out: recorded fields, inputs, rate, threads."""

    fields: tuple[str, ...] = FIELDS
    inputs: int = CONTROL
    stride: int = 1
    block: int = BLOCK
    threads: int = 1
    mode: native.Mode = "native"


def roll_out(
    cases: Sequence[Case], n_step: int, recipe: Recipe | None = None, *, workspace: Workspace | None = None,
    progress: Callable[[int, int], None] | None = None, see: See | None = None,
) -> list[Rollout]:  # fmt: skip
    """Roll simulations out side by side, each exactly as it runs alone."""
    recipe = recipe or Recipe()
    with native.installed(recipe.mode), native.without_clock():
        failures = limp(cases)
        alive = [case for case, failure in zip(cases, failures, strict=True) if failure is None]
        run = _Run(alive, n_step, recipe, workspace or Workspace())
        start = time.perf_counter()
        if alive:
            run.through(progress, see)
        wall = (time.perf_counter() - start) / max(len(alive), 1)
    place, found = 0, []
    for case, failure in zip(cases, failures, strict=True):
        if failure is None:
            found.append(run.rollout(place, wall))
            place += 1
        else:
            found.append(not_begun(case.model, failure, recipe))
    return found


def not_begun(model: mujoco.MjModel, failure: Exception, recipe: Recipe | None = None) -> Rollout:
    """The Rollout, without rows, of a simulation that cannot start."""
    fields = (recipe or Recipe()).fields
    rows = {name: np.empty((0, width)) for name, width in widths(model, fields).items()}
    return Rollout(rows, np.empty((0, model.nu)), failure)


def failed(model: mujoco.MjModel, reason: str, step: int, simulation: int = 0) -> SimulationError:
    """The error that a kernel's or MuJoCo's complaint is, with the actuator's name for its number."""

    def name(match: re.Match[str]) -> str:
        return repr(model.actuator(int(match[1])).name)

    named = re.sub(r"actuator (\d+)", name, reason)
    return SimulationError(named, simulation=simulation, time=step * model.opt.timestep)


def row_width(model: mujoco.MjModel, fields: tuple[str, ...] = METRIC_FIELDS) -> int:
    """Numbers that are recorded in each step."""
    return sum(widths(model, fields).values())


def widths(model: mujoco.MjModel, fields: tuple[str, ...]) -> dict[str, int]:
    """Numbers of the state and of each recorded field of MjData, by name."""
    data = native.scratch(model)
    return {name: np.size(getattr(data, name)) for name in (*STATE, *fields)}


def limp(cases: Sequence[Case]) -> list[Exception | None]:
    """The reason for which each simulation must not start."""
    # Whether the callbacks in force are those of the muscles shows on one of all cases with the same muscles:
    # the others differ in who wears them, and their own rows are looked at.
    proven: set[bytes] = set()
    return [case.failure or _limp(case, proven) for case in cases]


def _limp(case: Case, proven: set[bytes]) -> Exception | None:
    try:
        native.assert_rows(case.model)
        muscles = native.muscle_rows(case.model)
        if muscles not in proven:
            native.assert_muscles_pull(case.model, case.state)
            proven.add(muscles)
    except FAILURES as error:
        return failed(case.model, str(error), 0, case.number)
    except Exception as error:  # of a user's own law or friction: this simulation's own
        return error
    return None


class _Run:
    """A roll-out under way."""

    def __init__(self, cases: Sequence[Case], n_step: int, recipe: Recipe, workspace: Workspace):
        self.cases, self.n_step, self.recipe, self.workspace = cases, n_step, recipe, workspace
        self.stops: dict[int, tuple[int, str | None]] = {}  # simulation: steps done, why it stopped
        self.faults: set[int] = set()  # simulations whose policy gave up
        if not cases:
            return
        periods = {case.policy.period for case in cases} - {None}
        if len(periods) > 1:
            raise ValueError(f"policies of one roll-out choose at different periods: {periods}")
        self.block = min(recipe.block, *(period for period in periods if period), n_step) or 1
        n, kept = len(cases), -(-n_step // recipe.stride)
        self.in_place = recipe.stride == 1 and (n == 1 or (self.block == n_step and not periods))
        self.start = state_parts(cases[0].model, [case.state for case in cases])
        self.now = {name: values.copy() for name, values in self.start.items()}
        self.widths = widths(cases[0].model, recipe.fields)
        self.rows = workspace.rows("", (n, kept), self.widths)
        self.control = workspace.take(
            "control", (n, kept, mujoco.mj_stateSize(cases[0].model, recipe.inputs))
        )

    def through(self, progress: Callable[[int, int], None] | None, see: See | None) -> None:
        """All steps, block by block."""
        cases, recipe = self.cases, self.recipe
        models, states = [case.model for case in cases], [case.state for case in cases]
        stepper = stepper_of(models, states, recipe.mode, recipe.inputs, recipe.threads)
        before = seen = 0
        for first in range(0, self.n_step, self.block):
            alive = [k for k in range(len(cases)) if k not in self.stops]
            if not alive:
                return
            steps = range(first, min(first + self.block, self.n_step))
            keeps = all(cases[k].policy.keeps for k in alive)
            now = {name: values.copy() for name, values in self.now.items()} if keeps else {}
            try:
                self._advance(stepper, alive, steps, before)
                before = first
                if steps.stop - seen < min(recipe.block, self.n_step - seen):
                    continue
                going = [k for k in alive if k not in self.stops]
                if see is not None:
                    for k in going:
                        see(self.cases[k].number, self.stretch(k, seen, steps.stop))
                if progress is not None and going:
                    progress(steps.stop, self.n_step)
                seen = steps.stop
            except KeyboardInterrupt:
                if not keeps:
                    raise
                self.now = now  # the block may be half done
                self.faults.update(alive)
                self.stops.update(dict.fromkeys(alive, (first, "stopped by Ctrl-C")))

    def _advance(self, stepper: Stepper, alive: list[int], steps: range, before: int) -> None:
        # as the policies choose them; of the rows that are kept they are kept
        chosen, stride = [self._chosen(k, steps, before) for k in alive], self.recipe.stride
        into = slice(-(-steps.start // stride), -(-steps.stop // stride))
        for k, rows in zip(alive, chosen, strict=True):
            self.control[k, into] = rows[-steps.start % stride :: stride]
        inputs = self.control[:, into] if self.in_place else np.ascontiguousarray(chosen)
        if not self.stops.keys().isdisjoint(alive):  # a policy gave up
            going = [place for place, k in enumerate(alive) if k not in self.stops]
            alive, inputs = [alive[place] for place in going], np.ascontiguousarray(inputs[going])
            if not alive:
                return
        if self.in_place:
            out = {name: values[:, steps.start : steps.stop] for name, values in self.rows.items()}
        else:
            out = self.workspace.rows("block of ", (len(alive), len(steps)), self.widths)
        out["time"][:] = np.nan  # tells the rows that no step has written
        stopped = stepper.advance(alive, inputs, out)
        for place, k in enumerate(alive):
            done = len(steps)
            if k in stopped:
                stamps = out["time"][place, :, 0]
                stop = stopped[k]
                # Steps before a failure: rows that no step has written are NaN, those repeated do not move
                # on
                due = (steps.start + np.arange(len(stamps)) + 0.5) * self.cases[k].model.opt.timestep
                due += self.start["time"][k]
                done = max(int(np.sum(stamps > due)) - stop.spoilt, 0)
                self.stops[k] = steps.start + done, stopped[k].reason
            if not self.in_place:  # every stride-th row, aligned: states come after their step, forces before
                for name, values in one_of(out, place).items():
                    if name in STATE:
                        values = np.concatenate([self.now[name][k][None], values[:-1]])
                    self.rows[name][k, into] = values[-steps.start % stride :: stride]
            for name in STATE if done else ():
                self.now[name][k] = out[name][place, done - 1]

    def _chosen(self, k: int, steps: range, before: int) -> np.ndarray:
        """Inputs of one simulation; of one whose policy gives up, none."""
        moment = Moment(
            steps, lambda: one_of(self.now, k, copy=True), lambda: self.aligned(k, before, steps.start)
        )
        try:
            return self.cases[k].policy.choose(moment)
        except PolicyFault as fault:
            self.stops[k] = steps.start, str(fault)
            self.faults.add(k)
        except StopEarly:
            self.stops[k] = steps.start, None
        return np.zeros((len(steps), self.control.shape[-1]))

    def aligned(self, k: int, first: int, stop: int) -> Rows:
        """Rows of the steps first…stop of a simulation."""
        stride = self.recipe.stride
        if not self.in_place:
            kept = slice(-(-first // stride), -(-stop // stride))
            return {name: values[k, kept] for name, values in self.rows.items()}
        found = {name: values[k, first:stop] for name, values in self.rows.items() if name not in STATE}
        for name in STATE:
            values = self.rows[name][k]
            before = values[first - 1 : first] if first else self.start[name][k][None]
            found[name] = np.concatenate([before, values[first : max(stop - 1, first)]])[: stop - first]
        return found

    def stretch(self, k: int, first: int, stop: int) -> Rollout:
        """Steps first…stop of a simulation."""
        stride = self.recipe.stride
        kept = slice(-(-first // stride), -(-stop // stride))
        tell = self.cases[k].policy.reported
        told = {} if tell is None else tell(first, stop)
        reported = {name: values[-first % stride :: stride] for name, values in told.items()}
        return Rollout(self.aligned(k, first, stop), self.control[k, kept], None, 0.0, first, {}, reported)

    def rollout(self, k: int, wall: float) -> Rollout:
        """The simulation number k up to its end or its failure; `wall` is the time it took [s]."""
        done, reason = self.stops.get(k, (self.n_step, None))
        model, number = self.cases[k].model, self.cases[k].number
        failure: SimulationError | None = None if reason is None else failed(model, reason, done, number)
        if reason is not None and k in self.faults:
            failure = ControllerError(reason, simulation=number, time=done * model.opt.timestep)
        found = self.stretch(k, 0, done)
        final = one_of(self.now, k, copy=True)
        return Rollout(found.rows, found.control, failure, wall, 0, final, found.reported)


def state_parts(model: mujoco.MjModel, states: Sequence[np.ndarray] | np.ndarray) -> Rows:
    """Time, qpos, qvel and act (n, width) of mjSTATE_INTEGRATION rows; of an array they are views."""
    rows, found, first = np.asarray(states), {}, 0
    for name in STATE:
        size = mujoco.mj_stateSize(model, getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}"))
        found[name] = rows[:, first : first + size]
        first += size
    return found
