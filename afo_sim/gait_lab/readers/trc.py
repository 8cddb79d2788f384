""".trc files: marker trajectories as OpenSim and camera systems write them."""

import pathlib
import re
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.readers import text
from afo_sim.gait_lab.readers.markers import Markers, lost_as_nan, marker_set
from afo_sim.gait_lab.readers.signals import check_clock, even_clock, refuse_slow
from afo_sim.gait_lab.readers.unit_checks import length_name, metres_of

_LAYOUT = "'PathFileType' on line 1, 'Frame#<tab>Time<tab>names' on line 4"
_AXIS = re.compile(r"[xyz]\d+$", re.IGNORECASE)


@dataclass(frozen=True)
class _Header:
    """The header above the numbers."""

    stated: dict[str, str]  # DataRate, Units, … by key in lower case
    names: list[str]  # of markers; "" where there is none
    lead: int  # columns before the first marker: 2, or 1 without a time
    tabs: bool  # cells are separated by tabs, otherwise by blanks
    rows: list[str]


def read_trc(path: pathlib.Path) -> Markers:
    """Read a .trc file."""
    lines, ended = text.read_lines(path)
    header = _header(path, lines)
    table, warnings = _table(path, header, ended)
    names = [*header.names, *[""] * ((table.shape[1] - header.lead) // 3 - len(header.names))]
    counts = {"numframes": ("frames", len(table)), "nummarkers": ("markers", len(names))}
    warnings += text.miscounts(header.stated, counts)
    time, clock = _clock(path, header, table)
    check_clock(path, time, "Time")
    points = lost_as_nan(table[:, header.lead :].reshape(len(table), len(names), 3))
    unit = length_name(header.stated.get("units", ""))
    unit = "" if re.fullmatch(r"[-+0-9.,e]*", unit) else unit
    factor, doubts = metres_of(path, "Units", unit, points)
    return marker_set(path, time, names, points * factor, [*clock, *warnings, *doubts])


def _header(path: pathlib.Path, lines: list[str]) -> _Header:
    """Header lines anywhere, if they are in order."""
    keys = values = ""
    for k, line in enumerate(lines[:40]):
        cells = line.split()
        if len(cells) > 1 and cells[0].lower().startswith("datarate"):
            keys, values = line, next((later for later in lines[k + 1 :] if later.strip()), "")
        elif len(cells) > 2 and re.fullmatch(r"frames?(#|no\.?)?", cells[0].lower()):
            names, words = keys.split(), values.split()
            if len(words) != len(names):  # one is absent, and only tabs can say which
                names, words = text.cells_of(keys, "\t"), text.cells_of(values, "\t")
            stated = {name.lower(): word for name, word in zip(names, words, strict=False)}
            return _titles(path, line, lines[k + 1 :], stated)
    raise InputError("is not laid out as a .trc file", file=path, allowed=_LAYOUT)


def _titles(path: pathlib.Path, line: str, rest: list[str], stated: dict[str, str]) -> _Header:
    """Markers' names, each above the first of its three columns, or one after the other."""
    tabs = "\t" in line
    # some write "Frame #"; blanks alone separate names only if no name holds one
    cells = text.cells_of(
        re.sub(r"^(\s*frames?)\s+#", r"\1#", line, flags=re.IGNORECASE), "\t" if tabs else None
    )
    lead = 2 if cells[1].lower().startswith("time") else 1
    titles = text.without_empty_end(cells[lead:])
    spaced = tabs and all(not title or k % 3 == 0 for k, title in enumerate(titles))
    names = titles[::3] if spaced and len(titles) > 1 else [title for title in titles if title]
    rows = [row for row in rest if row.strip()]
    if rows and all(not cell or _AXIS.match(cell) for cell in rows[0].split()):
        rows = rows[1:]
    if len(rows) < 2 or not names:
        raise InputError("is not laid out as a .trc file", file=path, allowed=_LAYOUT)
    return _Header(stated, names, lead, tabs and "\t" in rows[0], rows)


def _table(path: pathlib.Path, header: _Header, ended: bool) -> tuple[np.ndarray, list[Notice]]:
    """The numbers (n, lead + 3 × markers), NaN where a cell is empty, and warnings."""
    rows, warnings, separator = header.rows, [], "\t" if header.tabs else None
    named = header.lead + 3 * len(header.names)
    split = (text.cells_of(row, separator) for row in rows)  # all cells at a time would be ten times the file
    counts = [(len(cells), len(text.without_empty_end(cells))) for cells in split]
    if not ended and len(rows) > 3 and counts[-1][0] < min(counts[-2][0], named):
        rows, counts = rows[:-1], counts[:-1]
        warnings.append(text.CUT_SHORT)
    width = max(named, *{filled for _, filled in counts})
    width = header.lead + 3 * -(-(width - header.lead) // 3)
    if not header.tabs and any(count != width for count, _ in counts):
        k = next(k for k, (count, _) in enumerate(counts) if count != width)
        seen = f"row {k + 1} has {counts[k][0]} numbers where the names ask for {named}"
        raise InputError(seen, file=path, allowed="tabs between the cells where some are empty")
    if width > 3 * named + 300:
        raise InputError(f"has rows of {width} numbers for {len(header.names)} names", file=path)
    text.require_size(path, len(rows), width)
    table = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        cells = text.cells_of(row, separator)
        try:
            found = text.parse_row(cells[:width])
        except ValueError:
            problem = f"frame {cells[0] or k + 1} holds something that is not a number"
            raise InputError(problem, file=path, allowed="numbers separated by tabs") from None
        table[k, : len(found)] = found
    return table, warnings


def _clock(path: pathlib.Path, header: _Header, table: np.ndarray) -> tuple[np.ndarray, list[Notice]]:
    rate = text.parse_rate(header.stated.get("datarate", ""))
    time = np.full(len(table), np.nan)
    if header.lead == 2:
        time = text.measured(path, ["Time"], table[:, 1:2])[:, 0]
    if np.isfinite(time).any() and np.any(time[np.isfinite(time)] != 0.0):
        refuse_slow(path, time, "Time", "seconds" + (f"; its DataRate is {rate:g} Hz" if rate else ""))
        return even_clock(time, rate)
    if rate is None:
        raise InputError("has neither times nor a DataRate", file=path, field="Time", allowed="seconds")
    words = "has no times; they were counted at DataRate {rate:g} Hz"
    return np.arange(len(table)) / rate, [Notice("times-counted", words, rate=rate)]
