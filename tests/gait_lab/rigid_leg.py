"""A leg whose ankle, outsole and ground force are known exactly, and what a marker beside it records."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait import GaitCycle

HEEL, BALL = (-0.060, -0.070), (0.120, -0.070)  # of the outsole, from the ankle's axis [m]
MASS, STRIDE_TIME, SPEED = 70.0, 1.1, 1.2
FLAT = (0.12, 0.30)  # where the sole does not turn at all


@dataclass(frozen=True)
class RigidLeg:
    """A leg that stands with its sole at one pitch from 12 to 30 % of the stride, then rises.

    equinus : by which that pitch is toe down [rad]; marker : how far the recorded point lies up the shank
    from the axis [m]; sole : thickness of what lies between the outsole and the floor [m].
    """

    equinus: float = 0.0
    marker: float = 0.0
    sole: float = 0.0

    def recorded(self) -> GaitCycle:
        """The cycle of the recorded point."""
        phase = np.linspace(0.0, 1.0, 201)
        turn = 2.0 * np.pi * phase
        shank = 0.45 * np.sin(turn - 0.9) + 0.05 * np.sin(2.0 * turn)
        rises = np.clip((phase - FLAT[1]) / 0.3, 0.0, 1.0)
        lands = np.clip(1.0 - phase / FLAT[0], 0.0, 1.0)
        swings = np.clip((phase - 0.7) / 0.3, 0.0, 1.0)
        pitch = -self.equinus + 0.3 * lands**2 - 1.0 * rises**2 * (1.0 - swings) + 0.3 * swings**2
        ends = [-x * np.sin(pitch) - z * np.cos(pitch) for x, z in (HEEL, BALL)]
        swing = np.clip((phase - 0.62) / 0.38, 0.0, 1.0)
        axis_x = SPEED * STRIDE_TIME * (swing - np.sin(2.0 * np.pi * swing) / (2.0 * np.pi))
        axis_z = np.max(ends, axis=0) + self.sole + 0.05 * np.sin(np.pi * swing) ** 2
        on = phase < 0.6
        upward = np.where(on, 1.2 * np.sin(np.pi * np.clip(phase / 0.6, 0.0, 1.0)) ** 0.5, 0.0)
        forward = np.where(on, -0.2 * np.sin(2.0 * np.pi * phase / 0.6), 0.0)
        cop = np.where(on, -0.03 + 0.25 * phase, np.nan)
        about = np.where(on, cop, 0.0) * upward + axis_z * forward
        ahead, above = self.marker * np.sin(shank), self.marker * np.cos(shank)
        away = np.where(on, cop - ahead, 0.0) * upward + (axis_z + above) * forward
        assert self.marker or np.array_equal(about, away)
        return GaitCycle(
            source="a rigid leg",
            licence="none",
            side="right",
            stride_time=STRIDE_TIME,
            body_mass=MASS,
            walking_speed=SPEED,
            ankle_height=float((axis_z + above)[(phase >= FLAT[0]) & (phase <= FLAT[1])].mean()),
            phase=phase,
            shank_angle=shank,
            knee_angle=0.4 + 0.3 * np.sin(turn),
            ankle_angle=shank + pitch,
            ankle_x=axis_x + ahead,
            ankle_z=axis_z + above,
            grf_x=forward,
            grf_z=upward,
            cop_x=cop - ahead,
            ankle_moment=-away * GRAVITY,
        )
