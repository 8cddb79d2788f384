"""Expectations of a run, in Python or from a file of checks: ranges on columns and metrics, with messages.

assert expect(run, "ankle/angle").between("-15 deg", "28 deg").after("1 s")
"""

import dataclasses
import math
import os
import pathlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from afo_sim.common import InputError, JsonDict, nearest_name, parse_quantity, read_toml
from afo_sim.metrics import OTHER, instead, told, words
from afo_sim.simulation.criterion import (
    CHECKS,
    GRACE,
    TOTALS,
    Criterion,
    Result,
    Signal,
    judge,
    read_criterion,
    seconds,
    times_seconds,
)
from afo_sim.simulation.recording import Recording


@dataclass(frozen=True, eq=False, repr=False)
class Expectation:
    """An expectation of one column, built by chaining checks and windows in any order.

    It is evaluated by `check`, by `verify` and by its truth value. A window holds its first time and not
    its last. All of several checks must hold. Limits are texts with units, such as "28 deg".

    run : whose columns are looked at
    columns : that must all comply, by name
    checks : that must all hold
    start : of the window [s]
    end : of the window, not in it [s]
    cycles : each cycle of the timer is checked alone
    is_rate : time derivatives are checked
    why : words that a failure ends with
    """

    run: Recording
    columns: tuple[str, ...]
    checks: tuple[Criterion, ...] = ()
    start: float = -math.inf
    end: float = math.inf
    cycles: bool = False
    is_rate: bool = False
    why: str = ""

    def rate(self) -> Self:
        """Look at the time derivative; before the checks, because their limits are per second then."""
        if self.checks:
            raise InputError("comes before the checks, whose limits are per second then", field="rate")
        return dataclasses.replace(self, is_rate=True)

    def after(self, time: str) -> Self:
        """Only samples from `time` (such as "1 s") on."""
        return dataclasses.replace(self, start=max(self.start, seconds(time, "after")))

    def before(self, time: str) -> Self:
        """Only samples before `time` (such as "4 s")."""
        return dataclasses.replace(self, end=min(self.end, seconds(time, "before")))

    def during(self, start: str, end: str) -> Self:
        """Only samples from `start` on and before `end`."""
        return self.after(start).before(end)

    def per_cycle(self) -> Self:
        """Check every cycle of the timer that was begun; all times count from the cycle's start."""
        return dataclasses.replace(self, cycles=True)

    def between(self, low: object, high: object) -> Self:
        """Every sample is within `low` to `high`."""
        return self.expecting("between", [low, high])

    def above(self, low: object) -> Self:
        """No sample is below `low`."""
        return self.expecting("above", low)

    def below(self, high: object) -> Self:
        """No sample is above `high`."""
        return self.expecting("below", high)

    def peak_between(self, low: object, high: object) -> Self:
        """The greatest sample is within `low` to `high`."""
        return self.expecting("peak_between", [low, high])

    def trough_between(self, low: object, high: object) -> Self:
        """The least sample is within `low` to `high`."""
        return self.expecting("trough_between", [low, high])

    def range_between(self, low: object, high: object) -> Self:
        """The greatest sample less the least is within `low` to `high`."""
        return self.expecting("range_between", [low, high])

    def final_between(self, low: object, high: object) -> Self:
        """The last sample is within `low` to `high`."""
        return self.expecting("final_between", [low, high])

    def integral_between(self, low: object, high: object) -> Self:
        """The sum over time, in the column's unit times seconds, is within `low` to `high`."""
        return self.expecting("integral_between", [low, high])

    def rise_time_below(self, high: object) -> Self:
        """From 10 % to 90 % of the way from the first sample to the peak it takes at most `high`."""
        return self.expecting("rise_time_below", high)

    def settles_to(self, value: object, *, within: object, by: object) -> Self:
        """From the time `by` on, every sample is at most `within` away from `value`."""
        return self.expecting("settles_to", {"value": value, "within": within, "by": by})

    def expecting(self, kind: str, limits: object) -> Self:
        """Add the check named `kind`, with limits written as in a checks file."""
        unit = times_seconds(self.run.describe(self.columns[0])[0], -1 if self.is_rate else 0)
        if kind in TOTALS and kind != "range_between":
            unit = "s" if kind == "rise_time_below" else times_seconds(unit, 1)
        checks = {*self.checks, read_criterion(kind, limits, unit)}
        return dataclasses.replace(self, checks=tuple(sorted(checks, key=lambda check: check.words)))

    def check(self) -> Result:
        """Run the check, and return its result."""
        name = ("rate of " if self.is_rate else "") + " + ".join(self.columns)
        if not self.checks:
            raise InputError("no expectation is stated for it", field=name, allowed=", ".join(CHECKS))
        if not self.run.ok:
            return _never_ended(self.run, name, self.why)
        signals = self._signals(name)
        results = [judge(check, signals, self._window_words()) for check in self.checks]
        shown = [result for result in results if not result.ok] or results
        message = "; and ".join(result.message for result in shown) + _because(self.why)
        return dataclasses.replace(shown[0], message=message, column=name)

    def verify(self) -> None:
        """Raise AssertionError with the message unless all is as expected."""
        self.check().verify()

    def __bool__(self) -> bool:
        return self.check().ok

    def __repr__(self) -> str:
        try:
            return self.check().message
        except InputError as error:
            return str(error)

    def _signals(self, name: str) -> list[Signal]:
        """The samples in the window, in each cycle if it is per cycle."""
        time = self.run["time"]
        if len(time) < 2:
            raise InputError("the recording has fewer than two samples", field="time")
        values = np.sum([self.run[column] for column in self.columns], axis=0)
        if self.is_rate:
            with np.errstate(invalid="ignore"):
                values = np.where(np.isfinite(values), np.gradient(values, time), values)
        steps = np.diff(time, append=2.0 * time[-1] - time[-2])
        try:
            period = parse_quantity(self.run.described["timer"]["period"], "s") if self.cycles else math.inf
        except (KeyError, ValueError):
            raise InputError("the run's scenario has no timer period", field="per_cycle") from None
        last = max(math.ceil((time[-1] - GRACE) / period), 1) - 1
        cycle = np.minimum((time + GRACE) // period, last)  # a sample at the very end is the last one's
        found = []
        for k in np.unique(cycle).astype(int).tolist():
            label, start = (f"{name}, cycle {k + 1}", k * period) if self.cycles else (name, 0.0)
            clock = time - start
            inside = (cycle == k) & (clock >= self.start - GRACE) & (clock < self.end - GRACE)
            if not inside.any():
                field = (
                    "after" if self.start > -math.inf else "before" if self.end < math.inf else "per_cycle"
                )
                problem, words = f"no sample of {label} lies in the window", self._window_words()[2:]
                allowed = f"times up to {clock[cycle == k][-1]:g} s"
                raise InputError(problem, field=field, value=words, allowed=allowed)
            found.append(Signal(label, start, time[inside], values[inside], steps[inside]))
        return found

    def _window_words(self) -> str:
        words = f", after {self.start:g} s" if self.start > -math.inf else ""
        words += f", before {self.end:g} s" if self.end < math.inf else ""
        return words + (", per cycle" if self.cycles else "")


def expect(run: Recording, column: str | Sequence[str]) -> Expectation:
    """Begin an expectation of a run's column, or of the sum of several.

    Parameters
    ----------
    run : recording
    column : such as "ankle/angle", or a list of columns of one unit

    Raises
    ------
    InputError
        No such column, or the columns have different units.

    Returns
    -------
    Expectation: chain its checks (`between`, `above`, `peak_between`, `settles_to`, …) and windows (`after`,
    `during`, `per_cycle`); it is true if all hold; `verify` raises AssertionError if not.

    Examples
    --------
    >>> seated = run("seated", {"duration": "1 s"})
    >>> bool(expect(seated, "ankle/angle").between("-20 deg", "30 deg").after("0.5 s"))
    True
    """
    field, columns = ("column", (column,)) if isinstance(column, str) else ("sum", tuple(column))
    if not columns:
        raise InputError("names no column", field=field)
    for name in columns:
        if name not in run.columns:
            raise _unknown("the recording has no such column", field, name, run.columns)
    units = {run.describe(name)[0] for name in columns}
    if len(units) > 1:
        raise InputError("adds columns of different units", field=field, value=", ".join(sorted(units)))
    return Expectation(run, columns)


def check_metric(run: Recording, metric: str, low: object, high: object) -> Result:
    """Check that a metric of a run, such as "range_of_motion", is within `low` to `high`."""
    return metric_result(run, metric, "between", [low, high])


def metric_result(run: Recording, metric: str, kind: str, limits: object, why: str = "") -> Result:
    """The result of the check named `kind` on a metric, with limits written as in a checks file."""
    if metric not in run.metrics:
        problem = told("the run has no such metric", metric)
        if words(metric).group != OTHER:
            problem = "the run does not contain it: such runs have none, or it was made by an older version"
        raise _unknown(problem, "metric", metric, run.metrics, instead(metric, run.metrics))
    value, unit = run.metrics[metric].value, run.metrics[metric].unit
    check = read_criterion(kind, limits, unit)
    if not run.ok:
        return _never_ended(run, metric, why)
    once = np.array([math.nan])
    result = judge(check, [Signal(metric, 0.0, once, np.array([value]), once)], "")
    return dataclasses.replace(result, message=result.message + _because(why))


def _because(why: str) -> str:
    return f"; why: {why}" if why else ""


def _never_ended(run: Recording, name: str, why: str) -> Result:
    message = f"{name}: the run did not reach its end: {run.status}{_because(why)}"
    return Result(False, message, name, math.nan, math.nan, math.nan)


def _unknown(
    problem: str, field: str, name: str, names: Iterable[str], nearest: str | None = None
) -> InputError:
    alike = [other for other in names if other.split("/")[0] == name.split("/")[0]] or names
    nearest = nearest or nearest_name(name, names)
    return InputError(problem, field=field, value=name, allowed=", ".join(alike), nearest=nearest)


METRIC_KEYS = ("metric", "between", "above", "below", "why")
SUBJECTS = ("column", "metric", "sum")
ENTRY_KEYS: dict[str, type] = {"column": str, "metric": str, "sum": list, **dict.fromkeys(CHECKS, object)}
ENTRY_KEYS |= {"after": object, "before": object, "per_cycle": bool, "rate": bool, "why": str}


@dataclass(frozen=True)
class CheckEntry:
    """One [[check]] of a checks file; `number` counts from 1."""

    file: pathlib.Path
    number: int
    table: JsonDict

    def check(self, run: Recording) -> Result:
        """Look at a run; what is wrong with the entry is an `InputError` that names file and field."""
        table = self.table
        (kind,) = (key for key in table if key in CHECKS)
        try:
            if "metric" in table:
                return metric_result(run, table["metric"], kind, table[kind], table.get("why", ""))
            expected = expect(run, table["column"] if "column" in table else table["sum"])
            expected = expected.rate() if table.get("rate") else expected
            expected = expected.expecting(kind, table[kind])
            expected = expected.after(table["after"]) if "after" in table else expected
            expected = expected.before(table["before"]) if "before" in table else expected
            expected = expected.per_cycle() if table.get("per_cycle") else expected
            return dataclasses.replace(expected, why=table.get("why", "")).check()
        except InputError as error:
            facts = (error.problem, error.field, error.value, error.allowed, error.nearest)
            raise self.refusal(*facts) from None

    def refusal(
        self, problem: str, key: str, value: object, allowed: str = "", nearest: str | None = None
    ) -> InputError:
        """Refusal of this entry, at a key or ("") as a whole."""
        field = f"check[{self.number}]" + (f".{key}" if key else "")
        return InputError(problem, file=self.file, field=field, value=value, allowed=allowed, nearest=nearest)

    def examined(self) -> Self:
        """Itself, if it looks at one thing, in one way, and no key is unknown or of a wrong type."""
        for key, value in self.table.items():
            if key not in ENTRY_KEYS:
                nearest = nearest_name(key, ENTRY_KEYS)
                raise self.refusal("is an unknown key", key, value, ", ".join(ENTRY_KEYS), nearest)
            if "metric" in self.table and key not in METRIC_KEYS:
                raise self.refusal("does not go with a metric", key, value, ", ".join(METRIC_KEYS))
            wanted = ENTRY_KEYS[key]
            right = isinstance(value, wanted)
            if not right or (wanted is list and not all(isinstance(item, str) for item in value)):
                words = {str: "a text", bool: "true or false", list: "a list of texts"}
                raise self.refusal("has another type", key, value, words[wanted])
        for what, keys in (("column, metric or sum", SUBJECTS), ("check", CHECKS)):
            found = [key for key in keys if key in self.table]
            if len(found) != 1:
                problem = f"has {'more than one' if found else 'no'} {what}"
                raise self.refusal(problem, "", ", ".join(found) or None, "one of " + ", ".join(keys))
        return self


def read_checks(path: str | os.PathLike[str]) -> list[CheckEntry]:
    """The entries of a checks file."""
    file = pathlib.Path(path)
    table = read_toml(file)
    for key in table:
        if key != "check":
            raise InputError("is an unknown key", file=file, field=key, allowed="[[check]]")
    tables = table.get("check")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError("has no checks", file=file, field="check", allowed="[[check]] tables")
    return [CheckEntry(file, number, t).examined() for number, t in enumerate(tables, start=1)]


def run_checks(run: Recording, path: str | os.PathLike[str]) -> list[Result]:
    """The result of each entry of a checks file, in its order."""
    return [entry.check(run) for entry in read_checks(path)]
