"""Gymnasium and dm_control environments on a scenario; importing registers the tasks in Gymnasium."""

from afo_sim.rl.environments.tasks import TASKS


def gym_id(name: str) -> str:
    """Gymnasium's name of a task: "afo_sim/SeatedTracking-v0"."""
    return f"afo_sim/{''.join(word.title() for word in name.split('_'))}-v{TASKS[name].version}"


def register() -> None:
    """Register all tasks; nothing where Gymnasium is missing."""
    try:
        from gymnasium.envs.registration import register as add
        from gymnasium.envs.registration import registry
    except ImportError:
        return
    for name in TASKS:
        if gym_id(name) not in registry:
            add(
                gym_id(name),
                entry_point=f"{__name__}.gym_env:OrthosisEnv",
                vector_entry_point=f"{__name__}.gym_env:OrthosisVectorEnv",
                kwargs={"task": name},
            )
    if "afo_sim/DropfootDay-v0" not in registry:
        refused = f"{__name__}.tasks:retired_day"
        add("afo_sim/DropfootDay-v0", entry_point=refused, vector_entry_point=refused)


register()
