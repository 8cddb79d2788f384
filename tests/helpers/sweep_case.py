"""Sweeps that never ran: results as a sweep writes them, of functions that are known in closed form."""

import json
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq


def write_sweep(
    folder: pathlib.Path,
    design: str,
    parameters: Mapping[str, tuple[np.ndarray, str]],
    metrics: Mapping[str, tuple[np.ndarray, str]],
    *,
    failed: Mapping[int, tuple[str, str]] | None = None,
    chunks: list[np.ndarray] | None = None,
    seeds: tuple[str, ...] = (),
) -> pathlib.Path:
    """Write results.parquet, or with `chunks` only the files of those rows; {name: (values, unit)}.

    `seeds` are parameters that are every case's own seed.
    """
    n = len(next(iter(parameters.values()))[0])
    failed = dict(failed or {})
    status = [failed.get(k, ("ok", ""))[0] for k in range(n)]
    reason = [failed.get(k, ("ok", ""))[1] for k in range(n)]
    fields = [
        pa.field("case", pa.int64(), metadata={"role": "case"}),
        pa.field("seed", pa.uint32()),
        pa.field("status", pa.string()),
        pa.field("reason", pa.string()),
    ]
    columns: list[Any] = [np.arange(n), np.arange(n, dtype=np.uint32) + 7, status, reason]
    for role, group in (("parameter", parameters), ("metric", metrics)):
        for name, (values, unit) in group.items():
            facts = {"role": role, "unit": unit} | ({"key": f"some.{name}"} if role == "parameter" else {})
            kind = pa.array(values[:1]).type
            fields.append(pa.field(name, kind, metadata=facts))
            gone = role == "metric" and failed
            columns.append([None if k in failed else v for k, v in enumerate(values)] if gone else values)
    sweep = {"design": design, "scenario": "seated", "seed": 0, "cases": n, "versions": {}}
    sweep["parameters"] = [
        {"name": name} | ({"distribution": "own seed"} if name in seeds else {}) for name in parameters
    ]
    schema = pa.schema(fields, metadata={"sweep": json.dumps(sweep)})
    table = pa.table(
        [pa.array(c, field.type) for c, field in zip(columns, fields, strict=True)], schema=schema
    )
    folder.mkdir(parents=True, exist_ok=True)
    if chunks is None:
        pq.write_table(table, folder / "results.parquet")
    for k, rows in enumerate(chunks or ()):
        (folder / "chunks").mkdir(exist_ok=True)
        pq.write_table(table.take(pa.array(rows)), folder / "chunks" / f"{k}.parquet")
    return folder


def saltelli(bounds: Mapping[str, tuple[float, float]], n: int, seed: int = 0) -> dict[str, np.ndarray]:
    """{parameter: values} of a Saltelli design, as SALib samples it."""
    from SALib.sample import sobol

    problem = {"num_vars": len(bounds), "names": list(bounds), "bounds": list(map(list, bounds.values()))}
    return dict(zip(bounds, sobol.sample(problem, n, calc_second_order=True, seed=seed).T, strict=True))
