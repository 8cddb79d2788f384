"""Expectations of a run: ranges on its columns and metrics, and messages that say where one is left.

assert expect(run, "ankle/angle").between("-15 deg", "28 deg").after("1 s")
"""

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import in_unit, parse_quantity
from afo_sim.metrics.ankle import rise_time
from afo_sim.simulation.columns import describe
from afo_sim.simulation.recording import Recording

GRACE = 1e-9  # [s], so that 4000 × 0.001 s counts as 4 s
SAMPLE_CHECKS = ("between", "above", "below", "settles_to")  # the others look at one number of the window
MOMENTS: dict[str, Callable[[np.ndarray], Any]] = {
    "peak_between": np.argmax,
    "trough_between": np.argmin,
    "final_between": lambda values: len(values) - 1,
}
TOTALS: dict[str, Callable[["_Signal"], Any]] = {
    "range_between": lambda signal: np.ptp(signal.values),
    "integral_between": lambda signal: np.sum(signal.values * signal.steps),
    "rise_time_below": lambda signal: rise_time(signal.time, signal.values),
}
CHECKS = (*SAMPLE_CHECKS, *MOMENTS, *TOTALS)


@dataclass(frozen=True)
class Result:
    """What a check found; true when all is well.

    `value` is the worst sample (when `ok`, the one closest to a limit) and `limit` the limit it is
    compared with, both in the column's SI unit, or in the metric's; `time` [s] is NaN for a metric.
    """

    ok: bool
    message: str
    column: str
    time: float
    value: float
    limit: float

    def __bool__(self) -> bool:
        return self.ok

    def verify(self) -> None:
        """Raise AssertionError with the message unless all is well."""
        if not self.ok:
            raise AssertionError(self.message)


@dataclass(frozen=True)
class _Limit:
    value: float  # in the SI unit
    text: str = ""
    unit: str = ""  # as the person wrote it


@dataclass(frozen=True)
class _Check:
    kind: str
    unit: str  # SI, of what is compared
    low: _Limit
    high: _Limit
    words: str
    by: float = -math.inf  # [s], samples before it are let be


@dataclass(frozen=True)
class _Signal:
    name: str
    start: float  # [s], what the person's times count from
    time: np.ndarray
    values: np.ndarray
    steps: np.ndarray  # how long each sample lasts [s]


@dataclass(frozen=True, eq=False, repr=False)
class Expectation:
    """What is expected of one column, built by chaining checks and windows in any order.

    It is looked at when `check`, `verify`, or the truth of it is asked for. A window holds its first time
    and not its last. Of several checks all must hold. Limits are texts with units, such as "28 deg".
    """

    run: Recording
    columns: tuple[str, ...]
    checks: tuple[_Check, ...] = ()
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
        return dataclasses.replace(self, start=max(self.start, _seconds(time, "after")))

    def before(self, time: str) -> Self:
        """Only samples before `time` (such as "4 s")."""
        return dataclasses.replace(self, end=min(self.end, _seconds(time, "before")))

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
        unit = _times_seconds(describe(self.columns[0])[0], -1 if self.is_rate else 0)
        if kind in TOTALS and kind != "range_between":
            unit = "s" if kind == "rise_time_below" else _times_seconds(unit, 1)
        checks = {*self.checks, _read_check(kind, limits, unit)}
        return dataclasses.replace(self, checks=tuple(sorted(checks, key=lambda check: check.words)))

    def check(self) -> Result:
        """Look, and say what was found.

        Raises
        ------
        InputError
            No check was asked for, or a window holds no sample.
        """
        name = ("rate of " if self.is_rate else "") + " + ".join(self.columns)
        if not self.checks:
            raise InputError("nothing is expected of it", field=name, allowed=", ".join(CHECKS))
        if not self.run.ok:
            return _never_ended(self.run, name, self.why)
        signals = self._signals(name)
        results = [_check_all(check, signals, self._window_words()) for check in self.checks]
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

    def _signals(self, name: str) -> list[_Signal]:
        """What is looked at: the samples in the window, in each cycle if it is per cycle."""
        time = self.run["time"]
        if len(time) < 2:
            raise InputError("the recording has less than two samples", field="time")
        values = np.sum([self.run[column] for column in self.columns], axis=0)
        if self.is_rate:
            with np.errstate(invalid="ignore"):
                values = np.where(np.isfinite(values), np.gradient(values, time), values)
        steps = np.diff(time, append=2.0 * time[-1] - time[-2])
        period = _period(self.run) if self.cycles else math.inf
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
            found.append(_Signal(label, start, time[inside], values[inside], steps[inside]))
        return found

    def _window_words(self) -> str:
        words = f", after {self.start:g} s" if self.start > -math.inf else ""
        words += f", before {self.end:g} s" if self.end < math.inf else ""
        return words + (", per cycle" if self.cycles else "")


def expect(run: Recording, column: str | Sequence[str]) -> Expectation:
    """Begin an expectation of a run's column, or of the sum of several.

    Parameters
    ----------
    run : what is looked at
    column : such as "ankle/angle", or a list of columns of one unit

    Raises
    ------
    InputError
        There is no such column, or the columns have different units.

    Returns
    -------
    Expectation: chain its checks (`between`, `above`, `peak_between`, `settles_to`, …) and windows (`after`,
    `during`, `per_cycle`); its truth value tells whether all hold, `verify` raises AssertionError.

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
    units = {describe(name)[0] for name in columns}
    if len(units) > 1:
        raise InputError("adds columns of different units", field=field, value=", ".join(sorted(units)))
    return Expectation(run, columns)


def check_metric(run: Recording, metric: str, low: object, high: object) -> Result:
    """Check that a metric of a run, such as "range_of_motion", is within `low` to `high`.

    Raises
    ------
    InputError
        There is no such metric, or a limit is not in its unit.
    """
    return metric_result(run, metric, "between", [low, high])


def metric_result(run: Recording, metric: str, kind: str, limits: object, why: str = "") -> Result:
    """What the check named `kind`, with limits written as in a checks file, finds of a metric."""
    if metric not in run.metrics:
        raise _unknown("the run has no such metric", "metric", metric, run.metrics)
    value, unit = run.metrics[metric].value, run.metrics[metric].unit
    check = _read_check(kind, limits, unit)
    if not run.ok:
        return _never_ended(run, metric, why)
    once = np.array([math.nan])
    result = _check_all(check, [_Signal(metric, 0.0, once, np.array([value]), once)], "")
    return dataclasses.replace(result, message=result.message + _because(why))


def _check_all(check: _Check, signals: list[_Signal], window: str) -> Result:
    """The worst result of one check over the cycles, and how many fail."""
    found = [_check_one(check, signal, f"({check.words}{window})") for signal in signals]
    _, worst = max(found, key=lambda pair: pair[0])
    failures = sum(not result.ok for _, result in found)
    tail = f"; {failures} of {len(found)} cycles fail" if failures and len(found) > 1 else ""
    return dataclasses.replace(worst, message=worst.message + tail)


def _check_one(check: _Check, signal: _Signal, words: str) -> tuple[float, Result]:
    """How far [SI] the worst sample is outside the limits (less than 0 is inside), and the result."""
    odd = ~np.isfinite(signal.values)
    if odd.any():
        value, at = float(signal.values[odd][0]), float(signal.time[odd][0])
        message = f"{signal.name}: {value}{_at(at)} is not a finite number {words}{_count(odd, signal.time)}"
        return math.inf, Result(False, message, signal.name, at, value, math.nan)
    times, values = _measure(check, signal)
    over, under = values - check.high.value, check.low.value - values
    worst = int(np.argmax(np.maximum(over, under)))
    at, value = float(times[worst]), float(values[worst])
    noun = "" if check.kind in SAMPLE_CHECKS else re.sub("_between|_below", "", check.kind).replace("_", " ")
    place = f" from {signal.time[0]:.6g} s to {at:.6g} s" if check.kind in TOTALS else _at(at)
    if math.isnan(value):
        message = f"{signal.name}: there is no {noun}{place} {words}"
        return math.inf, Result(False, message, signal.name, at, value, check.high.value)
    limit = check.high if over[worst] >= under[worst] else check.low
    excess = float(max(over[worst], under[worst]))
    zero, one = (in_unit(x, check.unit, limit.unit) for x in (0.0, 1.0))
    seen = _written(in_unit(value, check.unit, limit.unit), limit.unit)
    away = _written(abs(excess) * (one - zero), limit.unit)
    side = "above" if value >= limit.value else "below"
    message = f"{signal.name}: {f'{noun} of ' if noun else ''}{seen}{place} is {away} {side} the limit of "
    message += f"{limit.text} {words}"
    if excess > 0.0:
        message += _count(np.maximum(over, under) > 0.0, times)
    return excess, Result(excess <= 0.0, message, signal.name, at, value, limit.value)


def _measure(check: _Check, signal: _Signal) -> tuple[np.ndarray, np.ndarray]:
    """Times and values that are compared with the limits."""
    if check.kind in MOMENTS:
        k = [int(MOMENTS[check.kind](signal.values))]
        return signal.time[k], signal.values[k]
    if check.kind in TOTALS:
        return signal.time[-1:], np.array([TOTALS[check.kind](signal)], dtype=float)
    late = ~(signal.time - signal.start < check.by - GRACE)  # a metric has no time
    if not late.any():
        raise InputError("no sample of the window is that late", field=check.kind, value=check.words)
    return signal.time[late], signal.values[late]


def _read_check(kind: str, limits: Any, unit: str) -> _Check:
    """A check whose limits are read in `unit`."""
    if kind == "settles_to":
        if not isinstance(limits, dict) or set(limits) != {"value", "within", "by"}:
            raise InputError("is not a settling", field=kind, value=limits, allowed="value, within and by")
        value, within = _limit(limits["value"], unit, kind), _limit(limits["within"], unit, kind, True)
        if within.value < 0.0:
            raise InputError("is negative", field=kind, value=within.text, allowed="within at least 0")
        low, high = (
            _Limit(x, _written(in_unit(x, unit, value.unit), value.unit), value.unit)
            for x in (value.value - within.value, value.value + within.value)
        )
        words = f"settles to {value.text} within {within.text} by {limits['by']}"
        return _Check(kind, unit, low, high, words, _seconds(limits["by"], kind))
    words, difference = kind.replace("_", " "), kind == "range_between"
    if not kind.endswith("between"):
        limit = _limit(limits, unit, kind)
        low = limit if kind == "above" else _Limit(-math.inf)
        high = limit if kind != "above" else _Limit(math.inf)
        return _Check(kind, unit, low, high, f"{words} {limit.text}")
    if not isinstance(limits, list) or len(limits) != 2:
        raise InputError("is not a range", field=kind, value=limits, allowed="a lower and an upper limit")
    low, high = (_limit(limit, unit, kind, difference) for limit in limits)
    if low.value > high.value:
        raise InputError("is an empty range", field=kind, value=limits, allowed="the lower limit first")
    return _Check(kind, unit, low, high, f"{words} {low.text} and {high.text}")


def _limit(text: object, unit: str, field: str, difference: bool = False) -> _Limit:
    """A limit in words and in `unit`; of a `difference`, 5 degC is no such thing."""
    try:
        value = parse_quantity(text, unit)
    except ValueError as error:
        allowed = f'a text with a unit that converts to "{unit}"' if unit else "a number, without a unit"
        raise InputError(str(error), field=field, value=text, allowed=allowed) from None
    written = re.sub(r"^\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*", "", str(text)).strip() if unit else ""
    if difference and unit and parse_quantity(f"0 {written}", unit) != 0.0:
        raise InputError("is not a difference", field=field, value=text, allowed=f'a unit such as "{unit}"')
    return _Limit(value, str(text).strip(), written)


def _seconds(text: object, field: str) -> float:
    return _limit(text, "s", field).value


def _times_seconds(unit: str, power: int) -> str:
    """The unit times seconds to a power: of "kg/s" and 1, "kg"."""
    base, per, exponent = re.fullmatch(r"(.*?)(?:(/s)(?:\^(\d))?)?", unit).groups()  # type: ignore[union-attr]
    power -= int(exponent or 1) if per else 0
    if power > 0:
        return f"{base}*s" if base else "s"
    if power == 0:
        return base
    return (f"{base}/s" + (f"^{-power}" if power < -1 else "")) if base else f"s^{power}"


def _period(run: Recording) -> float:
    try:
        return parse_quantity(run.scenario["timer"]["period"], "s")
    except (KeyError, ValueError):
        raise InputError("the run's scenario has no timer period", field="per_cycle") from None


def _written(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".strip()


def _at(time: float) -> str:
    return "" if math.isnan(time) else f" at {time:.6g} s"


def _count(bad: np.ndarray, time: np.ndarray) -> str:
    if len(bad) == 1:
        return ""
    return f"; {int(bad.sum())} of {len(bad)} samples fail, the first{_at(float(time[bad][0]))}"


def _because(why: str) -> str:
    return f"; why: {why}" if why else ""


def _never_ended(run: Recording, name: str, why: str) -> Result:
    message = f"{name}: the run did not reach its end: {run.status}{_because(why)}"
    return Result(False, message, name, math.nan, math.nan, math.nan)


def _unknown(problem: str, field: str, name: str, names: Iterable[str]) -> InputError:
    alike = [other for other in names if other.split("/")[0] == name.split("/")[0]] or names
    nearest = nearest_name(name, names)
    return InputError(problem, field=field, value=name, allowed=", ".join(alike), nearest=nearest)
