"""A walker of straight lines and circles, drawn by geometry alone: no data, so that all about it is known."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints

ANKLE, HEEL, TOE = 0.08, -0.06, 0.15  # ankle's height; ends of the sole ahead of it [m]
MARKER = 0.03  # height of heel and toe above the sole [m]
SEGMENT = 0.42  # of the leg, two alike [m]
SIDE = {"right": 1.0, "left": -1.0}
PITCH = PchipInterpolator([0, 0.08, 0.38, 0.62, 0.8, 0.95, 1], np.radians([20, 0, 0, -55, -20, 20, 20]))
TOE_OFF = 0.62


@dataclass(frozen=True)
class AnalyticWalker:
    """Walks along s, sways a little, and sets its feet flat; SI."""

    speed: float = 1.2
    period: float = 1.1
    toe_out: float = 0.0  # [rad]
    radius: float = math.inf  # of the circle, turning left
    belt: float = 0.0  # the laboratory's ground runs backward at this speed
    drift: float = 0.0  # of the belt's speed over time [m/s²]
    sway: float = 0.02
    forward: tuple[float, float, float] = (1.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    left_handed: bool = False
    noise: float = 0.0
    duty: float = TOE_OFF  # of each foot, as a share of the stride; a runner's is below 0.5 [-]

    @property
    def stride(self) -> float:
        return self.speed * self.period

    def legs(self, time: np.ndarray) -> dict[str, LegPoints]:
        """Both legs in the laboratory."""
        random = np.random.default_rng(7)
        found = {}
        pelvis = self._laboratory(self._pelvis(time), time)
        for side in SIDE:
            points = {
                role: LegPoint(self._laboratory(local, time) + self._noise(random, time), "drawn")
                for role, local in self._leg(time, side).items()
            }
            found[side] = LegPoints(side, time, points, pelvis=pelvis + self._noise(random, time))
        return found

    def _noise(self, random: np.random.Generator, time: np.ndarray) -> np.ndarray:
        return random.normal(0.0, self.noise, (len(time), 3))

    def _pelvis(self, time: np.ndarray) -> np.ndarray:
        wave = 2.0 * np.pi * time / self.period
        along = self.speed * time + 0.01 * np.sin(2.0 * wave)
        return np.column_stack([along, self.sway * np.sin(wave), 0.95 + 0.015 * np.cos(2.0 * wave)])

    def _foot(self, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ankle ahead of its place when flat, its height, the foot's pitch, over phase 0 to 1."""
        pitch = PITCH(phase)
        pivot = np.where(phase < 0.2, HEEL, TOE)
        ahead = pivot - (pivot * np.cos(pitch) + ANKLE * np.sin(pitch))
        height = -(pivot * np.sin(pitch) - ANKLE * np.cos(pitch))
        share = np.clip((phase - TOE_OFF) / (1.0 - TOE_OFF), 0.0, 1.0)
        smooth = share**2 * (3.0 - 2.0 * share)
        from_, to = self._end(TOE_OFF), self._end(0.0)
        swing = phase > TOE_OFF
        ahead = np.where(swing, from_[0] + smooth * (self.stride + to[0] - from_[0]), ahead)
        lift = from_[1] + smooth * (to[1] - from_[1]) + 0.05 * np.sin(np.pi * share)
        return ahead, np.where(swing, lift, height), pitch

    def _end(self, phase: float) -> tuple[float, float]:
        pitch = float(PITCH(phase))
        pivot = HEEL if phase < 0.2 else TOE
        return (
            pivot - (pivot * math.cos(pitch) + ANKLE * math.sin(pitch)),
            -(pivot * math.sin(pitch) - ANKLE * math.cos(pitch)),
        )

    def _leg(self, time: np.ndarray, side: str) -> dict[str, np.ndarray]:
        """Points along, to the right and up, each (n, 3)."""
        strides = time / self.period + (0.0 if side == "right" else 0.5)
        number, phase = (
            np.floor(strides),
            np.interp(strides % 1.0, (0.0, self.duty, 1.0), (0.0, TOE_OFF, 1.0)),
        )
        ahead, height, pitch = self._foot(phase)
        # the body passes over the flat foot in the middle of stance
        place = (number - (0.0 if side == "right" else 0.5) + 0.25 * self.duty / TOE_OFF) * self.stride
        lateral = np.full_like(time, 0.09 * SIDE[side])
        ankle = np.column_stack([place + ahead, lateral, height])
        hip = self._pelvis(time) + np.array([0.0, 0.09 * SIDE[side], -0.09])
        out = self.toe_out * SIDE[side]
        heel, toe = (self._sole(ankle, pitch, out, end) for end in (HEEL, TOE))
        return {"hip": hip, "knee": _knee(hip, ankle), "ankle": ankle, "heel": heel, "toe": toe}

    def _sole(self, ankle: np.ndarray, pitch: np.ndarray, out: float, end: float) -> np.ndarray:
        down = MARKER - ANKLE
        along = end * np.cos(pitch) - down * np.sin(pitch)
        return ankle + np.column_stack(
            [along * np.cos(out), along * np.sin(out), end * np.sin(pitch) + down * np.cos(pitch)]
        )

    def _laboratory(self, local: np.ndarray, time: np.ndarray) -> np.ndarray:
        along, right, height = local.T
        if math.isfinite(self.radius):
            angle = along / self.radius
            along = (self.radius + right) * np.sin(angle)
            right = (self.radius + right) * np.cos(angle) - self.radius
        along = along - self.belt * time - 0.5 * self.drift * time**2
        forward, up = np.array(self.forward), np.array(self.up)
        across = np.cross(forward, up) * (-1.0 if self.left_handed else 1.0)
        return along[:, None] * forward + right[:, None] * across + height[:, None] * up


def _knee(hip: np.ndarray, ankle: np.ndarray) -> np.ndarray:
    """Knee of a leg of two equal segments, bent forward."""
    line = ankle - hip
    half = 0.5 * np.linalg.norm(line, axis=1)
    bend = np.sqrt(np.maximum(SEGMENT**2 - half**2, 0.0))
    ahead = np.column_stack([-line[:, 2], np.zeros(len(line)), line[:, 0]])
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    return 0.5 * (hip + ankle) + bend[:, None] * ahead


def changed(legs: dict[str, LegPoints], change: Callable[[np.ndarray], np.ndarray]) -> dict[str, LegPoints]:
    """The legs with every path changed."""
    return {
        side: dataclasses.replace(
            leg,
            points={r: dataclasses.replace(p, path=change(p.path)) for r, p in leg.points.items()},
            pelvis=None if leg.pelvis is None else change(leg.pelvis),
        )
        for side, leg in legs.items()
    }
