"""Strides of one leg: from heel strike to the next, or closed from hardly a period."""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Keywords
from afo_sim.gait_lab.readers.signals import stretches
from afo_sim.gait_lab.trial import recorded_stride
from afo_sim.gait_lab.trial.events import (
    STANCE,
    STEP,
    FootEvents,
    find_events,
    period_by_force,
    period_by_motion,
    posture,
    posture_near,
    posture_return,
)
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact, find_contacts
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.travel import STRIDE

_MISSED = 1.6  # time of a stride, as a share of the others' median, that holds a strike that was missed [-]

_SAME = 0.15  # of force, kinematics and posture about one event, as a share of the stride [-] (assumed)
_ALONE = 0.7  # distance of a marked heel strike from any other, as a share of the stride [-] (assumed)
_SUNK = 0.75  # share of the toe's fall after heel strike that is over when a foot that landed on its heel
# beside the plate meets it [-] (derived: 0.84 and 0.87 in two such steps, 0 to 0.2 in seven on a plate)
_RAISED = 0.02  # height of the toe at heel strike from which on its fall is looked at [m] (assumed)
_WINDOWS = 41  # that are tried where a recording holds more than a period
_BARE = 0.01  # share of a period without force that is no gap in a stance [-] (assumed: a motion's sample)
_WAY_OUT = "a recording with a whole stride of this leg in view, or 95 % of one"
_Contacts = Sequence[PlateContact]
_SIGNALS = ("shank_angle", "knee_angle", "ankle_angle", "ankle_x", "ankle_z")


@dataclass(frozen=True)
class _Strike:
    time: float
    how: str
    contact: PlateContact | None = None


@dataclass(frozen=True)
class _Leg:
    """What is known of a leg."""

    motion: LegMotion
    events: FootEvents
    contacts: tuple[PlateContact, ...]  # that are steps
    beside: dict[PlateContact, str]  # those that begin with no heel strike of this foot, and why


def find_strides(
    motion: LegMotion, ground: GroundForce | None, other: LegMotion | None = None
) -> list[RecordedStride]:
    """All strides of a leg, with ground force or without."""
    leg, why = _known(motion, ground)
    if leg.events.reach < STEP:
        seen = f"the foot moves only {leg.events.reach:.2f} m against the body, which is not walking"
        raise InputError("no whole stride was found: " + "; ".join([seen, *why][:6]), allowed=_WAY_OUT)
    found = _whole(leg, _strikes(leg), why)
    whole = [contact for contact in leg.contacts if contact not in leg.beside]
    if any(stride.loaded for stride in found) or (found and not whole):
        return found
    closed = _closed_stride(motion, ground, whole, other, "; ".join(leg.beside.values()))
    if found:
        starts = {stride.start for stride in found}
        lost = [_incomplete(contact, leg) for contact in whole if contact.start not in starts]
        found[-1] = dataclasses.replace(found[-1], missing="; ".join([found[-1].missing, *lost]))
        usual = float(np.median([stride.time for stride in found]))
        if not isinstance(closed, RecordedStride) or abs(closed.time - usual) > _SAME * usual:
            return found
        return sorted([*found, closed] if closed.loaded else found, key=lambda stride: stride.start)
    if isinstance(closed, RecordedStride):
        return [closed]
    why = [str(closed), *why, *(_incomplete(contact, leg) for contact in whole)]
    raise InputError("no whole stride was found: " + "; ".join(why[:6]), allowed=_WAY_OUT)


def _known(motion: LegMotion, ground: GroundForce | None) -> tuple[_Leg, list[str]]:
    """The leg, and why contacts are no steps of it."""
    events = find_events(motion)
    contacts = steps(ground)
    steppable = tuple(contact for contact in contacts if contact.end - contact.start <= STRIDE[1])
    beside = {}
    for contact in steppable:
        if contact.begins and _inside(motion, contact.start):
            reason = beside_heel_strike(contact.start, motion, events)
            if reason:
                beside[contact] = f"{place(contact)}: {reason}"
    reason = "too long for a step; both feet on one plate, or wrong axes?"
    why = [f"{place(contact)}: {reason}" for contact in contacts if contact not in steppable]
    return _Leg(motion, events, steppable, beside), [*why, *beside.values()]


def _inside(motion: LegMotion, moment: float) -> bool:
    step = float(motion.time[1] - motion.time[0])
    return bool(motion.time[0] - step <= moment <= motion.time[-1] + step)


def _strikes(leg: _Leg) -> list[_Strike]:
    """Heel strikes within the motion, each once."""
    by_force = [
        _Strike(contact.start, recorded_stride.FORCE, contact)
        for contact in leg.contacts
        if contact.begins and contact not in leg.beside and _inside(leg.motion, contact.start)
    ]
    moments = list(leg.events.strikes)
    if by_force and (returned := posture_return(leg.motion, by_force[-1].time)):
        moments.append(returned)
    within = _SAME * leg.events.stride_time
    strikes = list(by_force)
    for moment in moments:
        if all(abs(moment - strike.time) > within for strike in strikes):
            strikes.append(_by_posture(leg, by_force, moment, within))
    for moment in leg.motion.marked:  # where neither force nor motion shows a heel strike
        near = any(abs(moment - strike.time) < _ALONE * leg.events.stride_time for strike in strikes)
        if not near and _inside(leg.motion, moment):
            strikes.append(_Strike(moment, recorded_stride.MARKED))
    return sorted(strikes, key=lambda strike: strike.time)


def _by_posture(leg: _Leg, by_force: Sequence[_Strike], moment: float, within: float) -> _Strike:
    """The strike about a kinematic event, at the posture of the nearest contact's if there is one."""
    for model in sorted(by_force, key=lambda strike: abs(strike.time - moment))[:1]:
        returned = posture_near(leg.motion, model.time, moment, within)
        if returned is None and abs(moment - leg.motion.time[-1]) < 1e-9:
            returned = moment  # the recording was cut at the heel strike
        if returned is not None:
            return _Strike(returned, recorded_stride.POSTURE)
    return _Strike(moment, leg.events.method)


def _whole(leg: _Leg, strikes: Sequence[_Strike], why: list[str]) -> list[RecordedStride]:
    """The strides between strikes; adds to `why` what is none."""
    found = []
    times = [second.time - first.time for first, second in itertools.pairwise(strikes)]
    for first, second in itertools.pairwise(strikes):
        time = second.time - first.time
        span = f"{first.time:.2f} to {second.time:.2f} s"
        gaps = [name for name, a, b in leg.motion.hidden if a < second.time and b > first.time]
        if not STRIDE[0] <= time <= STRIDE[1]:
            why.append(f"{span}: {time:.2f} s, and a stride lasts {STRIDE[0]:g} to {STRIDE[1]:g} s")
        elif time > _MISSED * float(np.median(times)):
            why.append(f"{span}: a heel strike in it was missed")
        elif _MISSED * time < float(np.median(times)):
            why.append(f"{span}: {time:.2f} s, where the other strides last {np.median(times):.2f} s")
        elif gaps:
            why.append(f"{span}: {gaps[0]} is missing for too long")
        else:
            found.append(_stride(leg, first, second))
    return found


def _stride(leg: _Leg, first: _Strike, second: _Strike) -> RecordedStride:
    time = second.time - first.time
    off = next((time for time in leg.events.toe_offs if time > first.time + 0.1), None)
    missing = "the ground force is missing"
    if first.contact is not None:
        missing = _left_early(first.contact, off, second.time)
        off = off if missing else first.contact.end
    if off is None or off >= second.time:
        off = first.time + STANCE * time
    for contact, reason in leg.beside.items():
        if missing and contact.start < off and contact.end > first.time:
            missing += f" in part ({reason})"
    known = leg.motion.side, first.time, second.time, off, first.how
    return RecordedStride(*known, loaded=not missing, end_by=second.how, missing=missing)


def _left_early(contact: PlateContact, off: float | None, end: float) -> str:
    """Why a contact that begins with a stride does not hold its whole stance; empty if it does."""
    early = 0.0 if off is None else off - contact.end
    if not contact.ends:
        seen = "the plate's recording ends before the toe-off"
    elif contact.end > end:
        seen = "the foot is on the plate beyond its next heel strike"
    elif abs(early) > _SAME * (end - contact.start):
        when = "before" if early > 0.0 else "after"
        seen = f"the foot leaves the plate {abs(early):.2f} s {when} its toe-off"
    else:
        return ""
    return f"the ground force is missing in part ({seen})"


def _incomplete(contact: PlateContact, leg: _Leg) -> str:
    """Why a contact that is a step begins no stride."""
    first, last = leg.motion.time[0], leg.motion.time[-1]
    next_strike = contact.start + leg.events.stride_time
    why = "the motion ends before the next heel strike"
    if any(start < next_strike and end > contact.start for _, start, end in leg.motion.hidden):
        why = "the leg is not visible throughout its stride"
    elif not contact.begins:
        why = "its beginning was not recorded"
    elif not contact.ends:
        why = "its end was not recorded"
    elif not first <= contact.start <= last:
        why = f"the motion is known from {first:.2f} to {last:.2f} s"
    return f"{place(contact)}: {why}"


def steps(ground: GroundForce | None) -> list[PlateContact]:
    """The foot's own contacts; those of one step that lay on two plates as one."""
    merged: list[PlateContact] = []
    for contact in sorted(ground.contacts, key=lambda c: c.start) if ground else ():
        if merged and contact.start < merged[-1].end:
            last = max(merged[-1], contact, key=lambda c: c.end)
            merged[-1] = dataclasses.replace(merged[-1], end=last.end, ends=last.ends)
        else:
            merged.append(contact)
    return merged


def place(contact: PlateContact) -> str:
    """The contact in words."""
    return f"contact {contact.start:.2f} to {contact.end:.2f} s"


def beside_heel_strike(start: float, motion: LegMotion, events: FootEvents) -> str:
    """Why a contact does not begin with heel strike, in words; empty if it does, or nothing shows it."""
    if not events.strikes:
        return ""
    time = events.stride_time
    around = [*events.strikes]
    if max(len(events.strikes), len(events.toe_offs)) > 1:  # else the stride's time is not seen, but usual
        around += [events.strikes[0] - time, events.strikes[-1] + time]
    strike = min(around, key=lambda moment: abs(moment - start))
    late = start - strike
    if _SAME * time < abs(late) < 0.5 * time:
        return f"it begins {late:+.2f} s from the foot's heel strike; another foot's, or a part of a step?"
    if late > 0.0 and _sunk(motion, strike, start, time) > _SUNK:
        return f"the heel landed {late:.2f} s before, beside the plate, or the clocks differ"
    return ""


def _sunk(motion: LegMotion, strike: float, start: float, time: float) -> float:
    """Share of the toe's fall after a heel strike that is over at `start` [-]; 0 if the foot lands flat."""
    height = motion.toe[:, 1]
    soon = (motion.time >= strike) & (motion.time <= strike + 0.3 * time)
    if not soon.any():
        return 0.0
    up, now = np.interp([strike, start], motion.time, height) - height[soon].min()
    return float((up - now) / up) if up > _RAISED else 0.0


def _steps_without_motion(ground: GroundForce, own: _Contacts) -> list[PlateContact]:
    """Contacts before and after the motion on plates that only this foot was seen on."""
    if not own:
        return []
    first, last = own[0].start, own[-1].end
    plates = {contact.plate for contact in own} - {contact.plate for contact in ground.foreign}
    found = [c for name in sorted(plates) for c in find_contacts(name, *ground.plates[name])]
    return sorted((c for c in found if c.end < first or c.start > last), key=lambda c: c.start)


def _closed_stride(
    motion: LegMotion, ground: GroundForce | None, contacts: _Contacts, other: LegMotion | None, missing: str
) -> RecordedStride | str:
    """Close the longest visible part of the motion to a stride, or return why not."""
    seen = _longest_seen(motion)
    length = float(seen.time[-1] - seen.time[0])
    around = [*contacts, *_steps_without_motion(ground, contacts)] if ground else []
    starts = sorted(contact.start for contact in around if contact.begins)
    period, how = period_by_force(starts, seen), recorded_stride.FORCE
    if period is None:
        found, how = period_by_motion(seen, other), "the leg's motion"
        if isinstance(found, str):
            return found
        period = found
    if length < (1.0 - recorded_stride.WIDEST) * period:
        return recorded_stride.too_short(length, period)
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
    return dataclasses.replace(best, missing=f"the ground force is missing{part}")


def _longest_seen(motion: LegMotion) -> LegMotion:
    """The longest stretch of the motion in which nothing is hidden."""
    seen = np.ones(len(motion.time), dtype=bool)
    for _, start, end in motion.hidden:
        seen &= (motion.time <= start) | (motion.time >= end)
    first, stop = max(stretches(seen), key=lambda run: run[1] - run[0], default=(0, 0))
    part = slice(first, max(first + 2, stop))
    arrays: Keywords = {
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
    first = np.linspace(time[0], time[-1] - period, _WINDOWS)
    now, then = (np.column_stack([np.interp(t, time, c) for c in state.T]) for t in (first, first + period))
    for start in first[np.argsort(np.linalg.norm(then - now, axis=1))]:
        yield float(start), float(start + period)


def _closed(
    motion: LegMotion, ground: GroundForce | None, contacts: _Contacts, starts: Sequence[float],
    window: tuple[float, float], period: float, how: str,
) -> RecordedStride:  # fmt: skip
    residual = {name: _seam(motion.time, getattr(motion, name), window, period) for name in _SIGNALS}
    length = -residual["ankle_x"]
    if motion.pelvis_x is not None:
        length = -_seam(motion.time, motion.pelvis_x, window, period)
    residual["ankle_x"] += length
    unrolled = _unrolled(motion, window, period, length)
    events = find_events(unrolled)
    strike, by = _strike(unrolled, events, starts, window, period)
    toe_off = _toe_off(events, [c.end for c in contacts if c.ends], strike, period)
    # whether plates carry the whole stance, a period before or later counted
    stance = np.linspace(strike, toe_off, 201)[2:-2]
    when = window[0] + (stance - window[0]) % period
    known, on = when <= window[1], np.zeros(len(when), dtype=bool)
    for contact in contacts:
        on |= (when >= contact.start - _BARE * period) & (when <= contact.end + _BARE * period)
    loaded = bool(on[known].all() and known.mean() > 0.5)
    if loaded and ground and ground.time[0] <= window[0] and ground.time[-1] >= window[1]:
        for name in ("force_x", "force_z"):
            residual[name] = _seam(ground.time, getattr(ground, name), window, period)
    gap = max(0.0, period - (window[1] - window[0]))
    closed = recorded_stride.Closing(window, gap, residual, how, length)
    ends = motion.side, strike, strike + period, toe_off, by
    return RecordedStride(*ends, loaded=loaded, closed=closed)


def _seam(time: np.ndarray, values: np.ndarray, window: tuple[float, float], period: float) -> float:
    return float(recorded_stride.seam(time, values[:, None], window, period, 0.0)[0])


def _unrolled(motion: LegMotion, window: tuple[float, float], period: float, length: float) -> LegMotion:
    """The motion of the window, three periods of it."""
    step = float(motion.time[1] - motion.time[0])
    time = np.arange(window[0] - period, window[0] + 2.0 * period, step)
    changed: Keywords = {"time": time}
    for field in dataclasses.fields(motion):
        values = getattr(motion, field.name)
        if field.name == "time" or not isinstance(values, np.ndarray):
            continue
        columns = values.reshape(len(values), -1)
        travel = np.zeros(columns.shape[1])
        travel[0] = length if field.name in ("ankle_x", "heel", "toe", "pelvis_x") else 0.0
        again = recorded_stride.repeated(motion.time, columns, window, period, travel, time)
        changed[field.name] = again.reshape(len(time), *values.shape[1:])
    return dataclasses.replace(motion, **changed)


def _strike(
    motion: LegMotion, events: FootEvents, starts: Sequence[float], window: tuple[float, float], period: float
) -> tuple[float, str]:
    """The heel strike nearest to the window's middle, by force if the kinematics agree; its evidence."""
    middle = 0.5 * (window[0] + window[1])
    for start in sorted(starts, key=lambda start: abs(start - middle)):
        place = window[0] + (start - window[0]) % period
        if abs(start - middle) < period and not beside_heel_strike(place, motion, events):
            return start, recorded_stride.FORCE
    if events.strikes:
        return min(events.strikes, key=lambda s: abs(s - middle)), events.method
    return window[0], recorded_stride.BEGINNING


def _toe_off(events: FootEvents, by_force: Sequence[float], strike: float, period: float) -> float:
    """The toe-off after a heel strike, by force where a contact's end is near the kinematics' [s]."""
    if not events.toe_offs:
        return strike + ((by_force[0] - strike) % period if by_force else STANCE * period)
    moved = (events.toe_offs[0] - strike) % period
    shares = [(off - strike) % period for off in by_force]
    near = [share for share in shares if abs(share - moved) < _SAME * period]
    return strike + (min(near, key=lambda share: abs(share - moved)) if near else moved)
