"""A stride from a recording that holds hardly a period of walking, or no heel strike at its ends."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from afo_sim.gait_lab.trial.closing import WIDEST, repeated, seam, too_short
from afo_sim.gait_lab.trial.events import STANCE, FootEvents, find_events
from afo_sim.gait_lab.trial.foot_contacts import SAME, begins, beside_heel_strike, ends, steps_without_motion
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.period import period_by_force, period_by_motion
from afo_sim.gait_lab.trial.posture import posture
from afo_sim.gait_lab.trial.recorded_stride import Closing, RecordedStride

WINDOWS = 41  # that are tried where a recording holds more than a period
BARE = 0.01  # share of a period without force that is no gap in a stance [-] (assumed: a motion's sample)
SIGNALS = ("shank_angle", "knee_angle", "ankle_angle", "ankle_x", "ankle_z")


def closed_stride(
    motion: LegMotion, ground: GroundForce | None, contacts: Sequence[PlateContact], missing: str = ""
) -> RecordedStride | str:
    """Close the longest part of the motion that was seen to a stride, or say why not."""
    seen = _longest_seen(motion)
    length = float(seen.time[-1] - seen.time[0])
    around = [*contacts, *(steps_without_motion(ground, contacts) if ground else ())]
    starts = sorted(c.start for c in around if ground and begins(c, ground))
    period, how = period_by_force(starts, seen), "force"
    if period is None:
        period, how = period_by_motion(seen), "the leg's motion"
    if period is None:
        return f"the leg's motion does not come back within its {length:.2f} s"
    if length < (1.0 - WIDEST) * period:
        return too_short(length, period)
    best: RecordedStride | None = None
    for window in _windows(seen, period):
        stride = _closed(seen, ground, contacts, starts, window, period, how)
        best = best or stride
        if stride.loaded:
            return stride
        if not contacts:
            break
    assert best is not None
    part = f" in part ({missing})" if missing else ""
    return dataclasses.replace(best, by=f"{best.by}; the ground force is missing{part}")


def _longest_seen(motion: LegMotion) -> LegMotion:
    """The longest stretch of the motion in which nothing is hidden."""
    hidden = np.zeros(len(motion.time) + 2, dtype=bool)
    hidden[[0, -1]] = True
    for _, start, end in motion.hidden:
        hidden[1:-1] |= (motion.time > start) & (motion.time < end)
    edges = np.flatnonzero(hidden)
    k = int(np.argmax(np.diff(edges)))
    part = slice(int(edges[k]), max(int(edges[k]) + 2, int(edges[k + 1]) - 1))
    arrays: dict[str, Any] = {
        f.name: getattr(motion, f.name)[part]
        for f in dataclasses.fields(motion)
        if isinstance(getattr(motion, f.name), np.ndarray)
    }
    return dataclasses.replace(motion, hidden=(), **arrays)


def _windows(motion: LegMotion, period: float) -> Iterator[tuple[float, float]]:
    """Windows of a period, those first that close best; the whole motion if it is shorter."""
    time = motion.time
    if time[-1] - time[0] <= period:
        yield float(time[0]), float(time[-1])
        return
    state = posture(motion)
    first = np.linspace(time[0], time[-1] - period, WINDOWS)
    now, then = (np.column_stack([np.interp(t, time, c) for c in state.T]) for t in (first, first + period))
    for start in first[np.argsort(np.linalg.norm(then - now, axis=1))]:
        yield float(start), float(start + period)


def _closed(
    motion: LegMotion,
    ground: GroundForce | None,
    contacts: Sequence[PlateContact],
    starts: Sequence[float],
    window: tuple[float, float],
    period: float,
    how: str,
) -> RecordedStride:
    residual = {name: _seam(motion.time, getattr(motion, name), window, period) for name in SIGNALS}
    length = -residual["ankle_x"]
    if motion.pelvis_x is not None:
        length = -_seam(motion.time, motion.pelvis_x, window, period)
    residual["ankle_x"] += length
    unrolled = _unrolled(motion, window, period, length)
    events = find_events(unrolled)
    strike, by = _strike(unrolled, events, starts, window, period)
    off = [c.end for c in contacts if ground and ends(c, ground)]
    toe_off = _toe_off(events, off, strike, period)
    loaded = _covered(contacts, strike, toe_off, window, period)
    if loaded and ground and ground.time[0] <= window[0] and ground.time[-1] >= window[1]:
        for name in ("force_x", "force_z"):
            residual[name] = _seam(ground.time, getattr(ground, name), window, period)
    gap = max(0.0, period - (window[1] - window[0]))
    return RecordedStride(
        side=motion.side,
        start=strike,
        end=strike + period,
        toe_off=toe_off,
        by=f"{by}; closed over a gap of {1e3 * gap:.0f} ms, its period by {how}",
        loaded=loaded,
        closed=Closing(window, gap, residual, length),
    )


def _seam(time: np.ndarray, values: np.ndarray, window: tuple[float, float], period: float) -> float:
    return float(seam(time, values[:, None], window, period, 0.0)[0])


def _unrolled(motion: LegMotion, window: tuple[float, float], period: float, length: float) -> LegMotion:
    """The motion of the window, three periods of it."""
    step = float(motion.time[1] - motion.time[0])
    time = np.arange(window[0] - period, window[0] + 2.0 * period, step)
    changed: dict[str, Any] = {"time": time}
    for field in dataclasses.fields(motion):
        values = getattr(motion, field.name)
        if field.name == "time" or not isinstance(values, np.ndarray):
            continue
        columns = values.reshape(len(values), -1)
        travel = np.zeros(columns.shape[1])
        travel[0] = length if field.name in ("ankle_x", "heel", "toe", "pelvis_x") else 0.0
        again = repeated(motion.time, columns, window, period, travel, time)
        changed[field.name] = again.reshape(len(time), *values.shape[1:])
    return dataclasses.replace(motion, **changed)


def _strike(
    motion: LegMotion,
    events: FootEvents,
    starts: Sequence[float],
    window: tuple[float, float],
    period: float,
) -> tuple[float, str]:
    """The heel strike nearest to the window's middle, by force if the kinematics agree; its evidence."""
    middle = 0.5 * (window[0] + window[1])
    for start in sorted(starts, key=lambda start: abs(start - middle)):
        place = window[0] + (start - window[0]) % period
        if abs(start - middle) < period and not beside_heel_strike(place, motion, events):
            return start, "force"
    if events.strikes:
        return min(events.strikes, key=lambda s: abs(s - middle)), f"heel strike by {events.method}"
    return window[0], "the beginning of the recording, for want of a heel strike"


def _toe_off(events: FootEvents, by_force: Sequence[float], strike: float, period: float) -> float:
    """The toe-off after a heel strike, by force where a contact's end is near the kinematics' [s]."""
    if not events.toe_offs:
        return strike + ((by_force[0] - strike) % period if by_force else STANCE * period)
    moved = (events.toe_offs[0] - strike) % period
    shares = [(off - strike) % period for off in by_force]
    near = [share for share in shares if abs(share - moved) < SAME * period]
    return strike + (min(near, key=lambda share: abs(share - moved)) if near else moved)


def _covered(
    contacts: Sequence[PlateContact],
    strike: float,
    toe_off: float,
    window: tuple[float, float],
    period: float,
) -> bool:
    """Whether plates carry the whole stance, a period before or later counted."""
    stance = np.linspace(strike, toe_off, 201)[2:-2]
    when = window[0] + (stance - window[0]) % period
    known = when <= window[1]
    on = np.zeros(len(when), dtype=bool)
    for contact in contacts:
        on |= (when >= contact.start - BARE * period) & (when <= contact.end + BARE * period)
    return bool(on[known].all() and known.mean() > 0.5)
