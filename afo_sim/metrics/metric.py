"""A number with its unit, the registry of what such numbers are called and mean, and their old names."""

import collections
import dataclasses
import functools
import importlib
import itertools
import pkgutil
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import NoReturn, Self, TypeVar

from afo_sim import metrics
from afo_sim.common import Function, Given, InputError, Lazy, in_unit, nearest_name, parse_quantity

CLEARANCE, CONTACT, ANKLE = "Clearance in swing", "Initial contact and loading", "Angle"
PUSH_OFF = "Push-off"
NEED, TORQUE, WORK = "Torque needed", "Torque of the orthosis", "Work of the orthosis"
START = "First strides after a stop"
AIR, TIME, WALKERS = "Air and pressure", "Walking", "Patients who respond"
YOURS, OTHER = "Your own", "Further"
ENERGY = "Energy of air and muscles"
SAFETY = "Safety margins"
# in the order of a report
_FIRST = (TIME, CLEARANCE, START, CONTACT, ANKLE, PUSH_OFF, NEED, TORQUE, WORK, AIR, ENERGY, SAFETY)
GROUPS = (*_FIRST, WALKERS, YOURS, OTHER)

Found = Iterator[tuple[str, float]]  # name of a metric, value in the registry's unit


class Metric(float):
    """A number with its unit: a float in arithmetic, comparable with texts such as "10 mm".

    Arithmetic gives plain floats, since units of results are not tracked. A comparison with a plain
    number assumes the metric's own unit; a text or another metric is converted first.

    Parameters
    ----------
    value : in `unit`
    unit : as pint reads it; "" for a bare number

    Raises
    ------
    InputError
        Different dimensions are compared by size; `==` is then false.

    Examples
    --------
    >>> clearance = Metric(12.5, "mm")
    >>> print(clearance)
    12.5 mm
    >>> clearance > 10, clearance > "1 cm", 2 * clearance, f"{clearance:.2f}"
    (True, True, 25.0, '12.50')
    """

    __slots__ = ("_unit",)
    _unit: str

    def __new__(cls, value: float, unit: str = "") -> Self:
        """A float; the unit comes with it."""
        made = float.__new__(cls, value)
        _set_unit(made, unit)
        return made

    @property
    def value(self) -> float:
        """The plain number [unit]."""
        return float(self)

    @property
    def unit(self) -> str:
        """The unit of the number."""
        return self._unit

    def to(self, unit: str) -> "Metric":
        """The same in another unit of its dimension; InputError where there is none such."""
        try:
            return Metric(in_unit(float(self), _spelled(self.unit), _spelled(unit)), unit)
        except Exception as error:  # what pint makes of a unit, or of another dimension
            raise InputError(f"does not convert to {unit}: {error}", value=str(self)) from None

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a metric is fixed: {name} cannot be set")

    def __reduce__(self) -> tuple[type["Metric"], tuple[float, str]]:  # of pickle and copy
        return Metric, (float(self), self.unit)

    def __str__(self) -> str:
        return f"{float(self):.4g} {self.unit}".rstrip()

    def __repr__(self) -> str:
        return f"<{self}>"

    def __format__(self, spec: str) -> str:
        return format(float(self), spec) if spec else str(self)

    __hash__ = float.__hash__

    def __eq__(self, other: object) -> bool:
        try:
            return float(self) == self._other(other)
        except InputError:
            return False

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __lt__(self, other: Given) -> bool:
        return float(self) < self._other(other)

    def __le__(self, other: Given) -> bool:
        return float(self) <= self._other(other)

    def __gt__(self, other: Given) -> bool:
        return float(self) > self._other(other)

    def __ge__(self, other: Given) -> bool:
        return float(self) >= self._other(other)

    def _other(self, other: Given) -> Given:
        """The other side of a comparison, in this unit."""
        if isinstance(other, Metric):
            return float(other) if other.unit == self.unit else float(other.to(self.unit))
        if not isinstance(other, str):
            return other
        try:
            return parse_quantity(_spelled(other), _spelled(self.unit))
        except ValueError as error:
            raise InputError(f"does not compare with {self}: it {error}", value=other) from None


def _spelled(text: str) -> str:
    """A quantity or unit as people write it, as pint reads it."""
    return text.replace("%", "percent").replace("·", "*").replace("°", "deg")


_set_unit = vars(Metric)["_unit"].__set__


class Of(StrEnum):
    """What the function of a metric looks at."""

    STRIDE = "stride"  # a `Stride`; over a run the metric is the mean of the strides that count
    WORN = "worn stride"  # a `Stride` of a leg that wears an orthosis
    RUN = "run"  # a `Run`: columns, facts and the metrics that are known before
    WHOLE = "whole"  # what its caller gives it, before those of a RUN
    BESIDE = "beside"  # what its caller gives it, from beside the strides: a search, a balance, another run


@dataclass(frozen=True)
class MetricEntry:
    """A metric's row in the registry."""

    group: str  # of the metrics' page
    name: str  # in `run.metrics`
    unit: str  # as pint reads it; "" of a bare number
    label: str  # for people
    meaning: str = ""  # what it is, in words
    of: Of = Of.WHOLE  # the whole run, or a stride
    made_of: frozenset[str] = frozenset()  # columns that it is computed of

    def fill(self, name: str) -> "MetricEntry | None":
        """This row for a metric of that name; None where the name is another."""
        if name == self.name:
            return self
        before, hole, after = self.name.partition("{}")
        if not hole or not (name.startswith(before) and name.endswith(after)):
            return None
        middle = name[len(before) : len(name) - len(after)]
        if len(before) + len(after) >= len(name):
            return None
        middle = middle.replace("_", " ")
        middle = middle.capitalize() if self.label.startswith("{}") else middle
        return dataclasses.replace(self, name=name, label=self.label.format(middle))


METRICS: dict[str, MetricEntry] = {}
REPORTED: dict[Function, list[MetricEntry]] = {}  # by the function that reports them
Reports = TypeVar("Reports", bound=Function)


def reported(
    group: str, *rows: tuple[str, ...], of: Of = Of.WHOLE, made_of: Collection[str] = ()
) -> Callable[[Reports], Reports]:
    """Register what the decorated function reports; this is all that a new metric needs."""

    def register(function: Reports) -> Reports:
        for row in rows:
            name, unit, label, meaning = (*row, "")[:4]
            made = MetricEntry(group, name, unit, label, meaning, of, frozenset(made_of))
            assert made.name not in METRICS, f"{made.name} is registered twice"
            METRICS[made.name] = made
            REPORTED.setdefault(function, []).append(made)
        return function

    return register


@functools.cache
def load_all() -> None:
    """Import every module of this room, so that what it reports is registered."""
    for module in pkgutil.iter_modules(metrics.__path__):
        importlib.import_module(f"{metrics.__name__}.{module.name}")


@functools.cache
def functions_of(*scopes: Of) -> tuple[Callable[..., Found], ...]:
    """Functions that report what is of some scopes: scope by scope, in the order of the groups."""
    load_all()
    found = {}
    for f, rows in REPORTED.items():
        if rows[0].of in scopes:
            group = min(GROUPS.index(row.group) for row in rows)
            found[f] = scopes.index(rows[0].of), group, f.__module__, f.__code__.co_firstlineno
    return tuple(sorted(found, key=found.__getitem__))


@functools.lru_cache(maxsize=64)  # cases of a sweep want the same
def reporting(
    functions: tuple[Callable[..., Found], ...], wanted: frozenset[str] | None, strict: bool = True
) -> tuple[Callable[..., Found], ...]:
    """Those of some functions that report what is wanted; `strict`, all where none registers one of it."""
    if wanted is None:
        return functions
    found = {name: [f for f in functions if any(row.fill(name) for row in REPORTED[f])] for name in wanted}
    if strict and not all(found.values()):
        return functions
    return tuple(f for f in functions if any(f in each for each in found.values()))


def of_strides(wanted: Collection[str]) -> frozenset[str]:
    """Those of some metrics, and of what they are made of, that strides report or that nobody registers."""
    rows = {name: known(name) for name in {*wanted, *made_of(wanted)}}
    return frozenset(n for n, row in rows.items() if row is None or row.of not in (Of.RUN, Of.BESIDE))


def made_of(wanted: Collection[str]) -> frozenset[str]:
    """The metrics that some metrics are computed from."""
    return frozenset().union(*(row.made_of for row in map(known, wanted) if row is not None))


@functools.cache
def known(name: str) -> MetricEntry | None:
    """The registered row of a metric; None where no function reports it."""
    load_all()
    if name in METRICS:
        return METRICS[name]
    return next(filter(None, (row.fill(name) for row in METRICS.values())), None)


@functools.cache
def unit_of(name: str) -> str:
    """The unit of a registered metric; KeyError where no function reports it."""
    if (row := known(name)) is None:
        raise KeyError(f"no function registers the metric {name}")
    return row.unit


def measured(name: str, value: float) -> Metric:
    """A value with the unit that the registry has for its name."""
    return Metric(value, unit_of(name))


def all_measured(values: Iterable[tuple[str, float]]) -> dict[str, Metric]:
    """Values with their units, by name."""
    found = dict(values)
    made = list(map(float.__new__, itertools.repeat(Metric), found.values()))  # as Metric() does, in C
    collections.deque(map(_set_unit, made, map(unit_of, found)), 0)
    return dict(zip(found, made, strict=True))


EVENT = "the minimum is looked for while the foot is fast"
# Old name: the new one, and why.
RENAMED = {
    "swings_without_toe_dip": ("swings_without_toe_event", EVENT),
    "swings_without_ball_dip": ("swings_without_ball_event", EVENT),
    "share_of_dorsiflexion_moment": (
        "orthosis_swing_torque_mean",
        "its peak stood at push-off; needed_swing_torque_mean is what to compare it with",
    ),
    "share_of_plantarflexion_moment": (
        "orthosis_peak_plantarflexion_torque",
        "a share of one peak in another that stands elsewhere in the stride says nothing",
    ),
}
OVER_10_MS = "_10ms", "every peak is the largest mean over 10 ms"  # what the names of some ended in, and why


def _renamed(name: str) -> tuple[str, str] | None:
    """The new name of a metric of a former version, and why; None of another."""
    ending, why = OVER_10_MS
    return (name.removesuffix(ending), why) if name.endswith(ending) else RENAMED.get(name)


def instead(name: str, names: Iterable[str]) -> str | None:
    """The metric meant by a name that is none of `names`: its new name, or the most similar one."""
    found = _renamed(name)
    return found[0] if found else nearest_name(name, names)


def told(problem: str, name: str) -> str:
    """A problem with an unknown metric; of one that has another name now, why."""
    found = _renamed(name)
    return f"{problem} any more ({found[1]})" if found else problem


def no_metric(problem: str, name: str, names: Iterable[str], **at: Given) -> InputError:
    """An error for a metric that is none of `names`; `at` as InputError has it."""
    return InputError(told(problem, name), value=name, nearest=instead(name, names), **at)


class Metrics(Lazy[str, Metric]):
    """Metrics by name; one that is not there is refused, an old one with its new name."""

    def __missing__(self, name: str) -> Metric:
        if name in self:
            return self[name]
        raise no_metric("the run has no such metric", name, self, field="metric")
