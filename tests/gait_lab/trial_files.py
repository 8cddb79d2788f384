"""Files of a trial, as laboratories write them."""

import pathlib
from collections.abc import Mapping, Sequence

import numpy as np
from gait_lab.laboratory import Laboratory, Recorded
from walking import METRE, write_table
from walking import write_points as write_trc


def write_trial(
    folder: pathlib.Path,
    laboratory: Laboratory,
    name: str,
    plates: str | Sequence[Recorded] = "feet",
    points: Mapping[str, np.ndarray] | None = None,
) -> list[pathlib.Path]:
    """Markers of a set, or some points, as .trc, and the plates of a kind, or some plates, as .mot."""
    points = laboratory.markers(name) if points is None else points
    plates = laboratory.plates(plates) if isinstance(plates, str) else plates
    markers = write_trc(folder / "walk.trc", laboratory.time, points)
    return [markers, write_forces(folder / "grf.mot", plates)]


def write_angles(
    path: pathlib.Path, time: np.ndarray, angles: Mapping[str, np.ndarray], *, degrees: bool = True
) -> pathlib.Path:
    """Joint angles as .mot or .sto."""
    scale = 180.0 / np.pi if degrees else 1.0
    columns = {n: v * (1.0 if n.startswith("pelvis_t") and len(n) == 9 else scale) for n, v in angles.items()}
    return write_table(path, time, columns, "yes" if degrees else "no")


def write_forces(path: pathlib.Path, plates: Sequence[Recorded]) -> pathlib.Path:
    """Ground reaction as OpenSim has it; where nothing presses, the place is nonsense, as in real files."""
    columns = {}
    for plate in plates:
        idle = np.linalg.norm(plate.force, axis=1) < 1.0
        for k, axis in enumerate("xyz"):
            columns[f"ground_force_{plate.name}_v{axis}"] = plate.force[:, k]
        for k, axis in enumerate("xyz"):
            columns[f"ground_force_{plate.name}_p{axis}"] = np.where(idle, 3.31, plate.place[:, k])
        for axis in "xyz":
            columns[f"ground_torque_{plate.name}_{axis}"] = np.zeros_like(plate.time)
    return write_table(path, plates[0].time, columns)


def write_csv_markers(
    path: pathlib.Path, time: np.ndarray, points: Mapping[str, np.ndarray], unit: str = "mm"
) -> pathlib.Path:
    """`time [s], R.Knee x [mm], …`; a point without numbers is left empty."""
    names = ["time [s]", *(f"{name} {axis} [{unit}]" for name in points for axis in "xyz")]
    table = np.column_stack([time, METRE[unit] * np.column_stack(list(points.values()))])
    return _write_csv(path, names, table)


def write_csv_forces(path: pathlib.Path, plates: Sequence[Recorded], unit: str = "mm") -> pathlib.Path:
    """`time [s], plate1 fx [N], …, plate1 px [mm], …`."""
    names, columns = ["time [s]"], [plates[0].time]
    for k, plate in enumerate(plates, 1):
        names += [f"plate{k} f{axis} [N]" for axis in "xyz"]
        names += [f"plate{k} p{axis} [{unit}]" for axis in "xyz"]
        columns += [*plate.force.T, *(METRE[unit] * plate.place).T]
    return _write_csv(path, names, np.column_stack(columns))


def _write_csv(path: pathlib.Path, names: Sequence[str], table: np.ndarray) -> pathlib.Path:
    rows = (",".join("" if np.isnan(value) else f"{value:.8g}" for value in row) for row in table)
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    return path
