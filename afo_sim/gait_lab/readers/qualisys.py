"""Qualisys Track Manager's TSV exports: one file of markers, and one of each force plate."""

import contextlib
import pathlib
import re
from dataclasses import replace

import numpy as np

from afo_sim.common import InputError
from afo_sim.gait_lab.readers import text
from afo_sim.gait_lab.readers.csv_trial import Column, CsvTrial, trial_of
from afo_sim.gait_lab.readers.plates import Plate

_LAYOUT = "lines of a key, a tab and its value (FREQUENCY, MARKER_NAMES or FORCE_PLATE_NAME), then the rows"
_PLATE = {
    f"{word}_{axis}": f"{kind}{axis}" for word, kind in (("force", "f"), ("cop", "p")) for axis in "xyz"
}
_CORNERS = ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY")  # in C3D's order


def read_qualisys(path: pathlib.Path) -> CsvTrial:
    """Read the markers or the force plate of a QTM export."""
    lines, ended = text.read_lines(path)
    start = next((k for k, line in enumerate(lines) if _is_row(line)), len(lines))
    header = [text.cells_of(line, "\t") for line in lines[:start] if line.strip()]
    stated = {cells[0].upper(): text.without_empty_end(cells[1:]) for cells in header}
    rows = [line for line in lines[start:] if line.strip()]
    rate = text.rate_of(path, "FREQUENCY", (stated.get("FREQUENCY") or [""])[0])
    if not header or not rows:
        raise InputError("has no rows of numbers", file=path, allowed=_LAYOUT)
    titles = _titles(path, stated, header[-1], rows[0])  # `NAME x`; `PLATE fx`, `PLATE px`; "" of the others
    table, notices = text.numbers(path, rows, titles, "\t", ended)
    units = [("N", 1.0) if re.search(" f[xyz]$", title) else ("m", 1e-3) for title in titles]
    named = enumerate(zip(titles, units, strict=True))
    columns = [Column(t, *unit, table[:, k]) for k, (t, unit) in named if t]
    said = {key: cells[0] for key, cells in stated.items() if cells}
    counted = {"NO_OF_FRAMES": ("frames", len(table)), "NO_OF_SAMPLES": ("rows", len(table))}
    notices += text.miscounts(said, counted)
    trial = trial_of(path, np.arange(len(table)) / rate, columns, notices)
    places = [f"FORCE_PLATE_CORNER_{place}_{axis}" for place in _CORNERS for axis in "XYZ"]
    corners = None  # where not all are stated
    with contextlib.suppress(ValueError, LookupError):
        corners = 1e-3 * np.reshape(text.parse_row([stated[place][0] for place in places]), (4, 3))
    plates = tuple(replace(plate, corners=corners) for plate in trial.plates)
    if plates and "local" in " ".join(stated.get("DESCRIPTION", [])).lower():
        plates = tuple(_turned(path, plate) for plate in plates)
    return replace(trial, plates=plates)


def _turned(path: pathlib.Path, plate: Plate) -> Plate:
    """A plate whose numbers are in its own axes: x and y to the corners so named, z by them downward."""
    corners = np.full((4, 3), np.nan) if plate.corners is None else plate.corners
    x, y = np.array([[1.0, -1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0]]) @ corners
    z, size = np.cross(x, y), float(np.linalg.norm(x) * np.linalg.norm(y))
    problem = "has its forces in the plate's own axes, and "
    allowed = "QTM's export in world (lab) coordinates"
    if not np.linalg.norm(z) > 0.98 * size:  # x and y within 11 deg of a right angle
        problem += "not the four corners of a rectangle that they could be turned by"
        raise InputError(problem, file=path, allowed=f"{allowed}, or FORCE_PLATE_CORNER_… of all four [mm]")
    axes = np.column_stack([axis / np.linalg.norm(axis) for axis in (x, np.cross(z, x), z)])
    if np.sum(z) > 0.0 < np.sum(plate.force[:, 2]):  # QTM writes what presses on the plate, along z downward
        problem += "its corners make the axis along which it is pressed point up: are they in their order?"
        raise InputError(problem, file=path, allowed=allowed)
    return replace(plate, force=plate.force @ axes.T, place=corners.mean(axis=0) + plate.place @ axes.T)


def _is_row(line: str) -> bool:
    try:
        return bool(line.strip()) and len(text.parse_row(text.cells_of(line, "\t"))) > 1
    except ValueError:
        return False


def _titles(path: pathlib.Path, stated: dict[str, list[str]], last: list[str], row: str) -> list[str]:
    """Of columns of markers, before which frame and time may stand, or of a plate's force and pressure."""
    if "MARKER_NAMES" in stated:
        if "6D" in stated.get("DATA_INCLUDED", []):
            raise InputError("holds rigid bodies (6D)", file=path, allowed="QTM's export of 3D data")
        names = stated["MARKER_NAMES"]
        lead = 2 if len(text.without_empty_end(text.cells_of(row, "\t"))) > 3 * len(names) else 0
        if last[0].lower() in ("frame", "time"):
            lead = sum(cell.lower() in ("frame", "time") for cell in last[:2])
        return [""] * lead + [f"{name} {axis}" for name in names for axis in "xyz"]
    plate = " ".join(stated.get("FORCE_PLATE_NAME", [])) or "1"
    found = [_PLATE.get(cell.lower(), "") for cell in text.without_empty_end(last)]
    if not set(_PLATE.values()) <= set(found):
        allowed = "Force_X, Force_Y, Force_Z, COP_X, COP_Y, COP_Z above the rows"
        raise InputError("has neither markers nor a whole force plate", file=path, allowed=allowed)
    return [name and f"{plate} {name}" for name in found]
