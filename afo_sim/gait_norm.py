"""Normative ankle and knee angle over the gait cycle: to compare with, not to drive anything."""

import functools
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.assets import find_gait
from afo_sim.gait import DEGREE
from afo_sim.phase_table import read_header, read_table

SHIPPED = "norm_adult"
# Column of the file: field of Norm.
COLUMNS = {
    "phase": "phase",
    "ankle_angle_deg": "ankle_angle",
    "ankle_low_deg": "ankle_low",
    "ankle_high_deg": "ankle_high",
    "knee_angle_deg": "knee_angle",
}


@dataclass(frozen=True, eq=False)
class Norm:
    """Mean angles of healthy adults over phase, and how far published means spread [rad], each (n,)."""

    phase: np.ndarray  # 0…1 [-]
    ankle_angle: np.ndarray  # published mean, dorsiflexion positive
    ankle_low: np.ndarray  # lowest of several published means
    ankle_high: np.ndarray  # highest of them
    knee_angle: np.ndarray  # published mean, flexion positive
    header: Mapping[str, str]

    def at(self, name: str, phase: np.ndarray | float) -> np.ndarray:
        """A column at any phase.

        Parameters
        ----------
        name : "ankle_angle", "ankle_low", "ankle_high" or "knee_angle"
        phase : [-], of any shape

        Returns
        -------
        array of `phase`'s shape [rad], linear between the published points
        """
        return np.interp(np.asarray(phase) % 1.0, self.phase, getattr(self, name))


def is_norm(path: pathlib.Path) -> bool:
    """Whether a gait file is a norm, by the header line `# kind: norm`."""
    return read_header(path).get("kind") == "norm"


@functools.cache  # a path is read once in a process
def read(path: pathlib.Path | None = None) -> Norm:
    """Read a norm; the shipped one by default.

    Raises
    ------
    InputError
        As `phase_table.read_table`.
    """
    table = read_table(path or find_gait(SHIPPED), tuple(COLUMNS))
    scaled = {
        name: table.columns[column] * (1.0 if column == "phase" else DEGREE)
        for column, name in COLUMNS.items()
    }
    return Norm(**scaled, header=table.header)
