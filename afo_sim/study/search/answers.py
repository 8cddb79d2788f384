"""Every design of a search simulated with every patient, by the sweeps' engine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.simulation.examine import Asked
from afo_sim.study.design import Cases
from afo_sim.study.engine import OK
from afo_sim.study.pool import Pool

CHUNK = 20  # cases that a thread or a worker takes at a time

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Answers:
    """{metric: (designs, patients)}, NaN where there is none; of each design why cases failed, or ""."""

    metrics: dict[str, np.ndarray]
    reasons: tuple[str, ...]


Evaluate = Callable[[Columns], Answers]  # {parameter: values (n,) [SI]} → answers of n designs


def answers(
    scenario: Mapping[str, Any],
    designs: Cases,
    patients: Cases | None,
    metrics: Sequence[str],
    who: Pool,
) -> Answers:
    """Simulate every design with every patient."""
    jobs = _Jobs(designs, patients)
    many, chunks = jobs.many, range(-(-len(jobs) // CHUNK))
    done = who.outcomes(scenario, jobs, chunks, asked=Asked(frozenset(metrics), doubts=False))
    found = {n: o for c, outcomes in done for n, o in zip(jobs.numbers(c), outcomes, strict=True)}
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
    """Designs times patients as numbered cases."""

    chunk = CHUNK

    def __init__(self, designs: Cases, patients: Cases | None):
        self.designs, self.patients = designs, patients
        self.many = len(patients) if patients else 1

    def __len__(self) -> int:
        return len(self.designs) * self.many

    def sets(self, number: int) -> dict[str, Any]:
        design, patient = divmod(number, self.many)
        own = self.patients.sets(patient) if self.patients else {}
        return self.designs.sets(design) | own

    def numbers(self, chunk: int) -> range:
        return range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(self)))
