"""Scenarios that one steps oneself: one, `afo_sim.Simulator`, or several side by side, `Simulators`."""

import dataclasses
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Integral
from typing import Literal, cast

import numpy as np

from afo_sim import native
from afo_sim.common import ControllerError, Function, Given, InputError, Mixed, SimulationError, si
from afo_sim.control import Command, Controller, make
from afo_sim.description import MAX_STEPS, Scenario
from afo_sim.model import Built
from afo_sim.model.build import build
from afo_sim.simulation.columns import formulas, frame_of
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.forking import Forkable
from afo_sim.simulation.loop import RATE, SLIGHTLY, Commander, Loop, Seen
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.rollout import METRIC_FIELDS, Rollout
from afo_sim.simulation.sensed import SensorBank, checked_seed
from afo_sim.simulation.simulate import Stepped
from afo_sim.simulation.stepping import PolicyFault, Rows, one_of

MEMORY = ("_stepped.moment", "_sensors.moment", "_commander.commands", "_sight", "_blocks", "_seconds")


def steps_in(dt: float | str | None, timestep: float, field: str = "dt") -> int:
    """Steps of a time [s], one where it is None; InputError where that is no whole number."""
    if dt is None:
        return 1
    allowed = f"{timestep:g} s times 1, 2, 3, …"
    steps = si(dt, "s", field, allowed) / timestep
    if not 0.5 < steps < MAX_STEPS or abs(steps - round(steps)) > SLIGHTLY * steps:
        raise InputError("is not a whole number of time steps", field=field, value=dt, allowed=allowed)
    return round(steps)


class Simulator(Forkable, native.Closing):
    """A scenario to step yourself: observe, command, step. Holds the muscles' callbacks until `close`.

    With the same commands it gives exactly the results of `run` (when walking, with `gait.settled =
    "walked"`). Chambers follow the scenario's timer or phases until commanded; without these their
    valves are shut. The caller is the controller, unless one is given. `state()` and `restore(state)` fork
    it; copies and pickles are independent simulators in the same state.

    built : the compiled scenario, with its model

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, a Scenario, or a Built
    sets : dotted keys and values laid over it
    controller : commands the chambers, as in `run`; "scenario" for the scenario's own
    rate : of the controller's commands [Hz], or "100 Hz"; a scenario's controller has its own

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
        scenario: str | os.PathLike[str] | Scenario | Mapping[str, object] | Built,
        sets: Mapping[str, object] | None = None,
        controller: Controller | Literal["scenario"] | None = None,
        rate: float | str = RATE,
    ):
        self.built = scenario if isinstance(scenario, Built) else build(scenario, sets)
        _ = self.built.full_model, self.built.xml  # now: MuJoCo cannot compile beside Python callbacks
        self._controlled = controller, rate
        self._loop = self._new_loop()
        self._stepped = Stepped([self.built])
        self._hold = self._stepped.hold
        self._sensors = SensorBank(self.built)
        self._columns = formulas(self.built, whole=False)
        self._of, self._memory = (self.scenario,), MEMORY
        if self._loop is not None:
            self._of += self._loop.period, str(type(self._loop.controller))  # a type might not be pickled
            self._memory += ("_loop.controller", "_loop.reported")
        self.reset()

    def _new_loop(self) -> Loop | None:
        """The controller's loop at its start; None without a controller."""
        made, rate = self._controlled
        if isinstance(made, str):
            if made != "scenario" or (described := self.scenario.controller) is None:
                allowed = '"scenario" where the scenario has one, or a function of what is seen'
                raise InputError("is not a controller", field="controller", value=made, allowed=allowed)
            made, rate = make(described, self.scenario), described.rate
        return None if made is None else Loop(self.built, made, rate)

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        made, rate = self._controlled
        if callable(made):  # who is made resets its controller, which is then its own
            made = cast(Controller, self.state().values[self._memory.index("_loop.controller")])
        return type(self), (self.built, None, made, rate)

    @property
    def controller(self) -> Controller | None:
        """What commands the chambers, a copy after `restore`; None if the caller does."""
        return None if self._loop is None else self._loop.controller

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
        self._hold.check()
        self._loop = self._new_loop()  # first: a controller's reset() may look at this one
        self._stepped.reset([0])
        self._commander = Commander(self.built) if self._loop is None else self._loop.commander
        self._sensors.reset(seed)
        self._blocks: list[tuple[Rows, np.ndarray]] = []
        self._seconds = 0.0
        self._seen = self._look(one_of(self._stepped.begun, 0), self._stepped.schedules[0][:1], 0, 1)
        return self._seen

    def observe(self) -> Seen:
        """What is seen of the last step; see `control/controller.py`."""
        return self._seen

    def step(self, command: Mapping[str, Command] | None = None, dt: float | str | None = None) -> Seen:
        """Command chambers, and simulate on.

        Parameters
        ----------
        command : "inlet", "outlet", "both", "shut", two coils (inlet, outlet) from 0 to 1 [-], a gauge
            pressure [Pa], "3 bar", where the chamber has a drive, or "timed", by chamber; others keep their
            last one
        dt : time to simulate, a whole number of time steps, or of a controller's periods [s], or "10 ms"; one
            by default

        Returns
        -------
        what is seen of these steps, with a controller of its last period

        Raises
        ------
        InputError
            It is no command, or `dt` is no whole number of steps; nothing was stepped.
        SimulationError
            The simulation has failed; `recording` gives what came before, also where a controller raises.
        """
        self._hold.check()
        if (failure := self._stepped.failures.get(0)) is not None:
            raise SimulationError(f"{failure.reason}; reset() begins again", time=failure.time)
        if self._loop is None:
            return self._step(command, steps_in(dt, self.scenario.timestep))
        period, taken = self._loop.period, int(self._stepped.taken[0])
        steps = period if dt is None else steps_in(dt, self.scenario.timestep)
        if command is not None or steps % period:
            allowed = f"no command, and whole periods of {period * self.scenario.timestep:g} s"
            raise InputError("stands beside a controller", field="step", value=(command, dt), allowed=allowed)
        end = taken + steps if taken >= self.scenario.n_step else min(taken + steps, self.scenario.n_step)
        for first in range(taken, end, period):
            try:
                seen = dataclasses.replace(self._seen, period=period * self.scenario.timestep)
                with self._hold.calling("controller"):
                    self._loop.ask(seen, first)
            except PolicyFault as fault:
                self._stepped.failures[0] = ControllerError(str(fault), time=self.time)
            if (failure := self._stepped.failures.get(0)) is not None:
                raise self._loop.raised or failure
            self._step(None, min(period, end - first))
        return self._seen

    def _step(self, command: Mapping[str, Command] | None, steps: int) -> Seen:
        inputs = self._stepped.inputs(0, steps)
        if command is not None:
            self._commander.take(command)
        self._commander.apply(inputs)
        first, start = int(self._stepped.taken[0]), time.perf_counter()
        rows = self._stepped.advance([0], inputs[None])
        self._seconds += time.perf_counter() - start
        kept = one_of(rows, 0, copy=True)
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
        final = one_of(self._stepped.now, 0, copy=True)
        reported = {} if self._loop is None else self._loop.columns_reported(0, len(control))
        rollout = Rollout(rows, control, failure, self._seconds, 0, final, reported)
        return make_recording(self.built, rollout, seed=self._sensors.seed)

    def _look(self, rows: Rows, inputs: np.ndarray, first: int, steps: int) -> Seen:
        frame = frame_of(self.built, rows, inputs, first)
        readings = self._sensors.feed(frame, self._columns)
        return Seen(frame, readings, self.time, steps * self.scenario.timestep, self._columns)

    @property
    def _sight(self) -> tuple[Mixed, ...]:
        """What was seen last, without what belongs to the scenario."""
        seen, frame = self._seen, self._seen.frame
        return frame.rows, frame.control, frame.first_step, seen.readings, seen.time, seen.period

    @_sight.setter
    def _sight(self, sight: tuple[Mixed, ...]) -> None:
        rows, control, first, readings, time, period = sight
        self._seen = Seen(frame_of(self.built, rows, control, first), readings, time, period, self._columns)

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        self._stepped.close()


Source = str | os.PathLike[str] | Scenario | Mapping[str, object]
Commands = Mapping[str, Command]


class Simulators(native.Closing):
    """Many simulations stepped together through `mujoco.batch`; each gives exactly a Simulator's results.

    They keep no rows: `Simulator` and `run` make recordings. A simulation that fails stops, `failures`
    states why, and the others continue.

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
        sets: Mapping[str, object] | None = None,
        *,
        count: int = 1,
        threads: int = 1,
    ):
        several = isinstance(scenarios, Sequence) and not isinstance(scenarios, str)
        sources: list[Given] = list(scenarios) if several else [scenarios]  # type: ignore[arg-type]  # one stands alone
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
        own = {id(built): formulas(built, whole=False) for built in builts}
        self._columns = [own[id(built)] for built in self._stepped.builts]
        self._commanders = [Commander(built) for built in self._stepped.builts]
        self._sensors = [SensorBank(built) for built in self._stepped.builts]
        self._seen: list[Seen] = [None] * len(self)  # type: ignore[list-item]  # until `reset`
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
            allowed = "a list such as [0, 2]"
            raise InputError("are no numbers", field="numbers", value=numbers, allowed=allowed)
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
            self._look(k, one_of(self._stepped.begun, k), self._stepped.schedules[k][:1], 0, 1)
        return self.observe()

    def observe(self) -> list[Seen]:
        """What is seen of the last step of each."""
        return list(self._seen)

    def step(
        self, commands: Commands | Sequence[Commands | None] | None = None, dt: float | str | None = None
    ) -> list[Seen]:
        """Command chambers, and simulate all on that have not failed.

        Parameters
        ----------
        commands : of all alike, or one for each (`Simulator.step` tells what a command is)
        dt : time to simulate, a whole number of time steps [s], or "10 ms"; one step by default

        Returns
        -------
        what is seen of each; of one that has failed what was seen last

        Raises
        ------
        InputError
            It is no command, or `dt` is no whole number of steps; nothing was stepped.
        """
        self._stepped.hold.check()
        if isinstance(commands, Iterator):
            commands = list(commands)  # first: a generator may step these, or take them back
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
        allowed = f"one command for all, or {len(self)} of them"
        if not isinstance(commands, Iterable):
            raise InputError("are no commands", field="commands", value=commands, allowed=allowed)
        each = [commands] * len(self) if isinstance(commands, Mapping) else list(commands)
        if len(each) != len(self):
            problem = "are not as many as simulations"
            raise InputError(problem, field="commands", value=len(each), allowed=allowed)
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
