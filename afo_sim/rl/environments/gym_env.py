"""A task as a Gymnasium environment."""

import copy
import traceback
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.model.mounting import ANKLE
from afo_sim.rl.environments.catalogue import task_of
from afo_sim.rl.environments.episodes import Episodes
from afo_sim.rl.environments.gym import gymnasium
from afo_sim.rl.environments.setting import Setting, setting
from afo_sim.rl.environments.task import checked

RENDER_MODES = ("rgb_array",)
FPS = 100  # frames of real time: one every control period
LIGHT = 0.5  # ambient, of 1
ABOVE = np.array([0.0, 0.0, 0.15])  # from the ankle to the middle of the picture [m]


def observation_space(made: Setting) -> Any:
    """The measuring ranges, in SI."""
    return gymnasium.spaces.Box(made.low, made.high, dtype=np.float64)


def action_space(made: Setting) -> Any:
    """One number from −1 to 1 for each chamber."""
    return gymnasium.spaces.Box(-1.0, 1.0, (len(made.chambers),), dtype=np.float32)


def about(made: Setting) -> dict[str, Any]:
    """Names, units and meanings of the observation, and of the action, for `metadata`."""
    task = made.task
    return {
        "observation_names": list(task.units),
        "observation_units": task.units,
        "observation_meanings": task.meanings,
        "action_names": made.chambers,
        "reward_range": (task.lowest, task.highest),
    }


class OrthosisEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """One simulation of a task; see docs/environments.md."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}  # noqa: RUF012

    def __init__(
        self,
        task: str = "seated_tracking",
        sets: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
    ):
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise unknown(
                render_mode, list(RENDER_MODES), field="render_mode", problem="there is no such mode"
            )
        self.render_mode = render_mode
        self.setting = setting(task_of(task), sets)
        self.metadata = type(self).metadata | about(self.setting)
        self.observation_space = observation_space(self.setting)
        self.action_space = action_space(self.setting)
        self._episodes = Episodes(self.setting)
        self._going = False
        self._drawn: tuple[mujoco.MjModel, mujoco.MjData, Any] | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode, drawn by the seed."""
        super().reset(seed=seed)
        self._going = True
        return self._episodes.begin([0], [self.np_random])[0], {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Step by one control period."""
        if not self._going:
            raise InputError("the episode is over, or has not begun: reset()", field="step")
        outcome = self._episodes.step([0], checked(action, self.action_space.shape)[None])
        info = {"failure": str(outcome.failures[0])} if outcome.failures else {}
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
        renderer.update_scene(data, _beside(data.xanchor[model.joint(ANKLE).id]))
        found: np.ndarray = renderer.render()
        return found

    def close(self) -> None:
        """Give the muscle callbacks back; a second call does nothing."""
        if self._drawn is not None:
            self._drawn[2].close()
            self._drawn = None
        self._going = False
        self._episodes.close()


def _beside(ankle: np.ndarray) -> mujoco.MjvCamera:
    """A camera that looks at the leg from its side, the toes to the right."""
    camera = mujoco.MjvCamera()
    camera.lookat[:] = ankle + ABOVE
    camera.distance, camera.azimuth, camera.elevation = 0.9, 90.0, -5.0
    return camera


def _renderer(model: mujoco.MjModel) -> Any:
    try:
        return mujoco.Renderer(model, 480, 640)
    except Exception as error:  # of OpenGL's, which differ by platform
        for frame, _ in traceback.walk_tb(error.__traceback__):
            half_made: Any = frame.f_locals.get("self")
            if type(half_made).__name__ == "GLContext" and not hasattr(half_made, "_context"):
                half_made._context = None  # or its __del__ raises, some time later
        problem = f"cannot draw here ({error or type(error).__name__}): set MUJOCO_GL to egl or osmesa"
        raise InputError(problem, field="render_mode", value="rgb_array") from None
