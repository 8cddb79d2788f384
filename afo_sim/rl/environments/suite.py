"""The tasks as dm_control's suite has them: `suite.load("seated_tracking", task_kwargs={"random": 1})`."""

from collections import OrderedDict
from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim.common import Foreign, Function, Given, InputError, JsonMapping
from afo_sim.rl.dm import dm  # noqa: F401  one sentence where dm_control is missing
from afo_sim.rl.environments.episodes import FIELDS, Setting, Sight
from afo_sim.rl.environments.task import checked, coils_of
from afo_sim.rl.environments.tasks import setting_of, task_of
from afo_sim.rl.physics import ScenarioPhysics
from afo_sim.simulation import STATE, Forkable, state_parts

from dm_control.rl import control  # isort: skip
from dm_control.utils import containers  # isort: skip
from dm_env import specs  # isort: skip

BEFORE = sum(int(getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}")) for name in STATE)


class TaskPhysics(ScenarioPhysics):
    """A scenario's Physics with the row of its last step: the state before it, and the forces in it."""

    def __init__(self, setting: Setting):
        super().__init__(setting.built, timed=False)
        self.setting = setting
        model = self.model.ptr
        self._row = np.zeros(mujoco.mj_stateSize(model, BEFORE))
        parts = {name: values[0] for name, values in state_parts(model, self._row[None]).items()}
        forces = {name: getattr(self.data.ptr, name) for name in FIELDS}
        self.rows: Mapping[str, np.ndarray] = parts | forces
        self._to_look = model, self.data.ptr, self._row, BEFORE

    def _before_last(self) -> None:
        mujoco.mj_getState(*self._to_look)

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), (self.setting,)

    def command(self, coils: np.ndarray) -> None:
        """Set the coils of all chambers (2 n_chamber,), from the next step on."""
        on = coils.tolist()
        for k, chamber in enumerate(self.built.index.chambers):
            self._commander.commands[chamber] = on[2 * k], on[2 * k + 1]


class OrthosisTask(control.Task):
    """A task of this package as dm_control's."""

    def __init__(
        self, setting: Setting, random: int | np.random.RandomState | None = None, bounded: bool = True
    ):
        self.setting, self.bounded = setting, bounded
        if not isinstance(random, np.random.RandomState):
            random = np.random.RandomState(random)
        self._random = random  # where dm_control's tasks have it, and wrappers that reseed write it
        self._shape = (len(setting.chambers),)
        self._names = [one.name for one in setting.task.observed]
        self._view, self._one = Sight(setting, 1), np.zeros(1, int)
        # dm_control looks at an observation before the first episode, where its spec is not asked for
        self._seen = self._view.begin(self._one, [setting.draw(np.random.RandomState(0))])[0]

    @property
    def random(self) -> np.random.RandomState:
        """What draws the episodes."""
        return self._random

    @property
    def units(self) -> dict[str, str]:
        """Units of the observation by name."""
        return self.setting.task.units

    @property
    def meanings(self) -> dict[str, str]:
        """Meanings of the observation by name."""
        return self.setting.task.meanings

    def initialize_episode(self, physics: TaskPhysics) -> None:
        """Draw an episode."""
        self._seen = self._view.begin(self._one, [self.setting.draw(self.random)])[0]

    def before_step(self, action: Given, physics: TaskPhysics) -> None:
        """Command the valves; InputError where it is not a valid action."""
        action = getattr(action, "continuous_actions", action)
        physics.command(coils_of(checked(action, self._shape)))

    def after_step(self, physics: TaskPhysics) -> None:
        """Look at the last step."""
        rows = {name: values[:, None] for name, values in physics.rows.items()}
        (self._seen,), (self._reward,) = self._view.see(self._one, rows)

    def get_reward(self, physics: TaskPhysics) -> float:
        """Of the last step."""
        return float(self._reward)

    def get_observation(self, physics: TaskPhysics) -> "OrderedDict[str, np.ndarray]":
        """Of the last step, in new arrays (1,)."""
        return OrderedDict(zip(self._names, self._seen[:, None].copy(), strict=True))

    def action_spec(self, physics: TaskPhysics) -> specs.BoundedArray:
        """One number from −1 to 1 for each chamber."""
        return specs.BoundedArray(self._shape, float, -1.0, 1.0, name="\t".join(self.setting.chambers))

    def observation_spec(self, physics: TaskPhysics) -> Foreign:
        """Names and ranges; units stand in `units`."""
        if not self.bounded:
            raise NotImplementedError  # dm_control's word for: look at an observation
        observed = self.setting.task.observed
        return OrderedDict(
            (one.name, specs.BoundedArray((1,), float, one.low, one.high, name=one.name)) for one in observed
        )

    def __repr__(self) -> str:
        return f"OrthosisTask({self.setting.task.name})"


SUITE = containers.TaggedTasks()
OWN = ("n_sub_steps", "control_timestep")


class OrthosisEnvironment(Forkable, control.Environment):
    """dm_control's Environment of a task; it gives the muscle callbacks back when it is closed."""

    _memory = (
        *(f"_physics.{name}" for name in TaskPhysics._memory),
        *("_task._random", "_task._view.moment", "_task._seen", "_step_count", "_reset_next_step"),
    )

    def __init__(self, setting: Setting, random: Given, limit: float, more: JsonMapping):
        task = OrthosisTask(setting, random, bounded=not more.get("flat_observation"))
        super().__init__(TaskPhysics(setting), task, limit, n_sub_steps=setting.steps, **more)
        self._of, self._more, self._hold = (*setting.again[1], limit), more, self.physics._hold

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), (self.task.setting, None, self._of[-1], self._more)

    def close(self) -> None:
        """Free the simulation; a second call does nothing."""
        self.physics.close()


@SUITE.add("orthosis")
def seated_tracking(**kwargs: Given) -> OrthosisEnvironment:
    """Seated, the foot free in the air: the ankle follows a smooth random reference."""
    return _environment("seated_tracking", **kwargs)


@SUITE.add("orthosis")
def dropfoot_walk(**kwargs: Given) -> OrthosisEnvironment:
    """Walking with a drop foot on S1's orthosis: what the verdict asks."""
    return _environment("dropfoot_walk", **kwargs)


ALL_TASKS = tuple(("orthosis", name) for name in SUITE)


def load(
    task_name: str,
    task_kwargs: JsonMapping | None = None,
    environment_kwargs: JsonMapping | None = None,
) -> OrthosisEnvironment:
    """A dm_control environment of a task."""
    task_of(task_name)
    return SUITE[task_name](**dict(task_kwargs or {}), environment_kwargs=environment_kwargs)


def _environment(
    name: str,
    random: Given = None,
    sets: Mapping[str, object] | None = None,
    time_limit: float | None = None,
    environment_kwargs: JsonMapping | None = None,
) -> OrthosisEnvironment:
    more, task = dict(environment_kwargs or {}), task_of(name)
    if own := [key for key in OWN if key in more]:
        raise InputError("is the task's own", field=own[0], value=more[own[0]], allowed=f"{task.period:g} s")
    limit = task.duration if time_limit is None else time_limit
    if not task.period <= limit <= task.duration:
        allowed = f"{task.period:g} to {task.duration:g} s"
        raise InputError("is out of range", field="time_limit", value=limit, allowed=allowed)
    return OrthosisEnvironment(setting_of(name, sets), random, limit, more)
