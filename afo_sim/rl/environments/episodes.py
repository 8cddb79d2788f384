"""Episodes of a task, side by side: simulations stepped together, each with its own start and script."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from afo_sim.common import InputError, SimulationError
from afo_sim.description import Scenario, load
from afo_sim.model import Built
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.rl.environments.readers import FIELDS, readers
from afo_sim.rl.environments.task import Reader, Sample, Task, coils_of
from afo_sim.rl.environments.tasks import TASKS, task_of
from afo_sim.simulation import Stepped


class Random(Protocol):
    """What draws: numpy's Generator and RandomState do."""

    def uniform(self, low: float, high: float, size: int) -> np.ndarray:
        """Random numbers (size,)."""
        ...


@dataclass(frozen=True)
class Start:
    """A state that an episode begins in.

    step : number of the first step
    state : mjSTATE_INTEGRATION row
    rows : the sample that is seen of it (width,): of the step before, at the scenario's start of the start
    """

    step: int
    state: np.ndarray
    rows: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Setting:
    """A task on its compiled scenario.

    task, built : of it
    steps : of a control period
    inputs : of every step, before the action (n_step, nu)
    valves : actuators of the coils, in the order of `coils_of`
    readers : of columns
    times : of an episode's samples, since its start (periods + 1,) [s]
    starts : of which an episode draws one
    low, high : ends of the measuring ranges (n_observed,)
    sets : laid over the task's scenario
    """

    task: Task
    built: Built
    steps: int
    inputs: np.ndarray
    valves: list[int]
    readers: Mapping[str, Reader]
    times: np.ndarray
    starts: tuple[Start, ...]
    low: np.ndarray
    high: np.ndarray
    sets: Mapping[str, Any] = field(default_factory=dict)

    def __reduce__(self) -> tuple[Any, ...]:
        known = TASKS.get(self.task.name) is self.task
        return setting, (self.task.name if known else self.task, self.sets)

    @property
    def chambers(self) -> list[str]:
        """Names of the chambers, in the order of the action."""
        return list(self.built.index.chambers)

    def draw(self, random: Random) -> tuple[Start, np.ndarray]:
        """An episode: its start, and what it asks for at its samples (periods + 1, width)."""
        chosen, *draws = random.uniform(0.0, 1.0, size=1 + self.task.draws)
        start = self.starts[int(chosen * len(self.starts))]
        if self.task.script is None:
            return start, np.empty((len(self.times), 0))
        return start, self.task.script(np.array(draws), self.times)

    def sample(self, rows: Mapping[str, np.ndarray], step: Any, script: np.ndarray) -> Sample:
        """The sample of a step: see `Sample`."""
        return Sample(self.readers, rows, step, script)

    def observation(self, sample: Sample) -> np.ndarray:
        """The observation (n_observed,) or (n_observed, n), within the measuring ranges."""
        raw = np.array([one.of(sample) for one in self.task.observed])
        found: np.ndarray = np.minimum(np.maximum(raw.T, self.low), self.high).T
        return found

    def carried(self, sample: Sample) -> np.ndarray:
        """The columns whose gain the next reward needs (n_carried,) or (n_carried, n)."""
        return np.array([sample[name] for name in self.task.carried])


def setting(task: Task | str, sets: Mapping[str, Any] | None = None) -> Setting:
    """Compile a task."""
    task = task_of(task) if isinstance(task, str) else task
    _refuse_own(task, sets or {})
    scenario = load("scenario", task.scenario, {**(sets or {}), **task.sets})
    _refuse_commanders(scenario)
    built = build(scenario)
    steps = round(task.period / built.scenario.timestep)
    index = built.index
    valves = [index.valves[f"{name}_{side}"] for name in index.chambers for side in ("inlet", "outlet")]
    times = np.arange(task.periods + 1) * task.period - built.scenario.timestep  # a sample is a step old
    times[0] = 0.0
    return Setting(
        task,
        built,
        steps,
        schedule.controls(built),
        valves,
        readers(built),
        times,
        _starts(task, built, steps),
        np.array([one.low for one in task.observed]),
        np.array([one.high for one in task.observed]),
        dict(sets or {}),
    )


def _refuse_own(task: Task, sets: Mapping[str, Any]) -> None:
    if not isinstance(sets, Mapping):
        allowed = 'as in {"supply.pressure": "3 bar"}'
        raise InputError("is not a dict of keys and values", field="sets", value=sets, allowed=allowed)
    own = [key for key in sets if key in task.sets]
    if own:
        raise InputError("is the task's own", field=own[0], value=sets[own[0]], allowed=task.sets[own[0]])


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


def _starts(task: Task, built: Built, steps: int) -> tuple[Start, ...]:
    stepped = Stepped([built], fields=FIELDS)
    try:
        if task.strides is None:
            rows = {name: values[0, 0].copy() for name, values in stepped.begun.items()}
            return (Start(0, stepped.cases[0].state.copy(), rows),)
        return tuple(_walked(task.strides, built, stepped, steps, task.periods * steps))
    finally:
        stepped.close()


def _walked(
    strides: tuple[int, int], built: Built, stepped: Stepped, steps: int, episode: int
) -> list[Start]:
    """States of the scenario's walking with its own valve timing, at every control period of some strides."""
    walk = built.walk
    assert walk is not None
    phase = walk.phase[1 : 1 + built.scenario.n_step]
    found: list[Start] = []
    while (step := int(stepped.taken[0])) + steps < len(phase) and phase[step] < strides[1]:
        rows = stepped.advance([0], stepped.inputs(0, steps)[None])
        if stepped.failures:
            raise stepped.failures[0]
        step += steps
        if strides[0] <= phase[step] < strides[1]:
            last = {name: values[0, -1].copy() for name, values in rows.items()}
            found.append(Start(step, stepped.state(0), last))
    if not found or found[-1].step + episode > len(phase):
        problem = "walks too slowly for an episode: its strides end after the scenario"
        raise InputError(problem, field="gait", allowed=f"{strides[1]} strides and {episode} steps")
    return found


@dataclass(frozen=True)
class Outcome:
    """What a period has come to, of the simulations that were stepped (n,).

    observation : (n, n_observed)
    reward : (n,)
    over : whether the episode's time is up (n,)
    failures : of those that have become unstable, by place; their observation is that of the last good step
    """

    observation: np.ndarray
    reward: np.ndarray
    over: np.ndarray
    failures: Mapping[int, SimulationError]


class Episodes:
    """Simulations of one task that are stepped together, with the callbacks held until `close`."""

    MEMORY = ("stepped.moment", "scripts", "taken", "carried")  # what decides what follows

    def __init__(self, setting: Setting, count: int = 1, threads: int = 1):
        self.setting = setting
        self.stepped = Stepped([setting.built], count=count, fields=FIELDS, threads=threads)
        width = setting.draw(np.random.default_rng(0))[1].shape[1]
        self.scripts = np.zeros((count, len(setting.times), width))
        self.taken = np.zeros(count, int)  # periods of the episode
        self.carried = np.zeros((len(setting.task.carried), count))
        self._inputs: dict[int, np.ndarray] = {}
        self._offsets = np.arange(setting.steps)

    def __len__(self) -> int:
        return len(self.stepped)

    def begin(self, numbers: Sequence[int], randoms: Sequence[Random]) -> np.ndarray:
        """Begin an episode in some simulations, drawn by the random numbers of each; observations (n, …)."""
        drawn = [self.setting.draw(random) for random in randoms]
        starts = [start for start, _ in drawn]
        self.stepped.begin(numbers, [start.state for start in starts], [start.step for start in starts])
        ids = np.array(numbers, int)
        self.taken[ids] = 0
        self.scripts[ids] = [script for _, script in drawn]
        rows = {name: np.stack([start.rows[name] for start in starts], axis=1) for name in starts[0].rows}
        steps = np.maximum([start.step - 1 for start in starts], 0)
        return self._seen(ids, rows, steps)[0]

    def step(self, numbers: Sequence[int], action: np.ndarray) -> Outcome:
        """Step some simulations by one control period.

        Units: action (n, n_chamber).
        """
        setting, ids = self.setting, np.array(numbers, int)
        first = self.stepped.taken[ids]
        inputs = self._block(len(ids))
        np.take(setting.inputs, first[:, None] + self._offsets, axis=0, out=inputs, mode="clip")
        inputs[..., setting.valves] = coils_of(action)[:, None]
        rows = self.stepped.advance(numbers, inputs)
        self.taken[ids] += 1
        last = {name: values[:, -1].T for name, values in rows.items()}
        observation, sample, gained = self._seen(ids, last, first + setting.steps - 1)
        failures = {p: self.stepped.failures[k] for p, k in enumerate(numbers) if k in self.stepped.failures}
        reward = np.array(setting.task.reward(sample, gained), float)
        reward[list(failures)] = 0.0
        return Outcome(observation, reward, self.taken[ids] >= setting.task.periods, failures)

    def _seen(
        self, ids: np.ndarray, rows: Mapping[str, np.ndarray], steps: np.ndarray
    ) -> tuple[np.ndarray, Any, np.ndarray]:
        script = self.scripts[ids, self.taken[ids]].T
        sample = self.setting.sample(rows, steps, script)
        carried = self.setting.carried(sample).reshape(len(self.carried), len(ids))
        gained = carried - self.carried[:, ids]
        self.carried[:, ids] = carried
        return np.ascontiguousarray(self.setting.observation(sample).T), sample, gained

    def _block(self, count: int) -> np.ndarray:
        if count not in self._inputs:
            self._inputs.clear()
            self._inputs[count] = np.empty((count, self.setting.steps, self.setting.inputs.shape[1]))
        return self._inputs[count]

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self.stepped.close()
