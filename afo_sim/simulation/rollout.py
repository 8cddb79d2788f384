"""One simulation or many: roll-out through `mujoco.batch`, or by a plain loop; recording."""

import math
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.batch import SimulationError as BatchError

from afo_sim import native
from afo_sim.common.errors import SimulationError
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built, build
from afo_sim.model.mounting import ANKLE
from afo_sim.model.start import equilibrium, fill_chambers, walking_start
from afo_sim.simulation.recording import Recording, make_recording

# What a roll-out records. The state is that after each step, the rest belongs to the state before it.
STATE = ("time", "qpos", "qvel", "act")
TOLD = ("actuator_force", "qfrc_actuator", "userdata")  # all that metrics need beside the state
DERIVED = (
    *TOLD,
    "qacc",
    "actuator_length",
    "actuator_velocity",
    "qfrc_bias",
    "qfrc_passive",
    "qfrc_constraint",
    "ten_J",
)
# How a kernel's objection arrives: through mju_error, or in Python mode as itself.
PLAY = 0.5  # beyond a stop [rad]
FAILURES = (mujoco.FatalError, native.KernelFailure)
BLOCK = 10_000  # steps between two reports of progress

Progress = Callable[[int, int], None]
Rows = dict[str, np.ndarray]
Watch = Callable[[Recording], None]  # takes each new stretch of a run while it is computed
See = Callable[[Rows, int], None]
WATCHED_BLOCK = 250  # steps between two stretches that somebody watches


@dataclass(frozen=True)
class Rollout:
    """Aligned rows of one simulation: row k is the state before step k and that step's forces."""

    rows: Rows
    failure: Exception | None
    wall_seconds: float
    first_step: int = 0


def run(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    progress: Progress | None = None,
) -> Recording:
    """Simulate a scenario from static equilibrium.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}
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
    (True, (1000,))
    >>> high = run(load("scenario", "seated"), {"duration": "1 s"})
    >>> high.metrics["peak_dorsiflexion_angle"] > low.metrics["peak_dorsiflexion_angle"]
    True
    """
    if isinstance(scenario, Scenario):
        description = scenario.set(sets) if sets else scenario
    else:
        description = load("scenario", scenario, sets)
    return run_built(build(description), progress=progress)


def run_built(built: Built, *, progress: Progress | None = None, watch: Watch | None = None) -> Recording:
    """Simulate a compiled scenario from static equilibrium, as `run` does; `watch` sees it grow."""
    control = schedule.controls(built)

    def see(rows: Rows, first: int) -> None:
        stretch = Rollout(rows, None, 0.0, first)
        if watch is not None:
            watch(make_recording(built, control[first : first + len(rows["time"])], stretch))

    rollout = simulate(built, control, progress=progress, see=None if watch is None else see)
    return make_recording(built, control, rollout)


def simulate(
    built: Built,
    control: np.ndarray,
    *,
    state: np.ndarray | None = None,
    progress: Progress | None = None,
    see: See | None = None,
) -> Rollout:
    """Roll a compiled scenario out.

    Parameters
    ----------
    built : compiled scenario
    control : inputs (n_step, nu), as `schedule.controls` makes them
    state : mjSTATE_INTEGRATION row to start from; the static equilibrium by default
    progress : called with (steps done, steps in all)
    see : called with each new stretch of aligned rows, and its first step

    Returns
    -------
    Rollout, shorter than `control` when the simulation failed
    """
    mode = built.scenario.callback
    with native.installed(mode):
        started = _start(built, control, state)
        if isinstance(started, Rollout):
            return started
        roll = _batch_rollout if mode == "native" else _python_rollout
        start = time.perf_counter()
        rows, done, reason = roll(built, control, started, progress, see)
        wall = time.perf_counter() - start
    return _ended(built, rows, started, done, reason, wall)


@dataclass
class Workspace:
    """Memory that roll-outs record into, one after the other: new memory costs as much as some stepping."""

    arrays: dict[str, np.ndarray]

    def take(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        """An array of this shape, with what was left in it."""
        size = math.prod(shape)
        if name not in self.arrays or self.arrays[name].size < size:
            self.arrays[name] = np.empty(size)
        return self.arrays[name][:size].reshape(shape)


def simulate_together(
    builts: Sequence[Built],
    controls: Sequence[np.ndarray],
    workspace: Workspace | None = None,
) -> list[Rollout]:
    """Roll compiled scenarios out in one call, each exactly as `simulate` does it alone.

    Of their rows only what metrics need is recorded: the state and TOLD.

    Parameters
    ----------
    builts : compiled scenarios whose MjData are of one layout; they may differ in every number
    controls : inputs of each (n_step, nu), all of one length
    workspace : memory for the rows, which are then good until it is used again

    Returns
    -------
    list of Rollout, in order. What fails in one does not touch the others: of one that cannot even start,
    `failure` is what `simulate` would raise.
    """
    with native.installed("native"):
        begun = [_begun(built, control) for built, control in zip(builts, controls, strict=True)]
        alive = [k for k, state in enumerate(begun) if not isinstance(state, Rollout)]
        start = time.perf_counter()
        ends = _rollouts(
            [builts[k] for k in alive],
            [controls[k] for k in alive],
            [begun[k] for k in alive],
            workspace or Workspace({}),
        )
        wall = time.perf_counter() - start
    for k, (rows, done, reason) in zip(alive, ends, strict=True):
        begun[k] = _ended(builts[k], rows, begun[k], done, reason, wall / len(alive))
    return begun


def _start(built: Built, control: np.ndarray, state: np.ndarray | None) -> Any:
    """The state that a roll-out starts from, or the Rollout of one that cannot start."""
    try:
        native.assert_rows(built.model)
        if state is None:
            state = equilibrium(built, control[0]) if built.walk is None else walking_start(built)
        _assert_muscles_pull(built, state)
    except FAILURES as error:
        return _not_begun(built, _failure(built, _named(built, str(error)), 0))
    return state


def _begun(built: Built, control: np.ndarray) -> Any:
    """As `_start`, but an error is this simulation's own."""
    try:
        return _start(built, control, None)
    except Exception as error:
        return _not_begun(built, error)


def _not_begun(built: Built, failure: Exception) -> Rollout:
    return Rollout(_blank(mujoco.MjData(built.model), 0), failure, 0.0)


def _ended(
    built: Built, rows: Rows, state: np.ndarray, done: int, reason: str | None, wall: float
) -> Rollout:
    beyond = _beyond_stops(built, rows["qpos"][:done, built.index.ankle_qpos])
    if beyond is not None:
        done, reason = beyond, "the ankle has gone through its stops"
    failure = None if reason is None else _failure(built, reason, done)
    return Rollout(_aligned(built.model, rows, state, 0, done), failure, wall)


def _beyond_stops(built: Built, angle: np.ndarray) -> int | None:
    """The first step after which the ankle is far beyond its stops: no stop gives way by that much."""
    lower, upper = built.model.joint(ANKLE).range
    outside = np.flatnonzero((angle < lower - PLAY) | (angle > upper + PLAY))
    return int(outside[0]) if len(outside) else None


def _failure(built: Built, reason: str, step: int) -> SimulationError:
    return SimulationError(reason, simulation=0, time=step * built.scenario.timestep)


def _assert_muscles_pull(built: Built, state: np.ndarray) -> None:
    """Refuse to run limp muscles: with 3 bar in every chamber each must carry its law's force."""
    data = mujoco.MjData(built.model)
    mujoco.mj_setState(built.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    fill_chambers(built, data, 3e5)
    data.qvel[built.index.ankle_dof] = 0.1
    mujoco.mj_forward(built.model, data)
    native.assert_live(built.model, data, list(built.index.muscles.values()))


def _batch_rollout(
    built: Built, control: np.ndarray, state: np.ndarray, progress: Progress | None, see: See | None
) -> tuple[Rows, int, str | None]:
    batch = Batch(built.model, nsim=1, nthread=1)
    batch.state[:] = state
    data = mujoco.MjData(built.model)
    n_step = len(control)
    rows = {name: np.full((1, *values.shape), np.nan) for name, values in _blank(data, n_step).items()}
    reason, spoilt = None, 0
    length = BLOCK if see is None else WATCHED_BLOCK
    for first in range(0, n_step, length):
        block = slice(first, min(first + length, n_step))
        out: dict[Any, np.ndarray] = {_recorded(name): rows[name][:, block] for name in rows}
        try:
            batch.rollout(block.stop - first, control[None, block], record=list(out), out=out)
        except BatchError:
            reason = _named(built, batch.error(0))
            break
        reason = instability(batch.warning[0])
        if reason is not None:
            spoilt = 1  # the step that warned has been recorded
            break
        if progress is not None:
            progress(block.stop, n_step)
        if see is not None:
            flat = {name: values[0] for name, values in rows.items()}
            see(_aligned(built.model, flat, state, first, block.stop), first)
    done = n_step if reason is None else _steps_done(rows["time"][0, :, 0], built, spoilt)
    return {name: values[0] for name, values in rows.items()}, done, reason


def _rollouts(
    builts: list[Built],
    controls: list[np.ndarray],
    states: list[np.ndarray],
    workspace: Workspace,
) -> list[tuple[Rows, int, str | None]]:
    """Of each: rows, steps done, and why it stopped."""
    if not builts:
        return []
    batch = Batch(builts[0].model, nsim=len(builts), nthread=1)
    batch.set_models([built.model for built in builts])
    batch.state[:] = states
    n_step = len(controls[0])
    blank = _blank(mujoco.MjData(builts[0].model), 0, TOLD)
    rows = {
        name: workspace.take(name, (len(builts), n_step, values.shape[1])) for name, values in blank.items()
    }
    rows["time"][:] = np.nan  # tells the rows that no step has written
    control = np.stack(controls, out=workspace.take("control", (len(builts), *controls[0].shape)))
    out: dict[Any, np.ndarray] = {_recorded(name): values for name, values in rows.items()}
    failed: tuple[int, ...] = ()
    try:
        batch.rollout(n_step, control, record=list(out), out=out)
    except BatchError as error:
        failed = tuple(error.ids)
    found = []
    for k, built in enumerate(builts):
        reason = _named(built, batch.error(k)) if k in failed else instability(batch.warning[k])
        spoilt = k not in failed
        done = n_step if reason is None else _steps_done(rows["time"][k, :, 0], built, spoilt)
        found.append(({name: values[k] for name, values in rows.items()}, done, reason))
    return found


def _recorded(name: str) -> Any:
    """How Batch names a field: `time` is a scalar of MjData, which it records as a part of the state only."""
    return int(mujoco.mjtState.mjSTATE_TIME) if name == "time" else name


def _steps_done(stamps: np.ndarray, built: Built, spoilt: int) -> int:
    """Steps before a failure: rows that no step has written are NaN, those repeated do not move on."""
    due = (np.arange(len(stamps)) + 0.5) * built.scenario.timestep
    return max(int(np.sum(stamps > due)) - spoilt, 0)


def _python_rollout(
    built: Built, control: np.ndarray, state: np.ndarray, progress: Progress | None, see: See | None
) -> tuple[Rows, int, str | None]:
    """The same rows by a plain loop, since `mujoco.batch` refuses Python callbacks."""
    model = built.model
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    n_step = len(control)
    rows = _blank(data, n_step)
    for k in range(n_step):
        data.ctrl[:] = control[k]
        try:
            mujoco.mj_step(model, data)
        except FAILURES as error:
            return rows, k, _named(built, str(error))
        reason = instability(np.array([[w.lastinfo, w.number] for w in data.warning]))
        if reason is not None:
            return rows, k, reason
        for name, values in rows.items():
            values[k] = getattr(data, name)
        if progress is not None and (k + 1) % WATCHED_BLOCK == 0:
            progress(k + 1, n_step)
        if see is not None and ((k + 1) % WATCHED_BLOCK == 0 or k + 1 == n_step):
            first = k - k % WATCHED_BLOCK
            see(_aligned(model, rows, state, first, k + 1), first)
    return rows, n_step, None


def row_width(model: mujoco.MjModel) -> int:
    """Numbers that `simulate_together` records in each step."""
    return sum(values.shape[1] for values in _blank(mujoco.MjData(model), 0, TOLD).values())


def _blank(data: mujoco.MjData, n_step: int, derived: tuple[str, ...] = DERIVED) -> Rows:
    """Rows to record into, NaN until a step has written them."""
    widths = {name: np.size(getattr(data, name)) for name in (*STATE, *derived)}
    return {name: np.full((n_step, width), np.nan) for name, width in widths.items()}


def instability(counters: np.ndarray) -> str | None:
    """MuJoCo's own signs that a simulation has become unstable."""
    bad = {
        mujoco.mjtWarning.mjWARN_BADQPOS: "position",
        mujoco.mjtWarning.mjWARN_BADQVEL: "velocity",
        mujoco.mjtWarning.mjWARN_BADQACC: "acceleration",
        mujoco.mjtWarning.mjWARN_BADCTRL: "control",
    }
    for warning, word in bad.items():
        if counters[int(warning)][-1] > 0:
            return f"a {word} is not a number, or is too large"
    return None


def _named(built: Built, message: str) -> str:
    """A callback's complaint with the actuator's name for its number."""

    def name(match: re.Match[str]) -> str:
        return repr(built.model.actuator(int(match[1])).name)

    return re.sub(r"actuator (\d+)", name, message)


def _aligned(model: mujoco.MjModel, rows: Rows, state: np.ndarray, first: int, stop: int) -> Rows:
    """Rows first…stop, states moved down by one: row k is the state that step k started from."""
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    aligned = {name: values[first:stop] for name, values in rows.items() if name not in STATE}
    for name in STATE:
        before = rows[name][first - 1 : first] if first else np.reshape(getattr(data, name), (1, -1))
        aligned[name] = np.concatenate([before, rows[name][first : max(stop - 1, first)]])[: stop - first]
    return aligned
