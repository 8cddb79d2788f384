"""The files of a run: written together or not at all, read whole or in blocks."""

import json
import math
import os
import pathlib
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, Protocol

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.notice import Notice
from afo_sim.common.writing import check_writable, json_text, settle, together
from afo_sim.metrics.metric import Metric
from afo_sim.simulation.kept_model import labelled, packed, unpacked

PARQUET, SUMMARY, MODEL, RERUN = "recording.parquet", "summary.json", "model.xml", "recording.rrd"
RUN_KEY, MODEL_KEY = "afo_sim", "afo_sim_model"  # of the Parquet file's metadata
ROW_GROUP = 8192  # rows that a reader of a long run holds at a time

Write = Callable[[pathlib.Path], object]


class Run(Protocol):
    """The parts of a recording that its files hold."""

    @property
    def columns(self) -> dict[str, np.ndarray]: ...
    @property
    def model_xml(self) -> str: ...
    @property
    def model_binary(self) -> bytes: ...
    @property
    def parameters(self) -> dict[str, list[float]]: ...
    def describe(self, column: str) -> tuple[str, str]: ...
    def summary(self) -> dict[str, Any]: ...


def write_run(recording: Run, folder: pathlib.Path, picture: Write | None) -> pathlib.Path:
    """Write the files of a run; they appear together, and an older run stays whole until then."""
    check_writable(folder)
    with together(folder, (PARQUET, SUMMARY, MODEL, RERUN)) as scratch:
        write_parquet(recording, scratch / PARQUET)
        (scratch / MODEL).write_text(labelled(recording.model_xml), encoding="utf-8")
        (scratch / SUMMARY).write_text(json_text(recording.summary()), encoding="utf-8")
        if picture is not None:
            picture(scratch / RERUN)
    return folder


def write_parquet(recording: Run, path: pathlib.Path) -> None:
    """One row per sample; unit and sign in each column's metadata, the run in the schema's.

    The model that ran stands beside them, in the file's own metadata: whoever wants rows never reads it.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = []
    for name in recording.columns:
        unit, sign = recording.describe(name)
        fields.append(pa.field(name, pa.float64(), metadata={"unit": unit, "sign": sign}))
    run = recording.summary() | {"model_xml": recording.model_xml, "parameters": recording.parameters}
    schema = pa.schema(fields, metadata={RUN_KEY: json_text(run)})
    table = pa.table([_float_array(v) for v in recording.columns.values()], schema=schema)
    model = packed(recording.model_binary)
    with pq.ParquetWriter(path, schema) as file:
        file.write_table(table, row_group_size=ROW_GROUP)
        if model:
            file.add_key_value_metadata({MODEL_KEY: model})


def _float_array(values: np.ndarray) -> Any:
    """Numbers as pyarrow's; its own way from NumPy imports pandas, to see whether they are a Series."""
    import pyarrow as pa

    buffer = pa.py_buffer(np.ascontiguousarray(values, float))
    return pa.Array.from_buffers(pa.float64(), len(values), [None, buffer], null_count=0)


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
    with suppress(InputError):  # a folder that may only be read stays as it is
        settle(path)
    path = path / PARQUET if path.is_dir() else path
    if not path.is_file():
        raise InputError(f"there is no run here ({PARQUET} is missing)", file=folder)
    try:
        return pq.ParquetFile(path, pre_buffer=False)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=path) from None


def read_header(file: Any, folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Header of a run's opened Parquet file, by field of Recording; all but its rows."""
    try:
        run = json.loads(file.schema_arrow.metadata[RUN_KEY.encode()])
        model = (file.metadata.metadata or {}).get(MODEL_KEY.encode(), b"")
        return {
            "metrics": _metrics(run["metrics"]),
            "strides": {row["stride"]: _metrics(row["metrics"]) for row in run.get("strides", ())},
            "scenario": run["scenario"],
            "model_xml": run["model_xml"],
            "model_binary": unpacked(model.decode()),
            "status": run["status"],
            "warnings": _warnings(run["warnings"], run.get("notices", ())),
            "timing": run["timing"],
            "versions": run["versions"],
            "parameters": run["parameters"],
            "studies": run.get("studies", {}),
        }
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None


def _warnings(texts: list[str], notices: Iterable[dict[str, Any]]) -> tuple[str, ...]:
    """Warnings with their codes; those of an older recording are texts."""
    known = {one["text"]: Notice.from_json(one) for one in notices}
    return tuple(known.get(text, text) for text in texts)


def _metrics(table: dict[str, Any]) -> dict[str, Metric]:
    return {
        name: Metric(math.nan if metric["value"] is None else metric["value"], metric["unit"])
        for name, metric in table.items()
    }


def read_run(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """A run's files, by field of Recording."""
    import pyarrow as pa

    file = open_parquet(folder)
    header = read_header(file, folder)
    try:
        table = file.read()
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None
    return header | {"columns": {name: table[name].to_numpy() for name in table.column_names}}
