"""Simulation of a study's cases by threads of this process, or by a Dask cluster."""

import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from afo_sim.simulation.examine import EVERYTHING, Asked
from afo_sim.study import cluster, engine
from afo_sim.study.engine import Jobs, Outcome

Evaluate = Callable[
    [Mapping[str, Any], Iterable[tuple[int, Mapping[str, Any]]], int, int, Asked],
    Iterator[tuple[int, Outcome]],
]  # as engine.outcomes


@dataclass(frozen=True)
class Pool:
    """Threads of this process, or the Dask cluster at an address."""

    threads: int = 1
    scheduler: str = ""

    def outcomes(
        self,
        scenario: Mapping[str, Any],
        jobs: Jobs,
        due: Iterable[int],
        evaluate: Evaluate = engine.outcomes,
        asked: Asked = EVERYTHING,
    ) -> Generator[tuple[int, list[Outcome]], None, None]:
        """(chunk, its outcomes), in no particular order; bit for bit the same whoever computes."""
        if self.scheduler:
            yield from cluster.chunks(scenario, jobs, due, self.scheduler, asked)
            return
        cases = ((number, jobs.sets(number)) for chunk in due for number in jobs.numbers(chunk))
        found: dict[int, dict[int, Outcome]] = {}
        for number, outcome in evaluate(scenario, cases, self.threads, jobs.chunk, asked):
            chunk = number // jobs.chunk
            rows = found.setdefault(chunk, {})
            rows[number] = outcome
            if len(rows) == len(jobs.numbers(chunk)):
                yield chunk, [rows[number] for number in jobs.numbers(chunk)]
                del found[chunk]


@contextmanager
def pool(threads: int = 0, workers: int = 0, scheduler: str = "") -> Iterator[Pool]:
    """Threads, or a cluster: of so many workers on this machine, or the one at an address.

    Parameters
    ----------
    threads : of this process, unless there are workers or a scheduler; as many as processors if 0
    workers : processes of a Dask cluster made for this
    scheduler : address of a running Dask cluster

    Raises
    ------
    InputError
        Dask is not installed.
    """
    if scheduler or not workers:
        yield Pool(threads or processors(), scheduler)
        return
    with cluster.library().LocalCluster(**cluster.local_options(workers)) as local:
        yield Pool(threads, local.scheduler_address)


def processors() -> int:
    """That this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
