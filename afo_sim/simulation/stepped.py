"""Simulations side by side that somebody steps: as many steps at a time as he likes, each with its inputs."""

from collections.abc import Sequence

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built
from afo_sim.simulation.policy import Rows, fixed
from afo_sim.simulation.rollout import CONTROL, FIELDS, STATE, Case, failed, first_states, widths
from afo_sim.simulation.simulate import case_of
from afo_sim.simulation.stepping import BatchStepper, LoopStepper, Stepper


class Stepped:
    """Compiled scenarios that are stepped together through `mujoco.batch`, with the callbacks held.

    Parameters
    ----------
    builts : compiled scenarios whose MjData are of one layout; they may differ in every number
    count : number of simulations of a single scenario, instead of several scenarios
    fields : of MjData that are recorded, beside the state
    threads : that step

    Raises
    ------
    CallbackError
        The muscle callbacks cannot be installed.
    SimulationError
        A kernel refuses a start.
    """

    def __init__(
        self,
        builts: Sequence[Built],
        *,
        count: int = 1,
        fields: tuple[str, ...] = FIELDS,
        threads: int = 1,
    ):
        self.builts = list(builts) * (count if len(builts) == 1 else 1)
        self.fields = fields
        mode = self.builts[0].scenario.callback
        self.hold = native.Hold(mode)
        try:
            # of one scenario many times, schedule and start are computed once
            own = {id(built): built for built in self.builts}
            schedules = {key: schedule.controls(built) for key, built in own.items()}
            cases = {key: _case(built, schedules[key]) for key, built in own.items()}
            self.schedules = [schedules[id(built)] for built in self.builts]
            self.cases = [cases[id(built)] for built in self.builts]
            models, states = [case.model for case in self.cases], [case.state for case in self.cases]
            self.stepper: Stepper = (
                BatchStepper(models, states, CONTROL, threads)
                if mode == "native"
                else LoopStepper(models, states, CONTROL)
            )
            single = {key: first_states([case]) for key, case in cases.items()}
            self.starts = {
                name: np.concatenate([single[id(built)][name] for built in self.builts]) for name in STATE
            }
            begun = {key: _first_rows(case, schedules[key][0], fields) for key, case in cases.items()}
            self.begun = {
                name: np.stack([begun[id(built)][name] for built in self.builts])
                for name in next(iter(begun.values()))
            }
        except BaseException:
            self.hold.close()
            raise
        self.now = {name: values.copy() for name, values in self.starts.items()}
        self.taken = np.zeros(len(self.builts), int)
        self.failures: dict[int, SimulationError] = {}
        self.done: dict[int, int] = {}  # good steps of the block in which a simulation failed
        self._blocks: dict[tuple[int, int], Rows] = {}

    def __len__(self) -> int:
        return len(self.builts)

    def reset(self, numbers: Sequence[int]) -> None:
        """Take simulations back to their start."""
        self.hold.check()
        for k in numbers:
            self.stepper.restart(k, self.cases[k].state)
            self.failures.pop(k, None)
            self.taken[k] = 0
            for name in STATE:
                self.now[name][k] = self.starts[name][k]

    def begin(self, numbers: Sequence[int], states: Sequence[np.ndarray], steps: Sequence[int]) -> None:
        """Take simulations to states in the midst of a run.

        Parameters
        ----------
        numbers : of the simulations
        states : their mjSTATE_INTEGRATION rows, as `state` gives them
        steps : numbers of the steps that begin in these states
        """
        self.hold.check()
        for k, state, step in zip(numbers, states, steps, strict=True):
            self.stepper.restart(k, state)
            self.failures.pop(k, None)
            self.taken[k] = step
        for name, values in state_parts(self.cases[0].model, np.array(states)).items():
            self.now[name][list(numbers)] = values

    def state(self, k: int) -> np.ndarray:
        """The present state of a simulation, an mjSTATE_INTEGRATION row."""
        return self.stepper.state(k)

    def inputs(self, k: int, steps: int) -> np.ndarray:
        """The scenario's own inputs of a simulation's next steps (steps, nu); a timer goes on for ever."""
        first = int(self.taken[k])
        while first + steps > len(self.schedules[k]):
            if self.builts[k].walk is not None:
                left = len(self.schedules[k]) - first
                raise _walk_over(self.builts[k], left)
            self.schedules[k] = schedule.controls(self.builts[k], 2 * (first + steps))
        return self.schedules[k][first : first + steps].copy()

    def advance(self, alive: Sequence[int], inputs: np.ndarray) -> Rows:
        """Step, and return aligned rows of these steps, good until the next call with as many steps.

        Parameters
        ----------
        alive : numbers of the simulations to step
        inputs : theirs (len(alive), steps, nu)

        Returns
        -------
        {field: (len(alive), steps, width)}; where a simulation has failed, rows from the failure on are those
        of its last good step, and `failures` tells why.
        """
        self.hold.check()
        n, steps = inputs.shape[:2]
        out = self._block(n, steps)
        out["time"][:] = np.nan
        stopped = self.stepper.advance(list(alive), np.ascontiguousarray(inputs), out)
        for place, k in enumerate(alive):
            if k in stopped:
                self._stop(place, k, out, stopped[k].reason, stopped[k].spoilt)
        ids = list(alive)
        rows = {}
        for name, values in out.items():
            if name not in STATE:
                rows[name] = values
                continue
            after = values[:, -1].copy()
            values[:, 1:] = values[:, :-1]
            values[:, 0] = self.now[name][ids]
            self.now[name][ids] = after
            rows[name] = values
        self.taken[ids] += steps
        return rows

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


def _case(built: Built, control: np.ndarray) -> Case:
    native.assert_rows(built.model)
    case = case_of(built, fixed(control), control[0])
    if not isinstance(case, Case):
        assert case.failure is not None
        raise case.failure
    native.assert_muscles_pull(case.model, case.state)
    return case


def _first_rows(case: Case, control: np.ndarray, fields: tuple[str, ...]) -> Rows:
    """The one row of the start (1, width): its state, and the forces in it."""
    data = native.scratch(case.model)
    mujoco.mj_setState(case.model, data, case.state, mujoco.mjtState.mjSTATE_INTEGRATION)
    return forces_of(case.model, data, control, fields)


def forces_of(
    model: mujoco.MjModel, data: mujoco.MjData, control: np.ndarray, fields: tuple[str, ...]
) -> Rows:
    """The row of the state in `data`, solved there (1, width). The callbacks must be installed."""
    data.ctrl[:] = control
    mujoco.mj_forward(model, data)
    return {name: np.array(getattr(data, name), float).reshape(1, -1) for name in (*STATE, *fields)}


def state_parts(model: mujoco.MjModel, states: np.ndarray) -> Rows:
    """Time, qpos, qvel and act (n, width) of mjSTATE_INTEGRATION rows, which begin with them."""
    found, first = {}, 0
    for name in STATE:
        size = mujoco.mj_stateSize(model, getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}"))
        found[name] = states[:, first : first + size]
        first += size
    return found


def _walk_over(built: Built, left: int) -> InputError:
    end = built.scenario.n_step * built.scenario.timestep
    return InputError(
        f"the recorded walking ends at t = {end:.6g} s: reset(), or take a longer duration",
        field="duration",
        value=f"{left} steps are left",
    )
