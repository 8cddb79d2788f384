"""Sampled signals: clocks made even, gaps filled, noise filtered."""

import pathlib

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import note

_WOBBLE = 0.005  # share of a step by which steps may differ and count as even [-]; assumed
_DISAGREES = 0.02  # share by which clock and stated rate may differ without a word [-]; assumed
_SHORTEST_STEP = 1e-5  # likewise: of the fastest plates a tenth [s]; assumed
_UNEVEN = 100.0  # mean step over the middle one, beyond which even steps would fill the memory [-]; assumed
_LONGEST_STEP = 0.5  # between two samples of a walk [s]; assumed: beyond, it is no time in seconds

_LONGEST_GAP = 0.2  # that is filled without distrust [s]
# Two passes of a second-order Butterworth filter have their -3 dB at this share of one pass's (Winter 2009).
_TWO_PASSES = 0.802


def even_clock(time: np.ndarray, rate: float | None = None) -> tuple[np.ndarray, list[Notice]]:
    """The clock without the rounding of its print, with notices."""
    if len(time) < 3 or not np.isfinite(time).all() or time[-1] <= time[0]:
        return time, []
    # the power of ten that all stamps are multiples of [s]
    known = (k for k in range(1, 9) if np.abs(time - np.round(time, k)).max() < 1e-9)
    grain, count = float(10.0 ** -next(known, 9)), np.arange(len(time))
    steps = np.diff(time)
    mean = float(time[-1] - time[0]) / count[-1]
    stated = 1.0 / rate if rate and np.isfinite(rate) and rate > 0.0 else None
    if stated is not None and abs(mean / stated - 1.0) > _DISAGREES:
        if _is_rounded_step(steps, stated, grain):
            text = "its clock has rounded steps of {step:.4g} s; the stated {rate:g} Hz are taken, which "
            text += "makes it {percent:+.1f} % as long"
            off = 100.0 * (stated / mean - 1.0)
            doubt = Notice("clock-step-rounded", text, step=mean, rate=rate, percent=off)
            return time[0] + stated * count, [doubt]
        text = "its clock has steps of {rate:.5g} Hz, its header says {stated:g} Hz: the clock is taken"
        return time, [Notice("clock-rate-differs", text, rate=1.0 / mean, stated=rate)]
    if np.ptp(steps) <= _WOBBLE * mean or steps.min() < 0.0:
        return time, []
    repeats = int((steps == 0.0).sum())
    if not repeats and (grain > 0.5 * mean or np.abs(steps - mean).max() > 1.01 * grain):
        return time, []  # a frame was dropped, or the clock is uneven indeed
    step = float(np.polyfit(count, time, 1)[0])
    for likely in (stated, 1.0 / max(round(1.0 / step), 1)):  # a whole number of Hz before any other
        if likely is not None and abs(likely - step) * count[-1] <= grain:
            step = likely
            break
    even = float(np.mean(time - step * count)) + step * count
    if np.abs(even - time).max() > 0.75 * grain:  # half of it where rounded, more where cut off
        return time, []
    text = "its clock is rounded to {grain:g} s and was read as even steps of {rate:.5g} Hz"
    if not repeats:
        return even, [note("clock-rounded", text, grain=grain, rate=1.0 / step)]
    text += ": {repeats} stamps repeat"
    return even, [Notice("clock-repeats", text, grain=grain, rate=1.0 / step, repeats=repeats)]


def _is_rounded_step(steps: np.ndarray, stated: float, grain: float) -> bool:
    """Whether a clock of equal steps that is no whole number of Hz is the stated one, its step rounded."""
    mean = float(steps.mean())
    rate = 1.0 / mean
    even = float(np.ptp(steps)) < 1e-6 + _WOBBLE * mean
    return even and abs(rate - round(rate)) > 1e-4 * rate and abs(mean - stated) <= 0.5 * grain + 1e-9


def refuse_slow(path: pathlib.Path, time: np.ndarray, field: str, allowed: str) -> None:
    """Refuse a clock whose steps are too long for seconds."""
    step = float(np.nanmedian(np.diff(time))) if len(time) > 1 else 0.0
    if step > _LONGEST_STEP:
        problem = f"its time runs in steps of {step:g} s: milliseconds, or numbers of frames?"
        raise InputError(problem, file=path, field=field, allowed=allowed)


def check_clock(file: pathlib.Path, time: np.ndarray, field: str = "time") -> None:
    """Refuse a clock that stops, runs backward, jumps or has a value that is not a number."""
    if not np.all(np.isfinite(time)):
        row = int(np.argmin(np.isfinite(time)))
        raise InputError(f"row {row + 1} has no finite time", file=file, field=field, value=float(time[row]))
    steps = np.diff(time)
    if len(steps) == 0:
        raise InputError("has a single row", file=file, field=field, allowed="at least two")
    if np.any(steps <= 0.0):
        seen = f"time does not increase after {time[np.argmax(steps <= 0.0)]:g} s"
        raise InputError(seen, file=file, field=field)
    middle, mean = float(np.median(steps)), float(steps.mean())
    longest = max(_LONGEST_GAP, 3.0 * middle)
    if steps.max() > longest:
        k = int(np.argmax(steps))
        seen = f"time leaps from {time[k]:g} to {time[k + 1]:g} s"
        raise InputError(seen, file=file, field=field, allowed=f"steps of at most {longest:.3g} s")
    if middle < 0.99 * _SHORTEST_STEP or mean > _UNEVEN * middle:
        seen = f"its time runs in steps of {middle:g} s, {mean:g} s in the mean"
        raise InputError(seen, file=file, field=field, allowed=f"even steps from {_SHORTEST_STEP:g} s")


def nearest_of(known: np.ndarray, count: int) -> np.ndarray:
    """Of each of `count` samples, the nearest known one (count,)."""
    rows = np.arange(count)
    after = np.clip(np.searchsorted(known, rows), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    return np.asarray(np.where(rows - known[before] < known[after] - rows, known[before], known[after]))


def stretches(where: np.ndarray) -> list[tuple[int, int]]:
    """The first sample of each stretch in which something is true, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.r_[False, where, False].astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def fill_gaps(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Interpolate missing samples (NaN), and return where too many were missing."""
    from scipy.interpolate import PchipInterpolator

    known = np.isfinite(values)
    if known.all():
        return values, []
    if known.sum() < 2:
        return np.zeros_like(values), [(float(time[0]), float(time[-1]))]
    inside = np.clip(time, time[known][0], time[known][-1])
    filled = np.where(known, values, PchipInterpolator(time[known], values[known])(inside))
    hidden = []
    for start, stop in stretches(~known):
        span = float(time[max(start - 1, 0)]), float(time[min(stop, len(time) - 1)])
        if span[1] - span[0] > _LONGEST_GAP or start == 0 or stop == len(time):
            hidden.append(span)
    return filled, hidden


def evenly(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The signal in even steps of time, its own steps if they are even already."""
    steps = np.diff(time)
    step = float(np.median(steps))
    if np.abs(steps - step).max() <= 0.1 * step:
        return time, values
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / step) + 1)
    flat = values.reshape(len(values), -1)
    found = np.column_stack([np.interp(even, time, column) for column in flat.T])
    return even, found.reshape(len(even), *values.shape[1:])


def low_pass(time: np.ndarray, values: np.ndarray, cutoff: float) -> np.ndarray:
    """Second-order Butterworth low-pass, forward and backward, so that nothing is delayed."""
    from scipy.signal import butter, sosfiltfilt

    rate = (len(time) - 1) / (time[-1] - time[0])
    once = cutoff / _TWO_PASSES
    if cutoff <= 0.0 or once >= 0.49 * rate or len(time) < 16:
        return values
    sections = butter(2, once, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=min(len(time) - 1, int(rate / once))))
