"""Strides of one leg: from heel strike to the next, cut and brought to gait phase."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.ground_force import GroundForce, PlateContact
from afo_sim.gait.readers.leg_motion import LegMotion
from afo_sim.gait.readers.signals import low_pass

STRIDE = (0.5, 2.5)  # shortest and longest time of a stride [s]
AGREEMENT = 0.1  # of posture and force about a heel strike, as a share of the stride [-]
SMOOTH = 6.0  # low-pass for comparing postures [Hz]
STRANGER = 0.5  # largest distance of two postures that are taken for the same [rad]


@dataclass(frozen=True)
class RecordedStride:
    """Heel strike to heel strike [s]."""

    start: float
    end: float
    toe_off: float
    by: str  # evidence of the second heel strike: "force" or "posture"

    @property
    def time(self) -> float:
        """Its duration [s]."""
        return self.end - self.start

    def window(self, share: tuple[float, float]) -> tuple[float, float]:
        """From when to when a part of the stride lasts [s]."""
        return self.start + share[0] * self.time, self.start + share[1] * self.time


def find_strides(ground: GroundForce, motion: LegMotion) -> list[RecordedStride]:
    """Strides that begin with a contact seen as a whole.

    A stride ends with the next contact of the foot. Where no plate lies there, it ends when the leg's
    posture comes back to that of its first heel strike, found by the angles and their velocities.

    Raises
    ------
    InputError
        There is no such stride; says why of each contact.
    """
    contacts = _merged(ground.contacts)
    found, why = [], []
    for k, contact in enumerate(contacts):
        place = f"contact {contact.start:.2f} to {contact.end:.2f} s: "
        if contact.end - contact.start > STRIDE[1]:
            why.append(place + "too long for a step; both feet on one plate, or wrong axes?")
            continue
        if not contact.whole:
            why.append(place + "its beginning or end is not on the recording")
            continue
        if not motion.time[0] <= contact.start <= motion.time[-1]:
            why.append(place + f"the motion is known from {motion.time[0]:.2f} to {motion.time[-1]:.2f} s")
            continue
        end, by = _next_strike(contact, contacts[k + 1 :], motion)
        if end is None:
            why.append(place + "the motion ends before the next heel strike")
            continue
        gaps = [name for name, a, b in motion.hidden if a < end and b > contact.start]
        if gaps:
            why.append(place + f"marker {gaps[0]} is missing for too long")
            continue
        found.append(RecordedStride(contact.start, end, contact.end, by))
    if not found:
        raise InputError("no whole stride was found: " + "; ".join(why[:6]))
    return found


def posture_return(motion: LegMotion, start: float) -> float | None:
    """First time after `start` at which the leg's posture returns [s]; None if the motion ends before.

    Posture is shank, knee and ankle angle and a tenth of a second of their velocities; the return is the
    nearest approach, to a part of a sample, of the first cycle.
    """
    angles = np.column_stack([motion.shank_angle, motion.knee_angle, motion.ankle_angle])
    angles = low_pass(motion.time, angles, SMOOTH)  # else velocities of unfiltered data are noise
    state = np.hstack([angles, 0.1 * np.gradient(angles, motion.time, axis=0)])
    here = np.array([np.interp(start, motion.time, column) for column in state.T])
    distance = np.linalg.norm(state - here, axis=1)
    later = (motion.time >= start + STRIDE[0]) & (motion.time <= start + STRIDE[1])
    inner = np.flatnonzero(later[1:-1]) + 1
    lows = inner[(distance[inner] <= distance[inner - 1]) & (distance[inner] < distance[inner + 1])]
    lows = lows[distance[lows] < STRANGER]
    if not len(lows) and later[-1] and distance[-2] > distance[-1] < 0.5 * STRANGER:
        return float(motion.time[-1])  # the recording was cut at the heel strike
    if not len(lows):
        return None
    k = int(lows[np.argmax(distance[lows] < 2.0 * distance[lows].min() + 0.05)])
    left, middle, right = distance[k - 1 : k + 2] ** 2
    bend = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / bend if bend > 0.0 else 0.0
    return float(motion.time[k] + shift * (motion.time[1] - motion.time[0]))


def _next_strike(
    contact: PlateContact, later: list[PlateContact], motion: LegMotion
) -> tuple[float | None, str]:
    """The next heel strike: a contact's beginning where posture agrees, or else posture's own."""
    returned = posture_return(motion, contact.start)
    if returned is None:
        return None, ""
    for following in later:
        if abs(following.start - returned) < AGREEMENT * (returned - contact.start):
            return min(following.start, float(motion.time[-1])), "force"
    return returned, "posture"


def _merged(contacts: tuple[PlateContact, ...]) -> list[PlateContact]:
    """Contacts of one step that lay on two plates as one."""
    merged: list[PlateContact] = []
    for contact in contacts:
        if merged and contact.start < merged[-1].end:
            last = merged.pop()
            whole = last.whole and contact.whole
            merged.append(PlateContact(last.plate, last.start, max(last.end, contact.end), whole, own=True))
        else:
            merged.append(contact)
    return merged
