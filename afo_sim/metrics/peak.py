"""The peak of a signal as its largest mean over 10 ms: what a single instant shows may be an impact."""

import math

import numpy as np

from afo_sim.metrics.window import Window

ROUNDING = 1e-9  # of torques [N·m], powers [W/kg] and works [J/kg]: what is less is nothing
WINDOW = 0.010  # [s]
MEANING = "largest mean over 10 ms"


def largest_mean(
    values: np.ndarray, timestep: float, window: float = WINDOW, within: Window | None = None
) -> float:
    """Largest mean of a signal over a window that begins or ends at a row, straight between its rows."""
    if within is not None:
        length = window / timestep  # in rows
        if within.end - within.start <= length:
            return within.mean(values)
        first = Window(within.start, within.start + length).mean(values)
        last = Window(within.end - length, within.end).mean(values)
        rows = values[math.ceil(within.start) : math.floor(within.end) + 1]
        inner = [largest_mean(rows, timestep, window)] if len(rows) - 1 >= length else []
        return max(first, last, *inner)
    if len(values) == 1:
        return float(values[0])
    if (len(values) - 1) * timestep <= window:
        return float(np.mean(0.5 * (values[1:] + values[:-1])))
    return max(_from_rows(values, timestep, window), _from_rows(values[::-1], timestep, window))


def _from_rows(values: np.ndarray, timestep: float, window: float) -> float:
    """Largest mean over the windows that begin at a row."""
    whole = int(window / timestep * (1.0 + 1e-12))
    rest = max(0.0, window / timestep - whole)  # of the last step, as a share of it
    area = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    found = area[whole:] - area[: len(area) - whole]
    if rest > 1e-9:
        begun = values[whole:]
        found = found[:-1] + rest * begun[:-1] + 0.5 * rest**2 * (begun[1:] - begun[:-1])
    return float(found.max()) * timestep / window


def row(name: str, label: str, meaning: str = "", unit: str = "N*m") -> tuple[str, ...]:
    """Row of the registry for the peak of a torque or of another signal over 10 ms."""
    return name, unit, f"{label}, peak over 10 ms", "; ".join(filter(None, (MEANING, meaning)))


def highest_mean(values: np.ndarray, timestep: float, within: Window | None = None) -> float:
    """Peak over 10 ms of a signal (n,), or within a stretch of it; at least zero."""
    mean = largest_mean(values, timestep, within=within) if len(values) else 0.0
    return clean(max(mean, 0.0))


def flow_peak(flow: np.ndarray, timestep: float) -> float:
    """Peak over 10 ms of what is a mean over each step (n,)."""
    moved, length = np.concatenate([[0.0], np.cumsum(flow)]), min(WINDOW / timestep, float(len(flow)))
    rows = np.arange(len(moved), dtype=float)
    begun, ended = rows[rows + length <= rows[-1]], rows[rows >= length]
    behind = np.interp(begun + length, rows, moved) - moved[: len(begun)]
    before = moved[len(moved) - len(ended) :] - np.interp(ended - length, rows, moved)
    return float(max(behind.max(), before.max())) / length


def clean(value: float) -> float:
    """Without what rounding leaves where there is nothing."""
    return 0.0 if abs(value) < ROUNDING else value
