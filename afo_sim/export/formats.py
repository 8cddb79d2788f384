"""The formats that a run can be exported to: what each writes, and how it is opened."""

import pathlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from afo_sim.common.errors import InputError
from afo_sim.export.coordinates import ANKLE, NEEDED, coordinates, external_loads, ground_loads
from afo_sim.export.csv_rows import Report, write_csv
from afo_sim.export.finite import finite
from afo_sim.export.mat import write_mat
from afo_sim.export.metrics_table import write_metrics
from afo_sim.export.names import legal_names
from afo_sim.export.rows import Rows, rows_of
from afo_sim.export.side import side_of
from afo_sim.export.storage import write_storage
from afo_sim.simulation.files import to_binary
from afo_sim.simulation.recording import Recording

METRICS, LOADS, LOADS_XML = "_metrics.csv", "_grf.mot", "_external_loads.xml"  # after a file's stem


@dataclass(frozen=True)
class Order:
    """What is to be written: a run, its rate [Hz] and columns, and whom to tell of progress."""

    recording: Recording
    rate: float | None
    columns: tuple[str, ...]
    report: Report

    def rows(self, *, columns: Iterable[str] | None = None) -> Rows:
        """The rows that leave, of the columns that were chosen or of others."""
        return rows_of(self.recording, self.rate, self.columns if columns is None else columns)


@dataclass(frozen=True)
class Format:
    """A format.

    `write` writes a file, and others beside it whose names end as `beside` says, and returns notes on what is
    not as in the run. `opens` says how to open the file {name}, `minds` what always to mind. `rows` is False
    of a format that holds none, `chosen` of one whose columns are its own.
    """

    name: str
    beside: tuple[str, ...]
    opens: str
    write: Callable[[Order, pathlib.Path], tuple[str, ...]]
    minds: str = ""
    rows: bool = True
    chosen: bool = True


def _beside(path: pathlib.Path, ending: str) -> pathlib.Path:
    return path.with_name(path.stem + ending)


def _sto(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    rows = finite(order.rows(), failed=not order.recording.ok)
    label = legal_names(rows.columns)
    columns = {label[name]: values for name, values in rows.columns.items()}
    write_storage(path, order.recording.scenario["name"], columns, degrees=False, report=order.report)
    write_metrics(order.recording, _beside(path, METRICS))
    return rows.notes


def _mot(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    side, note = side_of(order.recording)
    present = [name for name in NEEDED if name in order.recording.columns]
    rows = finite(order.rows(columns=present), failed=not order.recording.ok)
    if ANKLE not in rows.columns:
        raise InputError("is not a finite number in every row", field=ANKLE)
    angles, loads = coordinates(rows, side), ground_loads(rows)
    write_storage(path, path.stem, angles, degrees=True, report=order.report)
    if loads:
        file = _beside(path, LOADS)
        write_storage(file, file.stem, loads, degrees=False, report=order.report)
        _beside(path, LOADS_XML).write_text(external_loads(path.stem, file.name, side), encoding="utf-8")
    write_metrics(order.recording, _beside(path, METRICS))
    return (*rows.notes, note) if note else rows.notes


def _csv(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    rows = order.rows()
    write_csv(rows, path, order.report)
    write_metrics(order.recording, _beside(path, METRICS))
    return rows.notes


def _mat(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    rows = order.rows()
    write_mat(order.recording, rows, path)
    return rows.notes


def _mjb(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    path.write_bytes(to_binary(order.recording.model()))
    return ()


FORMATS = {
    each.name: each
    for each in (
        Format("sto", (METRICS,), 'OpenSim: Tools > Plot, or opensim.TimeSeriesTable("{name}")', _sto),
        Format(
            "mot",
            (LOADS, LOADS_XML, METRICS),
            "OpenSim: File > Load Motion, with a model such as Gait2392 opened",
            _mot,
            "mtp_angle is positive with the toes up, as in Gait2392; for the Rajagopal models turn its sign",
            chosen=False,
        ),
        Format("csv", (METRICS,), 'any spreadsheet, or pandas.read_csv("{name}")', _csv),
        Format("mat", (), "MATLAB or Octave: load {name}, then run.columns, run.metrics", _mat),
        Format(
            "mjb",
            (),
            'mujoco.MjModel.from_binary_path("{name}"), with the same version of MuJoCo',
            _mjb,
            "in MuJoCo alone its muscles are limp: step it inside afo_sim.native.installed()",
            rows=False,
            chosen=False,
        ),
    )
}
