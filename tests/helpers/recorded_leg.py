"""A known walk as the motion of one leg and the force on its foot."""

import numpy as np
from walking import Walk

from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact, find_contacts
from afo_sim.gait_lab.trial.leg_motion import LegMotion

ANGLES = ("shank_angle", "knee_angle", "ankle_angle")


def leg(walk: Walk, time: np.ndarray, *, belt: float = 0.0) -> LegMotion:
    """The leg's motion, on a belt of a speed [m/s]."""
    points = {name: path - np.outer(belt * time, [1.0, 0.0]) for name, path in walk.points(time).items()}
    return LegMotion(
        time=time,
        **{name: walk.angle(name, time) for name in ANGLES},
        ankle_x=points["ankle"][:, 0],
        ankle_z=points["ankle"][:, 1],
        heel=points["heel"],
        toe=points["toe"],
        pelvis_x=points["pelvis"][:, 0],
    )


def plate(
    walk: Walk, time: np.ndarray, seen: LegMotion, *, on: slice | None = None, late: float = 0.0
) -> GroundForce:
    """The force on the foot, on a plate that it meets in all steps or in some, and only after `late` [s]."""
    forward, upward, _ = walk.force(time)
    contacts = find_contacts("1", time, upward)[on or slice(None)]
    kept = np.zeros(len(time))
    for contact in contacts:
        kept[(time >= contact.start + late) & (time <= contact.end)] = 1.0
    contacts = [
        PlateContact("1", c.start + late, c.end, c.begins, c.ends)
        for c in contacts
        if c.end > seen.time[0] and c.start < seen.time[-1]
    ]
    return GroundForce(
        time, forward * kept, upward * kept, 0.0 * time, tuple(contacts), {"1": (time, upward * kept)}
    )


def toe_off(walk: Walk, number: int) -> float:
    """When the upward force falls below 20 N in stride `number` [s]."""
    time = walk.start + (number + np.linspace(0.5, 0.75, 150_001)) * walk.cycle.stride_time
    return float(time[np.argmax(walk.force(time)[1] < 20.0)])
