"""Scenarios that one steps oneself, side by side: `afo_sim.Simulators`."""

import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.control.command import Command
from afo_sim.description.scenario import Scenario
from afo_sim.model.build import build
from afo_sim.simulation.commander import Commander
from afo_sim.simulation.observing import Seen, frame_of, seen_columns
from afo_sim.simulation.policy import Rows
from afo_sim.simulation.rollout import METRIC_FIELDS
from afo_sim.simulation.sensed import SensorBank, checked_seed
from afo_sim.simulation.simulator import steps_in
from afo_sim.simulation.stepped import Stepped

Source = str | os.PathLike[str] | Scenario | Mapping[str, Any]
Commands = Mapping[str, Command]


class Simulators(native.Closing):
    """Many simulations stepped together through `mujoco.batch`; each is, to the bit, what a Simulator is.

    They keep no rows: `Simulator` and `run` make recordings. A simulation that fails stands still, `failures`
    says why, and the others go on.

    Parameters
    ----------
    scenarios : one scenario, which `count` multiplies, or several that differ in numbers only
    sets : dotted keys and values laid over each
    count : simulations of a single scenario
    threads : that step

    Raises
    ------
    InputError
        A description is wrong, or the scenarios' models differ in more than numbers.
    CallbackError
        The muscle callbacks cannot be installed.

    Examples
    --------
    >>> with Simulators("seated", {"duration": "1 s"}, count=8) as many:
    ...     for _ in range(20):
    ...         lifted = [seen["ankle/angle"] > 0.05 for seen in many.observe()]
    ...         seen = many.step([{"dorsiflexor": "outlet" if up else "inlet"} for up in lifted], 0.01)
    ...     len(many), len(seen), many.failures
    (8, 8, {})
    """

    def __init__(
        self,
        scenarios: Source | Sequence[Source],
        sets: Mapping[str, Any] | None = None,
        *,
        count: int = 1,
        threads: int = 1,
    ):
        several = isinstance(scenarios, Sequence) and not isinstance(scenarios, str)
        sources: list[Any] = list(scenarios) if several else [scenarios]  # type: ignore[arg-type]
        if several and (count != 1 or not sources):
            allowed = "several scenarios, or one and a count"
            raise InputError("stands beside several scenarios", field="count", value=count, allowed=allowed)
        for name, number, least in (("count", count, 1), ("threads", threads, 0)):
            if not _is_whole(number) or number < least:
                allowed = f"a whole number from {least} on"
                raise InputError("is out of range", field=name, value=number, allowed=allowed)
        builts = [build(source, sets) for source in sources]
        if len({(built.model._sizes.tobytes(), built.scenario.timestep) for built in builts}) > 1:
            problem = "differ in more than numbers: they cannot be stepped together"
            allowed = "one layout of the model and one time step"
            raise InputError(problem, field="scenarios", allowed=allowed)
        self._stepped = Stepped(builts, count=count, fields=METRIC_FIELDS, threads=threads)
        own = {id(built): seen_columns(built) for built in builts}
        self._columns = [own[id(built)] for built in self._stepped.builts]
        self._commanders = [Commander(built) for built in self._stepped.builts]
        self._sensors = [SensorBank(built) for built in self._stepped.builts]
        self._seen: list[Seen] = [None] * len(self)  # type: ignore[list-item]
        self.reset()

    def __len__(self) -> int:
        return len(self._stepped)

    @property
    def timestep(self) -> float:
        """Time of one step [s]."""
        return self._stepped.builts[0].scenario.timestep

    @property
    def time(self) -> np.ndarray:
        """Present time of each [s] (n,)."""
        return np.asarray(self._stepped.taken * self.timestep)

    @property
    def failures(self) -> dict[int, SimulationError]:
        """Why a simulation has failed, by its number."""
        return dict(self._stepped.failures)

    @property
    def done(self) -> np.ndarray:
        """Whether the duration of each is over, or it has failed (n,)."""
        ends = np.array([built.scenario.n_step for built in self._stepped.builts])
        failed = np.isin(np.arange(len(self)), list(self._stepped.failures))
        return np.asarray((self._stepped.taken >= ends) | failed)

    def reset(self, numbers: Sequence[int] | None = None, seed: int | None = None) -> list[Seen]:
        """Take simulations back to their start, with no commands.

        Parameters
        ----------
        numbers : of the simulations; all by default
        seed : from 0 on, of the sensors' noise, of simulation k `seed` + k; the scenario's own by default

        Returns
        -------
        what is seen of all simulations
        """
        if numbers is not None and not isinstance(numbers, Iterable):
            raise InputError(
                "are no numbers", field="numbers", value=numbers, allowed="a list such as [0, 2]"
            )
        chosen = range(len(self)) if numbers is None else list(numbers)
        for k in chosen:
            if not _is_whole(k) or not 0 <= k < len(self):
                allowed = f"0 to {len(self) - 1}"
                raise InputError("there is no such simulation", field="numbers", value=k, allowed=allowed)
        seeds = {k: None if seed is None else checked_seed(seed, k) for k in chosen}
        self._stepped.reset(list(chosen))
        for k in chosen:
            self._commanders[k].reset()
            self._sensors[k].reset(seeds[k])
            begun = {name: values[k] for name, values in self._stepped.begun.items()}
            self._look(k, begun, self._stepped.schedules[k][:1], 0, 1)
        return self.observe()

    def observe(self) -> list[Seen]:
        """What is seen of the last step of each."""
        return list(self._seen)

    def step(
        self, commands: Commands | Sequence[Commands | None] | None = None, dt: float | None = None
    ) -> list[Seen]:
        """Command chambers, and simulate all on that have not failed.

        Parameters
        ----------
        commands : of all alike, or one for each (`Simulator.step` tells what a command is)
        dt : time to simulate, a whole number of time steps [s]; one step by default

        Returns
        -------
        what is seen of each; of one that has failed what was seen last

        Raises
        ------
        InputError
            It is no command, or `dt` is no whole number of steps; nothing was stepped.
        """
        steps = steps_in(dt, self.timestep)
        alive = [k for k in range(len(self)) if k not in self._stepped.failures]
        inputs = np.empty((len(alive), steps, self._stepped.cases[0].model.nu))
        for place, k in enumerate(alive):
            inputs[place] = self._stepped.inputs(k, steps)
        self._take(commands)
        for place, k in enumerate(alive):
            self._commanders[k].apply(inputs[place])
        first = self._stepped.taken.copy()
        rows = self._stepped.advance(alive, inputs) if alive else {}
        for place, k in enumerate(alive):
            done = self._stepped.done.get(k, steps) if k in self._stepped.failures else steps
            if done:
                own = {name: values[place, :done].copy() for name, values in rows.items()}
                self._look(k, own, inputs[place, :done], int(first[k]), steps)
        return self.observe()

    def _take(self, commands: Commands | Sequence[Commands | None] | None) -> None:
        """Put all commands in force, or none where one is wrong."""
        if commands is None:
            return
        if not isinstance(commands, Iterable):
            allowed = f"one command for all, or {len(self)} of them"
            raise InputError("are no commands", field="commands", value=commands, allowed=allowed)
        each = [commands] * len(self) if isinstance(commands, Mapping) else list(commands)
        if len(each) != len(self):
            allowed = f"one command for all, or {len(self)} of them"
            raise InputError(
                "are not as many as simulations", field="commands", value=len(each), allowed=allowed
            )
        before = [dict(commander.commands) for commander in self._commanders]
        try:
            for commander, command in zip(self._commanders, each, strict=True):
                if command is not None:
                    commander.take(command)
        except InputError:
            for commander, old in zip(self._commanders, before, strict=True):
                commander.commands = old
            raise

    def _look(self, k: int, rows: Rows, inputs: np.ndarray, first: int, steps: int) -> None:
        frame = frame_of(self._stepped.builts[k], rows, inputs, first)
        readings = self._sensors[k].feed(frame, self._columns[k])
        time = float(self.time[k])
        self._seen[k] = Seen(frame, readings, time, steps * self.timestep, self._columns[k])

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        self._stepped.close()


def _is_whole(number: object) -> bool:
    return isinstance(number, Integral) and not isinstance(number, bool)
