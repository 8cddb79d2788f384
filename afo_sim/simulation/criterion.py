"""Criteria on samples: limits with units for the samples of a window, and the result in words."""

import dataclasses
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import FloatOrArray, Given, InputError, in_unit, parse_quantity, quantity_at
from afo_sim.metrics import rise_time

GRACE = 1e-9  # [s], so that 4000 × 0.001 s counts as 4 s
SAMPLE_CHECKS = ("between", "above", "below", "settles_to")  # the others look at one number of the window
MOMENTS: dict[str, Callable[[np.ndarray], FloatOrArray]] = {
    "peak_between": np.argmax,
    "trough_between": np.argmin,
    "final_between": lambda values: len(values) - 1,
}
TOTALS: dict[str, Callable[["Signal"], FloatOrArray]] = {
    "range_between": lambda signal: np.ptp(signal.values),
    "integral_between": lambda signal: np.sum(signal.values * signal.steps),
    "rise_time_below": lambda signal: rise_time(signal.time, signal.values),
}
CHECKS = (*SAMPLE_CHECKS, *MOMENTS, *TOTALS)


@dataclass(frozen=True)
class Result:
    """The result of a check; true when all is well."""

    ok: bool  # all is well
    message: str  # what was found, in words
    column: str  # the worst one's name
    time: float  # of the worst sample [s]; NaN of a total
    value: float  # the worst [SI]
    limit: float  # that it is held against [SI]

    def __bool__(self) -> bool:
        return self.ok

    def verify(self) -> None:
        """Raise AssertionError with the message unless all is well."""
        if not self.ok:
            raise AssertionError(self.message)


@dataclass(frozen=True)
class Bound:
    """A limit: its number, and the text and unit in which the person wrote it."""

    value: float  # in the SI unit
    text: str = ""
    unit: str = ""  # as the person wrote it


@dataclass(frozen=True)
class Criterion:
    """A check by name, with its limits in SI and in words."""

    kind: str  # such as "between"
    unit: str  # SI, of what is compared
    low: Bound  # limit, −inf of none
    high: Bound  # limit, inf of none
    words: str  # the check as a sentence's part
    by: float = -math.inf  # [s], samples before it are let be


@dataclass(frozen=True)
class Signal:
    """Samples to be checked [SI], and their times [s] (n,)."""

    name: str
    start: float  # [s], from which the person's times count
    time: np.ndarray
    values: np.ndarray
    steps: np.ndarray  # how long each sample lasts [s]


def judge(criterion: Criterion, signals: list[Signal], window: str) -> Result:
    """The worst result of one criterion over the cycles, and how many fail."""
    found = [_judge_one(criterion, signal, f"({criterion.words}{window})") for signal in signals]
    _, worst = max(found, key=lambda pair: pair[0])
    failures = sum(not result.ok for _, result in found)
    tail = f"; {failures} of {len(found)} cycles fail" if failures and len(found) > 1 else ""
    return dataclasses.replace(worst, message=worst.message + tail)


def _judge_one(criterion: Criterion, signal: Signal, words: str) -> tuple[float, Result]:
    """Distance of the worst sample outside the limits [SI], negative inside, and the result."""
    odd = ~np.isfinite(signal.values)
    if odd.any():
        value, at = float(signal.values[odd][0]), float(signal.time[odd][0])
        message = f"{signal.name}: {value}{_at(at)} is not a finite number {words}{_count(odd, signal.time)}"
        return math.inf, Result(False, message, signal.name, at, value, math.nan)
    times, values = signal.time[-1:], signal.values[-1:]  # that are compared with the limits
    if criterion.kind in MOMENTS:
        k = [int(MOMENTS[criterion.kind](signal.values))]
        times, values = signal.time[k], signal.values[k]
    elif criterion.kind in TOTALS:
        values = np.array([TOTALS[criterion.kind](signal)], dtype=float)
    else:
        late = ~(signal.time - signal.start < criterion.by - GRACE)  # a metric has no time
        if not late.any():
            problem = "no sample of the window is that late"
            raise InputError(problem, field=criterion.kind, value=criterion.words)
        times, values = signal.time[late], signal.values[late]
    over, under = values - criterion.high.value, criterion.low.value - values
    worst = int(np.argmax(np.maximum(over, under)))
    at, value = float(times[worst]), float(values[worst])
    plain = criterion.kind in SAMPLE_CHECKS
    noun = "" if plain else re.sub("_between|_below", "", criterion.kind).replace("_", " ")
    place = f" from {signal.time[0]:.6g} s to {at:.6g} s" if criterion.kind in TOTALS else _at(at)
    if math.isnan(value):
        message = f"{signal.name}: there is no {noun}{place} {words}"
        return math.inf, Result(False, message, signal.name, at, value, criterion.high.value)
    limit = criterion.high if over[worst] >= under[worst] else criterion.low
    excess = float(max(over[worst], under[worst]))
    zero, one = (in_unit(x, criterion.unit, limit.unit) for x in (0.0, 1.0))
    seen = _written(in_unit(value, criterion.unit, limit.unit), limit.unit)
    away = _written(abs(excess) * (one - zero), limit.unit)
    side = "above" if value >= limit.value else "below"
    message = f"{signal.name}: {f'{noun} of ' if noun else ''}{seen}{place} is {away} {side} the limit of "
    message += f"{limit.text} {words}"
    if excess > 0.0:
        message += _count(np.maximum(over, under) > 0.0, times)
    return excess, Result(excess <= 0.0, message, signal.name, at, value, limit.value)


def read_criterion(kind: str, limits: Given, unit: str) -> Criterion:
    """A criterion by name, with limits written as in a checks file and read in `unit`."""
    if kind == "settles_to":
        if not isinstance(limits, dict) or set(limits) != {"value", "within", "by"}:
            raise InputError("is not a settling", field=kind, value=limits, allowed="value, within and by")
        value, within = _limit(limits["value"], unit, kind), _limit(limits["within"], unit, kind, True)
        if within.value < 0.0:
            raise InputError("is negative", field=kind, value=within.text, allowed="within at least 0")
        low, high = (
            Bound(x, _written(in_unit(x, unit, value.unit), value.unit), value.unit)
            for x in (value.value - within.value, value.value + within.value)
        )
        words = f"settles to {value.text} within {within.text} by {limits['by']}"
        return Criterion(kind, unit, low, high, words, seconds(limits["by"], kind))
    words, difference = kind.replace("_", " "), kind == "range_between"
    if not kind.endswith("between"):
        limit = _limit(limits, unit, kind)
        low = limit if kind == "above" else Bound(-math.inf)
        high = limit if kind != "above" else Bound(math.inf)
        return Criterion(kind, unit, low, high, f"{words} {limit.text}")
    if not isinstance(limits, list) or len(limits) != 2:
        raise InputError("is not a range", field=kind, value=limits, allowed="a lower and an upper limit")
    low, high = (_limit(limit, unit, kind, difference) for limit in limits)
    if low.value > high.value:
        raise InputError("is an empty range", field=kind, value=limits, allowed="the lower limit first")
    return Criterion(kind, unit, low, high, f"{words} {low.text} and {high.text}")


def _limit(text: object, unit: str, field: str, difference: bool = False) -> Bound:
    """A limit in words and in `unit`; that of a `difference` has no unit with an offset, such as degC."""
    allowed = f'a text with a unit that converts to "{unit}"' if unit else "a number, without a unit"
    value = quantity_at(field, text, unit, allowed=allowed)
    written = re.sub(r"^\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*", "", str(text)).strip() if unit else ""
    if difference and unit and parse_quantity(f"0 {written}", unit) != 0.0:
        raise InputError("is not a difference", field=field, value=text, allowed=f'a unit such as "{unit}"')
    return Bound(value, str(text).strip(), written)


def seconds(text: object, field: str) -> float:
    """A time in words, such as "1 s" [s]."""
    return _limit(text, "s", field).value


def times_seconds(unit: str, power: int) -> str:
    """The unit times seconds to a power: of "kg/s" and 1, "kg"."""
    base, per, exponent = re.fullmatch(r"(.*?)(?:(/s)(?:\^(\d))?)?", unit).groups()  # type: ignore[union-attr]  # it matches any text
    power -= int(exponent or 1) if per else 0
    if power > 0:
        return f"{base}*s" if base else "s"
    if power == 0:
        return base
    return (f"{base}/s" + (f"^{-power}" if power < -1 else "")) if base else f"s^{power}"


def _written(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".strip()


def _at(time: float) -> str:
    return "" if math.isnan(time) else f" at {time:.6g} s"


def _count(bad: np.ndarray, time: np.ndarray) -> str:
    if len(bad) == 1:
        return ""
    return f"; {int(bad.sum())} of {len(bad)} samples fail, the first{_at(float(time[bad][0]))}"
