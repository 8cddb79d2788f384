"""OpenSim's .mot and .sto files: a header to `endheader`, then a table over time."""

import pathlib
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.signals import check_clock


@dataclass(frozen=True, eq=False)
class OpenSimTable:
    """Columns over time, in the file's own units."""

    file: pathlib.Path
    time: np.ndarray  # [s] (n,)
    columns: dict[str, np.ndarray]  # coordinate or column name: (n,)
    degrees: bool | None  # of the rotations; None when the header is silent


def read_opensim_table(path: pathlib.Path) -> OpenSimTable:
    """Read a .mot or .sto file.

    Parameters
    ----------
    path : as OpenSim writes it (version 1 to 3), or SIMM's .mot

    Returns
    -------
    OpenSimTable; "/jointset/ankle_r/ankle_angle_r/value" is called "ankle_angle_r"

    Raises
    ------
    InputError
        No header, a table that is not rectangular or shorter than its header says, time that stands still.
    """
    lines = _lines(path)
    end = next((k for k, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None:
        raise InputError(
            "has no header that ends in 'endheader'", file=path, allowed="an OpenSim .mot or .sto"
        )
    header = _header(lines[:end])
    rows = [line.split() for line in lines[end + 1 :] if line.strip()]
    if len(rows) < 3 or rows[0][0].lower() != "time":
        raise InputError(
            "has no table over time after its header", file=path, allowed="a first column 'time'"
        )
    names = [_coordinate(name) for name in rows[0]]
    table = np.empty((len(rows) - 1, len(names)))
    for k, cells in enumerate(rows[1:]):
        try:
            table[k] = [float(cell) for cell in cells]
        except ValueError:
            problem = f"row {k + 1} of its table is not {len(names)} numbers"
            raise InputError(problem, file=path, value=" ".join(cells)) from None
    stated = header.get("nrows", header.get("datarows", ""))
    if stated.isdigit() and int(stated) > len(table):
        problem = f"has {len(table)} rows, its header says {stated}: cut short?"
        raise InputError(problem, file=path)
    check_clock(path, table[:, 0])
    degrees = {"yes": True, "no": False}.get(header.get("indegrees", "").lower())
    return OpenSimTable(path, table[:, 0], dict(zip(names[1:], table.T[1:], strict=True)), degrees)


def _lines(path: pathlib.Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=path) from None


def _header(lines: list[str]) -> dict[str, str]:
    """`key=value` lines, and SIMM's `key value` lines."""
    found = {}
    for line in lines:
        key, equals, value = line.partition("=")
        if not equals:
            key, _, value = line.strip().partition(" ")
        found[key.strip().lower()] = value.strip()
    return found


def _coordinate(name: str) -> str:
    parts = name.strip("/").split("/")
    return parts[-2] if len(parts) > 1 and parts[-1] == "value" else parts[-1]
