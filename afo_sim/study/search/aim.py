"""Aim of a search: an objective over the patients, and limits that a share of them must keep."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

OUTSIDE, LACKING, OBJECTIVE = "outside", "lacking", "objective"
OF_LIMIT = ("level", "kept", "short")  # columns of each


@dataclass(frozen=True)
class Objective:
    """The metric that is to be lowest or highest, `over` the patients: their mean, median or worst."""

    metric: str
    goal: Literal["lowest", "highest"]
    over: Literal["mean", "median", "worst"] = "mean"

    def of(self, values: np.ndarray) -> np.ndarray:
        """Of designs (n,), of the metric (n, patients); NaN where any patient's is."""
        if self.over == "mean":
            return np.asarray(np.mean(values, axis=1))
        if self.over == "median":
            return np.asarray(np.median(values, axis=1))
        return np.asarray((np.max if self.goal == "lowest" else np.min)(values, axis=1))


@dataclass(frozen=True)
class StatedLimit:
    """At least, or at most, `bound` in a `share` of the patients; the bound as it is written."""

    metric: str
    at_least: bool
    bound: Any
    share: float = 1.0
    number: int = 1

    @property
    def option(self) -> str:
        """The option that holds the bound."""
        return "at_least" if self.at_least else "at_most"

    @property
    def name(self) -> str:
        """For columns: toe_clearance_at_least, toe_clearance_at_least_2."""
        return f"{self.metric}_{self.option}" + (f"_{self.number}" if self.number > 1 else "")


@dataclass(frozen=True)
class Limit(StatedLimit):
    """A limit whose bound is in the metric's unit.

    Source: Weibull's plotting position: Gumbel 1958, Statistics of Extremes, section 1.2.7
    """

    sampled: bool = False

    def spare(self, patients: int) -> int:
        """Number of the patients that need not keep it."""
        if self.sampled:
            return max(math.floor((1.0 - self.share) * (patients + 1) + 1e-9) - 1, 0)
        return patients - math.ceil(self.share * patients - 1e-9)

    def level(self, values: np.ndarray) -> float:
        """The best bound that the share of the patients keeps; NaN where too few have a value."""
        spare = self.spare(len(values)) - int(np.count_nonzero(np.isnan(values)))
        if spare < 0:
            return math.nan
        known = np.sort(values[~np.isnan(values)])
        return float(known[spare] if self.at_least else known[-1 - spare])

    def kept(self, values: np.ndarray) -> float:
        """The share of the patients (patients,) that keep it."""
        return float(np.mean(values >= self.bound if self.at_least else values <= self.bound))

    def short(self, level: float) -> float:
        """Shortfall of a level [the metric's unit]; 0 where it keeps the bound."""
        return max(self.bound - level if self.at_least else level - self.bound, 0.0)


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
        found = {
            OBJECTIVE: self.objective.of(goal),
            LACKING: np.count_nonzero(np.isnan(goal), axis=1).astype(np.int64),
        }
        for limit in self.limits:
            values = metrics[limit.metric]
            missing = np.count_nonzero(np.isnan(values), axis=1)
            found[LACKING] += np.maximum(missing - limit.spare(values.shape[1]), 0)
            levels = np.array([limit.level(row) for row in values])
            found[f"{limit.name}_level"] = levels
            found[f"{limit.name}_kept"] = np.array([limit.kept(row) for row in values])
            found[f"{limit.name}_short"] = np.array([limit.short(level) for level in levels])
        return found

    def unknown(self, count: int) -> dict[str, np.ndarray]:
        """The columns of `judge` of designs that were not simulated."""
        names = [f"{limit.name}_{what}" for limit in self.limits for what in OF_LIMIT]
        found = {name: np.full(count, math.nan) for name in (OBJECTIVE, *names)}
        return found | {LACKING: np.zeros(count, np.int64)}

    def violation(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Shortfall of designs over all limits (n,), of each as a share of the largest."""
        total = np.zeros(len(columns[OBJECTIVE]))
        for limit in self.limits:
            short = np.nan_to_num(columns[f"{limit.name}_short"])
            total += short / (np.max(short, initial=0.0) or 1.0)
        return total

    def ranks(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Rank of designs (n,): 0 is the best; equals share a rank.

        Source: Deb 2000, doi 10.1016/S0045-7825(99)00389-8
        """
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
