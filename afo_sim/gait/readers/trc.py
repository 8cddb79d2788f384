""".trc files: marker trajectories as OpenSim and camera systems write them."""

import pathlib

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import parse_quantity
from afo_sim.gait.readers.markers import Markers
from afo_sim.gait.readers.signals import check_clock


def read_trc(path: pathlib.Path) -> Markers:
    """Read a .trc file.

    Parameters
    ----------
    path : tab-separated; markers' names on the fourth line, `Units` in the third; an empty cell is a gap

    Raises
    ------
    InputError
        Another layout, an unknown unit, or fewer frames than the header says.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=path) from None
    if len(lines) < 7 or not lines[0].startswith("PathFileType") or not lines[3].startswith("Frame#"):
        allowed = "'PathFileType' on line 1, 'Frame#<tab>Time<tab>names' on line 4"
        raise InputError("is not laid out as a .trc file", file=path, allowed=allowed)
    header = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    unit = header.get("Units", "not stated")
    try:
        metre = parse_quantity(f"1 {unit}", "m")
    except ValueError:
        raise InputError("is no length", file=path, field="Units", value=unit, allowed="m, mm, cm") from None
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    table = _table(path, lines[5:], 2 + 3 * len(names))
    stated = header.get("NumFrames", "")
    if stated.isdigit() and int(stated) > len(table):
        raise InputError(f"has {len(table)} frames, its header says {stated}: cut short?", file=path)
    check_clock(path, table[:, 1], "Time")
    points = table[:, 2:].reshape(len(table), len(names), 3) * metre
    points[np.all(points == 0.0, axis=2)] = np.nan  # some systems write a lost marker as 0 0 0
    return Markers(path, table[:, 1], {name: points[:, k] for k, name in enumerate(names)})


def _table(path: pathlib.Path, lines: list[str], width: int) -> np.ndarray:
    rows = []
    for line in lines:
        cells = line.rstrip("\r\n").split("\t")
        if not cells[0].strip():
            continue  # the empty line that some writers put before the data
        cells = (cells + [""] * width)[:width]
        try:
            rows.append([float(cell) if cell.strip() else np.nan for cell in cells])
        except ValueError:
            problem = f"frame {cells[0].strip()} holds what is no number"
            raise InputError(problem, file=path, allowed="numbers separated by tabs") from None
    return np.array(rows).reshape(-1, width)
