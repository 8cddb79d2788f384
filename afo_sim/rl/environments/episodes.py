"""Episodes of a task, side by side: simulations stepped together, each with its own start and script."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, Function, InputError, JsonDict, JsonMapping, SimulationError
from afo_sim.description import Scenario, load
from afo_sim.model import Built
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.rl.environments.task import Random, Reader, Sample, Task, coils_of
from afo_sim.simulation import Stepped

Rows = Mapping[str, np.ndarray]  # fields of the last step (width, n)
FIELDS = ("actuator_force", "qfrc_actuator", "userdata")  # of MjData, beside the state
COILS = ("inlet", "outlet")  # of a chamber, in order


@dataclass(frozen=True, eq=False)
class Setting:
    """A task on a compiled scenario, from which episodes are drawn."""

    task: Task
    built: Built
    inputs: np.ndarray
    rows: Rows
    again: tuple[Function, tuple[object, ...]]

    def __reduce__(self) -> tuple[Function, tuple[object, ...]]:
        return self.again

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

    @cached_property
    def draw(self) -> Callable[[Random], np.ndarray]:
        """Draws what an episode asks for at its samples, which are a step old (periods + 1, width)."""
        times = np.arange(self.task.periods + 1) * self.task.period - self.built.scenario.timestep
        times[0] = 0.0
        return self.task.script(self.built, times)


def setting(
    task: Task,
    sets: Mapping[str, object] | None = None,
    again: tuple[Function, tuple[object, ...]] | None = None,
) -> Setting:
    """Compile a task."""
    check_sets(task, sets)
    built = build(load("scenario", task.scenario, {**(sets or {}), **task.sets}))
    stepped = Stepped([built], fields=FIELDS)
    try:
        rows = {name: values[0, 0].copy() for name, values in stepped.begun.items()}
    finally:
        stepped.close()
    return Setting(task, built, schedule.controls(built), rows, again or (setting, (task, sets)))


def check_sets(task: Task, sets: Mapping[str, object] | None) -> None:
    """Refuse keys that are the task's own, and what would command the valves beside the action."""
    sets = {} if sets is None else sets
    if not isinstance(sets, Mapping):
        allowed = 'as in {"supply.pressure": "3 bar"}'
        raise InputError("is not a dict of keys and values", field="sets", value=sets, allowed=allowed)
    own = [key for key in sets if key in task.sets]
    if own:
        raise InputError("is the task's own", field=own[0], value=sets[own[0]], allowed=task.sets[own[0]])
    scenario: Scenario = load("scenario", task.scenario, {**sets, **task.sets})
    if scenario.controller is not None:
        kind = scenario.controller.kind
        raise InputError("conflicts with the action", field="controller", value=kind, allowed="none")
    if scenario.gait is not None and scenario.gait.pace:
        problem = "conflicts with the task: a stopped walker has no swings, which the reward counts"
        raise InputError(problem, field="gait.pace", allowed="none; gait.speed for another pace")
    if scenario.drive:
        problem = "would have no effect: an action switches the valves"
        raise InputError(problem, field="drive", value=", ".join(scenario.drive), allowed="none")


def readers(built: Built) -> dict[str, Reader]:
    """Columns of the last step by name: the formulas of `simulation/columns.py`, addresses looked up once."""

    def place(field: str, at: int, less: float = 0.0) -> Reader:
        return lambda s: s.rows[field][at] - less

    index, model = built.index, built.model
    found = {"ankle/angle": place("qpos", index.ankle_qpos), "ankle/velocity": place("qvel", index.ankle_dof)}
    for chamber, actuator in index.chambers.items():
        # read from arrays of addresses, the air's numbers are their own addresses
        at = native.read_air(model, np.arange(model.na), np.arange(model.nuserdata), actuator)
        found[f"chamber/{chamber}/pressure"] = place("userdata", int(at.absolute_pressure), AMBIENT_PRESSURE)
        found[f"chamber/{chamber}/mass"] = place("act", int(at.mass))
    return found


class Sight:
    """What a task sees of some simulations, sample after sample, and what that is worth."""

    _memory = ("taken", "scripts", "mass")

    def __init__(self, setting: Setting, count: int):
        built = setting.built
        self.setting, self.readers = setting, {**readers(built), **setting.task.readers(built)}
        self.masses = [f"chamber/{name}/mass" for name in setting.chambers]
        self.taken = np.zeros(count, int)  # periods of the episode
        self.scripts = np.zeros((count, *setting.draw(np.random.default_rng(0)).shape))
        self.mass = np.zeros((count, len(self.masses)))  # of the air at the last sample [kg]

    @property
    def moment(self) -> JsonDict:
        """All that it remembers; it may be assigned again, and is copied by whoever keeps it."""
        return {name: getattr(self, name) for name in self._memory}

    @moment.setter
    def moment(self, moment: JsonMapping) -> None:
        vars(self).update(moment)

    def begin(self, ids: np.ndarray, scripts: Sequence[np.ndarray]) -> np.ndarray:
        """Begin episodes; observations of their starts (n, n_observed)."""
        self.taken[ids], self.scripts[ids] = 0, scripts
        rows = {name: np.repeat(row[:, None], len(ids), axis=1) for name, row in self.setting.rows.items()}
        return self.observation(self._sample(ids, rows))

    def see(self, ids: np.ndarray, rows: Rows) -> tuple[np.ndarray, np.ndarray]:
        """Observations (n, n_observed) and rewards (n,) of the next samples."""
        self.taken[ids] += 1
        sample = self._sample(ids, rows)
        return self.observation(sample), np.array(self.setting.task.reward(sample), float)

    def observation(self, sample: Sample) -> np.ndarray:
        """Within the measuring ranges (n_observed,) or (n, n_observed)."""
        raw = np.array([one.of(sample) for one in self.setting.task.observed])
        return np.ascontiguousarray(np.clip(raw.T, *self.setting.ranges))

    def _sample(self, ids: np.ndarray, rows: Rows) -> Sample:
        taken = np.minimum(self.taken[ids], self.scripts.shape[1] - 1)
        sample = Sample(self.readers, rows, self.scripts[ids, taken].T)
        mass = np.stack([sample[name] for name in self.masses], axis=1)
        sample.found["air/taken"] = np.maximum(mass - self.mass[ids], 0.0).sum(axis=1)
        self.mass[ids] = mass
        return sample


@dataclass(frozen=True)
class Outcome:
    """What a period has come to, of the simulations that were stepped (n,)."""

    observation: np.ndarray
    reward: np.ndarray
    over: np.ndarray
    failures: Mapping[int, SimulationError]


class Episodes:
    """Simulations of one task that are stepped together, with the callbacks held until `close`."""

    MEMORY = ("stepped.moment", "view.moment")  # what decides what follows, in this order

    def __init__(self, setting: Setting, count: int = 1, threads: int = 1):
        self.setting = setting
        self.stepped = Stepped([setting.built], count=count, fields=FIELDS, threads=threads)
        self.view = Sight(setting, count)

    def __len__(self) -> int:
        return len(self.stepped)

    def begin(self, numbers: Sequence[int], randoms: Sequence[Random]) -> np.ndarray:
        """Begin an episode in some simulations, drawn by the random numbers of each; observations (n, …)."""
        self.stepped.reset(numbers)
        return self.view.begin(np.array(numbers, int), [self.setting.draw(random) for random in randoms])

    def step(self, numbers: Sequence[int], action: np.ndarray) -> Outcome:
        """Step some simulations by one control period."""
        steps, taken = self.setting.steps, self.stepped.taken
        inputs = np.stack([self.setting.inputs[taken[k] : taken[k] + steps] for k in numbers])
        inputs[..., self.setting.valves] = coils_of(action)[:, None]
        rows = self.stepped.advance(numbers, inputs)
        last, ids = {name: values[:, -1].T for name, values in rows.items()}, np.array(numbers, int)
        observation, reward = self.view.see(ids, last)
        failures = {p: self.stepped.failures[k] for p, k in enumerate(numbers) if k in self.stepped.failures}
        reward[list(failures)] = 0.0
        return Outcome(observation, reward, taken[ids] >= self.setting.task.periods * steps, failures)

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self.stepped.close()
