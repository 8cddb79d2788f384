"""Text files of Motek D-Flow's mocap module: markers and force plates of a treadmill, y up."""

import pathlib
import re
from dataclasses import replace

import numpy as np

from afo_sim.common import InputError
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.csv_trial import Column, CsvTrial, trial_of
from afo_sim.gait_lab.readers.signals import check_clock
from afo_sim.gait_lab.readers.text import cells_of, numbers, read_lines, without_empty_end

_LAYOUT = "TimeStamp, FrameNumber, NAME.PosX …, FP1.ForX …, FP1.CopX … in its first line, with tabs"
_PART = re.compile(r"(?P<name>.+)\.(?P<kind>pos|for|cop)(?P<axis>[xyz])$", re.IGNORECASE)
_KIND = {"pos": ("", "m"), "for": ("f", "N"), "cop": ("p", "m")}  # in a CSV's name, and the unit


def read_d_flow(path: pathlib.Path) -> CsvTrial:
    """Read a mocap file of D-Flow."""
    lines, ended = read_lines(path)
    lines = [line for line in lines if line.strip() and not line.startswith("#")]
    titles = without_empty_end(cells_of(lines[0], "\t")) if lines else []
    plain = [title.lower() for title in titles]
    if "timestamp" not in plain or "framenumber" not in plain:
        raise InputError("has no TimeStamp and FrameNumber", file=path, allowed=_LAYOUT)
    table, notices = numbers(path, lines[1:], titles, "\t", ended)
    stamps, frames = table[:, plain.index("timestamp")], table[:, plain.index("framenumber")]
    new = np.r_[True, np.diff(frames) != 0.0]  # the cameras' frames; D-Flow may write one twice
    table, stamps, frames = table[new], stamps[new], frames[new]
    check_clock(path, stamps, "TimeStamp")
    check_clock(path, frames * (stamps[-1] - stamps[0]) / (frames[-1] - frames[0]), "FrameNumber")
    # a stamp is when a frame arrived, ±2 ms; the cameras' frames are even
    time = np.polyval(np.polyfit(frames - frames[0], stamps, 1), frames - frames[0])
    segments = {title.rsplit(".", 1)[0] for title in plain if re.search(r"\.rot[xyz]$", title)}
    columns = []
    for k, title in enumerate(titles):
        part = _PART.match(title)
        if part and part["name"].lower() not in segments:
            kind, unit = _KIND[part["kind"].lower()]
            name = f"{part['name']} {kind}{part['axis'].lower()}"
            columns.append(Column(name, unit, 1.0, table[:, k]))
    trial, lost = trial_of(path, time, columns, notices), 0
    for points in trial.markers.positions.values() if trial.markers else ():
        held = np.r_[False, (points[1:] == points[:-1]).all(axis=1)]  # a lost marker's last place
        points[held] = np.nan
        lost += int(held.sum())
    text = "{count} places of markers repeat the one before, as D-Flow writes lost ones: they are gaps"
    gaps = [note("markers-held", text, count=lost)] if lost else []
    return replace(trial, notices=(*trial.notices, *gaps))
