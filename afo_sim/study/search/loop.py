"""The search itself: ask for designs, judge them, tell how they compare, generation by generation."""

import pathlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.study.constraint import Constraint
from afo_sim.study.parameter import Parameter
from afo_sim.study.search import store
from afo_sim.study.search.aim import LACKING, OUTSIDE, Aim, outside
from afo_sim.study.search.answers import Columns, Evaluate
from afo_sim.study.search.evolution import Evolution


@dataclass(frozen=True)
class Problem:
    """What is searched: ranges, constraints on them, and what makes a design good."""

    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...]
    aim: Aim
    seed: int
    population: int | None = None

    def evolution(self) -> Evolution:
        """The optimiser at its start."""
        return Evolution(len(self.parameters), self.seed, self.population)

    def values(self, shares: np.ndarray) -> Columns:
        """{parameter: values (n,) [SI]} of shares from 0 to 1 (n, parameters)."""
        return {p.name: p.spread.at(shares[:, k]) for k, p in enumerate(self.parameters)}  # type: ignore[union-attr]


@dataclass(frozen=True)
class Progress:
    """Generations that are done, how many there will be at most, and the best design so far."""

    generations: int
    most: int
    best: Columns
    feasible: bool


def evolve(
    problem: Problem,
    folder: pathlib.Path,
    generations: int,
    evaluate: Evaluate,
    report: Callable[[Progress], None] | None = None,
) -> tuple[Columns, bool]:
    """Search; killed at any time, the next call goes on from the last finished generation.

    What is in the folder is replayed: the optimiser asks for the same designs again, and is told the same.

    Parameters
    ----------
    problem : what is searched
    folder : where generations are kept
    generations : after which to stop
    evaluate : what the patients make of designs
    report : told after every generation

    Returns
    -------
    (all designs in the order in which they were tried, whether the search has settled)

    Raises
    ------
    InputError
        The folder cannot be written to, or holds designs that this optimiser would not have asked for.
    """
    evolution = problem.evolution()
    done: list[Columns] = []
    while len(done) < generations and not evolution.settled:
        values = problem.values(evolution.ask())
        columns = store.read_generation(folder, len(done))
        if columns is None:
            columns = _judged(problem, len(done), values, evaluate)
            store.write_generation(folder, len(done), columns)
        elif any(not np.array_equal(columns.get(name), values[name]) for name in values):  # type: ignore[arg-type]
            raise InputError(
                f"generation {len(done)} holds other designs than are asked for here: another processor?",
                file=folder,
                allowed="--if-changed restart",
            )
        evolution.tell(problem.aim.ranks(columns))
        done.append(columns)
        if report is not None:
            report(_progress(problem.aim, done, generations))
    return store.joined(done), evolution.settled


def best_of(aim: Aim, columns: Columns) -> int:
    """Row of the best design; of equals the first."""
    return int(np.argmin(aim.ranks(columns)))


def row(columns: Columns, number: int) -> Columns:
    """One design, as a table of one row."""
    return {name: values[number : number + 1] for name, values in columns.items()}


def _judged(problem: Problem, generation: int, values: Columns, evaluate: Evaluate) -> Columns:
    """A generation's table. Designs outside the constraints are not simulated."""
    count = len(next(iter(values.values())))
    off = outside([constraint.excess(values) for constraint in problem.constraints], count)
    judged, reasons = problem.aim.unknown(count), np.full(count, "", dtype=object)
    inside = np.flatnonzero(off == 0.0)
    if len(inside):
        found = evaluate({name: column[inside] for name, column in values.items()})
        for name, column in problem.aim.judge(found.metrics).items():
            judged[name][inside] = column
        reasons[inside] = found.reasons
    numbers = np.arange(generation * count, (generation + 1) * count)
    head = {"generation": np.full(count, generation), "design": numbers}
    return head | values | {OUTSIDE: off, LACKING: judged.pop(LACKING)} | judged | {"reason": reasons}


def _progress(aim: Aim, done: Sequence[Columns], most: int) -> Progress:
    together = store.joined(done)
    best = row(together, best_of(aim, together))
    return Progress(len(done), most, best, bool(aim.feasible(best)[0]))
