"""C3D files: markers and force plates."""

import pathlib

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import parse_quantity
from afo_sim.gait_lab.readers.c3d_file import C3dFile, read_c3d_file
from afo_sim.gait_lab.readers.c3d_plates import plates_of_c3d
from afo_sim.gait_lab.readers.length_unit import length_name, metres
from afo_sim.gait_lab.readers.markers import Markers, lost_as_nan, marker_set
from afo_sim.gait_lab.readers.plates import Plate

# Results of a model that Vicon stores as points; each of these parameters lists their names.
RESULTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "REACTIONS", "SCALARS")


def read_c3d(path: pathlib.Path) -> tuple[Markers, list[Plate]]:
    """Read markers and force plates from a C3D file."""
    file = read_c3d_file(path)
    rate = _rate(path, file)
    names, points, remarks = _markers(file)
    metre, warnings = _metre(path, file, points)
    time = (file.first_frame + np.arange(file.frames)) / rate
    samples = file.analogs.shape[1]
    ratio = max(round(samples / file.frames), 1) if file.frames else 1
    analog_time = file.first_frame / rate + np.arange(samples) / (rate * ratio)
    plates, left_out = plates_of_c3d(path, file, analog_time, metre)
    remarks += _events(file)
    return marker_set(path, time, names, points * metre, remarks, [*warnings, *left_out]), plates


def _rate(path: pathlib.Path, file: C3dFile) -> float:
    """Frames a second."""
    rates = [*file.numbers("POINT", "RATE")[:1], file.frame_rate]
    rate = next((float(rate) for rate in rates if np.isfinite(rate) and rate > 0.0), 0.0)
    if not 1.0 <= rate <= 1e5:
        raise InputError("is no frame rate", file=path, field="POINT:RATE", value=rate, allowed="Hz")
    return rate


def _markers(file: C3dFile) -> tuple[list[str], np.ndarray, list[str]]:
    """Names, coordinates (n, markers, 3) in the file's unit, and remarks."""
    count = file.points.shape[1]
    names = (file.texts("POINT", "LABELS") + [""] * count)[:count]
    results = {name for kind in RESULTS for name in file.texts("POINT", kind) if name}
    kept = [k for k, name in enumerate(names) if name not in results]
    results_there = count - len(kept)
    remarks = [f"{results_there} of its points are a model's results, no markers"] if results_there else []
    points = np.where(file.residuals[..., None] < 0.0, np.nan, file.points)
    return [names[k] for k in kept], lost_as_nan(points[:, kept]), remarks


def _metre(path: pathlib.Path, file: C3dFile, points: np.ndarray) -> tuple[float, list[str]]:
    """Metres in the file's unit of length, and warnings."""
    stated = length_name((file.texts("POINT", "UNITS") or [""])[0]) or "mm"  # C3D's own habit
    try:
        factor = parse_quantity(f"1 {stated}", "m")
    except ValueError:
        raise InputError(
            "is no length", file=path, field="POINT:UNITS", value=stated, allowed="mm, m"
        ) from None
    found, warnings = metres(points, factor, stated)
    assert found is not None
    return found, warnings


def _events(file: C3dFile) -> list[str]:
    """A remark on events that somebody marked by hand or program."""
    labels, times = file.texts("EVENT", "LABELS"), file.numbers("EVENT", "TIMES")
    if not labels:
        return []
    seconds = [60.0 * a + b for a, b in zip(times[::2], times[1::2], strict=False)]  # minutes and seconds
    shown = ", ".join(f"{name} {at:.2f} s" for name, at in zip(labels[:4], seconds, strict=False))
    more = ", …" if len(labels) > 4 else ""
    return [f"its {len(labels)} events ({shown}{more}) are not used: force and motion tell them again"]
