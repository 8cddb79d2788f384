"""A scenario that one steps oneself: `afo_sim.Simulator`."""

import math
import numbers
import os
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.control.command import Command
from afo_sim.description.scenario import MAX_STEPS, Scenario
from afo_sim.model.build import build
from afo_sim.simulation.commander import Commander
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.observing import Seen, frame_of, seen_columns
from afo_sim.simulation.policy import Rows
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.rollout import Rollout
from afo_sim.simulation.sensed import SensorBank, checked_seed
from afo_sim.simulation.stepped import Stepped

SLIGHTLY = 1e-6  # of dt, to which it must be whole steps


def steps_in(dt: float | None, timestep: float) -> int:
    """Steps of a time [s], one where it is None; InputError where that is no whole number."""
    if dt is None:
        return 1
    number = isinstance(dt, numbers.Real) and not isinstance(dt, bool)
    steps = dt / timestep if number else math.nan
    if not 0.5 < steps < MAX_STEPS or abs(steps - round(steps)) > SLIGHTLY * steps:
        allowed = f"{timestep:g} s times 1, 2, 3, …"
        raise InputError("is no whole number of time steps", field="dt", value=dt, allowed=allowed)
    return round(steps)


class Simulator(native.Closing):
    """A scenario that is stepped: observe, command, step; with the muscles' callbacks held until `close`.

    Fed with the same commands it gives the same bits as `run` (in walking, as with `gait.settled =
    "walked"`). Chambers follow the scenario's timer or phases until they are commanded; without these their
    valves are shut. A described controller does not act here: whoever steps is the controller.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it

    Raises
    ------
    InputError
        The description is wrong.
    CallbackError
        The muscle callbacks cannot be installed.

    Examples
    --------
    >>> with Simulator("seated", {"duration": "1 s"}) as simulator:
    ...     seen = simulator.reset()
    ...     while not simulator.done:
    ...         lift = seen["ankle/angle"] < 0.05
    ...         seen = simulator.step({"dorsiflexor": "inlet" if lift else "outlet"}, 0.01)
    ...     run = simulator.recording()
    >>> run.ok, run["time"].shape
    (True, (500,))
    """

    def __init__(
        self,
        scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
        sets: Mapping[str, Any] | None = None,
    ):
        self.built = build(scenario, sets)
        _ = self.built.full_model, self.built.xml  # now: MuJoCo cannot compile beside Python callbacks
        self._stepped = Stepped([self.built])
        self._commander = Commander(self.built)
        self._sensors = SensorBank(self.built)
        self._columns = seen_columns(self.built)
        self.reset()

    @property
    def scenario(self) -> Scenario:
        """The scenario that is stepped."""
        return self.built.scenario

    @property
    def time(self) -> float:
        """Present time [s]."""
        return int(self._stepped.taken[0]) * self.scenario.timestep

    @property
    def done(self) -> bool:
        """Whether the scenario's duration is over, or the simulation has failed."""
        return bool(self._stepped.failures) or int(self._stepped.taken[0]) >= self.scenario.n_step

    def reset(self, seed: int | None = None) -> Seen:
        """Go back to the start; all commands are taken back.

        Parameters
        ----------
        seed : of the sensors' noise, from 0 to 2^32 − 1; the scenario's own by default

        Returns
        -------
        what is seen of the start
        """
        checked_seed(seed)  # before anything is taken back
        self._stepped.reset([0])
        self._commander.reset()
        self._sensors.reset(seed)
        self._blocks: list[tuple[Rows, np.ndarray]] = []
        self._seconds = 0.0
        begun = {name: values[0] for name, values in self._stepped.begun.items()}
        self._seen = self._look(begun, self._stepped.schedules[0][:1], 0, 1)
        return self._seen

    def observe(self) -> Seen:
        """What is seen of the last step; see `control/observation.py`."""
        return self._seen

    def step(self, command: Mapping[str, Command] | None = None, dt: float | None = None) -> Seen:
        """Command chambers, and simulate on.

        Parameters
        ----------
        command : "inlet", "outlet", "both", "shut", two coils (inlet, outlet) from 0 to 1 [-], a gauge
            pressure [Pa] where the chamber has a drive, or "timed", by chamber; others keep their last one
        dt : time to simulate, a whole number of time steps [s]; one step by default

        Returns
        -------
        what is seen of these steps

        Raises
        ------
        InputError
            It is no command, or `dt` is no whole number of steps; nothing was stepped.
        SimulationError
            The simulation has become unstable; `recording` gives what came before.
        """
        self._refuse_end()
        steps = steps_in(dt, self.scenario.timestep)
        inputs = self._stepped.inputs(0, steps)
        if command is not None:
            self._commander.take(command)
        self._commander.apply(inputs)
        first, start = int(self._stepped.taken[0]), time.perf_counter()
        rows = self._stepped.advance([0], inputs[None])
        self._seconds += time.perf_counter() - start
        kept = {name: values[0].copy() for name, values in rows.items()}
        failure = self._stepped.failures.get(0)
        if failure is not None:
            done = self._stepped.done[0]
            kept, inputs = {name: values[:done] for name, values in kept.items()}, inputs[:done]
        if len(inputs):
            self._blocks.append((kept, inputs))
            self._seen = self._look(kept, inputs, first, steps)
        if failure is not None:
            raise failure
        return self._seen

    def recording(self) -> Recording:
        """All steps since the last reset, as `run` gives them."""
        failure = self._stepped.failures.get(0)
        if not self._blocks:
            raise InputError("has no step yet: step() before recording()", field="recording")
        rows = {name: np.concatenate([rows[name] for rows, _ in self._blocks]) for name in self._blocks[0][0]}
        control = np.concatenate([inputs for _, inputs in self._blocks])
        final = {name: values[0].copy() for name, values in self._stepped.now.items()}
        rollout = Rollout(rows, control, failure, self._seconds, 0, final)
        return make_recording(self.built, rollout, seed=self._sensors.seed)

    def _look(self, rows: Rows, inputs: np.ndarray, first: int, steps: int) -> Seen:
        frame = frame_of(self.built, rows, inputs, first)
        readings = self._sensors.feed(frame, self._columns)
        return Seen(frame, readings, self.time, steps * self.scenario.timestep, self._columns)

    def _refuse_end(self) -> None:
        if (failure := self._stepped.failures.get(0)) is not None:
            raise SimulationError(f"{failure.reason}; reset() begins again", time=failure.time)

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        self._stepped.close()
