"""Rows of a run that leave it: which columns, how often, finite or not, and by which names."""

import dataclasses
import fnmatch
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, nearest_name
from afo_sim.simulation import Recording

TIME = "time"
_OFF = 0.005  # of the rate asked for, from which the one had is reported [-]
LONGEST = 63  # of a MATLAB name (namelengthmax)
_BLOCK = 2000  # rows from one report to the next
Report = Callable[[int, int], object]
Write = Callable[[Iterable[Iterable[float]]], object]


@dataclass(frozen=True)
class Rows:
    """Columns of a run [SI] (n,), `time` the first; unit and sign of each; notes on what is left out."""

    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    signs: Mapping[str, str]
    notes: tuple[str, ...] = ()


def rows_of(recording: Recording, rate: float | None = None, columns: Iterable[str] = ()) -> Rows:
    """The rows of a run, thinned to a rate."""
    time = recording[TIME]
    if not len(time):
        raise InputError(f"the run has no rows: {recording.status}")
    if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise InputError("time does not increase from row to row", field=TIME)
    every, notes = _every(time, rate)
    names = [TIME, *(name for name in _chosen(recording, columns) if name != TIME)]
    described = {name: recording.describe(name) for name in names}
    return Rows(
        {name: np.asarray(recording[name][::every], float) for name in names},
        {name: unit for name, (unit, _) in described.items()},
        {name: sign for name, (_, sign) in described.items()},
        notes,
    )


def _every(time: np.ndarray, rate: float | None) -> tuple[int, tuple[str, ...]]:
    """Step between kept rows, and a note if the rate differs from the requested one."""
    if rate is None or len(time) < 2:
        return 1, ()
    own = (len(time) - 1) / float(time[-1] - time[0])
    if not 0.0 < rate <= own * (1.0 + _OFF):
        allowed = f"more than 0 Hz and at most the run's own {own:.5g} Hz"
        raise InputError("is out of range", field="rate", value=f"{rate:g} Hz", allowed=allowed)
    every = max(1, round(own / rate))
    had = own / every
    if abs(had - rate) <= _OFF * rate:
        return every, ()
    return every, (f"{had:.5g} rows a second instead of {rate:g}: whole rows of the run are kept",)


def _chosen(recording: Recording, patterns: Iterable[str]) -> list[str]:
    """The columns that fit any of some patterns, in the run's order; all without a pattern."""
    wanted = list(patterns)
    found: set[str] = set()
    for pattern in wanted:
        fitting = fnmatch.filter(recording.columns, pattern)
        if not fitting:
            allowed, near = "a name, or a pattern such as 'ankle/*'", nearest_name(pattern, recording.columns)
            problem = "fits no column of the run"
            raise InputError(problem, field="columns", value=pattern, allowed=allowed, nearest=near)
        found |= set(fitting)
    return [name for name in recording.columns if name in found or not wanted]


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """{name: the same in letters, digits and underscores, different from all others}."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
        plain = plain if re.match("[A-Za-z]", plain) else f"x_{plain}"
        legal, number = plain[:LONGEST], 2
        while legal.lower() in taken:
            ending = f"_{number}"
            legal, number = plain[: LONGEST - len(ending)] + ending, number + 1
        taken.add(legal.lower())
        found[name] = legal
    return found


def finite(rows: Rows, *, failed: bool) -> Rows:
    """Rows of finite numbers only, with notes on what is left out."""
    columns, notes = dict(rows.columns), list(rows.notes)
    whole = np.logical_and.reduce([np.isfinite(values) for values in columns.values()])
    if failed and whole[0] and not whole.all():
        end = int(np.argmin(whole))
        columns = {name: values[:end] for name, values in columns.items()}
        notes.append(f"the last {len(whole) - end} rows are left out: they hold numbers that are not finite")
    bad = [name for name, values in columns.items() if name != TIME and not np.isfinite(values).all()]
    if bad:
        notes.append(f"left out, since they are not finite in every row: {', '.join(bad)}")
    kept = {name: values for name, values in columns.items() if name not in bad}
    return dataclasses.replace(rows, columns=kept, notes=tuple(notes))


def write_numbers(write: Write, columns: list[np.ndarray], report: Report) -> None:
    """Write columns (n,) row by row, each number as the shortest text that is read back to the same bits."""
    count = len(columns[0])
    for start in range(0, count, _BLOCK):
        write(zip(*[column[start : start + _BLOCK].tolist() for column in columns], strict=True))
        report(min(start + _BLOCK, count), count)
