"""The loop of a search: CMA-ES proposes designs, the engine simulates them, and their ranks lead on."""

import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import InputError, optional
from afo_sim.simulation import Asked
from afo_sim.study.constraint import Constraint
from afo_sim.study.design import Cases
from afo_sim.study.engine import OK, Jobs
from afo_sim.study.parameter import Parameter
from afo_sim.study.pool import Pool, Report
from afo_sim.study.search import store
from afo_sim.study.search.aim import LACKING, OUTSIDE, Aim

_CHUNK = 20  # cases that a thread or a worker takes at a time

Columns = dict[str, np.ndarray]
START, STEP = 0.5, 0.25  # middle of the cube; standard deviation of the first designs
_CONVERGED = 1e-4  # standard deviation in every direction below which nothing is left to find


@dataclass(frozen=True)
class Answers:
    """{metric: (designs, patients)}, NaN where there is none; of each design why cases failed, or ""."""

    metrics: dict[str, np.ndarray]
    reasons: tuple[str, ...]


Evaluate = Callable[[Columns], Answers]  # {parameter: values (n,) [SI]} → answers of n designs


def answers(
    scenario: Mapping[str, Any], designs: Cases, patients: Cases | None, metrics: Sequence[str], who: Pool
) -> Answers:
    """Simulate every design with every patient."""
    many = len(patients) if patients else 1

    def sets(number: int) -> dict[str, Any]:
        design, patient = divmod(number, many)
        return designs.sets(design) | (patients.sets(patient) if patients else {})

    jobs = Jobs(len(designs) * many, _CHUNK, sets)
    done = who.outcomes(scenario, jobs, range(jobs.count), Asked(frozenset(metrics), doubts=False))
    found = {n: o for c, outcomes in done for n, o in zip(jobs.numbers(c), outcomes, strict=True)}
    shape = len(designs), many
    values = {name: np.full(shape, np.nan) for name in metrics}
    reasons = [""] * len(designs)
    for number in range(jobs.cases):
        design, patient = divmod(number, many)
        outcome = found[number]
        for name in metrics:
            if name in outcome.metrics:
                values[name][design, patient] = outcome.metrics[name].value
        if outcome.status != OK and not reasons[design]:
            which = f"patient {patient}: " if patients else ""
            reasons[design] = f"{which}{outcome.status}: {outcome.reason}"
    return Answers(values, tuple(reasons))


class Evolution:
    """A search by covariance matrix adaptation, on ranks alone.

    Source: Hansen, arXiv:1604.00772; bounds by pycma's smooth transformation of the search space.
    """

    def __init__(self, dimensions: int, seed: int, population: int | None = None):
        cma = optional("cma")
        generator = np.random.default_rng(seed)
        self.dimensions = dimensions
        options = {
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: generator.standard_normal(shape),
            "seed": math.nan,  # leaves NumPy's own generator alone
            "verbose": -9,
            "signals_filename": "",  # no options from whatever file lies in the current folder
            "tolx": _CONVERGED,
            # It is given ranks, of which the best is always the same: they show no progress.
            "tolfun": 0.0,
            "tolfunhist": 0.0,
            "tolxstagnation": False,
            **dict.fromkeys(("tolflatfitness", "tolstagnation"), math.inf),
            **dict.fromkeys(("maxiter", "tolfacupx", "tolupsigma"), math.inf),
        }
        if population is not None:
            options["popsize"] = population
        # cma knows no search along one line: a second direction changes nothing
        self._strategy = cma.CMAEvolutionStrategy([START] * max(dimensions, 2), STEP, options)

    @property
    def population(self) -> int:
        """Designs in a generation."""
        return int(self._strategy.popsize)

    @property
    def converged(self) -> bool:
        """True where the designs have come so close together that nothing is left to find."""
        return bool(self._strategy.stop())

    def ask(self) -> np.ndarray:
        """The next designs (population, dimensions), as shares from 0 to 1."""
        self._asked = self._strategy.ask()
        return np.clip(np.array(self._asked)[:, : self.dimensions], 0.0, 1.0)

    def tell(self, ranks: np.ndarray) -> None:
        """Take the ranks of the designs last asked for (population,): the lower the better."""
        self._strategy.tell(self._asked, [float(rank) for rank in ranks])


@dataclass(frozen=True)
class Problem:
    """The problem of a search: ranges, constraints on them, aim, number of starts."""

    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...]
    aim: Aim
    seed: int
    population: int | None = None
    starts: int = 1

    @property
    def seeds(self) -> list[int]:
        """Of each start; the first one's is the search's own."""
        others = [np.random.SeedSequence([self.seed, k]).generate_state(1)[0] for k in range(1, self.starts)]
        return [self.seed, *map(int, others)]

    def evolutions(self) -> list[Evolution]:
        """The optimiser of each start."""
        return [Evolution(len(self.parameters), seed, self.population) for seed in self.seeds]

    def values(self, shares: np.ndarray) -> Columns:
        """{parameter: values (n,) [SI]} of shares from 0 to 1 (n, parameters)."""
        return {p.name: p.spread.at(shares[:, k]) for k, p in enumerate(self.parameters)}  # type: ignore[union-attr]


def evolve(
    problem: Problem, folder: pathlib.Path, generations: int, evaluate: Evaluate, report: Report | None = None
) -> tuple[Columns, bool]:
    """Search; killed at any time, the next call goes on from the last finished generation."""
    evolutions = problem.evolutions()
    done: list[Columns] = []
    most = generations * len(evolutions)
    for generation in range(generations):
        for start, evolution in enumerate(evolutions):
            if evolution.converged:
                continue
            number, values = generation * problem.starts + start, problem.values(evolution.ask())
            columns = store.read_generation(folder, number)
            if columns is None:
                first = sum(len(each["design"]) for each in done)
                columns = _judged(problem, (generation, start), first, values, evaluate)
                store.write_generation(folder, number, columns)
            elif not all(np.array_equal(columns.get(n, ""), x) for n, x in values.items()):
                seen = f"generation {number} holds other designs than are asked for here"
                raise InputError(f"{seen}: another processor?", file=folder, allowed="`changed=restart`")
            evolution.tell(problem.aim.ranks(columns))
            done.append(columns)
            if report is not None:
                report(len(done), most, f"{len(done)} of {most} generations")
    columns = {name: np.concatenate([each[name] for each in done]) for name in done[0]}
    return columns, all(evolution.converged for evolution in evolutions)


def best_of(aim: Aim, columns: Columns) -> int:
    """Row of the best design; of equals the first."""
    return int(np.argmin(aim.ranks(columns)))


def row(columns: Columns, number: int) -> Columns:
    """One design, as a table of one row."""
    return {name: values[number : number + 1] for name, values in columns.items()}


def _judged(
    problem: Problem, which: tuple[int, int], first: int, values: Columns, evaluate: Evaluate
) -> Columns:
    """A generation's table, its designs numbered from `first`. What is outside the constraints is not run."""
    count = len(next(iter(values.values())))
    excesses = [constraint.excess(values) for constraint in problem.constraints]
    off = np.sum(excesses, axis=0) if excesses else np.zeros(count)  # from within all constraints
    judged, reasons = problem.aim.unknown(count), np.full(count, "", dtype=object)
    inside = np.flatnonzero(off == 0.0)
    if len(inside):
        found = evaluate({name: column[inside] for name, column in values.items()})
        for name, column in problem.aim.judge(found.metrics).items():
            judged[name][inside] = column
        reasons[inside] = found.reasons
    head = {name: np.full(count, value) for name, value in zip(("generation", "start"), which, strict=True)}
    head["design"] = np.arange(first, first + count)
    return head | values | {OUTSIDE: off, LACKING: judged.pop(LACKING)} | judged | {"reason": reasons}
