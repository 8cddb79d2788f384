"""Joint draws of what is not known: all at once, each as probable as it is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.stats import qmc

from afo_sim.common.errors import InputError
from afo_sim.common.units import format_quantity
from afo_sim.description.keys import field_at
from afo_sim.description.scenario import Scenario
from afo_sim.study.uncertainty.held import Fit, Held, Unknown, fitted
from afo_sim.study.uncertainty.spreads import SpreadTable

MOST_TRIES = 200  # times that a draw which is no muscle is drawn anew


@dataclass(frozen=True, eq=False)
class Column:
    """The drawn values of one or several keys that have one value; without keys a height [m].

    `table` is that which it is drawn by; `own` the value in the middle [SI]; `values` are (n,).
    """

    name: str
    keys: tuple[str, ...]
    unit: str
    own: float
    values: np.ndarray
    table: SpreadTable


@dataclass(frozen=True, eq=False)
class Group:
    """What one measurement would tell, or one thing that varies: its standard normal deviates (n, k)."""

    name: str
    each_stride: bool
    measure: str
    deviates: np.ndarray


@dataclass(frozen=True, eq=False)
class Draws:
    """Joint draws; `rejected` counts those that were no muscle and were drawn anew."""

    count: int
    seed: int
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    rejected: int
    left_out: tuple[str, ...]
    notes: tuple[str, ...]

    def sets(self, draw: int) -> dict[str, Any]:
        """The overrides of one draw by dotted key, as `load` takes them."""
        return {
            key: format_quantity(float(column.values[draw]), column.unit)
            for column in self.columns
            for key in column.keys
        }

    def heights(self, *, each_stride: bool) -> np.ndarray:
        """What is added to every height of the sole [m] (n,): what varies, or what is not known."""
        found = [c.values for c in self.columns if not c.keys and c.table.each_stride is each_stride]
        return np.sum([np.zeros(self.count), *found], axis=0)


def draw(held: Held, scenario: Scenario, count: int, seed: int = 0) -> Draws:
    """Draw together whatever spreads.

    Unknowns and fits are independent of each other: a Latin hypercube in as many dimensions as they have
    deviates. The numbers of a fit follow its covariance; draws that are no muscle are rejected whole and
    drawn anew, for clipping would heap them up at a bound, against their correlations.
    """
    widths = [1] * len(held.unknowns) + [len(fitted(fit.muscle)) for fit in held.fits]
    if not widths:
        raise InputError("this scenario has nothing of what the spreads tell", field="spreads")
    generator = np.random.default_rng(seed)
    share = qmc.LatinHypercube(sum(widths), seed=generator).random(count)
    deviates = stats.norm.ppf(share)
    parts = np.split(deviates, np.cumsum(widths)[:-1], axis=1)
    columns: list[Column] = []
    owners: list[tuple[str, SpreadTable, np.ndarray]] = []
    rejected = 0
    for unknown, part in zip(held.unknowns, parts, strict=False):
        columns += _columns(unknown, part[:, 0])
        owners.append((unknown.name, unknown.table, part))
    for fit, part in zip(held.fits, parts[len(held.unknowns) :], strict=True):
        legal, again = _legal(fit, part, generator)
        rejected += again
        columns += _of_fit(fit, legal, scenario)
        owners.append((fit.name, fit.table, legal))
    return Draws(count, seed, tuple(columns), tuple(_groups(owners)), rejected, held.left_out, held.notes)


def _columns(unknown: Unknown, deviates: np.ndarray) -> Iterator[Column]:
    """An unknown's values; one whose keys have several own values has a column for each."""
    many = len(unknown.targets) > 1
    for k, target in enumerate(unknown.targets, start=1):
        name = f"{unknown.name}_{k}" if many else unknown.name
        values = target.distribution.at(deviates, target.own)
        yield Column(name, target.keys, target.unit, target.own, values, unknown.table)


def _legal(fit: Fit, deviates: np.ndarray, generator: np.random.Generator) -> tuple[np.ndarray, int]:
    """Deviates of draws that are muscles, and how many others were drawn on the way."""
    found, rejected = deviates.copy(), 0
    for _ in range(MOST_TRIES):
        wrong = ~fit.muscle.legal(fit.muscle.drawn(fit.table.scale * found))
        if not wrong.any():
            return found, rejected
        rejected += int(wrong.sum())
        found[wrong] = generator.standard_normal((int(wrong.sum()), found.shape[1]))
    raise InputError(
        f"hardly any draw of its fit is a muscle: {wrong.sum()} of {len(found)} lie beyond its bounds "
        f"after {MOST_TRIES} tries",
        field=f"parameters.{fit.name}",
        value=fit.muscle.name,
        allowed="a fit with smaller standard errors, or a scale below 1",
    )


def _of_fit(fit: Fit, deviates: np.ndarray, scenario: Scenario) -> Iterator[Column]:
    """A fit's values: one column for each of its numbers, at every place of the muscle."""
    for key, values in fit.muscle.drawn(fit.table.scale * deviates).items():
        keys = tuple(f"{place}.{key}" for place in fit.places)
        field = field_at(keys[0], scenario)
        name = f"{fit.name}_{key.rpartition('.')[2]}"
        yield Column(name, keys, field.unit, float(field.value), values, fit.table)


def _groups(owners: Sequence[tuple[str, SpreadTable, np.ndarray]]) -> Iterator[Group]:
    """What is measured together, in the order of the file."""
    by_name: dict[str, list[tuple[SpreadTable, np.ndarray]]] = {}
    for name, table, deviates in owners:
        by_name.setdefault(table.group or name, []).append((table, deviates))
    for name, members in by_name.items():
        first = members[0][0]
        yield Group(name, first.each_stride, first.measure, np.hstack([part for _, part in members]))
