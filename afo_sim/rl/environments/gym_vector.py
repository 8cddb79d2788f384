"""A task as a Gymnasium vector environment: many simulations stepped at once."""

import os
from collections.abc import Mapping, Sequence
from operator import index
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.rl.environments.catalogue import task_of
from afo_sim.rl.environments.episodes import Episodes
from afo_sim.rl.environments.gym import gymnasium
from afo_sim.rl.environments.gym_env import about, action_space, observation_space
from afo_sim.rl.environments.setting import setting
from afo_sim.rl.environments.task import checked

from gymnasium.utils import seeding  # isort: skip
from gymnasium.vector.utils import batch_space  # isort: skip

MASK = "reset_mask"  # Gymnasium's option: which simulations to reset


class OrthosisVectorEnv(gymnasium.vector.VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Simulations of one task side by side, with the numbers of single environments of the same seeds.

    An episode that is over begins anew in the next step, whose action it ignores (Gymnasium's
    `AutoresetMode.NEXT_STEP`). A simulation that becomes unstable is truncated; the others go on.
    """

    metadata: dict[str, Any] = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        task: str = "seated_tracking",
        num_envs: int = 1,
        sets: Mapping[str, Any] | None = None,
        threads: int | None = None,
    ):
        made = setting(task_of(task), sets)
        self.setting, self.num_envs = made, _positive("num_envs", num_envs)
        self.metadata = type(self).metadata | about(made)
        self.single_observation_space, self.single_action_space = observation_space(made), action_space(made)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        threads = (os.cpu_count() or 1) if threads is None else _positive("threads", threads)
        self._episodes = Episodes(made, num_envs, min(threads, num_envs))
        self._randoms: list[np.random.Generator] = [seeding.np_random()[0] for _ in range(num_envs)]
        self._over: np.ndarray | None = None  # episodes that begin anew in the next step

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin all episodes, or those of `options["reset_mask"]`."""
        mask = _mask((options or {}).get(MASK), self.num_envs)
        if self._over is None and not mask.all():
            raise InputError("nothing has begun yet: reset all first", field=MASK)
        for k, one in enumerate(_seeds(seed, self.num_envs)):
            if one is not None and mask[k]:
                self._randoms[k] = seeding.np_random(one)[0]
        if self._over is None:
            self._over = np.zeros(self.num_envs, bool)
            self._last = np.empty(self.observation_space.shape)
        self._begin(np.flatnonzero(mask))
        return self._last.copy(), {}

    def _begin(self, ids: np.ndarray) -> None:
        if len(ids):
            numbers = ids.tolist()
            self._last[ids] = self._episodes.begin(numbers, [self._randoms[k] for k in numbers])
            self._over[ids] = False  # type: ignore[index]

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all simulations by one control period."""
        if self._over is None:
            raise InputError("no episode has begun: reset()", field="step")
        given = checked(actions, self.action_space.shape)
        going, again = np.flatnonzero(~self._over), np.flatnonzero(self._over)
        reward, truncated = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        infos: dict[str, Any] = {}
        if len(going):
            outcome = self._episodes.step(going.tolist(), given[going])
            self._last[going], reward[going] = outcome.observation, outcome.reward
            truncated[going] = outcome.over
            for place, failure in outcome.failures.items():
                truncated[going[place]] = True
                infos = self._add_info(infos, {"failure": str(failure)}, int(going[place]))
        self._begin(again)
        self._over = truncated.copy()
        return self._last.copy(), reward, np.zeros(self.num_envs, bool), truncated, infos

    def close_extras(self, **_: Any) -> None:
        """Give the muscle callbacks back."""
        self._episodes.close()


def _positive(field: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError("is no number of them", field=field, value=value, allowed="1, 2, 3, …")
    return int(value)


def _seeds(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + k for k in range(count)]
    if not isinstance(seed, Sequence | np.ndarray):
        allowed = f"a whole number, or {count} of them"
        raise InputError("is no seed", field="seed", value=seed, allowed=allowed)
    if len(seed) != count:
        raise InputError(
            "has another length", field="seed", value=len(seed), allowed=f"{count}, or one number"
        )
    return [None if one is None else index(one) for one in seed]


def _mask(given: Any, count: int) -> np.ndarray:
    if given is None:
        return np.ones(count, bool)
    mask = np.asarray(given)
    if mask.shape != (count,) or mask.dtype != bool or not mask.any():
        allowed = f"{count} of True and False, one of them True"
        raise InputError("is no mask", field=MASK, value=given, allowed=allowed)
    return mask
