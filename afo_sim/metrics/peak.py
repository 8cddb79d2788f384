"""The peak of a signal as its largest mean over 10 ms: what a single instant shows may be an impact."""

import numpy as np

from afo_sim.common import Doubles
from afo_sim.metrics.kernel import NUMBERS, R, S, base, call, kernel
from afo_sim.metrics.window import mean
from afo_sim.physics import register_jitable

ROUNDING = 1e-9  # of torques [N·m], powers [W/kg] and works [J/kg]: what is less is nothing
WINDOW = 0.010  # [s]
MEANING = "largest mean over 10 ms"


@register_jitable
def clean(value: float) -> float:
    """Without what rounding leaves where there is nothing."""
    return 0.0 if abs(value) < ROUNDING else value


@register_jitable
def positive(value: float) -> float:
    """Cleaned, and at least zero; no number stays none."""
    return 0.0 if value < ROUNDING else value


@register_jitable
def greatest(b: Doubles, start: int, count: int, sign: float) -> float:
    """The greatest of ± some numbers; no number where one is none."""
    most = -np.inf
    for k in range(start, start + count):
        if sign * b[k] > most or b[k] != b[k]:
            most = sign * b[k]
    return most


@register_jitable
def highest(b: Doubles, start: int, count: int, length: float, sign: float) -> float:
    """Largest mean of ± a signal over `length` steps that begin or end at a row, straight between rows."""
    if count < 2:
        return sign * b[start] if count else 0.0
    length = min(length, count - 1.0)
    whole, most, area = int(length * (1.0 + 1e-12)), -np.inf, 0.0
    rest = max(0.0, length - whole)  # of the last step, as a share of it
    for k in range(start, start + whole):
        area += 0.5 * (b[k] + b[k + 1])
    for k in range(start, start + count - whole):
        end = k + whole
        if rest <= 1e-9:
            most = max(most, sign * area)
        elif end + 1 < start + count:
            most = max(most, sign * (area + rest * b[end] + 0.5 * rest**2 * (b[end + 1] - b[end])))
        if rest > 1e-9 and k > start:
            most = max(most, sign * (area + rest * b[k] + 0.5 * rest**2 * (b[k - 1] - b[k])))
        if end + 1 < start + count:
            area += 0.5 * ((b[end] + b[end + 1]) - (b[k] + b[k + 1]))
    return most / length if area == area else area


@register_jitable
def highest_step(b: Doubles, start: int, count: int, length: float, sign: float) -> float:
    """Largest mean over `length` steps of ± what is a mean over each step."""
    length = min(length, float(count))
    whole, most, area = int(length), -np.inf, 0.0
    rest = length - whole
    for k in range(start, start + whole):
        area += b[k]
    for k in range(start, start + count - whole + 1):
        end = k + whole
        if rest == 0.0:
            most = max(most, sign * area)
        elif k > start:
            most = max(most, sign * (area + rest * b[k - 1]))
        if end < start + count:
            most = max(most, sign * (area + rest * b[end]))
            area += b[end] - b[k]
    return most / length if area == area else area


@register_jitable
def peak(b: Doubles, row: int, sign: float) -> float:
    """Peak over 10 ms of ± a row over the stride; at least zero."""
    first, length = int(b[S.first]), WINDOW / b[S.timestep]
    return positive(highest(b, base(b, row) + first, int(b[S.end]) - first, length, sign))


@register_jitable
def peak_within(b: Doubles, row: int, start: float, end: float, sign: float) -> float:
    """The same within a window; the mean of a shorter window, and 0 of an empty one."""
    at, count, length = base(b, row), int(b[S.count]), WINDOW / b[S.timestep]
    if end - start <= length:
        return positive(sign * mean(b, at, count, start, end))
    most = sign * mean(b, at, count, start, start + length)
    most = max(most, sign * mean(b, at, count, end - length, end))
    first, last = int(start) + int(int(start) < start), min(int(end), count - 1)
    if last - first >= length:
        most = max(most, highest(b, at + first, last - first + 1, length, sign))
    return positive(most)


@register_jitable
def power_peak(b: Doubles, steps: int, sign: float) -> float:
    """Peak over 10 ms of ± the power of steps that the row `one` begins with; at least zero."""
    return positive(highest_step(b, base(b, R.one), steps, WINDOW / b[S.timestep], sign))


@kernel()
def _peaks(b: Doubles, out: Doubles) -> float:
    out[0] = highest(b, NUMBERS, int(b[0]), b[1], 1.0)
    return 0.0


def largest_mean(values: np.ndarray, timestep: float, window: float = WINDOW) -> float:
    """Largest mean of a signal over a window that begins or ends at a row, straight between its rows."""
    return float(call(_peaks, (window / timestep,), values)[0])


def highest_mean(values: np.ndarray, timestep: float) -> float:
    """Peak over 10 ms of a signal (n,); at least zero."""
    return positive(largest_mean(values, timestep))


def row(name: str, label: str, meaning: str = "", unit: str = "N*m") -> tuple[str, ...]:
    """Row of the registry for the peak of a torque or of another signal over 10 ms."""
    return name, unit, f"{label}, peak over 10 ms", "; ".join(filter(None, (MEANING, meaning)))
