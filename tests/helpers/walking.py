"""A known walk, written as a laboratory would: the leg of a gait cycle, stride after stride."""

import dataclasses
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, assets
from afo_sim.gait import KINEMATICS, GaitCycle
from afo_sim.gait.file import read

THIGH, SHANK = 0.41, 0.40
HEEL, TOE = (-0.05, -0.06), (0.12, -0.08)  # markers from the ankle, in the foot's frame [m]
HIP_FROM_PELVIS = (-0.06, -0.08)
TILT = np.radians(-4.0)  # of the pelvis, backward positive


@dataclass(frozen=True)
class Walk:
    """Strides of `cycle` without end, the first heel strike at `start` [s]."""

    cycle: GaitCycle
    start: float = 0.4
    way: float = 0.3  # the ankle's x at the first heel strike [m]

    def phase(self, time: np.ndarray) -> np.ndarray:
        return (time - self.start) / self.cycle.stride_time

    def angle(self, name: str, time: np.ndarray) -> np.ndarray:
        return self.cycle.signal(name, self.phase(time))

    def points(self, time: np.ndarray) -> dict[str, np.ndarray]:
        """Hip, knee, ankle, heel, toe and pelvis in the sagittal plane, each (n, 2) [m]."""
        shank, knee, ankle = (self.angle(f"{n}_angle", time) for n in ("shank", "knee", "ankle"))
        at = np.column_stack([self.way + self.angle("ankle_x", time), self.angle("ankle_z", time)])
        up = np.column_stack([np.sin(shank), np.cos(shank)])
        knees = at + SHANK * up
        thigh = shank - knee
        hips = knees + THIGH * np.column_stack([np.sin(thigh), np.cos(thigh)])
        pitch = ankle - shank
        along, across = (
            np.column_stack([np.cos(pitch), np.sin(pitch)]),
            np.column_stack([-np.sin(pitch), np.cos(pitch)]),
        )
        forward, high = HIP_FROM_PELVIS
        pelvis = hips - forward * np.array([np.cos(TILT), np.sin(TILT)])
        pelvis = pelvis - high * np.array([-np.sin(TILT), np.cos(TILT)])
        return {
            "hip": hips,
            "knee": knees,
            "ankle": at,
            "heel": at + HEEL[0] * along + HEEL[1] * across,
            "toe": at + TOE[0] * along + TOE[1] * across,
            "pelvis": pelvis,
        }

    def force(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forward and upward force [N] and the centre of pressure in the laboratory [m]."""
        forward, upward, cop = self.cycle.ground(self.phase(time))
        weight = self.cycle.body_mass * GRAVITY
        place = cop + self.way + self.angle("ankle_x", time)
        return forward * weight, upward * weight, place

    def heel_strike(self, number: int) -> float:
        """When the upward force passes 20 N about heel strike `number`, counted from 0 [s]."""
        middle = self.start + number * self.cycle.stride_time
        time = np.linspace(middle - 0.1, middle + 0.05, 150_001)
        return float(time[np.argmax(self.force(time)[1] > 20.0)])


def known_walk(gait: str = "gatk_stride1") -> Walk:
    """A shipped stride without its drift, the foot level where it lies flat: it repeats exactly."""
    cycle = read(assets.find_gait(gait))
    closed = {name: cycle.signal(name, cycle.phase) for name in KINEMATICS}
    again = dataclasses.replace(cycle, **closed)
    level = again.foot_pitch()[again.foot_flat()].mean()
    closed["ankle_angle"] = closed["ankle_angle"] - level
    return Walk(dataclasses.replace(cycle, **closed))


def write_table(
    path: pathlib.Path, time: np.ndarray, columns: dict[str, np.ndarray], degrees: str | None = "yes"
) -> pathlib.Path:
    """A .mot or .sto as OpenSim writes it."""
    header = [path.stem, "version=1", f"nRows={len(time)}", f"nColumns={len(columns) + 1}"]
    header += [f"inDegrees={degrees}"] if degrees else []
    lines = [*header, "", "Units are S.I. units (second, meters, Newtons, ...)", "", "endheader"]
    lines.append("\t".join(["time", *columns]))
    for row in np.column_stack([time, *columns.values()]):
        lines.append("\t".join(f"{value:.9g}" for value in row))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_angles(
    path: pathlib.Path, walk: Walk, time: np.ndarray, *, degrees: bool = True, knee: float = 1.0
) -> pathlib.Path:
    """Inverse kinematics of the right leg; `knee` −1 for models with flexion negative."""
    shank, flexion = walk.angle("shank_angle", time), walk.angle("knee_angle", time)
    pelvis = walk.points(time)["pelvis"]
    scale = 180.0 / np.pi if degrees else 1.0
    columns = {
        "pelvis_tilt": np.full_like(time, TILT) * scale,
        "pelvis_tx": pelvis[:, 0],
        "pelvis_ty": pelvis[:, 1],
        "hip_flexion_r": (flexion - shank - TILT) * scale,
        "knee_angle_r": knee * flexion * scale,
        "ankle_angle_r": walk.angle("ankle_angle", time) * scale,
    }
    return write_table(path, time, columns, "yes" if degrees else "no")


def write_forces(path: pathlib.Path, walk: Walk, time: np.ndarray, *, sign: float = 1.0) -> pathlib.Path:
    """Two plates: the right foot's on `1_`, the left foot's, half a stride later, on the unnumbered one.

    Where nothing presses, the centre of pressure is nonsense, as in real files.
    """
    other = Walk(walk.cycle, walk.start + 0.5 * walk.cycle.stride_time, walk.way + 0.55)
    columns = {}
    for prefix, leg in (("", other), ("1_", walk)):
        forward, upward, place = leg.force(time)
        nonsense = upward < 1.0
        columns[f"{prefix}ground_force_vx"] = sign * forward
        columns[f"{prefix}ground_force_vy"] = sign * upward
        columns[f"{prefix}ground_force_vz"] = np.zeros_like(time)
        columns[f"{prefix}ground_force_px"] = np.where(nonsense, 331.0, place)
        columns[f"{prefix}ground_force_py"] = np.zeros_like(time)
        columns[f"{prefix}ground_force_pz"] = np.zeros_like(time)
    return write_table(path, time, columns)


NAMES = {"hip": "RHJC", "knee": "RKJC", "ankle": "RAJC", "heel": "R.Heel", "toe": "R.Toe.Lat"}


def write_trc(path: pathlib.Path, walk: Walk, time: np.ndarray) -> pathlib.Path:
    """The leg's markers, x forward and y up."""
    points, out = walk.points(time), np.full(len(time), 0.12)
    return write_points(path, time, {n: np.column_stack([points[r], out]) for r, n in NAMES.items()})


METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}  # the unit's number in a metre


def write_points(
    path: pathlib.Path, time: np.ndarray, points: Mapping[str, np.ndarray], unit: str = "mm"
) -> pathlib.Path:
    """A .trc of markers (n, 3) [m]; a point without numbers is left empty."""
    rate, names = 1.0 / (time[1] - time[0]), list(points)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.6g}\t{rate:.6g}\t{len(time)}\t{len(names)}\t{unit}\t{rate:.6g}\t1\t{len(time)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    table = METRE[unit] * np.column_stack([points[name] for name in names])
    digits = {"mm": 4, "cm": 5, "m": 7}[unit]
    for k, row in enumerate(table):
        cells = ("" if np.isnan(value) else f"{value:.{digits}f}" for value in row)
        lines.append(f"{k + 1}\t{time[k]:.6f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines) + "\n")
    return path
