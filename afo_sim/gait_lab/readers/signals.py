"""Sampled signals: gaps filled, noise filtered, evenly in time."""

import pathlib

import numpy as np

from afo_sim.common.errors import InputError

LONGEST_GAP = 0.2  # that is filled without distrust [s]
# Two passes of a second-order Butterworth filter have their -3 dB at this share of one pass's (Winter 2009).
TWO_PASSES = 0.802


def check_clock(file: pathlib.Path, time: np.ndarray, field: str = "time") -> None:
    """Refuse a trial's clock that stands still, runs backward, leaps or holds what is no number.

    Units: time [s] (n,).
    """
    if not np.all(np.isfinite(time)):
        row = int(np.argmin(np.isfinite(time)))
        raise InputError(f"row {row + 1} has no finite time", file=file, field=field, value=float(time[row]))
    steps = np.diff(time)
    if len(steps) == 0:
        raise InputError("has a single row", file=file, field=field, allowed="at least two")
    if np.any(steps <= 0.0):
        raise InputError(
            f"time does not increase after {time[np.argmax(steps <= 0.0)]:g} s", file=file, field=field
        )
    longest = max(LONGEST_GAP, 3.0 * float(np.median(steps)))
    if steps.max() > longest:
        k = int(np.argmax(steps))
        seen = f"time leaps from {time[k]:g} to {time[k + 1]:g} s"
        raise InputError(seen, file=file, field=field, allowed=f"steps of at most {longest:.3g} s")


def fill_gaps(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Interpolate missing samples (NaN), and say where too many were missing.

    Units: time [s] (n,), values (n,), returns [s].
    """
    from scipy.interpolate import PchipInterpolator

    known = np.isfinite(values)
    if known.all():
        return values, []
    if known.sum() < 2:
        return np.zeros_like(values), [(float(time[0]), float(time[-1]))]
    inside = np.clip(time, time[known][0], time[known][-1])
    filled = np.where(known, values, PchipInterpolator(time[known], values[known])(inside))
    edges = np.flatnonzero(np.diff(np.r_[False, ~known, False].astype(int)))
    hidden = []
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        span = float(time[max(start - 1, 0)]), float(time[min(stop, len(time) - 1)])
        if span[1] - span[0] > LONGEST_GAP or start == 0 or stop == len(time):
            hidden.append(span)
    return filled, hidden


def evenly(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The signal in even steps of time, its own steps if they are even already.

    Units: time [s] (n,), values (n, …).
    """
    steps = np.diff(time)
    step = float(np.median(steps))
    if np.abs(steps - step).max() <= 0.1 * step:
        return time, values
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / step) + 1)
    flat = values.reshape(len(values), -1)
    found = np.column_stack([np.interp(even, time, column) for column in flat.T])
    return even, found.reshape(len(even), *values.shape[1:])


def low_pass(time: np.ndarray, values: np.ndarray, cutoff: float) -> np.ndarray:
    """Second-order Butterworth low-pass, forward and backward, so that nothing is delayed.

    Units: time [s] (n,), values (n, …), cutoff [Hz].
    """
    from scipy.signal import butter, sosfiltfilt

    rate = (len(time) - 1) / (time[-1] - time[0])
    once = cutoff / TWO_PASSES
    if cutoff <= 0.0 or once >= 0.49 * rate or len(time) < 16:
        return values
    sections = butter(2, once, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=min(len(time) - 1, int(rate / once))))
