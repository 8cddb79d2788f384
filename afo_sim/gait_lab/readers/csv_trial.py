"""CSV files of a trial with units in their titles: markers, joint angles and moments, force plates."""

import pathlib
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Notice, parse_quantity, split_title
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.markers import Markers, lost_as_nan, marker_set
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.plates import Plate, plate_of
from afo_sim.gait_lab.readers.signals import check_clock, even_clock, refuse_slow
from afo_sim.gait_lab.readers.text import cells_of, numbers, read_lines, unique_names, without_empty_end
from afo_sim.gait_lab.readers.unit_checks import UNITS, length_name, metres

_EXAMPLE = (
    "time [s], R.Knee x [mm], R.Knee y [mm], R.Knee z [mm], knee_angle_r [deg], plate1 fx [N], plate1 px [m]"
)
_GAIT_CYCLE = ("phase", "shank_angle_deg")  # columns of this program's own gait files
_POINT = re.compile(r"(?P<name>.+?)[ _.:-](?P<axis>[xyz])$", re.IGNORECASE)
_FORCE = re.compile(r"(?P<plate>.*?)[ _.:-]?(?P<kind>[fvp])(?P<axis>[xyz])$", re.IGNORECASE)
_MOMENTS = {"nm": 1.0, "n.m": 1.0, "n-m": 1.0, "nmm": 1e-3, "n.mm": 1e-3, "n-mm": 1e-3}
_WORDS = dict.fromkeys(("sec", "secs", "second", "seconds"), "s") | dict.fromkeys(("degree", "°"), "deg")
_WORDS["radians"] = "rad"


@dataclass(frozen=True, eq=False)
class CsvTrial(Noted):
    """What a CSV file holds, as the other readers give it."""

    markers: Markers | None
    tables: tuple[OpenSimTable, ...]  # joint angles in degrees and lengths in m; joint moments in N·m
    plates: tuple[Plate, ...]
    notices: tuple[Notice, ...] = ()


@dataclass(frozen=True)
class Column:
    """One column of a trial's table, named as the CSV names it: `R.Knee x`, `plate1 fx`, `plate1 px`."""

    name: str
    unit: str  # "s", "m", "deg", "N", "N*m", "" for any other
    scale: float  # into that
    values: np.ndarray


def read_csv_trial(path: pathlib.Path) -> CsvTrial:
    """Read a CSV file of a walking trial."""
    lines, ended = read_lines(path)
    place, separator, titles = _titles(path, lines)
    body = [line for line in lines[place + 1 :] if line.strip(" \t;,") and not line.lstrip().startswith("#")]
    table, notices = numbers(path, body, titles, separator, ended)
    bare = [title for title in titles if not split_title(title)[1]]
    if bare:
        shown = ", ".join(repr(title) for title in bare[:8]) + (", …" if len(bare) > 8 else "")
        raise InputError(f"columns without a unit: {shown}", file=path, allowed=_EXAMPLE)
    named = ((*split_title(title), values) for title, values in zip(titles, table.T, strict=True))
    columns = [Column(name, *unit_of(unit), values) for name, unit, values in named]
    titled = next(k for k, column in enumerate(columns) if _is_time(column.name))
    clock = columns.pop(titled)
    if clock.unit != "s":
        title = titles[titled]
        raise InputError("is not a valid time", file=path, field="time", value=title, allowed="time [s]")
    time, rounded = even_clock(clock.values * clock.scale)
    notices += rounded
    check_clock(path, time)
    refuse_slow(path, time, "time", "seconds")
    return trial_of(path, time, columns, notices)


def trial_of(
    path: pathlib.Path, time: np.ndarray, columns: list[Column], notices: Sequence[Notice] = ()
) -> CsvTrial:
    """Markers, plates and tables of a table's columns."""
    plates, columns = _plates(path, time, columns)
    markers, columns = _markers(path, time, columns)
    tables, unused = _tables(path, time, columns)
    text = "columns that were not used: {columns}"
    left = [note("columns-unused", text, columns=", ".join(unused[:8]))] if unused else []
    return CsvTrial(markers, tables, plates, (*notices, *left))


def _titles(path: pathlib.Path, lines: list[str]) -> tuple[int, str, list[str]]:
    """The line with the titles, what separates its cells, and the cells."""
    for k, line in enumerate(lines[:60]):
        if line.lstrip().startswith("#"):
            continue
        separator = max(";\t,", key=line.count)  # the first of those that are most
        cells = without_empty_end(cells_of(line, separator))
        names = [split_title(cell)[0].lower() for cell in cells]
        if set(_GAIT_CYCLE) <= set(names):
            problem = "is a gait cycle already: `gait show`"
            raise InputError(problem, file=path, allowed="a walking trial, to be imported")
        if len(cells) > 1 and any(_is_time(name) for name in names):
            return k, separator, cells
    raise InputError("has no line of titles with a time", file=path, allowed=_EXAMPLE)


def _is_time(name: str) -> bool:
    return name.strip().lower() in ("time", "t", "zeit")


def unit_of(text: str) -> tuple[str, float]:
    """The unit of what is measured, and how much of it the text's unit is; "" for what is not understood."""
    plain = text.strip()
    plain = _WORDS.get(plain.lower(), plain)
    if plain.lower() in _MOMENTS:
        return "N*m", _MOMENTS[plain.lower()]
    for unit in ("m", "s", "rad", "N", "N*m"):
        for word in (plain, length_name(plain)):
            try:
                scale = parse_quantity(f"1 {word}", unit)
            except ValueError:
                continue
            return ("deg", float(np.degrees(scale))) if unit == "rad" else (unit, scale)
    return "", 1.0


def _plates(
    path: pathlib.Path, time: np.ndarray, columns: list[Column]
) -> tuple[tuple[Plate, ...], list[Column]]:
    """Plates, and the columns that are left."""
    parts: dict[str, dict[str, Column]] = {}
    for column in columns:
        match = _FORCE.match(column.name)
        if match and column.unit == ("m" if match["kind"].lower() == "p" else "N"):
            kind = "p" if match["kind"].lower() == "p" else "f"
            parts.setdefault(match["plate"], {}).setdefault(kind + match["axis"].lower(), column)
    found = []
    taken: set[int] = set()
    for name, own in parts.items():
        forces, places = (sum(key[0] == kind for key in own) for kind in "fp")
        if not forces:
            continue  # a length that is called px by chance
        if forces < 2 or not places:
            problem = f"plate {name or '1'} has the columns {', '.join(own)} only"
            raise InputError(problem, file=path, allowed="fx, fy, fz [N] and px, py, pz [m] of each plate")
        values = {key.replace("f", "v"): column.values * column.scale for key, column in own.items()}
        found.append(plate_of(path, name or "1", time, values))
        taken |= {id(column) for column in own.values()}
    return tuple(found), [column for column in columns if id(column) not in taken]


def _markers(
    path: pathlib.Path, time: np.ndarray, columns: list[Column]
) -> tuple[Markers | None, list[Column]]:
    """Markers, and the columns that are left; a marker has x, y and z, in one unit of length."""
    parts: dict[str, dict[str, list[Column]]] = {}
    for column in columns:
        match = _POINT.match(column.name)
        if match and column.unit == "m" and not column.name.startswith("talus_"):
            parts.setdefault(match["name"].strip(), {}).setdefault(match["axis"].lower(), []).append(column)
    names, blocks, taken = [], [], set()
    for name, own in parts.items():
        if set(own) != set("xyz"):
            missing = ", ".join(sorted(set("xyz") - set(own)))
            raise InputError(f"marker {name} lacks its {missing}", file=path, allowed=_EXAMPLE)
        for triple in zip(own["x"], own["y"], own["z"], strict=False):  # more than one if its name is doubled
            names.append(name)
            blocks.append(np.column_stack([column.values * column.scale for column in triple]))
            taken |= {id(column) for column in triple}
    if not names:
        return None, columns
    stated = next(column.scale for column in columns if id(column) in taken)
    points = lost_as_nan(np.stack(blocks, axis=1) / stated)
    unit = next((name for name, factor in UNITS.items() if factor == stated), f"{stated:g} m")
    factor, notices = metres(points, stated, unit)
    markers = marker_set(path, time, names, points * (factor or stated), notices)
    return markers, [column for column in columns if id(column) not in taken]


def _tables(
    path: pathlib.Path, time: np.ndarray, columns: list[Column]
) -> tuple[tuple[OpenSimTable, ...], list[str]]:
    """A table of angles with lengths, one of moments, and the names of columns that are neither."""
    tables = []
    for units, degrees in ((("deg", "m"), True), (("N*m",), None)):
        own = [column for column in columns if column.unit in units]
        if any(column.unit == units[0] or column.name.startswith("talus_") for column in own):
            names, doubles = unique_names([column.name for column in own], "column")
            values = [column.values * column.scale for column in own]
            numbers = dict(zip(names, values, strict=True))
            tables.append(OpenSimTable(path, time, numbers, degrees, tuple(doubles)))
            columns = [column for column in columns if column.unit not in units]
    return tuple(tables), [column.name for column in columns]
