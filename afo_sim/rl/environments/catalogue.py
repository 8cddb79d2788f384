"""The tasks by name."""

from afo_sim.common.errors import unknown
from afo_sim.rl.environments.dropfoot_walk import TASK as DROPFOOT_WALK
from afo_sim.rl.environments.seated_tracking import TASK as SEATED_TRACKING
from afo_sim.rl.environments.task import Task

TASKS = {task.name: task for task in (SEATED_TRACKING, DROPFOOT_WALK)}


def task_of(name: str) -> Task:
    """A task by its name; InputError where there is none."""
    if name not in TASKS:
        raise unknown(name, list(TASKS), field="task", problem="there is no such task")
    return TASKS[name]
