"""One stride of recorded walking: sagittal leg motion and ground force over gait phase."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait.flat_foot import FlatFoot, flat_part
from afo_sim.gait.fourier import FourierSeries, Wave

HARMONICS = 12  # of the kinematics: 10 Hz at a stride of 1.2 s
_PRESSED = 0.1  # upward force of a foot that stands [body weights]; assumed
DEGREE = np.pi / 180.0

# Column of the file: (field of GaitCycle, factor from the file's unit and sign to the house's).
COLUMNS = {
    "phase": ("phase", 1.0),
    "shank_angle_deg": ("shank_angle", DEGREE),
    "knee_angle_deg": ("knee_angle", DEGREE),
    "ankle_angle_deg": ("ankle_angle", DEGREE),
    "ankle_x_m": ("ankle_x", 1.0),
    "ankle_z_m": ("ankle_z", 1.0),
    "grf_x_bw": ("grf_x", 1.0),
    "grf_z_bw": ("grf_z", 1.0),
    "cop_x_m": ("cop_x", 1.0),
    "ankle_moment_nm_per_kg": ("ankle_moment", -1.0),  # laboratories publish plantarflexion positive
}
# Number of the header: field of GaitCycle.
NUMBERS = {
    "stride_time_s": "stride_time",
    "body_mass_kg": "body_mass",
    "walking_speed_m_per_s": "walking_speed",
    "ankle_height_m": "ankle_height",
}
OPTIONAL = {"body_height_m": "body_height", "sole_thickness_m": "sole_thickness"}
Walker = Literal["healthy", "patient"]
_WARNING = "warning"  # notes "warning 1", "warning 2", …: what a person should look at
KINEMATICS = ("shank_angle", "knee_angle", "ankle_angle", "ankle_x", "ankle_z")


@dataclass(frozen=True, eq=False)
class GaitCycle:
    """One stride, heel strike to heel strike of the same foot, sampled over phase; SI, angles in rad."""

    source: str
    licence: str
    side: str  # "right" or "left"
    stride_time: float  # [s]
    body_mass: float  # [kg]
    walking_speed: float  # [m/s]
    ankle_height: float  # of the ankle point above the floor with the foot flat [m]
    phase: np.ndarray  # 0…1, both heel strikes [-]
    shank_angle: np.ndarray  # from the vertical, knee ahead of ankle positive [rad]
    knee_angle: np.ndarray  # flexion positive [rad]
    ankle_angle: np.ndarray  # dorsiflexion positive, 0 = flat foot under a vertical shank [rad]
    ankle_x: np.ndarray  # of the ankle joint's centre [m]
    ankle_z: np.ndarray  # [m]
    grf_x: np.ndarray  # ground on foot, forward positive, in body weights [-]
    grf_z: np.ndarray  # upward positive [-]
    cop_x: np.ndarray  # centre of pressure minus ankle centre, NaN in swing [m]
    ankle_moment: np.ndarray  # internal, dorsiflexion positive, per body mass [N·m/kg]
    body_height: float | None = None  # [m]; None where it is not known
    sole_thickness: float | None = None  # of what was worn, under the ankle [m]; None where it is not known
    walker: Walker | None = None  # whose walk it is; None where nobody said
    notes: Mapping[str, str] = field(default_factory=dict)  # further header lines of the file
    harmonics: int = HARMONICS

    @cached_property
    def series(self) -> dict[str, FourierSeries]:
        """The Fourier series of each kinematic signal, by the field's name."""
        return {name: self.fitted(name) for name in KINEMATICS}

    def fitted(self, name: str) -> FourierSeries:
        """The Fourier series of one kinematic signal, from its samples."""
        samples, on = getattr(self, name), name == "ankle_x"
        return FourierSeries.fit(self.phase, samples, self.harmonics, progressing=on)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a person should look at before the stride is believed, one sentence each."""
        return tuple(text for key, text in self.notes.items() if key.startswith(f"{_WARNING} "))

    def with_warnings(self, warnings: Sequence[str]) -> "GaitCycle":
        """The same stride with these warnings in its notes, so that its file carries them."""
        notes = {key: text for key, text in self.notes.items() if not key.startswith(f"{_WARNING} ")}
        notes |= {f"{_WARNING} {number}": text for number, text in enumerate(warnings, 1)}
        return dataclasses.replace(self, notes=notes)

    def signal(self, name: str, phase: np.ndarray | float | Wave, derivative: int = 0) -> np.ndarray:
        """A kinematic signal at any phase, or its velocity or acceleration, all from one Fourier series."""
        return self.series[name](phase, derivative) / self.stride_time**derivative

    def ground(self, phase: np.ndarray | float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ground force and its place at any phase, linear between the samples (a series would ring)."""
        place = np.asarray(phase, dtype=float) % 1.0
        forward, upward = (np.interp(place, self.phase, force) for force in (self.grf_x, self.grf_z))
        return forward, upward, self.pressed(phase)

    def pressed(self, phase: np.ndarray | float) -> np.ndarray:
        """Where the ground force acts at any phase, ahead of the ankle [m]."""
        known = np.isfinite(self.cop_x)
        return np.interp(phase, self.phase[known], self.cop_x[known], period=1.0)

    def ground_moment(self) -> np.ndarray:
        """Internal ankle moment that balances the ground force at each sample, the foot taken as massless."""
        return -(self.pressed(self.phase) * self.grf_z + self.ankle_z * self.grf_x) * GRAVITY

    @cached_property
    def flat(self) -> FlatFoot:
        """Where the sole lies flat, as phases of the stride."""
        return flat_part(self.phase, self.foot_pitch(), self.ankle_z, ~(self.grf_z < _PRESSED))

    def foot_flat(self) -> np.ndarray:
        """Mask of the samples in which the sole lies flat (n,)."""
        return self.flat.holds(self.phase)

    def foot_pitch(self) -> np.ndarray:
        """Angle of the sole to the floor at each sample, toe up positive [rad] (n,)."""
        return self.ankle_angle - self.shank_angle
