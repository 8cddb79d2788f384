"""Normative ankle and knee angle and ankle moment over the gait cycle: to compare with, not to drive."""

import functools
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import find_gait, read_phase_table
from afo_sim.gait.checks import stance
from afo_sim.gait.cycle import DEGREE, GaitCycle

PEOPLE = 6.0  # standard deviation of the ankle angle between healthy adults; 4 to 8 (Bovi 2011) [deg]
_SHIPPED = "norm_adult"
# Column of the file: (field of Norm, factor from the file's unit and sign to the house's).
_COLUMNS = {
    "phase": ("phase", 1.0),
    "ankle_angle_deg": ("ankle_angle", DEGREE),
    "ankle_low_deg": ("ankle_low", DEGREE),
    "ankle_high_deg": ("ankle_high", DEGREE),
    "knee_angle_deg": ("knee_angle", DEGREE),
    "ankle_moment_high_nm_per_kg": ("moment_low", -1.0),  # the file's moments are plantarflexion positive
    "ankle_moment_low_nm_per_kg": ("moment_high", -1.0),
}


@dataclass(frozen=True, eq=False)
class Norm:
    """Mean angles of healthy adults over phase, and how far published means spread, each (n,)."""

    phase: np.ndarray  # 0…1 [-]
    ankle_angle: np.ndarray  # published mean, dorsiflexion positive
    ankle_low: np.ndarray  # lowest of several published means
    ankle_high: np.ndarray  # highest of them
    knee_angle: np.ndarray  # published mean, flexion positive
    moment_low: np.ndarray  # lower of two published means: children, and a population not documented
    moment_high: np.ndarray  # higher of them
    header: Mapping[str, str]

    def at(self, name: str, phase: np.ndarray | float) -> np.ndarray:
        """A column at any phase."""
        return np.interp(np.asarray(phase) % 1.0, self.phase, getattr(self, name))


def swing_off_norm(cycle: GaitCycle) -> tuple[float, float]:
    """How far the ankle in swing lies beyond the shipped norm: mean, dorsiflexed positive, and RMS [deg]."""
    norm, swing = read(), cycle.phase > stance(cycle)
    angle, phase = cycle.ankle_angle[swing], cycle.phase[swing]
    off = (angle - np.clip(angle, norm.at("ankle_low", phase), norm.at("ankle_high", phase))) / DEGREE
    return float(off.mean()), float(np.sqrt(np.mean(off**2)))


@functools.cache  # a path is read once in a process
def read(path: pathlib.Path | None = None) -> Norm:
    """Read a norm; the shipped one by default."""
    table = read_phase_table(path or find_gait(_SHIPPED), tuple(_COLUMNS))
    scaled = {name: table.columns[column] * factor for column, (name, factor) in _COLUMNS.items()}
    return Norm(**scaled, header=table.header)
