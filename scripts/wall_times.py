"""Times that a user waits: commands in processes of their own, with an empty cache folder and a full one."""

import tempfile
from collections.abc import Callable, Sequence

from measuring import Figure, Spent, figure, process

RUN = ("-m", "afo_sim", "run", "seated", "--out", "{out}")
COMMANDS: dict[str, tuple[str, ...]] = {
    "afo-sim run": RUN,
    "afo-sim run --no-rrd": (*RUN, "--no-rrd"),
    "import and load": ("-c", "import afo_sim; afo_sim.load('scenario', 'seated')"),
    "afo-sim --help": ("-m", "afo_sim", "--help"),
    "callbacks alone": ("-c", "from afo_sim import native\nwith native.installed(): pass"),
}
VARIABLE = "AFO_SIM_CACHE"


def waits(command: Sequence[str], warm: int) -> tuple[Spent, list[Spent]]:
    """One command with an empty cache folder, then again and again with what it has left there."""
    with tempfile.TemporaryDirectory() as cache:

        def once() -> Spent:
            with tempfile.TemporaryDirectory() as out:
                return process([word.format(out=f"{out}/run") for word in command], {VARIABLE: cache})

        return once(), [once() for _ in range(warm)]


def wall_times(repeats: int, cold: int = 2) -> list[Figure]:
    """Wall and processor times of the commands [s].

    Parameters
    ----------
    repeats : of each command with a full cache, in all
    cold : empty cache folders that each command meets; their rounds take turns
    """
    process(
        ("-c", "import afo_sim.cli.common, rerun, mujoco, scipy.optimize")
    )  # Python's own caches and the disk's
    first: dict[str, list[Spent]] = {name: [] for name in COMMANDS}
    later: dict[str, list[Spent]] = {name: [] for name in COMMANDS}
    for _ in range(cold):
        for name, command in COMMANDS.items():
            start, rest = waits(command, max(repeats // cold, 1))
            first[name].append(start)
            later[name] += rest
    kinds: dict[str, Callable[[Spent], float]] = {
        "wall": lambda s: s.wall,
        "processor": lambda s: s.processor,
    }
    return [
        figure(f"{name}, {state}, {kind}", "s", "lower", [read(s) for s in found[name]])
        for name in COMMANDS
        for state, found in (("cold", first), ("warm", later))
        for kind, read in kinds.items()
    ]
