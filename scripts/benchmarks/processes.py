"""Processes of their own: times that a user waits, and the peak memory of a sweep of short cases.

A command meets an empty cache folder, then one that is full. Memory is watched over the number of cases.
"""

import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence

from measuring import Figure, Spent, figure, process

from afo_sim.study import engine

RUN = ("-m", "afo_sim", "run", "seated", "--out", "{out}")
COMMANDS: dict[str, tuple[str, ...]] = {
    "afo-sim run": RUN,
    "afo-sim run --no-rrd": (*RUN, "--no-rrd"),
    "import and load": ("-c", "import afo_sim; afo_sim.load('scenario', 'seated')"),
    "afo-sim --help": ("-m", "afo_sim", "--help"),
    "callbacks alone": ("-c", "from afo_sim import native\nwith native.installed(): pass"),
}
VARIABLE = "AFO_SIM_CACHE"
SHORT = {"duration": "0.5 s"}
WARM = 0.25  # of the cases, after which memory should grow no more


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


def memory(count: int) -> list[Figure]:
    """Peak memory after all cases, its growth from the first quarter of them on, and cases per second.

    Parameters
    ----------
    count : cases
    """
    command = [sys.executable, str(pathlib.Path(__file__)), str(count)]
    said = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return [
        figure(f"peak memory, {count} short cases", "MB", "lower", said["peak"]),
        figure(f"growth, last {1 - WARM:.0%} of {count}", "MB", "", said["growth"]),
        figure(f"short cases, {count}, 2 threads", "cases/s", "higher", said["rate"]),
    ]


def measured(count: int) -> dict[str, float]:
    """The numbers of `memory`, of this process."""
    cases = ((k, {**SHORT, "supply.pressure": f"{2.0 + 2.0 * k / count:.6f} bar"}) for k in range(count))
    early = _peak()
    begun = time.perf_counter()
    for done, _ in enumerate(engine.outcomes("seated", cases, 2), start=1):
        if done == int(WARM * count):
            early = _peak()
    seconds = time.perf_counter() - begun
    return {"peak": _peak(), "growth": _peak() - early, "rate": count / seconds}


def _peak() -> float:
    """The most memory that this process has had [MB]."""
    status = pathlib.Path("/proc/self/status")
    if status.exists():  # getrusage would tell of the process that started this one, too
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return float(line.split()[1]) / 1e3
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


if __name__ == "__main__":
    print(json.dumps(measured(int(sys.argv[1]))))
