"""A search's folder: what is searched, every generation, the result; each file whole or not at all."""

import json
import pathlib
import shutil
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, disk, keeping
from afo_sim.study.store import differences, holds_nothing

MANIFEST, GENERATIONS = "search.json", "generations"
DESIGNS, BEST, SCENARIO, FIGURE = "designs.parquet", "best.json", "best.toml", "search.png"
AGAIN = "the same command again when there is room; finished generations are kept"

Columns = dict[str, np.ndarray]
Changed = Literal["refuse", "restart"]


def opened(folder: pathlib.Path, fingerprint: Mapping[str, Any], changed: Changed) -> dict[str, Any]:
    """What a folder's search says of itself; {} where a new one begins.

    Parameters
    ----------
    folder : made if need be
    fingerprint : of the search
    changed : "restart" begins anew, and `begin` throws another search's designs away

    Raises
    ------
    InputError
        The folder holds another search, this one computed by other code, or something else; or it cannot
        be written to.
    """
    check_writable(folder)
    if holds_nothing(folder):
        return {}
    told = _json(folder / MANIFEST)
    before = told.get("fingerprint", {})
    if before == fingerprint:
        return told
    if changed == "restart":
        return {}
    problem = "the folder holds another search, or this one before it was changed"
    if before.get("search") == fingerprint["search"]:
        problem = f"the folder's designs were computed by other code{differences(before, fingerprint)}"
    allowed = "another folder, or --if-changed restart, which throws its designs away"
    raise InputError(problem, field="--out", value=str(folder), allowed=allowed)


def begin(folder: pathlib.Path, told: Mapping[str, Any]) -> None:
    """Say what a folder's search is; what another one has left there goes."""
    if (folder / MANIFEST).is_file() and _json(folder / MANIFEST).get("fingerprint") != told["fingerprint"]:
        clear(folder)
    _write_json(folder / MANIFEST, told)


def clear(folder: pathlib.Path) -> None:
    """Take away all that a search has written."""
    shutil.rmtree(folder / GENERATIONS, ignore_errors=True)
    for name in (BEST, DESIGNS, SCENARIO, FIGURE, MANIFEST):
        (folder / name).unlink(missing_ok=True)


def read_generation(folder: pathlib.Path, number: int) -> Columns | None:
    """A generation's designs, or None where it is not computed yet."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = _path(folder, number)
    if not path.is_file():
        return None
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise InputError(f"cannot be read: {error}", file=path, allowed="--if-changed restart") from None
    return {name: table[name].to_numpy() for name in table.column_names}


def write_generation(folder: pathlib.Path, number: int, columns: Columns) -> None:
    """Put a generation's designs on disk."""
    _write_table(_path(folder, number), columns, {}, {})


def write_designs(
    folder: pathlib.Path, columns: Columns, units: Mapping[str, str], about: Mapping[str, Any]
) -> None:
    """All designs in one table; {column: unit} in its columns' metadata."""
    _write_table(folder / DESIGNS, columns, units, about)


def read_best(folder: pathlib.Path) -> dict[str, Any] | None:
    """The result, if there is one."""
    return _json(folder / BEST) if (folder / BEST).is_file() else None


def write_best(folder: pathlib.Path, told: Mapping[str, Any]) -> None:
    """The result; that it is there says that all else is."""
    _write_json(folder / BEST, told)


def write_text(path: pathlib.Path, text: str) -> None:
    """A text, on disk."""
    with disk(path.parent, AGAIN), keeping(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def joined(generations: Sequence[Columns]) -> Columns:
    """Generations as one table."""
    return {name: np.concatenate([each[name] for each in generations]) for name in generations[0]}


def _path(folder: pathlib.Path, number: int) -> pathlib.Path:
    return folder / GENERATIONS / f"{number:06d}.parquet"


def _write_table(
    path: pathlib.Path, columns: Columns, units: Mapping[str, str], about: Mapping[str, Any]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = {
        name: pa.array(values.tolist() if values.dtype == object else values)
        for name, values in columns.items()
    }
    facts = {name: {"unit": units[name]} if name in units else None for name in columns}
    schema = pa.schema(
        [pa.field(name, array.type, metadata=facts[name]) for name, array in arrays.items()],
        metadata={"search": json.dumps(about)} if about else None,
    )
    with disk(path.parent, AGAIN), keeping(path) as temporary:
        pq.write_table(pa.table(list(arrays.values()), schema=schema), temporary)


def _write_json(path: pathlib.Path, told: Mapping[str, Any]) -> None:
    write_text(path, json.dumps(told, indent=1, ensure_ascii=False) + "\n")


def _json(path: pathlib.Path) -> dict[str, Any]:
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        problem = f"holds something else than a search ({path.name} is missing)"
        raise InputError(problem, field="--out", value=str(path.parent), allowed="an empty folder") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path) from None
    return told if isinstance(told, dict) else {}
