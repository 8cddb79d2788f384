"""Patients made of the known walker: slow, short of step, on their toes, lame; every number still known."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gait_lab.known_walker import MTP, Walker
from gait_lab.laboratory import Laboratory
from walking import SHANK, THIGH, Walk, known_walk


@dataclass(frozen=True)
class Patient(Walker):
    """The known walker with less of it, or with more."""

    share: float = 1.0  # of the joint angles' ranges and of the step's length
    slower: float = 1.0  # factor of the stride's time
    equinus: float = 0.0  # plantarflexion that is added throughout; the ball carries the foot [rad]
    right_load: float = 1.0  # factor of the right foot's force; the left one carries the rest

    @cached_property
    def walk(self) -> Walk:
        walk = known_walk()
        cycle, flat = walk.cycle, walk.cycle.foot_flat()

        def less(signal: np.ndarray) -> np.ndarray:
            middle = signal[flat].mean()
            return np.asarray(middle + self.share * (signal - middle))

        shank, knee, ankle = map(less, (cycle.shank_angle, cycle.knee_angle, cycle.ankle_angle))
        ankle = ankle - (ankle - shank)[flat].mean() - self.equinus
        hip = cycle.ankle_x + _ahead(cycle.shank_angle, cycle.knee_angle)
        cop = cycle.cop_x
        if self.equinus:
            cop = np.where(np.isfinite(cop), np.maximum(cop, 0.10), np.nan)
        changed = dataclasses.replace(
            cycle,
            stride_time=cycle.stride_time * self.slower,
            walking_speed=cycle.walking_speed * self.share / self.slower,
            shank_angle=shank,
            knee_angle=knee,
            ankle_angle=ankle,
            ankle_x=self.share * hip - _ahead(shank, knee),
            ankle_z=less(cycle.ankle_z),
            cop_x=cop,
        )
        return dataclasses.replace(walk, cycle=changed)

    def ankle_plane(self, side: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        plane = super().ankle_plane(side, time, derivative)
        raised = MTP[0] * np.sin(self.equinus)
        return plane if derivative else plane + np.array([0.0, raised])

    def force(self, side: str, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        force, place = super().force(side, time)
        return force * (self.right_load if side == "right" else 2.0 - self.right_load), place


def _ahead(shank: np.ndarray, knee: np.ndarray) -> np.ndarray:
    """The hip ahead of the ankle [m]."""
    return np.asarray(SHANK * np.sin(shank) + THIGH * np.sin(shank - knee))


def laboratory(patient: Patient, strides: float = 2.2, **choices: float) -> Laboratory:
    """A laboratory that records some strides; further fields of `Laboratory` as keywords."""
    seconds = round(strides * patient.stride_time + 0.8, 2)
    return dataclasses.replace(Laboratory(patient, seconds=seconds), **choices)


@dataclass(frozen=True)
class LameWalker(Patient):
    """A patient whose right foot drops in swing, carries less, and whose left foot strikes early."""

    drop: float = np.radians(15.0)  # of the right foot, the most in mid-swing [rad]
    left_strike: float = 0.45  # of the right foot's stride [-]

    def phase(self, side: str, time: np.ndarray) -> np.ndarray:
        return (time - self.start) / self.stride_time - (0.0 if side == "right" else self.left_strike)

    def angle(self, side: str, name: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        found = super().angle(side, name, time, derivative)
        if side == "left" or name != "ankle" or derivative:
            return found
        part = (self.phase(side, time) % 1.0 - 0.66) / 0.30
        return np.asarray(found - self.drop * np.where((part > 0) & (part < 1), np.sin(np.pi * part) ** 2, 0))
