"""Joint draws of what a scenario has of some spreads: all at once, each as probable as it is."""

import pathlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from scipy.special import ndtri

from afo_sim.common import InputError, JsonDict, format_quantity, nearest_name, quantity_at
from afo_sim.description import Field, Muscle, Scenario, field_at, holder, leaves
from afo_sim.description.reader import split_key
from afo_sim.model import recorded_stride, stride_time_of
from afo_sim.physics import LAWS
from afo_sim.study.parameter import Joint, Parameter
from afo_sim.study.parameter_table import is_free
from afo_sim.study.uncertainty.spreads import DERIVED_PATH, Distribution, Spreads, SpreadTable, astray, read

_STRIDE_TIME = "gait.stride_time"
_NOTABLE = 0.01  # share cut off at a bound from which on it is reported [-]
_MOST_TRIES = 200  # times that a draw which is not a valid muscle is drawn anew
_FEWEST = 2  # draws of a Latin hypercube


@dataclass(frozen=True)
class Target:
    """Keys of a scenario that have one value, and what they are drawn from."""

    keys: tuple[str, ...]
    own: float
    unit: str
    distribution: Distribution


@dataclass(frozen=True)
class Unknown:
    """One thing that is not known, or varies: one deviate, which all its targets follow."""

    name: str
    table: SpreadTable
    targets: tuple[Target, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """A muscle's fitted numbers, drawn together; `places` are the keys at which this muscle stands."""

    name: str
    table: SpreadTable
    muscle: Muscle
    places: tuple[str, ...]

    @property
    def keys(self) -> list[str]:
        """Keys of the numbers that were fitted together, at every place."""
        return [f"{at}.{key}" for at in self.places for key in _fitted(self.muscle)]


@dataclass(frozen=True, eq=False)
class Applied:
    """Spreads applied to a scenario: what is drawn, and what is left out and why."""

    unknowns: tuple[Unknown, ...]
    fits: tuple[Fit, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...] = ()


def applied(spreads: Spreads, scenario: Scenario) -> Applied:
    """What of some spreads a scenario has."""
    if scenario.gait is not None:
        recorded_stride(scenario.gait)  # here: one that is not there is no fault of the spreads' file
    unknowns: list[Unknown] = []
    fits: list[Fit] = []
    left_out: list[str] = []
    taken: dict[str, str] = {}
    # fits first, wherever they stand: what a fit draws is drawn with it
    for name, table in sorted(spreads.tables.items(), key=lambda each: each[1].fit is None):
        try:
            if table.fit is not None:
                found = list(_fits(name, table, scenario, left_out))
                fits += found
                drawn = [key for fit in found for key in fit.keys]
            else:
                fitted = [key for fit in fits for key in fit.keys]
                targets = tuple(_targets(name, table, scenario, fitted, left_out))
                unknowns += [Unknown(name, table, targets)] if targets else []
                drawn = [key for target in targets for key in target.keys]
        except InputError as error:
            raise error.replaced(file=spreads.file) from None
        for key in drawn:
            if key in taken:
                problem = f"is drawn by {taken[key]!r} too"
                raise InputError(problem, file=spreads.file, field=f"parameters.{name}", value=key)
            taken[key] = name
    notes = tuple(
        f"{unknown.name}: {100.0 * share:.0f} % of its spread lies beyond what is allowed and is drawn within"
        for unknown in unknowns
        for target in unknown.targets
        if (share := target.distribution.cut(target.own)) > _NOTABLE
    )
    return Applied(tuple(unknowns), tuple(fits), tuple(left_out), notes)


def _fitted(muscle: Muscle) -> tuple[str, ...]:
    return () if muscle.covariance is None else muscle.covariance.parameters


def _targets(
    name: str, table: SpreadTable, scenario: Scenario, fitted: Sequence[str], left_out: list[str]
) -> Iterator[Target]:
    """Keys by own value and width: those that have the same are one target."""
    if table.height is not None:
        assert scenario.gait is not None
        derived = recorded_stride(scenario.gait).notes.get("derived", "")
        if table.height == DERIVED_PATH and "ankle_z_m" not in derived:
            left_out.append(f"{name}: the ankle's path of this gait is recorded, not derived")
        else:
            yield Target((), 0.0, "m", _distribution(name, table, "m", 0.0, None))
        return
    alike: dict[tuple[str, float, bool], list[Field]] = {}
    for pattern in table.keys or (str(table.key),):
        for field in _matching(name, pattern, scenario, left_out):
            own, path = None if field.value is None else float(field.value), split_key(field.key)[0]
            if own is None and field.key == _STRIDE_TIME and scenario.gait and scenario.gait.speed is None:
                own = float(stride_time_of(scenario))  # that is not stated, the recording's
            if field.key in fitted:
                left_out.append(f"{name}: {field.key} is drawn with the fit")
            elif path[-1] == "force_factor" and not LAWS[holder(scenario, path).law].force_powers:
                left_out.append(f"{name}: {field.key}: the force of this muscle's law cannot be scaled")
            elif own is None:
                left_out.append(f"{name}: {field.key} has no value here")
            elif own == 0.0 and (table.relative_sd or table.factor_sd or table.relative_within):
                left_out.append(f"{name}: {field.key} is zero, about which nothing is relative")
            else:
                known = holder(scenario, path).measured if table.factor_sd_measured is not None else ()
                measured = path[-1].removesuffix("_factor") in known
                alike.setdefault((field.unit, own, measured), []).append(field)
    for (unit, own, measured), fields in alike.items():
        distribution = _distribution(name, table, unit, own, fields[0], measured=measured)
        yield Target(tuple(field.key for field in fields), own, unit, distribution)


def _matching(name: str, pattern: str, scenario: Scenario, left_out: list[str]) -> Iterator[Field]:
    """Fields of a scenario whose key fits a pattern; what is not there is noted."""
    parts = list(split_key(pattern)[0])
    known = [leaf for leaf in leaves(Scenario, scenario.resolved()) if len(leaf.path) == len(parts)]
    if "*" not in pattern:
        try:
            field = field_at(pattern, scenario)
        except InputError as error:
            if astray(parts):
                raise error.replaced(file=None, field=f"parameters.{name}", value=pattern) from None
            left_out.append(f"{name}: {pattern} is not there")
            return
        there = [field] if holder(scenario, split_key(pattern)[0]) is not None else []
    else:
        keys = [leaf.key for leaf in known if all(map(fnmatchcase, leaf.path, parts))]
        fields = [field_at(key, scenario) for key in keys]
        there = [field for field in fields if holder(scenario, split_key(field.key)[0]) is not None]
        if not there and astray(parts):
            nearest = nearest_name(pattern, [leaf.key for leaf in known])
            text, allowed = "fits no key of any scenario", "a key as afo-sim keys lists it, * for a name"
            at = f"parameters.{name}"
            raise InputError(text, field=at, value=pattern, allowed=allowed, nearest=nearest)
    for field in there:
        if field.kind != "number":
            problem = "is not a number that spreads"
            raise InputError(problem, field=f"parameters.{name}", value=field.key, allowed=field.form)
    if not there:
        left_out.append(f"{name}: {pattern} is not there")
    yield from there


def _distribution(
    name: str, table: SpreadTable, unit: str, own: float, field: Field | None, *, measured: bool = False
) -> Distribution:
    """The distribution about an own value, cut off at the table's bounds and at the field's."""
    assert table.distribution is not None

    def quantity(option: str, default: float) -> float:
        text = getattr(table, option)
        if text is None:
            return default
        return quantity_at(f"parameters.{name}.{option}", text, unit)

    relative = table.relative_within if table.relative_sd is None else table.relative_sd
    width = table.factor_sd_measured if measured else table.factor_sd
    if width is None and relative is not None:
        width = relative * abs(own)
    elif width is None:
        width = quantity("within" if table.sd is None else "sd", 0.0)
    low, high = (-float("inf"), float("inf")) if field is None else field.bounds
    low, high = max(low, quantity("at_least", low)), min(high, quantity("at_most", high))
    if not low <= own <= high:
        option = "at_least" if own < low else "at_most"
        problem = f"leaves out the scenario's own value of {field.key if field else name}"
        allowed = f"{'at most' if own < low else 'at least'} {own:g} {unit}".rstrip()
        field_name, value = f"parameters.{name}.{option}", getattr(table, option)
        raise InputError(problem, field=field_name, value=value, allowed=allowed)
    if table.distribution == "pearson3":
        return Distribution("pearson3", width, table.skew or 0.0)
    return Distribution(table.distribution, width, 0.0, low, high)


def _fits(name: str, table: SpreadTable, scenario: Scenario, left_out: list[str]) -> Iterator[Fit]:
    """The muscles of a scenario, each once: groups of the same muscle come from the same fit."""
    pattern = str(table.fit).split(".")[2]
    groups = [group for group in scenario.orthosis.muscle if fnmatchcase(group, pattern)]
    if not groups:
        left_out.append(f"{name}: {table.fit} is not there")
    kinds: dict[Muscle, list[str]] = {}
    for group in groups:
        kinds.setdefault(scenario.orthosis.muscle[group].type, []).append(group)
    for muscle, members in kinds.items():
        if why := muscle.without_draws:
            left_out.append(f"{name}: {muscle.name or ', '.join(members)}: {why}")
        else:
            own = name if len(kinds) == 1 else f"{name}_{members[0]}"
            yield Fit(own, table, muscle, tuple(f"orthosis.muscle.{group}.type" for group in members))


@dataclass(frozen=True, eq=False)
class Column:
    """The drawn values of one or several keys that have one value; without keys a height [m]."""

    name: str
    keys: tuple[str, ...]
    unit: str
    own: float
    values: np.ndarray
    table: SpreadTable


@dataclass(frozen=True, eq=False)
class Group:
    """What one measurement would give, or one thing that varies: its standard normal deviates (n, k)."""

    name: str
    each_stride: bool
    measure: str
    deviates: np.ndarray


@dataclass(frozen=True, eq=False)
class Draws:
    """Joint draws; `rejected` counts those that gave no valid muscle and were repeated."""

    count: int
    seed: int
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    rejected: int
    left_out: tuple[str, ...]
    notes: tuple[str, ...]

    def sets(self, draw: int) -> JsonDict:
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


def draw(spreads: Applied, scenario: Scenario, count: int, seed: int = 0) -> Draws:
    """Draw together whatever spreads."""
    widths = [1] * len(spreads.unknowns) + [len(_fitted(fit.muscle)) for fit in spreads.fits]
    if not widths:
        raise InputError("this scenario has nothing of what the spreads state", field="spreads")
    from scipy.stats import qmc  # slow to import

    generator = np.random.default_rng(seed)
    share = qmc.LatinHypercube(sum(widths), seed=generator).random(count)
    parts = np.split(ndtri(share), np.cumsum(widths)[:-1], axis=1)
    columns: list[Column] = []
    owners: list[tuple[str, SpreadTable, np.ndarray]] = []
    rejected = 0
    for unknown, part in zip(spreads.unknowns, parts, strict=False):
        for k, target in enumerate(unknown.targets, start=1):
            name = f"{unknown.name}_{k}" if len(unknown.targets) > 1 else unknown.name
            values = target.distribution.at(part[:, 0], target.own)
            columns.append(Column(name, target.keys, target.unit, target.own, values, unknown.table))
        owners.append((unknown.name, unknown.table, part))
    for fit, part in zip(spreads.fits, parts[len(spreads.unknowns) :], strict=True):
        legal, again = _legal(fit, part, generator)
        rejected += again
        for key, values in fit.muscle.drawn(fit.table.scale * legal).items():
            keys = tuple(f"{place}.{key}" for place in fit.places)
            field = field_at(keys[0], scenario)
            name = f"{fit.name}_{key.rpartition('.')[2]}"
            columns.append(Column(name, keys, field.unit, float(field.value), values, fit.table))
        owners.append((fit.name, fit.table, legal))
    by_name: dict[str, list[tuple[SpreadTable, np.ndarray]]] = {}  # what is measured together
    for name, table, deviates in owners:
        by_name.setdefault(table.group or name, []).append((table, deviates))
    groups = []
    for name, members in by_name.items():
        first = members[0][0]
        every = np.hstack([part for _, part in members])
        groups.append(Group(name, first.each_stride, first.measure, every))
    return Draws(count, seed, tuple(columns), tuple(groups), rejected, spreads.left_out, spreads.notes)


def _legal(fit: Fit, deviates: np.ndarray, generator: np.random.Generator) -> tuple[np.ndarray, int]:
    """Deviates of draws that are muscles, and how many others were drawn on the way."""
    found, rejected = deviates.copy(), 0
    for _ in range(_MOST_TRIES):
        wrong = ~fit.muscle.legal(fit.muscle.drawn(fit.table.scale * found))
        if not wrong.any():
            return found, rejected
        rejected += int(wrong.sum())
        found[wrong] = generator.standard_normal((int(wrong.sum()), found.shape[1]))
    text = f"hardly any draw of its fit is a muscle: {wrong.sum()} of {len(found)} lie beyond its bounds "
    text += f"after {_MOST_TRIES} tries"
    allowed = "a fit with smaller standard errors, or a scale below 1"
    raise InputError(text, field=f"parameters.{fit.name}", value=fit.muscle.name, allowed=allowed)


def joint_parameters(
    file: pathlib.Path, spreads: str, scenario: Scenario, cases: int, seed: int
) -> tuple[tuple[Parameter, ...], tuple[str, ...]]:
    """The parameters of a sweep whose cases are joint draws, and what is left out of it."""
    if not scenario.walking:
        problem = "what is not known is drawn of walking, and here nobody walks"
        raise InputError(problem, file=file, field="scenario", allowed="a scenario with a gait")
    if cases < _FEWEST:
        raise InputError("is too few", file=file, field="cases", value=cases, allowed=f"{_FEWEST} or more")
    drawn = draw(applied(read(spreads, file), scenario), scenario, cases, seed)
    found = []
    for column in drawn.columns:
        if not is_free(column.name):
            problem = "is the name of another column of the results"
            raise InputError(problem, file=file, field=f"spreads: parameters.{column.name}")
        if column.keys:
            spread = Joint(tuple(column.values.tolist()))
            found.append(Parameter(column.name, column.keys, column.unit, spread))
    notes = [*drawn.notes, *(["not drawn: " + "; ".join(drawn.left_out)] if drawn.left_out else [])]
    if heights := ", ".join(column.name for column in drawn.columns if not column.keys):
        text = f"not drawn: {heights}: no key of the scenario sets a height of the sole; "
        notes.append(f"{text}`afo-sim run --uncertainty` adds it to every clearance")
    return tuple(found), tuple(notes)
