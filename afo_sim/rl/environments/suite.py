"""The tasks as dm_control's suite has them: `suite.load("seated_tracking", task_kwargs={"random": 1})`."""

from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.rl.bridge import dm as _dm  # noqa: F401  one sentence where dm_control is missing
from afo_sim.rl.environments.catalogue import task_of
from afo_sim.rl.environments.dm_task import OrthosisTask, TaskPhysics
from afo_sim.rl.environments.setting import setting

from dm_control.rl import control  # isort: skip
from dm_control.utils import containers  # isort: skip

DOMAIN = "orthosis"
SUITE = containers.TaggedTasks()
OWN = ("n_sub_steps", "control_timestep")


class OrthosisEnvironment(control.Environment):
    """dm_control's Environment that gives the muscle callbacks back when it is closed."""

    def close(self) -> None:
        """Free the simulation; a second call does nothing."""
        self.physics.close()


@SUITE.add("orthosis")
def seated_tracking(**kwargs: Any) -> OrthosisEnvironment:
    """Seated, the foot free in the air: the ankle follows a smooth random reference."""
    return _environment("seated_tracking", **kwargs)


@SUITE.add("orthosis")
def dropfoot_walk(**kwargs: Any) -> OrthosisEnvironment:
    """Walking with a drop foot: clear the floor in swing, with little air."""
    return _environment("dropfoot_walk", **kwargs)


ALL_TASKS = tuple((DOMAIN, name) for name in SUITE)


def load(
    task_name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
) -> OrthosisEnvironment:
    """A dm_control environment of a task.

    Units: task_kwargs [s].
    """
    task_of(task_name)
    made: OrthosisEnvironment = SUITE[task_name](
        **dict(task_kwargs or {}), environment_kwargs=environment_kwargs
    )
    return made


def _environment(
    name: str,
    random: Any = None,
    sets: Mapping[str, Any] | None = None,
    time_limit: float | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
) -> OrthosisEnvironment:
    more, task = dict(environment_kwargs or {}), task_of(name)
    if own := [key for key in OWN if key in more]:
        raise InputError("is the task's own", field=own[0], value=more[own[0]], allowed=f"{task.period:g} s")
    limit = task.duration if time_limit is None else time_limit
    if not task.period <= limit <= task.duration:
        allowed = f"{task.period:g} to {task.duration:g} s"
        raise InputError("is out of range", field="time_limit", value=limit, allowed=allowed)
    made = setting(task, sets)
    return OrthosisEnvironment(
        TaskPhysics(made),
        OrthosisTask(made, random, bounded=not more.get("flat_observation")),
        time_limit=limit,
        n_sub_steps=made.steps,
        **more,
    )
