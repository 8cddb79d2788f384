"""A model that wears orthoses as a Gymnasium environment: the valves of all chambers are the action."""

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import NoReturn

import gymnasium
import mujoco
import numpy as np

from afo_sim.common import Function, Given, InputError, JsonDict
from afo_sim.legs import Attached
from afo_sim.rl.environments.task import DEAD, checked
from afo_sim.simulation import FAILURES, Forkable, steps_in

FALLEN = 0.3  # of its height at the start, by which a centre of mass that has fallen is lower [-]


def stands(env: "AttachedEnv") -> bool:
    """Whether the whole model's centre of mass has not come down by FALLEN of its height at the start."""
    return bool(env.height - env.data.subtree_com[0, 2] < FALLEN * abs(env.height))


@dataclass(frozen=True)
class _Origin:
    """What environments and their forks agree in: the model as it was attached."""

    spec: mujoco.MjSpec

    def __reduce__(self) -> NoReturn:
        problem = "is not pickled, since MuJoCo pickles no MjSpec: attach and make it in the other process"
        raise InputError(problem, field="AttachedEnv", allowed="copy(), state() and restore() in this one")


@dataclass(eq=False)
class AttachedEnv(Forkable, gymnasium.Env[np.ndarray, np.ndarray]):
    """A model that wears orthoses: an action is one number from −1 (outlet) to 1 (inlet) for each chamber."""

    _memory = ("data", "height", "_left", "_np_random", "_np_random_seed")

    leg: Attached
    observe: Mapping[str, Callable[[mujoco.MjData], float]] = field(default_factory=dict)
    reward: Callable[["AttachedEnv"], float] = stands
    terminated: Callable[["AttachedEnv"], bool] = lambda env: not stands(env)
    begin: Callable[["AttachedEnv"], object] = lambda env: None
    period: float = 0.01
    duration: float = 10.0

    def __post_init__(self) -> None:
        model, legs = copy.copy(self.leg.model), dict[str, Attached]()
        legs |= {prefix: replace(each, model=model, legs=legs) for prefix, each in self.leg.legs.items()}
        self.leg, self._of = legs[self.leg.prefix], (_Origin(self.leg.spec),)
        steps_in(self.period, model.opt.timestep, "period")  # refused before anything is held
        self._hold, self.data = self.leg.callbacks(), self.leg.data()
        self.height, self._left = 0.0, 0
        self._valves = [(each, name) for each in self.leg.legs.values() for name in each.chambers]
        names = [f"{each.prefix}{name}" for each, name in self._valves]
        seen = [f"{prefix}{each.orthosis.joint}_angle" for prefix, each in self.leg.legs.items()]
        seen += [f"{each}_pressure" for each in names]
        self.metadata = {"observation_names": [*seen, *self.observe], "action_names": names}
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, self._seen().shape, np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(names),), np.float32)

    __reduce__ = _Origin.__reduce__  # type: ignore[assignment]  # it pickles neither

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), tuple(getattr(self, each.name) for each in fields(self))

    def _seen(self) -> np.ndarray:
        pressures = [value for each in self.leg.legs.values() for value in each.pressure(self.data).values()]
        angles = [each.angle(self.data) for each in self.leg.legs.values()]
        return np.array([*angles, *pressures, *(float(read(self.data)) for read in self.observe.values())])

    def reset(self, *, seed: int | None = None, options: object = None) -> tuple[np.ndarray, JsonDict]:
        """Begin at rest with ambient air, as `begin` has it."""
        self._hold.check()
        super().reset(seed=seed)
        self._left = 0  # until the episode has begun
        self.leg.reset(self.data)
        with self._hold.calling("reset"):
            self.begin(self)
            mujoco.mj_forward(self.leg.model, self.data)
            self.height, self._left = float(self.data.subtree_com[0, 2]), round(self.duration / self.period)
            return self._seen(), {}

    def step(self, action: Given) -> tuple[np.ndarray, float, bool, bool, JsonDict]:
        """Step by one period; what becomes unstable is truncated, with its reason in `info`."""
        self._hold.check()
        if not self._left:
            raise InputError("the episode is over, or has not begun: reset()", field="step")
        for (each, name), side in zip(self._valves, checked(action, self.action_space.shape), strict=True):
            each.set_valves(self.data, {name: "inlet" if side > DEAD else "outlet" if side < -DEAD else None})
        steps = steps_in(self.period, self.leg.model.opt.timestep, "period")
        left, self._left = self._left - 1, 0  # whatever is raised now ends the episode
        with self._hold.calling("step"):
            try:
                mujoco.mj_step(self.leg.model, self.data, steps)
                failed = "" if np.isfinite(self.data.qacc).all() else "an acceleration is not a number"
            except FAILURES as error:
                failed = str(error)
            if failed:
                return np.nan_to_num(self._seen()), 0.0, False, True, {"failure": failed}
            over, seen, reward = bool(self.terminated(self)), self._seen(), float(self.reward(self))
        self._left = 0 if over else left
        return seen, reward, over, not (over or left), {}

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        self._hold.close()
