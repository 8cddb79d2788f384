"""What the patients make of designs: every design simulated with every patient, by the sweeps' engine."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from afo_sim.study import cluster, engine
from afo_sim.study.design import Cases
from afo_sim.study.engine import OK, Outcome
from afo_sim.study.store import Store

CHUNK = 32  # cases that a thread or a worker takes at a time

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Answers:
    """{metric: (designs, patients)}, NaN where there is none; of each design why cases failed, or ""."""

    metrics: dict[str, np.ndarray]
    reasons: tuple[str, ...]


Evaluate = Callable[[Columns], Answers]  # {parameter: values (n,) [SI]} → answers of n designs


@dataclass(frozen=True)
class Pool:
    """Who simulates: threads of this process, or the Dask cluster at an address."""

    threads: int = 1
    scheduler: str = ""


@contextmanager
def pool(threads: int, workers: int, scheduler: str) -> Iterator[Pool]:
    """Threads, or a cluster: of so many workers on this machine, or the one at an address.

    Raises
    ------
    InputError
        Dask is not installed.
    """
    if scheduler or not workers:
        yield Pool(threads, scheduler)
        return
    with cluster.library().LocalCluster(**cluster.local_options(workers)) as local:
        yield Pool(threads, local.scheduler_address)


def answers(
    scenario: Mapping[str, Any],
    designs: Cases,
    patients: Cases | None,
    metrics: Sequence[str],
    who: Pool,
) -> Answers:
    """Simulate every design with every patient.

    Parameters
    ----------
    scenario : what all cases begin with
    designs : to be judged
    patients : the same for all designs; the scenario's own alone if None
    metrics : that are looked at
    who : simulates; the answers are, bit for bit, the same whoever does

    Raises
    ------
    InputError
        The cluster cannot be reached, or its workers die over and over.
    """
    many = len(patients) if patients else 1
    jobs = _Jobs(designs, patients)
    found = dict(_outcomes(scenario, jobs, who))
    shape = len(designs), many
    values = {name: np.full(shape, np.nan) for name in metrics}
    reasons = [""] * len(designs)
    for number in range(len(jobs)):
        design, patient = divmod(number, many)
        outcome = found[number]
        for name in metrics:
            if name in outcome.metrics:
                values[name][design, patient] = outcome.metrics[name].value
        if outcome.status != OK and not reasons[design]:
            which = f"patient {patient}: " if patients else ""
            reasons[design] = f"{which}{outcome.status}: {outcome.reason}"
    return Answers(values, tuple(reasons))


class _Jobs:
    """Designs times patients as numbered cases, in the form in which a cluster takes a sweep's."""

    def __init__(self, designs: Cases, patients: Cases | None):
        self.designs, self.patients = designs, patients
        self.many = len(patients) if patients else 1
        self.cases = self

    def __len__(self) -> int:
        return len(self.designs) * self.many

    def sets(self, number: int) -> dict[str, Any]:
        design, patient = divmod(number, self.many)
        own = self.patients.sets(patient) if self.patients else {}
        return self.designs.sets(design) | own

    def numbers(self, chunk: int) -> range:
        return range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(self)))


def _outcomes(scenario: Mapping[str, Any], jobs: _Jobs, who: Pool) -> Iterator[tuple[int, Outcome]]:
    if not who.scheduler:
        cases = ((number, jobs.sets(number)) for number in range(len(jobs)))
        yield from engine.outcomes(scenario, cases, who.threads, CHUNK)
        return
    pending = list(range(-(-len(jobs) // CHUNK)))
    for chunk, outcomes in cluster.chunks(scenario, cast(Store, jobs), pending, 0, who.scheduler):
        yield from zip(jobs.numbers(chunk), outcomes, strict=True)
