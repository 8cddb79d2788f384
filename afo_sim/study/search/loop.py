"""The loop of a search: a method proposes designs, the engine simulates them, and the result leads on."""

import math
import pathlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, JsonDict, JsonMapping, disk, keeping, optional
from afo_sim.simulation import Asked
from afo_sim.study.design import Cases
from afo_sim.study.engine import OK, Jobs
from afo_sim.study.folder import AGAIN
from afo_sim.study.pool import Pool, Report
from afo_sim.study.search import store
from afo_sim.study.search.aim import LACKING, OUTSIDE, PATIENT, Columns, Problem
from afo_sim.study.search.surrogate import Surrogate

_CHUNK = 20  # cases that a thread or a worker takes at a time

START, STEP = 0.5, 0.25  # middle of the cube; standard deviation of the first designs
_CONVERGED = 1e-4  # standard deviation in every direction below which nothing is left to find


@dataclass(frozen=True)
class Answers:
    """{metric: (designs, patients)}, NaN where there is none; of each design why cases failed, or ""."""

    metrics: dict[str, np.ndarray]
    reasons: tuple[str, ...]


# {parameter: values (n,) [SI]} and the patient of each design (n,), -1 for all → answers of n designs
Evaluate = Callable[[Columns, np.ndarray], Answers]


def answers(
    scenario: JsonMapping, designs: Cases, patients: Cases | None, metrics: Sequence[str], who: Pool,
    only: np.ndarray | None = None,
) -> Answers:  # fmt: skip
    """Simulate every design with every patient, or with the one of `only` (designs,) where that is not -1."""
    many = len(patients) if patients else 1
    alone = np.full(len(designs), -1) if only is None else only
    runs = [(d, p) for d, one in enumerate(alone) for p in (range(many) if one < 0 else (int(one),))]

    def sets(number: int) -> JsonDict:
        design, patient = runs[number]
        return designs.sets(design) | (patients.sets(patient) if patients else {})

    jobs = Jobs(len(runs), _CHUNK, sets)
    asked = Asked(frozenset(metrics), doubts=False, walkers=designs.plan.walkers)
    done = who.outcomes(scenario, jobs, range(jobs.count), asked)
    found = {n: o for c, outcomes in done for n, o in zip(jobs.numbers(c), outcomes, strict=True)}
    values = {name: np.full((len(designs), many), np.nan) for name in metrics}
    reasons = [""] * len(designs)
    for number, (design, patient) in enumerate(runs):
        outcome = found[number]
        for name in metrics:
            if name in outcome.metrics:
                values[name][design, patient] = outcome.metrics[name].value
        if outcome.status != OK and not reasons[design]:
            which = f"patient {patient}: " if patients else ""
            reasons[design] = f"{which}{outcome.status}: {outcome.reason}"
    return Answers(values, tuple(reasons))


class Evolution:
    """A search by covariance matrix adaptation (Hansen, arXiv:1604.00772), on ranks; pycma keeps bounds."""

    def __init__(self, problem: Problem, seed: int):
        cma = optional("cma")
        generator = np.random.default_rng(seed)
        self.problem, dimensions = problem, len(problem.parameters)
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
        if problem.population is not None:
            options["popsize"] = problem.population
        # cma knows no search along one line: a second direction changes nothing
        self._strategy = cma.CMAEvolutionStrategy([START] * max(dimensions, 2), STEP, options)

    def runs(self, generations: int) -> int:
        """Simulations of that many generations at most."""
        return generations * int(self._strategy.popsize) * len(self.problem.traits)

    @property
    def converged(self) -> bool:
        """True where the designs have come so close together that nothing is left to find."""
        return bool(self._strategy.stop())

    def ask(self) -> tuple[np.ndarray, np.ndarray]:
        """The next designs as shares from 0 to 1 (n, dimensions), each with all patients: -1 (n,)."""
        self._asked = self._strategy.ask()
        shares = np.array(self._asked)[:, : len(self.problem.parameters)]
        return np.clip(shares, 0.0, 1.0), np.full(len(shares), -1)

    def tell(self, columns: Columns) -> None:
        """Take the ranks of the last requested designs."""
        self._strategy.tell(self._asked, self.problem.aim.ranks(columns).astype(np.float64).tolist())


METHODS: dict[str, type[Evolution] | type[Surrogate]] = {"surrogate": Surrogate, "cma-es": Evolution}


def evolve(
    problem: Problem, folder: pathlib.Path, generations: int, evaluate: Evaluate, report: Report | None = None
) -> tuple[Columns, bool, int]:
    """Designs run with all patients, whether the search has converged, and runs; resumable."""
    starts = [METHODS[problem.method](problem, seed) for seed in problem.seeds]
    done: list[Columns] = []
    most, designs = generations * len(starts), 0
    for generation in range(generations):
        for start, method in enumerate(starts):
            if method.converged:
                continue
            number, (shares, patients) = generation * problem.starts + start, method.ask()
            asked = problem.values(shares) | {PATIENT: patients}
            path = store.SEARCH.part(folder, number)
            if not path.is_file():
                columns = _judged(problem, (generation, start), designs, asked, evaluate)
                with disk(folder, AGAIN), keeping(path) as part:
                    store.write_table(part, columns, "generation", {}, {})
            else:
                columns = store.read_table(path)
                if not all(np.array_equal(columns.get(n, ""), x) for n, x in asked.items()):
                    seen = f"generation {number} holds other designs than are asked for here"
                    raise InputError(f"{seen}: another processor?", file=folder, allowed=store.RESTART)
            method.tell(columns)
            done.append(columns)
            designs += int(np.count_nonzero(patients < 0))
            if report is not None:
                report(len(done), most, f"{len(done)} of {most} generations")
    columns = {name: np.concatenate([each[name] for each in done]) for name in done[0]}
    whole, found = columns[PATIENT] < 0, [name for name in columns if name != PATIENT and "/" not in name]
    run = np.where(whole, len(problem.traits), 1)[columns[OUTSIDE] == 0.0]
    return {n: columns[n][whole] for n in found}, all(s.converged for s in starts), int(np.sum(run))


def _judged(
    problem: Problem, which: tuple[int, int], first: int, asked: Columns, evaluate: Evaluate
) -> Columns:
    """A generation's table and its runs' metrics; designs with all patients are numbered, others -1."""
    patients = asked[PATIENT]
    values = {name: column for name, column in asked.items() if name != PATIENT}
    count, whole, off = len(patients), patients < 0, problem.outside(values)
    reasons = np.full(count, "", dtype=object)
    runs = np.full((len(problem.aim.metrics), count, len(problem.traits)), np.nan)  # of metrics, patients
    inside = np.flatnonzero(off == 0.0)
    if len(inside):
        found = evaluate({name: column[inside] for name, column in values.items()}, patients[inside])
        runs[:, inside] = [found.metrics[name] for name in problem.aim.metrics]
        reasons[inside] = found.reasons
    known = whole & (off == 0.0)
    judged = problem.aim.judge(dict(zip(problem.aim.metrics, runs, strict=True)))
    judged = {name: np.where(known, c, 0 if name == LACKING else np.nan) for name, c in judged.items()}
    head = {name: np.full(count, value) for name, value in zip(("generation", "start"), which, strict=True)}
    head["design"] = np.where(whole, first + np.cumsum(whole) - 1, -1)
    names = [f"{name}/{k}" for name in problem.aim.metrics for k in range(len(problem.traits))]
    of_runs = dict(zip(names, np.moveaxis(runs, 2, 1).reshape(-1, count), strict=True))
    table = head | values | {OUTSIDE: off, LACKING: judged.pop(LACKING)} | judged | {"reason": reasons}
    return table | {PATIENT: patients} | of_runs
