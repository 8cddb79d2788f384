"""The formats that a run can be exported to: what each writes, and how it is opened."""

import csv
import json
import math
import pathlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, as_stored, json_text, takes, titles, write_bytes, write_text
from afo_sim.export import opensim
from afo_sim.export.elsewhere.writing import ELSEWHERE
from afo_sim.export.rows import Report, Rows, finite, legal_names, rows_of, write_numbers
from afo_sim.metrics import Metric, words
from afo_sim.simulation import Recording, to_binary

_TITLES = ("name", "value", "unit", "label")
_QUANTILES = ("quantile_5", "quantile_50", "quantile_95")  # of the draws of a run with bands
METRICS, LOADS, LOADS_XML = "_metrics.csv", "_grf.mot", "_external_loads.xml"  # after a file's stem


def _write_metrics(recording: Recording, path: pathlib.Path) -> None:
    """Write a run's metrics, one a line: name, value in its unit, unit, and what it is called."""
    drawn = recording.studies.get("uncertainty", {}).get("metrics", {})
    nothing = {"quantiles": [""] * len(_QUANTILES)}
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*_TITLES, *(_QUANTILES if drawn else ())])
        for name, metric in recording.metrics.items():
            bands = drawn.get(name, nothing)["quantiles"] if drawn else ()
            writer.writerow([name, float(metric), metric.unit, words(name).label, *bands])


def _json(value: object) -> str:
    """Plain data as JSON in ASCII: Octave's jsondecode takes no other letters from a .mat."""
    return json.dumps(json.loads(json_text(value)))


def _strides(strides: dict[int, dict[str, Metric]]) -> dict[str, np.ndarray]:
    """`stride`, the number of each, and the values of each metric, NaN where a stride has none."""
    legal = legal_names(["stride", *dict.fromkeys(name for values in strides.values() for name in values)])
    found = {"stride": np.array(list(strides), float)}
    for name, fieldname in legal.items():
        if name != "stride":
            found[fieldname] = np.array([float(values.get(name, math.nan)) for values in strides.values()])
    return found


@dataclass(frozen=True)
class Order:
    """What a format writes: `recording` and its requested rows."""

    recording: Recording
    rate: float | None  # asked for [Hz]
    columns: tuple[str, ...]  # names or patterns; all where there are none
    report: Report  # called with (rows written, in all)
    place: pathlib.Path  # where the file will stand

    def rows(self, *, columns: Iterable[str] | None = None) -> Rows:
        """Their `columns` [SI], `units` and `signs` by name, `time` first; of those chosen or of others."""
        return rows_of(self.recording, self.rate, self.columns if columns is None else columns)


@dataclass(frozen=True)
class Format:
    """A format that runs are exported to; `register` takes one of your own."""

    name: str  # ending of its files: letters and digits
    write: Callable[[Order, pathlib.Path], Iterable[str] | None]  # to a path; may give notes
    opens: str = "an input for this format"  # in which {name} stands for the file's
    beside: tuple[str, ...] = ()  # what the names of other files that it writes have behind the file's stem
    minds: str = ""  # what to mind then
    rows: bool = True  # whether it has rows, of which some may be asked for
    chosen: bool = True  # whether columns may be


def _beside(path: pathlib.Path, ending: str) -> pathlib.Path:
    return path.with_name(path.stem + ending)


def _sto(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    rows = finite(order.rows(), failed=not order.recording.ok)
    label = legal_names(rows.columns)
    columns = {label[name]: values for name, values in rows.columns.items()}
    opensim.write_storage(
        path, order.recording.described["name"], columns, degrees=False, report=order.report
    )
    _write_metrics(order.recording, _beside(path, METRICS))
    return rows.notes


def _mot(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    side, note = opensim.side_of(order.recording)
    present = [name for name in opensim.NEEDED if name in order.recording.columns]
    rows = finite(order.rows(columns=present), failed=not order.recording.ok)
    if opensim.ANKLE_ANGLE not in rows.columns:
        raise InputError("is not a finite number in every row", field=opensim.ANKLE_ANGLE)
    angles, loads = opensim.coordinates(rows, side), opensim.ground_loads(rows)
    opensim.write_storage(path, path.stem, angles, degrees=True, report=order.report)
    if loads:
        file = _beside(path, LOADS)
        opensim.write_storage(file, file.stem, loads, degrees=False, report=order.report)
        write_text(_beside(path, LOADS_XML), opensim.external_loads(path.stem, file.name, side))
    _write_metrics(order.recording, _beside(path, METRICS))
    return (*rows.notes, note) if note else rows.notes


def _csv(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    """Write rows; non-finite numbers are written as nan, inf or -inf."""
    rows = order.rows()
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)  # CR LF after each line
        writer.writerow(titles({name: rows.units[name] for name in rows.columns}).values())
        write_numbers(writer.writerows, list(rows.columns.values()), order.report)
    _write_metrics(order.recording, _beside(path, METRICS))
    return rows.notes


def _mat(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    """Write a run as the struct `run`."""
    from scipy.io import savemat

    rows, recording = order.rows(), order.recording
    field, legal = legal_names(rows.columns), legal_names(recording.metrics)
    run = {
        "name": recording.described["name"],
        "status": recording.status,
        "time": rows.columns["time"],
        "columns": {field[name]: values for name, values in rows.columns.items()},
        "names": {field[name]: name for name in rows.columns},
        "units": {field[name]: unit for name, unit in rows.units.items()},
        "signs": {field[name]: sign for name, sign in rows.signs.items()},
        "metrics": {legal[k]: {"value": float(m), "unit": m.unit} for k, m in recording.metrics.items()},
        "strides": _strides(recording.strides),
        "warnings": np.array(recording.warnings, dtype=object),
        "scenario": _json(as_stored(recording.described, order.place)),
        "studies": _json(recording.studies),
        "versions": _json(recording.versions),
    }
    savemat(path, {"run": run}, appendmat=False, long_field_names=True, do_compression=True, oned_as="column")
    return rows.notes


def _mjb(order: Order, path: pathlib.Path) -> tuple[str, ...]:
    write_bytes(path, to_binary(order.recording.model()))
    return ()


FORMATS = {
    each.name: each
    for each in (
        Format("sto", _sto, 'OpenSim: Tools > Plot, or opensim.TimeSeriesTable("{name}")', (METRICS,)),
        Format(
            "mot",
            _mot,
            "OpenSim: File > Load Motion, with a model such as Gait2392 opened",
            (LOADS, LOADS_XML, METRICS),
            "mtp_angle is positive with the toes up, as in Gait2392; for the Rajagopal models turn its sign",
            chosen=False,
        ),
        Format("csv", _csv, 'any spreadsheet, or pandas.read_csv("{name}")', (METRICS,)),
        Format("mat", _mat, "MATLAB or Octave: load {name}, then run.columns, run.metrics"),
        Format(
            "mjb",
            _mjb,
            'mujoco.MjModel.from_binary_path("{name}"), with the same version of MuJoCo',
            (),
            "in MuJoCo alone its muscles are limp: step it inside afo_sim.native.installed()",
            rows=False,
            chosen=False,
        ),
    )
}
SHIPPED = (*FORMATS, *ELSEWHERE)


def _add(own: Format) -> None:
    """Put a format of a user's own among the others, in the place of an older one of its name."""
    if own.name in SHIPPED or not own.name.isalnum() or own.name.lower() != own.name:
        problem = "names one of the package's" if own.name in SHIPPED else "is no ending of a file"
        raise InputError(problem, field="name", value=own.name, allowed="small letters and digits: mine")
    FORMATS[own.name] = own


takes(Format, _add)
