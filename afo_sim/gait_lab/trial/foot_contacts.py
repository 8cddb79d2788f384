"""One foot's steps on the plates: contacts put together, and their ends that are no recording's."""

from collections.abc import Sequence

import numpy as np

from afo_sim.gait_lab.trial.events import FootEvents
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact, find_contacts
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.travel import STRIDE

SAME = 0.15  # of force, kinematics and posture about one event, as a share of the stride [-] (assumed)
SUNK = 0.7  # share of the toe's fall after heel strike that is over when a foot that landed on its heel
# beside the plate meets it [-] (derived: 0.8 and 0.9 in two such steps, 0 to 0.2 in seven on a plate)
RAISED = 0.02  # height of the toe at heel strike from which on its fall is looked at [m] (assumed)


def steps(ground: GroundForce | None) -> list[PlateContact]:
    """The foot's own contacts; those of one step that lay on two plates as one."""
    merged: list[PlateContact] = []
    for contact in sorted(ground.contacts, key=lambda c: c.start) if ground else ():
        if merged and contact.start < merged[-1].end:
            last = merged.pop()
            whole = last.whole and contact.whole
            merged.append(PlateContact(last.plate, last.start, max(last.end, contact.end), whole, own=True))
        else:
            merged.append(contact)
    return merged


def place(contact: PlateContact) -> str:
    """The contact in words."""
    return f"contact {contact.start:.2f} to {contact.end:.2f} s"


def refused(contact: PlateContact) -> str:
    """Why a contact is no step, in words; empty if it is one."""
    if contact.end - contact.start > STRIDE[1]:
        return "too long for a step; both feet on one plate, or wrong axes?"
    return ""


def begins(contact: PlateContact, ground: GroundForce) -> bool:
    """Whether its beginning is a heel strike, and not the recording's beginning."""
    return contact.whole or contact.start > ground.plates[contact.plate][0][0]


def ends(contact: PlateContact, ground: GroundForce) -> bool:
    """Whether its end is a toe-off, and not the recording's end."""
    return contact.whole or contact.end < ground.plates[contact.plate][0][-1]


def beside_heel_strike(start: float, motion: LegMotion, events: FootEvents) -> str:
    """Why a contact's beginning is not the foot's heel strike, in words; empty if it is, or nothing tells.

    Units: start [s].
    """
    if not events.strikes:
        return ""
    time = events.stride_time
    around = np.array([events.strikes[0] - time, *events.strikes, events.strikes[-1] + time])
    strike = float(around[np.argmin(np.abs(around - start))])
    late = start - strike
    if SAME * time < abs(late) < 0.5 * time:
        return f"it begins {late:+.2f} s from the foot's heel strike; another foot's, or a part of a step?"
    if late > 0.0 and sunk(motion, strike, start, time) > SUNK:
        return f"the heel landed {late:.2f} s before, beside the plate, or the clocks differ"
    return ""


def sunk(motion: LegMotion, strike: float, start: float, time: float) -> float:
    """Share of the toe's fall after a heel strike that is over at `start` [-]; 0 if the foot lands flat."""
    if motion.toe is None:
        return 0.0
    height = motion.toe[:, 1]
    soon = (motion.time >= strike) & (motion.time <= strike + 0.3 * time)
    if not soon.any():
        return 0.0
    up, now = np.interp([strike, start], motion.time, height) - height[soon].min()
    return float((up - now) / up) if up > RAISED else 0.0


def steps_without_motion(ground: GroundForce, own: Sequence[PlateContact]) -> list[PlateContact]:
    """Contacts before and after the motion on plates that only this foot was seen on."""
    if not own:
        return []
    first, last = own[0].start, own[-1].end
    plates = {contact.plate for contact in own} - {contact.plate for contact in ground.foreign}
    found = [c for name in sorted(plates) for c in find_contacts(name, *ground.plates[name])]
    return sorted((c for c in found if c.end < first or c.start > last), key=lambda c: c.start)
