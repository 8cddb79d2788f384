"""The vector environment as Stable-Baselines3's VecEnv; whoever learns with that library installs it."""

from typing import Any

import numpy as np

from afo_sim.common import InputError
from afo_sim.rl.environments.gym_env import MASK, OrthosisVectorEnv

try:
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError:
    raise ImportError("this needs the library stable_baselines3: pip install stable-baselines3") from None


class OrthosisVecEnv(VecEnv):  # type: ignore[misc]
    """A vector environment as SB3 steps it: an episode that is over begins anew in the same step."""

    def __init__(self, envs: OrthosisVectorEnv):
        self.envs = envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> np.ndarray:
        """Begin all episodes; their observations."""
        seen = self.envs.reset(seed=self._seeds)[0]
        self._reset_seeds()
        return seen

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions of the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step all simulations by one control period."""
        seen, rewards, _, over, told = self.envs.step(self._actions)
        infos: list[dict[str, Any]] = [{"TimeLimit.truncated": bool(one)} for one in over]
        masks = {name: told[f"_{name}"] for name in told if f"_{name}" in told}
        for k, info in enumerate(infos):
            info |= {name: told[name][k] for name, mask in masks.items() if mask[k]}
            info |= {"terminal_observation": seen[k]} if over[k] else {}
        if over.any():
            seen = self.envs.reset(options={MASK: over})[0]
        return seen, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Give the muscle callbacks back."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the vector environment, for each simulation."""
        return [getattr(self.envs, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the vector environment, which all simulations share."""
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **more: Any) -> list[Any]:
        """Refuse: a simulation is no environment of its own."""
        raise InputError("no simulation is an environment", field="env_method", value=method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No simulation is wrapped."""
        return [False for _ in self._get_indices(indices)]
