"""A stride of a person of another size: geometric similarity at equal Froude number."""

import dataclasses

import numpy as np

from afo_sim.gait.cycle import GaitCycle


def scaled(cycle: GaitCycle, taller: float) -> GaitCycle:
    """The stride as a person walks it who is by a factor taller, all angles alike.

    Lengths go with l, times with √l (v²/(g l) stays), the ankle's moment per body mass with l.

    Parameters
    ----------
    cycle : as recorded
    taller : factor l on all lengths [-]

    Source
    ------
    Hof 1996, Gait Posture 4(3), doi 10.1016/0966-6362(95)01057-2 (dimensionless gait data); Alexander &
    Jayes 1983 (dynamic similarity at equal Froude number).
    """
    if taller == 1.0:
        return cycle
    slower = float(np.sqrt(taller))
    lengths = {
        name: getattr(cycle, name) * taller for name in ("ankle_height", "ankle_x", "ankle_z", "cop_x")
    }
    known = {name: getattr(cycle, name) for name in ("body_height", "sole_thickness")}
    found = dataclasses.replace(
        cycle,
        **lengths,
        **{name: value * taller for name, value in known.items() if value is not None},
        stride_time=cycle.stride_time * slower,
        walking_speed=cycle.walking_speed * slower,
        ankle_moment=cycle.ankle_moment * taller,
    )
    vars(found)["flat"] = cycle.flat  # the same foot at the same phases, whatever its size
    return found
