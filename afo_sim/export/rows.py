"""The rows and columns of a run that leave it."""

import fnmatch
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.simulation.recording import Recording

TIME = "time"
OFF = 0.005  # of the rate asked for, from which the one had is told [-]


@dataclass(frozen=True)
class Rows:
    """Columns of a run [SI] (n,), `time` the first; unit and sign of each; notes on what is left out."""

    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    signs: Mapping[str, str]
    notes: tuple[str, ...] = ()


def rows_of(recording: Recording, rate: float | None = None, columns: Iterable[str] = ()) -> Rows:
    """The rows of a run, thinned to a rate.

    Every k-th row is kept as it is: neither filtered nor interpolated, which would make numbers between
    two that never were (a phase between 0.99 and 0).

    Units: rate [Hz].
    """
    time = recording[TIME]
    if not len(time):
        raise InputError(f"the run has no rows: {recording.status}")
    if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise InputError("time does not increase from row to row", field=TIME)
    every, notes = _every(time, rate)
    names = [TIME, *(name for name in _chosen(recording, columns) if name != TIME)]
    told = {name: recording.describe(name) for name in names}
    return Rows(
        {name: np.asarray(recording[name][::every], float) for name in names},
        {name: unit for name, (unit, _) in told.items()},
        {name: sign for name, (_, sign) in told.items()},
        notes,
    )


def _every(time: np.ndarray, rate: float | None) -> tuple[int, tuple[str, ...]]:
    """Rows from one that is kept to the next, and a note where the rate is another than was asked for."""
    if rate is None or len(time) < 2:
        return 1, ()
    own = (len(time) - 1) / float(time[-1] - time[0])
    if not 0.0 < rate <= own * (1.0 + OFF):
        allowed = f"more than 0 Hz and at most the run's own {own:.5g} Hz"
        raise InputError("is out of range", field="rate", value=f"{rate:g} Hz", allowed=allowed)
    every = max(1, round(own / rate))
    had = own / every
    if abs(had - rate) <= OFF * rate:
        return every, ()
    return every, (f"{had:.5g} rows a second instead of {rate:g}: whole rows of the run are kept",)


def _chosen(recording: Recording, patterns: Iterable[str]) -> list[str]:
    """The columns that fit any of some patterns, in the run's order; all without a pattern."""
    wanted = list(patterns)
    found: set[str] = set()
    for pattern in wanted:
        fitting = fnmatch.filter(recording.columns, pattern)
        if not fitting:
            raise InputError(
                "fits no column of the run",
                field="columns",
                value=pattern,
                allowed="a name, or a pattern such as 'ankle/*'",
                nearest=nearest_name(pattern, recording.columns),
            )
        found |= set(fitting)
    return [name for name in recording.columns if name in found or not wanted]
