"""Strides of one leg: from heel strike to the next."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.trial.closed_stride import closed_stride
from afo_sim.gait_lab.trial.events import STANCE, STEP, FootEvents, find_events
from afo_sim.gait_lab.trial.foot_contacts import SAME, begins, beside_heel_strike, ends, place, refused, steps
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.posture import posture_near, posture_return
from afo_sim.gait_lab.trial.recorded_stride import Closing, RecordedStride
from afo_sim.gait_lab.trial.travel import STRIDE

__all__ = ["Closing", "RecordedStride", "find_strides", "posture_return"]

MISSED = 1.6  # time of a stride, as a share of the others' median, that holds a strike that was missed [-]


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
    ground: GroundForce | None
    contacts: tuple[PlateContact, ...]  # that are steps
    beside: dict[PlateContact, str]  # those that begin with no heel strike of this foot, and why


def find_strides(motion: LegMotion, ground: GroundForce | None) -> list[RecordedStride]:
    """All strides of a leg, with ground force or without.

    A stride begins and ends with the beginning of a contact where the foot meets a plate. Elsewhere the
    kinematics tell that there is a heel strike. Its time is that at which the leg's posture comes back to
    that of the nearest contact, or the kinematics' own if there is no contact. A recording without such a
    stride, or with none that is loaded, is closed to one if it holds 95 % of a period.
    """
    leg, why = _known(motion, ground)
    if leg.events.reach < STEP:
        seen = f"the foot moves only {leg.events.reach:.2f} m against the body, which is no walk"
        raise InputError("no whole stride was found: " + "; ".join([seen, *why][:6]))
    found = _whole(leg, _strikes(leg), why)
    whole = [contact for contact in leg.contacts if contact not in leg.beside]
    if any(stride.loaded for stride in found) or (found and not whole):
        return found
    closed = closed_stride(motion, ground, whole, "; ".join(leg.beside.values()))
    if found:
        usual = float(np.median([stride.time for stride in found]))
        if not isinstance(closed, RecordedStride) or abs(closed.time - usual) > SAME * usual:
            return found
        return sorted([*found, closed] if closed.loaded else found, key=lambda stride: stride.start)
    if isinstance(closed, RecordedStride):
        return [closed]
    why = [str(closed), *why, *(_incomplete(contact, leg) for contact in whole)]
    raise InputError("no whole stride was found: " + "; ".join(why[:6]))


def _known(motion: LegMotion, ground: GroundForce | None) -> tuple[_Leg, list[str]]:
    """The leg, and why contacts are no steps of it."""
    events = find_events(motion)
    contacts = steps(ground)
    steppable = tuple(contact for contact in contacts if not refused(contact))
    beside = {}
    for contact in steppable:
        if ground and begins(contact, ground) and _inside(motion, contact.start):
            reason = beside_heel_strike(contact.start, motion, events)
            if reason:
                beside[contact] = f"{place(contact)}: {reason}"
    why = [f"{place(contact)}: {refused(contact)}" for contact in contacts if refused(contact)]
    return _Leg(motion, events, ground, steppable, beside), [*why, *beside.values()]


def _inside(motion: LegMotion, moment: float) -> bool:
    """Whether the motion is known at a moment, or a sample from it."""
    step = float(motion.time[1] - motion.time[0])
    return bool(motion.time[0] - step <= moment <= motion.time[-1] + step)


def _strikes(leg: _Leg) -> list[_Strike]:
    """Heel strikes within the motion, each once."""
    by_force = [
        _Strike(contact.start, "force", contact)
        for contact in leg.contacts
        if leg.ground
        and begins(contact, leg.ground)
        and contact not in leg.beside
        and _inside(leg.motion, contact.start)
    ]
    moments = list(leg.events.strikes)
    if by_force and (returned := posture_return(leg.motion, by_force[-1].time)):
        moments.append(returned)
    within = SAME * leg.events.stride_time
    strikes = list(by_force)
    for moment in moments:
        if all(abs(moment - strike.time) > within for strike in strikes):
            strikes.append(_by_posture(leg, by_force, moment, within))
    return sorted(strikes, key=lambda strike: strike.time)


def _by_posture(leg: _Leg, by_force: Sequence[_Strike], moment: float, within: float) -> _Strike:
    """The strike about a kinematic event, at the posture of the nearest contact's if there is one."""
    for model in sorted(by_force, key=lambda strike: abs(strike.time - moment))[:1]:
        returned = posture_near(leg.motion, model.time, moment, within)
        if returned is None and abs(moment - leg.motion.time[-1]) < 1e-9:
            returned = moment  # the recording was cut at the heel strike
        if returned is not None:
            return _Strike(returned, "the leg's posture")
    return _Strike(moment, f"heel strike by {leg.events.method}")


def _whole(leg: _Leg, strikes: Sequence[_Strike], why: list[str]) -> list[RecordedStride]:
    """The strides between strikes; adds to `why` what is none."""
    found = []
    times = [second.time - first.time for first, second in itertools.pairwise(strikes)]
    for first, second in itertools.pairwise(strikes):
        time = second.time - first.time
        span = f"{first.time:.2f} to {second.time:.2f} s"
        gaps = [name for name, a, b in leg.motion.hidden if a < second.time and b > first.time]
        if not STRIDE[0] <= time <= STRIDE[1]:
            why.append(f"{span}: {time:.2f} s are no stride")
        elif time > MISSED * float(np.median(times)):
            why.append(f"{span}: a heel strike in it was missed")
        elif gaps:
            why.append(f"{span}: {gaps[0]} is missing for too long")
        else:
            found.append(_stride(leg, first, second))
    return found


def _stride(leg: _Leg, first: _Strike, second: _Strike) -> RecordedStride:
    time = second.time - first.time
    off = leg.events.toe_off_after(first.time)
    by = first.how if first.how == second.how else f"{first.how}, its end by {second.how}"
    missing = "the ground force is missing"
    if first.contact is not None:
        missing = _left_early(leg, first.contact, off, second.time)
        off = off if missing else first.contact.end
    if off is None or off >= second.time:
        off = first.time + STANCE * time
    for contact, reason in leg.beside.items():
        if missing and contact.start < off and contact.end > first.time:
            missing += f" in part ({reason})"
    by += f"; {missing}" if missing else ""
    return RecordedStride(leg.motion.side, first.time, second.time, off, by, loaded=not missing)


def _left_early(leg: _Leg, contact: PlateContact, off: float | None, end: float) -> str:
    """Why a contact that begins with a stride does not hold its whole stance; empty if it does."""
    if leg.ground and not ends(contact, leg.ground):
        return "the ground force is missing in part (the plate's recording ends before the toe-off)"
    early = 0.0 if off is None else off - contact.end
    if contact.end > end or abs(early) > SAME * (end - contact.start):
        seen = f"the foot leaves the plate {abs(early):.2f} s from its toe-off"
        return f"the ground force is missing in part ({seen})"
    return ""


def _incomplete(contact: PlateContact, leg: _Leg) -> str:
    """Why a contact that is a step begins no stride."""
    known = leg.motion.time[0], leg.motion.time[-1]
    if leg.ground and not begins(contact, leg.ground):
        return f"{place(contact)}: its beginning is not on the recording"
    if leg.ground and not ends(contact, leg.ground):
        return f"{place(contact)}: its end is not on the recording"
    if not known[0] <= contact.start <= known[1]:
        return f"{place(contact)}: the motion is known from {known[0]:.2f} to {known[1]:.2f} s"
    return f"{place(contact)}: the motion ends before the next heel strike"
