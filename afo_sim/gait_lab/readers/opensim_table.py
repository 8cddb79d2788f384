"""OpenSim's .mot and .sto files: a header to `endheader`, then a table over time."""

import pathlib
import re
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers import text
from afo_sim.gait_lab.readers.signals import check_clock, even_clock, refuse_slow

_VECTORS = ("quaternion", "vec3", "vec6", "spatialvec", "rotation", "unitvec3")  # in one cell of a table
_TIME = re.compile(r"(time|t|zeit)\s*[\[(]?\s*(s|sec|seconds?|ms)?\s*[\])]?$", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class OpenSimTable(Noted):
    """Columns over time, in the file's own units."""

    file: pathlib.Path
    time: np.ndarray  # [s] (n,)
    columns: dict[str, np.ndarray]  # coordinate or column name: (n,)
    degrees: bool | None  # of the rotations; None when the header is silent
    notices: tuple[Notice, ...] = ()  # what was odd about the file and how it was read


def read_opensim_table(path: pathlib.Path) -> OpenSimTable:
    """Read a .mot or .sto file."""
    lines, ended = text.read_lines(path)
    end = next((k for k, line in enumerate(lines) if line.strip(" \t;,").lower() == "endheader"), None)
    if end is None:
        problem = "has no header that ends in 'endheader'"
        raise InputError(problem, file=path, allowed="an OpenSim .mot or .sto")
    header = _header(lines[:end])
    body = [line for line in lines[end + 1 :] if line.strip(" \t;,")]
    if len(body) < 3:
        problem = "has no table over time after its header"
        raise InputError(problem, file=path, allowed="a row of names with 'time', then rows of numbers")
    separator = text.separator_of(body[0])
    names = text.without_empty_end(text.cells_of(body[0], separator))
    _refuse_vectors(path, header, names, body[1], separator)
    table, notices = text.numbers(path, body[1:], names, separator, ended, gaps=False)
    notices += text.miscounts(header, dict.fromkeys(("nrows", "datarows"), ("rows", len(table))))[:1]
    # each row has its columns: no harm
    wide = text.miscounts(header, dict.fromkeys(("ncolumns", "datacolumns"), ("columns", table.shape[1])))[:1]
    place, factor, clock = _clock_column(path, names, table)
    time, rounded = even_clock(table[:, place] * factor)
    check_clock(path, time)
    refuse_slow(path, time, "time", "seconds, or a title 'time [ms]'")
    columns, doubles = text.unique_names(_coordinates(names), "column")
    # of the leg, the second may have been meant
    if not any(re.match(r"(pelvis|hip|knee|ankle)_.*\.\d+$", name) for name in columns):
        doubles = [each.with_severity("note") for each in doubles]
    degrees = {"yes": True, "no": False}.get(header.get("indegrees", "").lower())
    found = {name: table[:, k] for k, name in enumerate(columns) if k != place}
    told = (*clock, *notices, *rounded, *(each.with_severity("note") for each in wide), *doubles)
    return OpenSimTable(path, time, found, degrees, told)


def _header(lines: list[str]) -> dict[str, str]:
    found = {}
    for line in lines:
        key, equals, value = line.strip(" \t;,").partition("=")
        if not equals:
            key, _, value = line.strip(" \t;,").partition(" ")
        found[key.strip().lower()] = value.strip()
    return found


def _refuse_vectors(
    path: pathlib.Path, header: dict[str, str], names: list[str], row: str, separator: str | None
) -> None:
    kind = header.get("datatype", "").lower()
    cells = text.cells_of(row, separator) if separator != "," else []
    commas = max((cell.count(",") for cell in cells), default=0)
    if not kind.startswith(_VECTORS) and commas < 2:
        return
    word = "quaternions" if kind.startswith("quaternion") or commas == 3 else "vectors"
    of = ", ".join(names[1:5]) + (", …" if len(names) > 5 else "")
    allowed = "joint angles, exported from inverse kinematics (export joint angles)"
    raise InputError(f"holds {word} of {of}, several numbers to a cell", file=path, allowed=allowed)


def _clock_column(path: pathlib.Path, names: list[str], table: np.ndarray) -> tuple[int, float, list[Notice]]:
    """Which column is the clock, seconds in its unit, and a remark if it is not the first, called time."""
    titled = [k for k, name in enumerate(names) if _TIME.match(name)]
    if titled:
        place = titled[0]
        milli = bool(re.search(r"[\[( ]ms", names[place], re.IGNORECASE))
        plain = place == 0 and not milli
        words = "its clock is column {column}, {title!r}"
        found = [] if plain else [note("clock-column", words, column=place + 1, title=names[place])]
        return place, 1e-3 if milli else 1.0, found
    with np.errstate(invalid="ignore"):
        steps = np.diff(table[:, 0])
        if len(steps) and np.all(steps > 0.0) and np.ptp(steps) <= 0.1 * steps.mean():
            words = "its first column, {title!r}, was taken as the time"
            return 0, 1.0, [note("clock-column", words, column=1, title=names[0])]
    problem = "has no table over time after its header"
    raise InputError(problem, file=path, value=", ".join(names[:6]), allowed="a first column 'time'")


def _coordinates(names: list[str]) -> list[str]:
    """Names without the path that OpenSim 4 puts before them, as long as they differ without it."""
    parts = [
        name.strip("/").split("/") if re.fullmatch(r"[^\s\[(]*/[^\s\[(]*", name) else [name] for name in names
    ]
    short = [p[-2] if len(p) > 1 and p[-1] == "value" else p[-1] for p in parts]
    return [
        "/".join(p[-2:]) if short.count(name) > 1 and len(p) > 1 and p[-1] != "value" else name
        for name, p in zip(short, parts, strict=True)
    ]
