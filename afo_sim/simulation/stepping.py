"""Inputs, known beforehand or chosen as it goes, and the MuJoCo steps of a block.

Blocks go through `mujoco.batch`, or through a plain loop where the callbacks are Python's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.batch import SimulationError as BatchError

from afo_sim import native
from afo_sim.model import get_state

Rows = dict[str, np.ndarray]
CONTROL = int(mujoco.mjtState.mjSTATE_CTRL)  # inputs that are the actuators' alone
_PLACE = mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL
BEGUN = int(_PLACE | mujoco.mjtState.mjSTATE_ACT)  # first parts of an mjSTATE_INTEGRATION row


def one_of(rows: Rows, place: int, *, copy: bool = False) -> Rows:
    """The rows of one of several simulations."""
    return {name: values[place].copy() if copy else values[place] for name, values in rows.items()}


@dataclass(frozen=True)
class Moment:
    """The view from which a policy chooses the inputs of the next steps, `steps`."""

    steps: range
    state: Callable[[], Rows]
    rows: Callable[[], Rows]

    @property
    def now(self) -> Rows:
        """The state that the first of these steps starts from: {"time", "qpos", "qvel", "act": (width,)}."""
        return self.state()

    @property
    def last(self) -> Rows:
        """Aligned rows of the steps since the last choice (n, width); none at first."""
        return self.rows()


@dataclass(frozen=True)
class Policy:
    """Inputs that are chosen block by block."""

    choose: Callable[[Moment], np.ndarray]
    period: int | None = None
    reported: Callable[[int, int], Rows] | None = None
    keeps: bool = False


class PolicyFault(Exception):
    """A policy cannot choose: the simulation ends here, with this sentence; what came before is kept."""


class StopEarly(Exception):
    """A policy wants no more steps: the simulation ends here, whole."""


def fixed(inputs: np.ndarray) -> Policy:
    """The policy of inputs (n_step, n_input) that are known beforehand."""
    return Policy(lambda moment: inputs[moment.steps.start : moment.steps.stop])


FAILURES = (mujoco.FatalError, native.KernelFailure)  # a kernel's objection, through mju_error or as itself


@dataclass(frozen=True)
class Stop:
    """Reason why a simulation ended early; `spoilt` if the step in which it stopped has been recorded."""

    reason: str
    spoilt: bool


class BatchStepper:
    """Any number of simulations in threads, with native callbacks."""

    def __init__(
        self, models: Sequence[mujoco.MjModel], states: Sequence[np.ndarray], inputs: int, threads: int
    ):
        self.inputs = inputs
        self.batch = Batch(models[0], nsim=len(models), nthread=threads)
        if len(set(map(id, models))) > 1:
            self.batch.set_models(list(models))
        self.batch.state[:] = states
        self.width = mujoco.mj_stateSize(models[0], BEGUN)

    def restart(self, k: int, state: np.ndarray) -> None:
        """Take a simulation to an mjSTATE_INTEGRATION row, with no memory of what was before."""
        if self.batch.error(k) or self.batch.warning[k].any():
            self.batch.reset([k], stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.batch.state[k] = state

    def state(self, k: int) -> np.ndarray:
        """The present mjSTATE_INTEGRATION row of a simulation, a copy."""
        return self.batch.state[k].copy()

    def begun(self, alive: Sequence[int]) -> np.ndarray:
        """Time, qpos, qvel and act of some simulations between two blocks (n, width), a copy."""
        return self.batch.state[alive, : self.width]

    def begin(self, alive: Sequence[int], states: np.ndarray) -> None:
        """Go on from such states."""
        self.batch.state[alive, : self.width] = states

    def advance(self, alive: Sequence[int], inputs: np.ndarray, out: Rows) -> dict[int, Stop]:
        """Step, and record every step."""
        batch = self.batch
        everyone = len(alive) == batch.nsim
        recorded = {
            (int(mujoco.mjtState.mjSTATE_TIME) if name == "time" else name): values
            for name, values in out.items()
        }
        stopped: dict[int, Stop] = {}
        try:
            batch.rollout(
                inputs.shape[1], inputs, self.inputs, record=list(recorded),
                ids=None if everyone else list(alive), out=recorded,
            )  # fmt: skip
        except BatchError as error:
            stopped = {int(k): Stop(batch.error(k), spoilt=False) for k in error.ids}
        for k in np.flatnonzero(batch.warning[:, list(BAD), -1].any(axis=1)).tolist():
            reason = instability(batch.warning[k])
            if reason is not None and k in alive and k not in stopped:
                stopped[k] = Stop(reason, spoilt=True)  # the step that warned has been recorded
        return stopped


class LoopStepper:
    """The same by `mj_step`, since `mujoco.batch` refuses Python callbacks."""

    def __init__(self, models: Sequence[mujoco.MjModel], states: Sequence[np.ndarray], inputs: int):
        self.inputs, self.models = inputs, models
        self.data = [mujoco.MjData(model) for model in models]
        for model, data, state in zip(models, self.data, states, strict=True):
            mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def restart(self, k: int, state: np.ndarray) -> None:
        mujoco.mj_resetData(self.models[k], self.data[k])
        mujoco.mj_setState(self.models[k], self.data[k], state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def state(self, k: int) -> np.ndarray:
        return get_state(self.models[k], self.data[k])

    def begun(self, alive: Sequence[int]) -> np.ndarray:
        found = np.empty((len(alive), mujoco.mj_stateSize(self.models[0], BEGUN)))
        for place, k in enumerate(alive):
            mujoco.mj_getState(self.models[k], self.data[k], found[place], BEGUN)
        return found

    def begin(self, alive: Sequence[int], states: np.ndarray) -> None:
        for place, k in enumerate(alive):
            mujoco.mj_setState(self.models[k], self.data[k], states[place], BEGUN)

    def advance(self, alive: Sequence[int], inputs: np.ndarray, out: Rows) -> dict[int, Stop]:
        stopped = {}
        for place, k in enumerate(alive):
            reason = self._advance(k, inputs[place], {name: values[place] for name, values in out.items()})
            if reason is not None:
                stopped[k] = Stop(reason, spoilt=False)
        return stopped

    def _advance(self, k: int, inputs: np.ndarray, out: Rows) -> str | None:
        model, data = self.models[k], self.data[k]
        for step, row in enumerate(inputs):
            mujoco.mj_setState(model, data, row, self.inputs)
            try:
                mujoco.mj_step(model, data)
            except FAILURES as error:
                return str(error)
            reason = instability(np.array([[w.lastinfo, w.number] for w in data.warning]))
            if reason is not None:
                return reason
            for name, values in out.items():
                values[step] = np.reshape(getattr(data, name), -1)
        return None


Stepper = BatchStepper | LoopStepper


def stepper_of(
    models: Sequence[mujoco.MjModel],
    states: Sequence[np.ndarray],
    mode: native.Mode,
    inputs: int = CONTROL,
    threads: int = 1,
) -> Stepper:
    """Simulations from these states: in a batch, or in a loop where the callbacks are Python's."""
    if mode == "native":
        return BatchStepper(models, states, inputs, threads)
    return LoopStepper(models, states, inputs)


BAD = {
    int(mujoco.mjtWarning.mjWARN_BADQPOS): "position",
    int(mujoco.mjtWarning.mjWARN_BADQVEL): "velocity",
    int(mujoco.mjtWarning.mjWARN_BADQACC): "acceleration",
    int(mujoco.mjtWarning.mjWARN_BADCTRL): "control",
}


def instability(counters: np.ndarray) -> str | None:
    """MuJoCo's own signs that a simulation has become unstable."""
    for warning, word in BAD.items():
        if counters[warning][-1] > 0:
            return f"a {word} is not a number, or is too large"
    return None
