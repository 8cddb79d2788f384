"""A search's folder: what is searched, every generation, the result; each file whole or not at all."""

import json
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim.common import InputError, disk, keeping, parquet_column, read_json, read_parquet, write_parquet
from afo_sim.study.folder import AGAIN, PARTS, FolderKind

MANIFEST, GENERATIONS = "search.json", "generations"
DESIGNS, BEST, SCENARIO, FIGURE = "designs.parquet", "best.json", "best.toml", "search.png"
SEARCH = FolderKind("search", MANIFEST, GENERATIONS, 6, (BEST, DESIGNS, SCENARIO, FIGURE), PARTS)

Columns = dict[str, np.ndarray]


def read_generation(folder: pathlib.Path, number: int) -> Columns | None:
    """A generation's designs, or None where it is not computed yet."""
    path = SEARCH.part(folder, number)
    return _read_table(path) if path.is_file() else None


def write_generation(folder: pathlib.Path, number: int, columns: Columns) -> None:
    """Put a generation's designs on disk."""
    with disk(folder, AGAIN), keeping(SEARCH.part(folder, number)) as temporary:
        _write_table(temporary, columns, {}, {}, "generation")


def write_designs(
    folder: pathlib.Path, columns: Columns, units: Mapping[str, str], about: Mapping[str, Any]
) -> None:
    """All designs in one table; {column: unit} in its columns' metadata."""
    _write_table(folder / DESIGNS, columns, units, about, "designs")


def read_designs(folder: pathlib.Path) -> Columns:
    """All designs of a search that has a result."""
    return _read_table(folder / DESIGNS)


def read_best(folder: pathlib.Path) -> dict[str, Any] | None:
    """The result, if there is one."""
    path = folder / BEST
    if not path.is_file():
        return None
    try:
        return dict(read_json(path))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, allowed="`changed=restart`") from None


def _write_table(
    path: pathlib.Path, columns: Columns, units: Mapping[str, str], about: Mapping[str, Any], kind: str
) -> None:
    import pyarrow as pa

    arrays = {name: parquet_column(values) for name, values in columns.items()}
    facts = {name: {"unit": units[name]} if name in units else None for name in columns}
    schema = pa.schema(
        [pa.field(name, array.type, metadata=facts[name]) for name, array in arrays.items()],
        metadata={"search": json.dumps(about)} if about else None,
    )
    write_parquet(path, pa.table(list(arrays.values()), schema=schema), kind)


def _read_table(path: pathlib.Path) -> Columns:
    try:
        table = read_parquet(path)
    except InputError as error:
        raise InputError(error.problem, file=path, allowed="`changed=restart`") from None
    return {name: table[name].to_numpy() for name in table.column_names}
