"""Episodes of a task, side by side: simulations stepped together, each with its own start and script."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, SimulationError
from afo_sim.description import Scenario, load
from afo_sim.model import Built
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.rl.environments.task import Reader, Sample, Task, coils_of
from afo_sim.simulation import Stepped

Rows = Mapping[str, np.ndarray]  # fields of the last step (width, n)
FIELDS = ("actuator_force", "qfrc_actuator", "userdata")  # of MjData, beside the state


class Random(Protocol):
    """What draws: numpy's Generator and RandomState do."""

    def uniform(self, low: float, high: float, size: int) -> np.ndarray:
        """Random numbers (size,)."""
        ...


@dataclass(frozen=True, eq=False)
class Start:
    """What an episode is stepped from."""

    built: Built
    inputs: np.ndarray
    state: np.ndarray
    rows: Mapping[str, np.ndarray]
    number: int

    @classmethod
    def of(cls, built: Built, number: int = 0) -> Self:
        """The scenario's own start."""
        stepped = Stepped([built], fields=FIELDS)
        try:
            rows = {name: values[0, 0].copy() for name, values in stepped.begun.items()}
            return cls(built, schedule.controls(built), stepped.cases[0].state.copy(), rows, number)
        finally:
            stepped.close()


COILS = ("inlet", "outlet")  # of a chamber, in order
# an episode: its start, and what belongs to its samples (periods + 1, width)
Drawn = tuple[Start, np.ndarray]
# observations (n, n_observed), rewards (n,), and parts of the reward by name (n,)
Seen = tuple[np.ndarray, np.ndarray, Mapping[str, np.ndarray]]


class View(Protocol):
    """What a task sees of some simulations, and what that is worth."""

    moment: Any
    """All that it remembers; it may be assigned again, and is copied by whoever keeps it."""

    def begin(self, ids: np.ndarray, drawn: Sequence[Drawn]) -> np.ndarray:
        """Begin episodes; observations of their starts (n, n_observed)."""
        ...

    def see(self, ids: np.ndarray, rows: Rows, coils: np.ndarray) -> Seen:
        """The samples of the next period, whose coils [-] were as given (n, 2 n_chamber)."""
        ...


@dataclass(frozen=True, eq=False)
class Setting:
    """A task on a compiled scenario, from which episodes are drawn."""

    task: Task
    start: Start
    again: tuple[Callable[..., Any], tuple[Any, ...]]

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self.again

    @property
    def built(self) -> Built:
        """The scenario that is drawn, and whose names are used."""
        return self.start.built

    @property
    def steps(self) -> int:
        """Of a control period."""
        return round(self.task.period / self.built.scenario.timestep)

    @property
    def chambers(self) -> list[str]:
        """Names of the chambers, in the order of the action."""
        return list(self.built.index.chambers)

    @property
    def valves(self) -> list[int]:
        """Actuators of the coils, in the order of `coils_of`."""
        return [self.built.index.valves[f"{name}_{side}"] for name in self.chambers for side in COILS]

    @cached_property
    def ranges(self) -> np.ndarray:
        """Lower and upper ends of the measuring ranges (2, n_observed)."""
        return np.array([(one.low, one.high) for one in self.task.observed]).T

    def draw(self, random: Random) -> Drawn:
        """An episode: its start, and what it asks for at its samples, which are a step old."""
        _, *draws = random.uniform(0.0, 1.0, size=1 + self.task.draws)
        times = np.arange(self.task.periods + 1) * self.task.period - self.built.scenario.timestep
        times[0] = 0.0
        if self.task.script is None:
            return self.start, np.empty((len(times), 0))
        return self.start, self.task.script(np.array(draws), times)

    def start_of(self, number: int) -> Start:
        """The start of a number."""
        return self.start

    def view(self, count: int) -> View:
        """What sees some simulations."""
        return Sight(self, count)


def setting(task: Task, sets: Mapping[str, Any] | None = None) -> Setting:
    """Compile a task."""
    check_sets(task, sets)
    start = Start.of(build(load("scenario", task.scenario, {**(sets or {}), **task.sets})))
    return Setting(task, start, (setting, (task, sets)))


def check_sets(task: Task, sets: Mapping[str, Any] | None) -> None:
    """Refuse keys that are the task's own, and what would command the valves beside the action."""
    sets = {} if sets is None else sets
    if not isinstance(sets, Mapping):
        allowed = 'as in {"supply.pressure": "3 bar"}'
        raise InputError("is not a dict of keys and values", field="sets", value=sets, allowed=allowed)
    own = [key for key in sets if key in task.sets]
    if own:
        raise InputError("is the task's own", field=own[0], value=sets[own[0]], allowed=task.sets[own[0]])
    _refuse_commanders(load("scenario", task.scenario, {**sets, **task.sets}))


def _refuse_commanders(scenario: Scenario) -> None:
    """Refuse what would command the valves beside the action: nobody would ask it."""
    if scenario.controller is not None:
        kind = scenario.controller.kind
        raise InputError("stands in the action's place", field="controller", value=kind, allowed="none")
    if scenario.gait is not None and scenario.gait.pace:
        problem = "stands in the task's way: who stops swings no more, and the reward counts swings"
        raise InputError(problem, field="gait.pace", allowed="none; gait.speed for another pace")
    if scenario.drive:
        problem = "would have no effect: an action switches the valves"
        raise InputError(problem, field="drive", value=", ".join(scenario.drive), allowed="none")


def readers(built: Built) -> Mapping[str, Reader]:
    """Columns of the last step by name: the formulas of `simulation/columns.py`, addresses looked up once."""

    def place(field: str, at: int, less: float = 0.0) -> Reader:
        return lambda s: s.rows[field][at] - less

    index, model = built.index, built.model
    found = {
        "ankle/angle": place("qpos", index.ankle_qpos),
        "ankle/velocity": place("qvel", index.ankle_dof),
    }
    for chamber, actuator in index.chambers.items():
        # read from arrays of addresses, the air's numbers are their own addresses
        at = native.read_air(model, np.arange(model.na), np.arange(model.nuserdata), actuator)
        found[f"chamber/{chamber}/pressure"] = place("userdata", int(at.absolute_pressure), AMBIENT_PRESSURE)
        found[f"chamber/{chamber}/mass"] = place("act", int(at.mass))
    return found


class Remembering:
    """A `View` whose memory is some of its attributes."""

    _memory: tuple[str, ...]

    @property
    def moment(self) -> dict[str, Any]:
        """As `View`."""
        return {name: getattr(self, name) for name in self._memory}

    @moment.setter
    def moment(self, moment: Mapping[str, Any]) -> None:
        vars(self).update(moment)


class Sight(Remembering):
    """The `View` of a task with a script: its samples."""

    _memory = ("taken", "scripts")

    def __init__(self, setting: Setting, count: int):
        self.setting, self.readers = setting, readers(setting.built)
        self.taken = np.zeros(count, int)  # periods of the episode
        self.scripts = np.zeros((count, *setting.draw(np.random.default_rng(0))[1].shape))

    def begin(self, ids: np.ndarray, drawn: Sequence[Drawn]) -> np.ndarray:
        """As `View`."""
        self.taken[ids], self.scripts[ids] = 0, [script for _, script in drawn]
        return self.observation(self._sample(ids, rows_of(drawn)))

    def see(self, ids: np.ndarray, rows: Rows, coils: np.ndarray) -> Seen:
        """As `View`."""
        self.taken[ids] += 1
        sample, reward = self._sample(ids, rows), self.setting.task.reward
        assert reward is not None
        return self.observation(sample), np.array(reward(sample), float), {}

    def observation(self, sample: Sample) -> np.ndarray:
        """Within the measuring ranges (n_observed,) or (n, n_observed)."""
        raw = np.array([one.of(sample) for one in self.setting.task.observed])
        return np.ascontiguousarray(np.clip(raw.T, *self.setting.ranges))

    def _sample(self, ids: np.ndarray, rows: Rows) -> Sample:
        taken = np.minimum(self.taken[ids], self.scripts.shape[1] - 1)
        steps = np.maximum(taken * self.setting.steps - 1, 0)
        return Sample(self.readers, rows, steps, self.scripts[ids, taken].T)


def rows_of(drawn: Sequence[Drawn]) -> Rows:
    """The samples that are seen of starts."""
    first = drawn[0][0].rows
    return {name: np.stack([start.rows[name] for start, _ in drawn], axis=1) for name in first}


@dataclass(frozen=True)
class Outcome:
    """What a period has come to, of the simulations that were stepped (n,)."""

    observation: np.ndarray
    reward: np.ndarray
    over: np.ndarray
    failures: Mapping[int, SimulationError]
    parts: Mapping[str, np.ndarray]


class Episodes:
    """Simulations of one task that are stepped together, with the callbacks held until `close`."""

    MEMORY = ("numbers", "stepped.moment", "view.moment")  # what decides what follows, in this order

    def __init__(self, setting: Setting, count: int = 1, threads: int = 1):
        self.setting, self.starts = setting, [setting.start] * count
        self.stepped = Stepped([setting.built], count=count, fields=FIELDS, threads=threads)
        self.view = setting.view(count)

    def __len__(self) -> int:
        return len(self.stepped)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of the starts that are stepped on from."""
        return tuple(start.number for start in self.starts)

    @numbers.setter
    def numbers(self, numbers: Sequence[int]) -> None:
        self.starts = [self.setting.start_of(number) for number in numbers]
        self.stepped.replace_models([start.built for start in self.starts])

    def begin(self, numbers: Sequence[int], randoms: Sequence[Random]) -> np.ndarray:
        """Begin an episode in some simulations, drawn by the random numbers of each; observations (n, …)."""
        return self.begin_drawn(numbers, [self.setting.draw(random) for random in randoms])

    def begin_drawn(self, numbers: Sequence[int], drawn: Sequence[Drawn]) -> np.ndarray:
        """Begin given episodes in some simulations."""
        for k, (start, _) in zip(numbers, drawn, strict=True):
            self.starts[k] = start
        self.stepped.replace_models([start.built for start in self.starts])
        self.stepped.begin(numbers, [start.state for start, _ in drawn], [0] * len(drawn))
        return self.view.begin(np.array(numbers, int), drawn)

    def step(self, numbers: Sequence[int], action: np.ndarray) -> Outcome:
        """Step some simulations by one control period."""
        steps, taken, coils = self.setting.steps, self.stepped.taken, coils_of(action)
        inputs = np.stack([self.starts[k].inputs[taken[k] : taken[k] + steps] for k in numbers])
        inputs[..., self.setting.valves] = coils[:, None]
        rows = self.stepped.advance(numbers, inputs)
        last, ids = {name: values[:, -1].T for name, values in rows.items()}, np.array(numbers, int)
        observation, reward, parts = self.view.see(ids, last, coils)
        failures = {p: self.stepped.failures[k] for p, k in enumerate(numbers) if k in self.stepped.failures}
        for each in (reward, *parts.values()):
            each[list(failures)] = 0.0
        over = taken[ids] >= self.setting.task.periods * steps
        return Outcome(observation, reward, over, failures, parts)

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self.stepped.close()
