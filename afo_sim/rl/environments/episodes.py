"""Episodes of a task, side by side: simulations stepped together, each with its own start and script."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common.errors import SimulationError
from afo_sim.rl.environments.readers import FIELDS
from afo_sim.rl.environments.setting import Random, Setting
from afo_sim.rl.environments.task import coils_of
from afo_sim.simulation.simulate import Stepped


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
