"""Patients made of the known walker: slow, short of step, on their toes, lame; every number still known."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from gait_lab.known_walker import MTP, Walker
from gait_lab.laboratory import Laboratory
from walking import SHANK, THIGH, Walk, known_walk


@dataclass(frozen=True)
class Patient(Walker):
    """The known walker with less of it, or with more."""

    share: float = 1.0  # of the joint angles' ranges and of the step's length
    equinus: float = 0.0  # plantarflexion that is added throughout; the ball carries the foot [rad]
    right_load: float = 1.0  # how readily the right foot takes its part while both stand

    @cached_property
    def walk(self) -> Walk:
        walk = known_walk(self.gait)
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
            shank_angle=shank,
            knee_angle=knee,
            ankle_angle=ankle,
            ankle_x=self.share * hip - _ahead(shank, knee),
            ankle_z=less(cycle.ankle_z),
            cop_x=cop,
        )
        return dataclasses.replace(walk, cycle=changed)

    @property
    def _share(self) -> float:
        return self.share

    def raised(self) -> float:
        return float(MTP[0] * np.sin(self.equinus))

    def bears(self, side: str) -> float:
        return self.right_load if side == "right" else 2.0 - self.right_load


def _ahead(shank: np.ndarray, knee: np.ndarray) -> np.ndarray:
    """The hip ahead of the ankle [m]."""
    return np.asarray(SHANK * np.sin(shank) + THIGH * np.sin(shank - knee))


def laboratory(patient: Patient, strides: float = 2.2, **choices: float) -> Laboratory:
    """A laboratory that records some strides; further fields of `Laboratory` as keywords."""
    seconds = round(strides * patient.stride_time + 0.8, 2)
    return dataclasses.replace(Laboratory(patient, seconds=seconds), **choices)


def anybody(seed: int, **fields: Any) -> Walker:
    """A healthy adult of another body and another speed, whose strides differ."""
    rng = np.random.default_rng([seed, 7])
    size = rng.uniform(0.85, 1.1)
    drawn = {
        "mass": rng.uniform(45.0, 110.0),
        "size": size,
        "slower": rng.uniform(max(0.85, np.sqrt(size / 1.25)), 1.2),  # else the moment is a runner's
        "toe_out": np.radians(rng.uniform(2.0, 12.0)),
        "start": rng.uniform(0.2, 0.6),
        "calm": rng.uniform(0.79, 0.88),
        "seed": seed,
    }
    return Walker(**(drawn | fields))


@dataclass(frozen=True)
class LameWalker(Patient):
    """A patient whose right foot drops in swing, carries less, and whose left foot strikes early."""

    drop: float = np.radians(15.0)  # of the right foot, the most in mid-swing [rad]
    left_strike: float = 0.45

    def recorded(self, side: str, name: str, phase: np.ndarray) -> np.ndarray:
        found = super().recorded(side, name, phase)
        if side == "left" or name != "ankle":
            return found
        part = (phase % 1.0 - 0.66) / 0.30
        return np.asarray(found - self.drop * np.where((part > 0) & (part < 1), np.sin(np.pi * part) ** 2, 0))
