"""The tasks' names in Gymnasium: registered by `import afo_sim.rl.environments`."""

from afo_sim.rl.environments.catalogue import TASKS

ROOM = "afo_sim.rl.environments"


def gym_id(name: str) -> str:
    """Gymnasium's name of a task: "afo_sim/SeatedTracking-v0"."""
    return f"afo_sim/{''.join(word.title() for word in name.split('_'))}-v0"


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
                entry_point=f"{ROOM}.gym_env:OrthosisEnv",
                vector_entry_point=f"{ROOM}.gym_vector:OrthosisVectorEnv",
                kwargs={"task": name},
            )
