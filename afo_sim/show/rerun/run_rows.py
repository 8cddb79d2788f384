"""Timelines: every row is logged in seconds and, in walking, in strides."""

import functools
import pathlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr

from afo_sim.common import Foreign, InputError, si
from afo_sim.description import Scenario, body_mass
from afo_sim.metrics import SOLVED
from afo_sim.model import as_run
from afo_sim.simulation import Recording, described_cycle, open_run, recording_header

_BLOCK = 8192  # rows per block and per message: the viewer need not take a long run in one piece

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Source:
    """A run's header (a Recording without rows), its columns' names, and its rows in blocks."""

    header: Recording
    columns: tuple[str, ...]
    n_row: int
    read: Callable[[Sequence[str], int], Iterator[Columns]]

    @property
    def name(self) -> str:
        """The scenario's name."""
        return str(self.header.described["name"])

    @functools.cached_property
    def scenario(self) -> Scenario:
        """The resolved scenario as a description again."""
        return self.header.scenario

    @property
    def rate(self) -> float:
        """Rows per second [Hz]."""
        ran = as_run(self.scenario) if self.solved else self.scenario
        return 1.0 / (ran.timestep * ran.record_stride)

    @property
    def cycle(self) -> float:
        """Duration of the viewer's loop: what repeats in a seated run, or the whole run [s]."""
        if self.solved:  # whole strides, about as long as was asked
            return self.n_row / self.rate
        period = None if self.walks else described_cycle(self.scenario)
        return float(period or self.scenario.duration)

    @property
    def walks(self) -> bool:
        """True where recorded walking drives the run."""
        return "gait/phase" in self.columns

    @property
    def solved(self) -> bool:
        """True where the run ends with the settled stride, which was solved for."""
        return SOLVED in self.columns

    @property
    def body_mass(self) -> float:
        """Of the patient, or else of the leg's body [kg]."""
        return body_mass(self.header.described)

    def named(self, kind: str) -> list[str]:
        """The muscles, chambers or valves of the run."""
        parts = (c.split("/") for c in self.columns)
        return list(dict.fromkeys(p[1] for p in parts if p[0] == kind))

    def every(self, rate: float | str | None) -> int:
        """Rows from one sample to the next at a rate [Hz]; 1 keeps all."""
        return 1 if rate is None else max(1, round(self.rate / si(rate, "Hz", "rate")))


def from_recording(recording: Recording) -> Source:
    """A run that is in memory."""
    n = len(recording["time"])

    def read(names: Sequence[str], every: int) -> Iterator[Columns]:
        for start in range(0, n, _BLOCK):
            first = start + -start % every
            if first < min(start + _BLOCK, n):
                yield {name: recording[name][first : start + _BLOCK : every] for name in names}

    return Source(recording, tuple(recording.columns), n, read)


def from_folder(folder: pathlib.Path) -> Source:
    """A run on disk; its rows are never all in memory."""
    file = open_run(folder)

    def read(names: Sequence[str], every: int) -> Iterator[Columns]:
        skip = 0
        for batch in file.iter_batches(batch_size=_BLOCK, columns=list(names), use_threads=False):
            block = {name: batch.column(name).to_numpy()[skip::every] for name in names}
            skip = (skip - batch.num_rows) % every
            if len(block[names[0]]):
                yield block

    columns = tuple(file.schema_arrow.names)
    return Source(recording_header(file, folder), columns, file.metadata.num_rows, read)


def require_rows(source: Source) -> None:
    """Refuse a run that stopped before its first row."""
    if source.n_row == 0:
        raise InputError("the run has no rows to look at", field=source.name, value=source.header.status)


def require_time(folders: Sequence[pathlib.Path], moment: float) -> None:
    """Refuse a time [s] at which none of the runs is recorded."""
    last = max((source.n_row - 1) / source.rate for source in map(from_folder, folders))
    if not 0.0 <= moment <= last:
        allowed = f"0 s to {last:g} s"
        raise InputError("is outside the run", field="at", value=f"{moment:g} s", allowed=allowed)


TIMELINE = "sim_time"
STRIDES = "strides"  # 1 s on it is one stride: runs of different cadence line up, stride for stride
GAIT = ("gait/stride", "gait/phase")
ANGLE = "ankle_angle_deg"  # timeline of a design: whole degrees
SWEPT = "ankle/swept"  # its column


def _stamps(time: np.ndarray) -> np.ndarray:
    """Times [s] on a timeline's grid of nanoseconds."""
    return np.round(time * 1e9).astype(np.int64).astype("timedelta64[ns]")


def strides(rows: Columns) -> np.ndarray:
    """Strides since the first heel strike of rows of walking [-] (n,)."""
    return rows["gait/stride"] + rows["gait/phase"]


def send(stream: rr.RecordingStream, entity: str, rows: Columns, columns: Foreign) -> None:
    """Log columns at the times of some rows."""
    times = [rr.TimeColumn(TIMELINE, duration=_stamps(rows["time"]))]
    if GAIT[0] in rows:
        times.append(rr.TimeColumn(STRIDES, duration=_stamps(strides(rows))))
    if SWEPT in rows:
        times.append(rr.TimeColumn(ANGLE, sequence=np.round(rows[SWEPT]).astype(np.int64)))
    stream.send_columns(entity, times, columns)
