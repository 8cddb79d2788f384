"""Aim of a search: an objective over the patients, and limits that a share of them must keep; its problem."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from afo_sim.common import Function, Mixed
from afo_sim.study.constraint import Constraint
from afo_sim.study.parameter import Parameter

Columns = dict[str, np.ndarray]
OUTSIDE, LACKING, OBJECTIVE, PATIENT = "outside", "lacking", "objective", "patient"
OF_LIMIT = ("level", "kept", "short")  # columns of each


@dataclass(frozen=True)
class Objective:
    """The metric that is to be lowest or highest, `over` the patients: their mean, median or worst."""

    metric: str
    goal: Literal["lowest", "highest"]
    over: Literal["mean", "median", "worst"] = "mean"

    def of(self, values: np.ndarray) -> np.ndarray:
        """Of designs (n,), of the metric (n, patients); NaN where any patient's is."""
        worst = np.max if self.goal == "lowest" else np.min
        ways: dict[str, Function] = {"mean": np.mean, "median": np.median, "worst": worst}
        return np.asarray(ways[self.over](values, axis=1))


@dataclass(frozen=True)
class Limit:
    """At least, or at most, `bound` in a `share` of the patients; as written, then in the metric's unit."""

    metric: str
    at_least: bool
    bound: Mixed
    share: float = 1.0
    number: int = 1
    sampled: bool = False

    @property
    def option(self) -> str:
        """The option that holds the bound."""
        return "at_least" if self.at_least else "at_most"

    @property
    def name(self) -> str:
        """For columns: toe_clearance_at_least, toe_clearance_at_least_2."""
        return f"{self.metric}_{self.option}" + (f"_{self.number}" if self.number > 1 else "")

    def spare(self, patients: int) -> int:
        """Number of the patients that need not keep it."""
        if self.sampled:
            return max(math.floor((1.0 - self.share) * (patients + 1) + 1e-9) - 1, 0)
        return patients - math.ceil(self.share * patients - 1e-9)

    def level(self, values: np.ndarray) -> np.ndarray:
        """The best bound that the share of the patients (…, patients) keeps; NaN where values lack."""
        many, spare = values.shape[-1], self.spare(values.shape[-1])
        place = spare - np.count_nonzero(np.isnan(values), axis=-1)  # among the known ones
        taken = np.maximum(place, 0) if self.at_least else np.full_like(place, many - 1 - spare)
        known = np.take_along_axis(np.sort(values, axis=-1), np.expand_dims(taken, -1), -1)[..., 0]
        return np.where(place < 0, math.nan, known)

    def kept(self, values: np.ndarray) -> np.ndarray:
        """The share of the patients (…, patients) that keep it."""
        return np.asarray(np.mean(values >= self.bound if self.at_least else values <= self.bound, axis=-1))

    def short(self, level: np.ndarray) -> np.ndarray:
        """Shortfall of levels [the metric's unit]; 0 where they keep the bound."""
        return np.maximum(self.bound - level if self.at_least else level - self.bound, 0.0)


@dataclass(frozen=True)
class Aim:
    """Objective and limits."""

    objective: Objective
    limits: tuple[Limit, ...] = ()

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that it looks at."""
        return tuple(dict.fromkeys([self.objective.metric, *(limit.metric for limit in self.limits)]))

    def judge(self, metrics: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Objective, limits and gaps of designs."""
        goal = metrics[self.objective.metric]
        lacking = np.count_nonzero(np.isnan(goal), axis=1).astype(np.int64)
        found = {OBJECTIVE: self.objective.of(goal), LACKING: lacking}
        for limit in self.limits:
            values = metrics[limit.metric]
            missing = np.count_nonzero(np.isnan(values), axis=1)
            found[LACKING] += np.maximum(missing - limit.spare(values.shape[1]), 0)
            found[f"{limit.name}_level"] = levels = limit.level(values)
            found[f"{limit.name}_kept"] = limit.kept(values)
            found[f"{limit.name}_short"] = limit.short(levels)
        return found

    def violation(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Shortfall of designs over all limits (n,), of each as a share of the largest."""
        total = np.zeros(len(columns[OBJECTIVE]))
        for limit in self.limits:
            short = np.nan_to_num(columns[f"{limit.name}_short"])
            total += short / (np.max(short, initial=0.0) or 1.0)
        return total

    def ranks(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Rank of designs (n,): 0 is the best; equals share a rank (Deb 2000: S0045-7825(99)00389-8)."""
        sign = 1.0 if self.objective.goal == "lowest" else -1.0
        cost = np.where(self.feasible(columns), sign * columns[OBJECTIVE], 0.0)
        keys = np.column_stack([columns[OUTSIDE], columns[LACKING], self.violation(columns), cost])
        order = np.lexsort(keys.T[::-1])
        new = np.any(keys[order][1:] != keys[order][:-1], axis=1)
        found = np.zeros(len(order), np.int64)
        found[order[1:]] = np.maximum.accumulate(np.where(new, np.arange(1, len(order)), 0))
        return found

    def feasible(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Mask of the designs that keep everything (n,)."""
        return (columns[OUTSIDE] == 0.0) & (columns[LACKING] == 0) & (self.violation(columns) == 0.0)


@dataclass(frozen=True)
class Problem:
    """The problem of a search: ranges, constraints on them, aim, number of starts, traits of the patients."""

    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...]
    aim: Aim
    seed: int
    population: int | None = None
    starts: int = 1
    method: str = "surrogate"
    # of each patient in standard deviations (patients, traits); a single one has none
    traits: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))

    @property
    def seeds(self) -> list[int]:
        """Of each start; the first one's is the search's own."""
        others = [np.random.SeedSequence([self.seed, k]).generate_state(1)[0] for k in range(1, self.starts)]
        return [self.seed, *map(int, others)]

    def values(self, shares: np.ndarray) -> Columns:
        """{parameter: values (n,) [SI]} of shares from 0 to 1 (n, parameters)."""
        return {p.name: p.range.at(shares[:, k]) for k, p in enumerate(self.parameters)}

    def outside(self, values: Columns) -> np.ndarray:
        """Distance of designs from within all constraints (n,)."""
        none = np.zeros(len(next(iter(values.values()))))
        return np.sum([none, *(constraint.excess(values) for constraint in self.constraints)], axis=0)


def best_of(aim: Aim, columns: Columns) -> int:
    """Row of the best design; of equals the first."""
    return int(np.argmin(aim.ranks(columns)))


def row(columns: Columns, number: int) -> Columns:
    """One design, as a table of one row."""
    return {name: values[number : number + 1] for name, values in columns.items()}
