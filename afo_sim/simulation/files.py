"""The files of a run: written whole or not at all, read whole or in blocks."""

import dataclasses
import json
import math
import os
import pathlib
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, settle, together, write_json, write_text
from afo_sim.metrics.metric import Metric
from afo_sim.simulation.recording import Recording, describe

PARQUET, SUMMARY, MODEL, RERUN = "recording.parquet", "summary.json", "model.xml", "recording.rrd"
ROW_GROUP = 8192  # rows that a reader of a long run holds at a time


def save(
    recording: Recording, folder: pathlib.Path, *, rrd: bool = True, rate: float | None = None
) -> pathlib.Path:
    """Write the files of a run, all together or none.

    Parameters
    ----------
    recording : what to write
    folder : made if need be
    rrd : also write recording.rrd
    rate : samples a second in it [Hz]; the run's own by default

    Returns
    -------
    the folder
    """
    check_writable(folder)
    with together(folder, (PARQUET, SUMMARY, MODEL, RERUN)) as scratch:
        write_parquet(recording, scratch / PARQUET)
        write_text(scratch / MODEL, recording.model_xml)
        write_json(scratch / SUMMARY, recording.summary())
        if rrd and len(recording["time"]):
            from afo_sim.show.rerun import write_rrd

            write_rrd(recording, scratch / RERUN, rate=rate)
    return folder


def _json_numbers(value: Any) -> Any:
    """NaN is no JSON: null instead."""
    if isinstance(value, dict):
        return {key: _json_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_json_numbers(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def write_parquet(recording: Recording, path: pathlib.Path) -> None:
    """One row per sample; unit and sign in each column's metadata, the run in the schema's."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = []
    for name in recording.columns:
        unit, sign = describe(name)
        fields.append(pa.field(name, pa.float64(), metadata={"unit": unit, "sign": sign}))
    run = recording.summary() | {"model_xml": recording.model_xml, "parameters": recording.parameters}
    schema = pa.schema(fields, metadata={"afo_sim": json.dumps(_json_numbers(run))})
    table = pa.table([pa.array(v) for v in recording.columns.values()], schema=schema)
    pq.write_table(table, path, row_group_size=ROW_GROUP)


def open_parquet(folder: str | os.PathLike[str]) -> Any:
    """The Parquet file of a run's folder (or itself), opened but not read.

    Raises
    ------
    InputError
        No run is there, or the file is damaged.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = pathlib.Path(folder)
    if path.is_dir():
        settle(path)
        path = path / PARQUET
    if not path.is_file():
        raise InputError(f"there is no run here ({PARQUET} is missing)", file=folder)
    try:
        return pq.ParquetFile(path, pre_buffer=False)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=path) from None


def recording_header(file: Any, folder: str | os.PathLike[str]) -> Recording:
    """A run's Recording without its rows, from its opened Parquet file."""
    try:
        run = json.loads(file.schema_arrow.metadata[b"afo_sim"])
        return Recording(
            columns={},
            metrics=_metrics(run["metrics"]),
            strides={row["stride"]: _metrics(row["metrics"]) for row in run.get("strides", ())},
            scenario=run["scenario"],
            model_xml=run["model_xml"],
            status=run["status"],
            warnings=tuple(run["warnings"]),
            timing=run["timing"],
            versions=run["versions"],
            parameters=run["parameters"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None


def _metrics(told: dict[str, Any]) -> dict[str, Metric]:
    return {
        name: Metric(math.nan if metric["value"] is None else metric["value"], metric["unit"])
        for name, metric in told.items()
    }


def read_recording(folder: str | os.PathLike[str]) -> Recording:
    """The recording in a run's folder (or of a Parquet file).

    Raises
    ------
    InputError
        No run is there, or the file is damaged.
    """
    import pyarrow as pa

    file = open_parquet(folder)
    header = recording_header(file, folder)
    try:
        table = file.read()
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None
    return dataclasses.replace(header, columns={name: table[name].to_numpy() for name in table.column_names})
