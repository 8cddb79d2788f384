"""Steppage: hip and knee bend more in swing, as people do whose foot hangs, and lift the ankle."""

import dataclasses

import numpy as np

from afo_sim.gait.checks import stance
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.hip_path import Chain


def stepped(cycle: GaitCycle, hip: float, knee: float, chain: Chain) -> GaitCycle:
    """The stride with more flexion of hip and knee in swing, on the same path of the hip.

    Both are added as sin² from toe-off to heel strike, the most in the middle of the swing. The ankle goes
    where the chain hip–knee–ankle takes it. Stance stays as it is.

    Parameters
    ----------
    cycle : as recorded
    hip, knee : flexion that is added in mid-swing [rad]; 0 to 0.7 was tried
    chain : the leg's lengths

    Returns
    -------
    GaitCycle; the cycle itself where nothing is added

    Source
    ------
    Steppage adds some 10 to 20° at the hip and 10 to 25° at the knee (from memory); no curve of the shank of
    drop-foot walkers was found in numbers. The shape over the swing is this project's own.
    """
    if hip == 0.0 and knee == 0.0:
        return cycle
    toe_off = stance(cycle)
    share = np.clip((cycle.phase - toe_off) / (1.0 - toe_off), 0.0, 1.0)
    bent = np.sin(np.pi * share) ** 2
    knee_angle = cycle.knee_angle + knee * bent
    shank_angle = cycle.shank_angle + (knee - hip) * bent  # so that the thigh swings by the hip's
    before = chain.hip(cycle.shank_angle, cycle.knee_angle)
    after = chain.hip(shank_angle, knee_angle)
    return dataclasses.replace(
        cycle,
        shank_angle=shank_angle,
        knee_angle=knee_angle,
        ankle_x=cycle.ankle_x + before[0] - after[0],
        ankle_z=cycle.ankle_z + before[1] - after[1],
    )
