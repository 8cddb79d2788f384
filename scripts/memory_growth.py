"""Peak memory of a sweep of short cases in a process of its own, and how it grows with their number."""

import json
import pathlib
import resource
import subprocess
import sys
import time

from measuring import Figure, figure

from afo_sim.study import engine

SHORT = {"duration": "0.5 s"}
WARM = 0.25  # of the cases, after which memory should grow no more


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
