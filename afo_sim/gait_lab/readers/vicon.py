"""Vicon Nexus' ASCII export: blocks of trajectories and of devices, each with a rate of its own."""

import pathlib
import re

import numpy as np

from afo_sim.common import InputError
from afo_sim.gait_lab.readers.csv_trial import Column, CsvTrial, trial_of, unit_of
from afo_sim.gait_lab.readers.signals import check_clock
from afo_sim.gait_lab.readers.text import cells_of, numbers, rate_of, read_lines, separator_of

_LAYOUT = "'Trajectories' or 'Devices', the rate, the names, 'Frame,Sub Frame,X,Y,Z', the units, the rows"
_TITLES = re.compile(r'"?frame"?\s*[,;\t]\s*"?sub ?frame', re.IGNORECASE)
_PLATE = re.compile(r"(?P<plate>.+?)\s*-\s*(?P<kind>force|cop)$", re.IGNORECASE)


def read_vicon(path: pathlib.Path) -> CsvTrial:
    """Read a Nexus export; its axes are the laboratory's, blocks of other kinds are left out."""
    lines, ended = read_lines(path)
    places = [k for k, line in enumerate(lines) if _TITLES.match(line)]
    found: dict[str, CsvTrial] = {}
    for place, stop in zip(places, [*(k - 3 for k in places[1:]), len(lines)], strict=True):
        kind = cells_of(lines[place - 3], separator_of(lines[place]))[0].lower() if place >= 3 else ""
        if kind in found:
            raise InputError(f"has a second block of {kind}", file=path, allowed=_LAYOUT)
        if kind in ("trajectories", "devices"):
            found[kind] = _block(path, lines[place - 2 : stop], ended or stop < len(lines))
    if not found:
        raise InputError("has neither trajectories nor devices", file=path, allowed=_LAYOUT)
    markers = next((block.markers for block in found.values() if block.markers), None)
    plates = tuple(plate for block in found.values() for plate in block.plates)
    notices = tuple(notice for block in found.values() for notice in block.notices)
    return CsvTrial(markers, (), plates, notices)


def _block(path: pathlib.Path, lines: list[str], ended: bool) -> CsvTrial:
    """A block from the line of its rate on."""
    separator = separator_of(lines[2])
    above, titles, units = ([*cells_of(line, separator)] for line in (*lines[1:3], *(lines[3:4] or [""])))
    rate = rate_of(path, "rate", cells_of(lines[0], separator)[0])
    rows = [line for line in lines[4:] if line.strip(" \t;,")]
    table, notices = numbers(path, rows, titles, separator or ",", ended)
    frame, part = table[:, 0], np.nan_to_num(table[:, 1])
    time = (frame * (part.max() + 1.0) + part) / rate  # a camera's frame holds so many samples of a plate
    check_clock(path, time, "Frame")
    columns, group = [], ""
    for k in range(2, len(titles)):
        group = (above[k] if k < len(above) else "") or group
        name = _name(group, titles[k].lower())
        if name:
            unit, scale = unit_of(units[k] if k < len(units) else "")
            if unit not in ("m", "N"):
                allowed = "mm, m or N in the row below the titles"
                raise InputError(f"column {name} has no unit", file=path, allowed=allowed)
            columns.append(Column(name, unit, scale, table[:, k]))
    return trial_of(path, time, columns, notices)


def _name(group: str, title: str) -> str:
    """A column's name as a CSV has it; "" for what is neither a place nor a plate's force or pressure."""
    plate = _PLATE.match(group)
    if plate and re.fullmatch("[fc][xyz]", title):
        return f"{plate['plate']} {'f' if plate['kind'].lower() == 'force' else 'p'}{title[1]}"
    return f"{group} {title}" if title in ("x", "y", "z") else ""
