"""Files of a trial, as laboratories write them."""

import pathlib
from collections.abc import Mapping, Sequence

import numpy as np
from gait_lab.laboratory import Recorded
from walking import write_table

METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}  # the unit's number in a metre


def write_trc(
    path: pathlib.Path, time: np.ndarray, points: Mapping[str, np.ndarray], unit: str = "mm"
) -> pathlib.Path:
    """A .trc; a point without numbers is left empty."""
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
