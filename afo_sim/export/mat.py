"""A run as MATLAB's .mat, version 5: one struct `run`."""

import json
import math
import pathlib
from typing import Any

import numpy as np

from afo_sim.common.writing import json_text
from afo_sim.export.names import legal_names
from afo_sim.export.rows import Rows
from afo_sim.metrics.metric import Metric
from afo_sim.simulation.recording import Recording


def write_mat(recording: Recording, rows: Rows, path: pathlib.Path) -> None:
    """Write a run as the struct `run`.

    `run.columns`, `run.names`, `run.units` and `run.signs` have the same fields: values (n × 1, double), the
    column's own name, unit and sign. `run.metrics.NAME` has `value` and `unit`; `run.strides` a column of
    values of each metric. `run.scenario`, `run.studies` and `run.versions` are JSON: jsondecode reads them.
    """
    from scipy.io import savemat

    field = legal_names(rows.columns)
    run = {
        "name": recording.scenario["name"],
        "status": recording.status,
        "time": rows.columns["time"],
        "columns": {field[name]: values for name, values in rows.columns.items()},
        "names": {field[name]: name for name in rows.columns},
        "units": {field[name]: unit for name, unit in rows.units.items()},
        "signs": {field[name]: sign for name, sign in rows.signs.items()},
        "metrics": _metrics(recording.metrics),
        "strides": _strides(recording.strides),
        "warnings": np.array(recording.warnings, dtype=object),
        "scenario": _json(recording.scenario),
        "studies": _json(recording.studies),
        "versions": _json(recording.versions),
    }
    savemat(path, {"run": run}, appendmat=False, long_field_names=True, do_compression=True, oned_as="column")


def _json(value: object) -> str:
    """Plain data as JSON in ASCII: Octave's jsondecode takes no other letters from a .mat."""
    return json.dumps(json.loads(json_text(value)))


def _metrics(metrics: dict[str, Metric]) -> dict[str, Any]:
    legal = legal_names(metrics)
    return {legal[name]: {"value": float(m), "unit": m.unit} for name, m in metrics.items()}


def _strides(strides: dict[int, dict[str, Metric]]) -> dict[str, np.ndarray]:
    """`stride`, the number of each, and the values of each metric, NaN where a stride has none."""
    legal = legal_names(["stride", *dict.fromkeys(name for told in strides.values() for name in told)])
    found = {"stride": np.array(list(strides), float)}
    for name, fieldname in legal.items():
        if name != "stride":
            found[fieldname] = np.array([float(told.get(name, math.nan)) for told in strides.values()])
    return found
