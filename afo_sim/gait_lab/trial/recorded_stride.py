"""A recorded stride: its signals over phase; a recording that holds hardly a period is closed to one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError

_AROUND = 50  # samples beside a stride that its spline knows: 0.27^50 is nothing (de Boor 1978)
WIDEST = 0.05  # gap that is bridged, as a share of the period [-] (assumed: 0.1 to 0.3 deg in a known walk)
# Evidence of a heel strike, beside the methods by which a foot lands.
FORCE, POSTURE, MARKED = "force", "the leg's posture", "the laboratory's event"
Window = tuple[float, float]  # of the recording that is used [s]
BEGINNING = "the beginning of the recording, for want of a heel strike"


@dataclass(frozen=True)
class Closing:
    """How a recording without a whole stride was closed to one."""

    window: Window
    gap: float  # between its end and its beginning one period later [s]
    residual: Mapping[str, float]  # difference of the two ends that their velocities do not explain, by the
    # name of the motion's signal [rad], [m] or the ground's [N]; it is spread evenly over the period
    period_by: str  # evidence of its period: FORCE, or "the leg's motion"
    length: float  # of the stride: the way of the pelvis, or else of the ankle, that is continuous across
    # the gap [m]; residual["ankle_x"] is what the ankle's own would differ by


@dataclass(frozen=True)
class RecordedStride:
    """Heel strike to heel strike of one foot."""

    side: str  # "right" or "left"
    start: float  # [s]; may lie outside the recording if the stride is closed, as `end` may
    end: float  # [s]
    toe_off: float  # [s]
    start_by: str  # evidence of its start: one of those above, or the method by which a foot lands
    loaded: bool  # the whole stance is on plates
    closed: Closing | None = None
    end_by: str = ""  # evidence of its end; empty: the same
    missing: str = ""  # why the ground force is missing, wholly or in part; empty where it is not

    @property
    def by(self) -> str:
        """Evidence for its ends, how it was closed, and what is missing, in words."""
        parts = [_heel_strike(self.start_by)]
        if self.end_by not in ("", self.start_by):
            parts[0] += f", its end by {_heel_strike(self.end_by)}"
        if self.closed is not None:
            gap = 1e3 * self.closed.gap
            parts.append(f"closed over a gap of {gap:.0f} ms, its period by {self.closed.period_by}")
        return "; ".join([*parts, self.missing] if self.missing else parts)

    @property
    def time(self) -> float:
        """Its duration [s]."""
        return self.end - self.start


def _heel_strike(by: str) -> str:
    return by if by in (FORCE, POSTURE, MARKED, BEGINNING) else f"heel strike by {by}"


def sample(
    time: np.ndarray, values: np.ndarray, stride: RecordedStride, phase: np.ndarray, travels: Sequence[bool],
    slack: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Signals at phases of a stride."""
    from scipy.interpolate import CubicSpline

    at = stride.start + np.asarray(phase, dtype=float) * stride.time
    found = np.full((len(at), values.shape[1]), np.nan)
    known = np.isfinite(values).all(axis=0)
    if stride.closed is None:
        step = float(time[1] - time[0])
        inside = (at >= time[0] - step) & (at <= time[-1] + step)
        near = slice(*np.searchsorted(time, (at.min() - _AROUND * step, at.max() + _AROUND * step)))
        time, values = time[near], values[near]  # a spline does not feel samples so far away
        found[np.ix_(inside, known)] = CubicSpline(time, values[:, known])(at[inside])
        return found
    window = _within(time, stride.closed.window, slack)
    travel = stride.closed.length * np.asarray(travels, dtype=float)[known]
    found[:, known] = repeated(time, values[:, known], window, stride.time, travel, at, 2.0 * slack)
    return found


def _within(time: np.ndarray, window: Window, slack: float) -> tuple[float, float]:
    """The window as far as signals reach, where they end within some slack of it and beyond a sample."""
    step = float(time[1] - time[0])
    start, end = window
    if start + step < time[0] <= start + slack + 0.5 * step:  # half a step, for clocks that are rounded
        start = float(time[0])
    if end - slack - 0.5 * step <= time[-1] < end - step:
        end = float(time[-1])
    return start, end


def repeated(
    time: np.ndarray, values: np.ndarray, window: Window, period: float, travel: np.ndarray, at: np.ndarray,
    slack: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Signals of a window, repeated every period, at any time."""
    from scipy.interpolate import CubicSpline

    start, end = window
    step = float(time[1] - time[0])
    if time[0] > start + step or time[-1] < end - step:
        raise InputError(
            f"the signals last from {time[0]:.3f} to {time[-1]:.3f} s, "
            f"the stride needs {start:.3f} to {end:.3f} s"
        )
    if period - (end - start) > (WIDEST + 1e-9) * period + slack:
        raise InputError(too_short(end - start, period))
    slope = (seam(time, values, window, period, travel) - travel) / period
    nodes = np.linspace(start, end, max(4, round((end - start) / step) + 1))
    if start + period - end < 0.5 * step:
        nodes = nodes[:-1]  # the same instant as the period's end
    middle = 0.5 * (start + end)
    level = CubicSpline(time, values)(nodes) + np.outer(nodes - middle, slope)
    wave = CubicSpline(np.r_[nodes, start + period], np.vstack([level, level[:1]]), bc_type="periodic")
    return np.asarray(wave(start + (at - start) % period) + np.outer(at - middle, travel / period))


def seam(
    time: np.ndarray, values: np.ndarray, window: Window, period: float, travel: np.ndarray | float
) -> np.ndarray:
    """What the window's beginning, a period later, is above where its end and both velocities lead (k,)."""
    from scipy.interpolate import CubicSpline

    signal = CubicSpline(time, values)
    gap = period - (window[1] - window[0])
    value, velocity, acceleration = (signal(np.array(window), order) for order in range(3))
    led = value[1] + 0.5 * gap * velocity.sum(axis=0) + gap**2 / 12.0 * (acceleration[1] - acceleration[0])
    return np.asarray(value[0] + travel - led)


def too_short(length: float, period: float) -> str:
    """The sentence that refuses a gap."""
    share = np.floor(1000.0 * length / period) / 10.0
    return (
        f"the motion is seen for {length:.3f} s at a stretch, {share:.1f} % of a period of {period:.3f} s; "
        f"at least {100.0 * (1.0 - WIDEST):.0f} % are needed to close it"
    )
