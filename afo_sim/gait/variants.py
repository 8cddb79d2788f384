"""A stride as another person walks it: one of another size, at equal Froude number, or one with steppage."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from afo_sim.gait.checks import stance
from afo_sim.gait.cycle import GaitCycle

_THIGH, _SHANK = 0.245, 0.246  # of body height (Winter 2009, figure 4.1, after Drillis & Contini)


@dataclass(frozen=True)
class Chain:
    """Lengths of a leg: hip to knee, knee to ankle [m]."""

    thigh: float
    shank: float

    @classmethod
    def of_height(cls, body_height: float) -> "Chain":
        """Of a person of that height [m]."""
        return cls(_THIGH * body_height, _SHANK * body_height)

    def hip(self, shank_angle: np.ndarray, knee_angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The hip from the ankle: forward, up [m] (n,)."""
        thigh = knee_angle - shank_angle  # knee ahead of the hip
        forward = self.shank * np.sin(shank_angle) - self.thigh * np.sin(thigh)
        return forward, self.shank * np.cos(shank_angle) + self.thigh * np.cos(thigh)


def scaled(cycle: GaitCycle, taller: float) -> GaitCycle:
    """The stride as a person walks it who is by a factor taller, all angles alike.

    Source: Hof 1996, Gait Posture 4(3), doi 10.1016/0966-6362(95)01057-2 (dimensionless gait data);
    Alexander & Jayes 1983 (dynamic similarity at equal Froude number).
    """
    if taller == 1.0:
        return cycle
    slower = float(np.sqrt(taller))
    names = ("ankle_height", "ankle_x", "ankle_z", "cop_x", "body_height", "sole_thickness")
    lengths = {name: length * taller for name in names if (length := getattr(cycle, name)) is not None}
    found = dataclasses.replace(
        cycle,
        **lengths,
        stride_time=cycle.stride_time * slower,
        walking_speed=cycle.walking_speed * slower,
        ankle_moment=cycle.ankle_moment * taller,
    )
    vars(found)["flat"] = cycle.flat  # the same foot at the same phases, whatever its size
    return found


def stepped(cycle: GaitCycle, hip: float, knee: float, chain: Chain) -> GaitCycle:
    """The stride with more flexion of hip and knee in swing, on the same path of the hip.

    Source: Steppage adds some 10 to 20° at the hip and 10 to 25° at the knee (from memory); no curve of
    the shank of drop-foot walkers was found in numbers. The shape over the swing is this project's own.
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
