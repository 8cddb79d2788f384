"""A task as a Gymnasium environment: one simulation, or many stepped at once."""

import copy
import os
import traceback
from collections.abc import Mapping, Sequence
from operator import index

import mujoco
import numpy as np

from afo_sim.common import Foreign, Function, Given, InputError, JsonDict, missing_extra, unknown
from afo_sim.model import ANKLE
from afo_sim.rl.environments.episodes import Episodes, Setting
from afo_sim.rl.environments.task import checked
from afo_sim.rl.environments.tasks import setting_of
from afo_sim.simulation import Forkable

try:
    import gymnasium
    from gymnasium.utils import seeding
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise missing_extra(error) or error from None

Sets = Mapping[str, object] | None
RENDER_MODES = ("rgb_array",)
FPS = 100  # frames of real time: one every control period
LIGHT = 0.5  # ambient, of 1
ABOVE = np.array([0.0, 0.0, 0.15])  # from the ankle to the middle of the picture [m]


def observation_space(made: Setting) -> gymnasium.spaces.Box:
    """The measuring ranges, in SI."""
    return gymnasium.spaces.Box(*made.ranges, dtype=np.float64)


def action_space(made: Setting) -> gymnasium.spaces.Box:
    """One number from −1 to 1 for each chamber."""
    return gymnasium.spaces.Box(-1.0, 1.0, (len(made.chambers),), dtype=np.float32)


def _about(made: Setting) -> JsonDict:
    task = made.task
    return {
        "observation_names": list(task.units),
        "observation_units": task.units,
        "observation_meanings": task.meanings,
        "action_names": made.chambers,
        "reward_range": (task.lowest, task.highest),
    }


EPISODES = tuple(f"_episodes.{name}" for name in Episodes.MEMORY)


class OrthosisEnv(Forkable, gymnasium.Env[np.ndarray, np.ndarray]):
    """One simulation of a task; see docs/environments.md."""

    _memory = (*EPISODES, "_np_random", "_np_random_seed", "_going", "spec")

    metadata: JsonDict = {"render_modes": list(RENDER_MODES), "render_fps": FPS}  # noqa: RUF012

    def __init__(
        self, task: str | Setting = "seated_tracking", sets: Sets = None, render_mode: str | None = None
    ):
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise unknown(render_mode, RENDER_MODES, field="render_mode", problem="there is no such mode")
        self.render_mode = render_mode
        self.setting = task if isinstance(task, Setting) else setting_of(task, sets)
        self._of = self.setting.again[1]
        self.metadata = type(self).metadata | _about(self.setting)
        self.observation_space = observation_space(self.setting)
        self.action_space = action_space(self.setting)
        self._episodes = Episodes(self.setting)
        self._hold = self._episodes.stepped.hold
        self._going = False
        self._drawn: tuple[mujoco.MjModel, mujoco.MjData, mujoco.Renderer] | None = None

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), (self.setting, None, self.render_mode)

    def reset(
        self, *, seed: int | None = None, options: JsonDict | None = None
    ) -> tuple[np.ndarray, JsonDict]:
        """Begin an episode, drawn by the seed."""
        super().reset(seed=seed)
        self._going = True
        return self._episodes.begin([0], [self.np_random])[0], {}

    def step(self, action: Given) -> tuple[np.ndarray, float, bool, bool, JsonDict]:
        """Step by one control period."""
        if not self._going:
            raise InputError("the episode is over, or has not begun: reset()", field="step")
        outcome = self._episodes.step([0], checked(action, self.action_space.shape)[None])
        info: JsonDict = {"failure": str(outcome.failures[0])} if outcome.failures else {}
        truncated = bool(outcome.over[0]) or bool(info)
        self._going = not truncated
        return outcome.observation[0], float(outcome.reward[0]), False, truncated, info

    def render(self) -> np.ndarray | None:
        """A picture (height, width, 3) where `render_mode` is "rgb_array"; it needs OpenGL."""
        if self.render_mode is None:
            return None
        if self._drawn is None:
            model = copy.deepcopy(self.setting.built.full_model)
            model.vis.headlight.ambient[:] = LIGHT
            self._drawn = model, mujoco.MjData(model), _renderer(model)
        model, data, renderer = self._drawn
        data.qpos[:] = self._episodes.stepped.now["qpos"][0]
        for place in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight, mujoco.mj_tendon):
            place(model, data)
        camera = mujoco.MjvCamera()  # at the leg from its side, the toes to the right
        camera.lookat[:] = data.xanchor[model.joint(ANKLE).id] + ABOVE
        camera.distance, camera.azimuth, camera.elevation = 0.9, 90.0, -5.0
        renderer.update_scene(data, camera)
        return renderer.render()

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        if self._drawn is not None:
            self._drawn[2].close()
            self._drawn = None
        self._going = False
        self._episodes.close()


def _renderer(model: mujoco.MjModel) -> mujoco.Renderer:
    try:
        return mujoco.Renderer(model, 480, 640)
    except Exception as error:  # of OpenGL's, which differ by platform
        for frame, _ in traceback.walk_tb(error.__traceback__):
            half_made: Foreign = frame.f_locals.get("self")
            if type(half_made).__name__ == "GLContext" and not hasattr(half_made, "_context"):
                half_made._context = None  # or its __del__ raises, some time later
        problem = f"cannot draw here ({error or type(error).__name__}): set MUJOCO_GL to egl or osmesa"
        raise InputError(problem, field="render_mode", value="rgb_array") from None


MASK = "reset_mask"  # Gymnasium's option: which simulations to reset


class OrthosisVectorEnv(Forkable, gymnasium.vector.VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Simulations of one task side by side, with the numbers of single environments of the same seeds."""

    _memory = (*EPISODES, "_randoms", "_over", "_last", "spec")
    metadata: JsonDict = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        task: str | Setting = "seated_tracking",
        num_envs: int = 1,
        sets: Sets = None,
        threads: int | None = None,
    ):
        made = task if isinstance(task, Setting) else setting_of(task, sets)
        self.setting, self.num_envs = made, _positive("num_envs", num_envs)
        self._of = *made.again[1], num_envs
        self.metadata = type(self).metadata | _about(made)
        self.single_observation_space, self.single_action_space = observation_space(made), action_space(made)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        threads = (os.cpu_count() or 1) if threads is None else _positive("threads", threads)
        self._threads = min(threads, num_envs)
        self._episodes = Episodes(made, num_envs, self._threads)
        self._hold = self._episodes.stepped.hold
        self._randoms: list[np.random.Generator] = [seeding.np_random()[0] for _ in range(num_envs)]
        self._over: np.ndarray | None = None  # episodes that begin anew in the next step
        self._last = np.empty(self.observation_space.shape)

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), (self.setting, self.num_envs, None, self._threads)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: JsonDict | None = None
    ) -> tuple[np.ndarray, JsonDict]:
        """Begin all episodes, or those of `options["reset_mask"]`."""
        given = (options or {}).get(MASK)
        mask = np.ones(self.num_envs, bool) if given is None else np.asarray(given)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            allowed = f"{self.num_envs} of True and False, one of them True"
            raise InputError("is not a valid mask", field=MASK, value=given, allowed=allowed)
        if self._over is None and not mask.all():
            raise InputError("nothing has begun yet: reset all first", field=MASK)
        for k, one in enumerate(_seeds(seed, self.num_envs)):
            if one is not None and mask[k]:
                self._randoms[k] = seeding.np_random(one)[0]
        if self._over is None:
            self._over = np.zeros(self.num_envs, bool)
        self._begin(np.flatnonzero(mask))
        return self._last.copy(), {}

    def _begin(self, ids: np.ndarray) -> None:
        if len(ids):
            numbers = ids.tolist()
            self._last[ids] = self._episodes.begin(numbers, [self._randoms[k] for k in numbers])
            self._over[ids] = False  # type: ignore[index]  # made by whoever calls

    def step(self, actions: Given) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, JsonDict]:
        """Step all simulations by one control period."""
        if self._over is None:
            raise InputError("no episode has begun: reset()", field="step")
        given = checked(actions, self.action_space.shape)
        going, again = np.flatnonzero(~self._over), np.flatnonzero(self._over)
        reward, truncated = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        infos: JsonDict = {}
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

    def close_extras(self, **_: object) -> None:
        """Give the muscle callbacks back."""
        self._episodes.close()


def _positive(field: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError("is not a valid number of them", field=field, value=value, allowed="1, 2, 3, …")
    return int(value)


def _seeds(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + k for k in range(count)]
    if not isinstance(seed, Sequence | np.ndarray):
        allowed = f"a whole number, or {count} of them"
        raise InputError("is not a valid seed", field="seed", value=seed, allowed=allowed)
    if len(seed) != count:
        allowed = f"{count}, or one number"
        raise InputError("has another length", field="seed", value=len(seed), allowed=allowed)
    return [None if one is None else index(one) for one in seed]
