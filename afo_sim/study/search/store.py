"""Files of a search's folder: what is searched, every generation, the result."""

import json
import pathlib
from collections.abc import Mapping

from afo_sim.common import InputError, JsonMapping, parquet_column, read_parquet, write_parquet
from afo_sim.study.folder import PARTS, FolderKind
from afo_sim.study.search.aim import Columns

MANIFEST, GENERATIONS = "search.json", "generations"
DESIGNS, BEST, SCENARIO, FIGURE = "designs.parquet", "best.json", "best.toml", "search.png"
SEARCH = FolderKind("search", MANIFEST, GENERATIONS, 6, (BEST, DESIGNS, SCENARIO, FIGURE), PARTS)
RESTART = "`changed=restart`"  # allowed where a file is damaged


def write_table(
    path: pathlib.Path, columns: Columns, kind: str, units: Mapping[str, str], about: JsonMapping
) -> None:
    """Designs; {column: unit} in its columns' metadata."""
    import pyarrow as pa

    arrays = {name: parquet_column(values) for name, values in columns.items()}
    facts = {name: {"unit": units[name]} if name in units else None for name in columns}
    schema = pa.schema(
        [pa.field(name, array.type, metadata=facts[name]) for name, array in arrays.items()],
        metadata={"search": json.dumps(about)} if about else None,
    )
    write_parquet(path, pa.table(list(arrays.values()), schema=schema), kind)


def read_table(path: pathlib.Path) -> Columns:
    """Designs of a generation, or of a search that has a result."""
    try:
        table = read_parquet(path)
    except InputError as error:
        raise InputError(error.problem, file=path, allowed=RESTART) from None
    return {name: table[name].to_numpy() for name in table.column_names}
