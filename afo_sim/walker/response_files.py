"""The files of a response: numbers and answers, columns of each walk, gaits that were adapted."""

import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Mapping
from typing import Any

from afo_sim.common import as_stored, check_writable, parquet_column, together, write_json, write_parquet
from afo_sim.common.versions import versions
from afo_sim.walker.answer import CASES, verdict
from afo_sim.walker.gait_file import write_gait
from afo_sim.walker.respond import Case, Response

STEM = "walk"
JSON = f"{STEM}.json"
PICTURES = tuple(f"{STEM}.{ending}" for ending in ("png", "gif", "html", "rrd"))
TABLE = f"{STEM}.csv"  # of responses at several values
Draw = Callable[[Response, pathlib.Path], None]


def save(
    response: Response,
    folder: str | os.PathLike[str],
    *,
    command: Mapping[str, Any] | None = None,
    draw: Draw | None = None,
) -> pathlib.Path:
    """Write walk.json, the columns of each case as Parquet, gaits that were searched as TOML; all or none.

    Parameters
    ----------
    response : what `respond` gives
    folder : made if need be
    command : what is kept beside it in walk.json
    draw : called with the response and the folder to draw into

    Returns
    -------
    the folder

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    import pyarrow as pa

    place = pathlib.Path(folder)
    check_writable(place)
    with together(place, FILES) as scratch:
        write_json(scratch / JSON, as_stored(_contents(response, command or {}), place))
        for case in response.cases.values():
            columns = {name: parquet_column(values) for name, values in case.walked.columns.items()}
            write_parquet(scratch / _file(case.name, "parquet"), pa.table(columns))
            if case.found is not None:
                write_gait(scratch / _file(case.name, "toml"), case.gait)
        if draw is not None:
            draw(response, scratch)
    return place


def _file(case: str, ending: str) -> str:
    return f"{case.replace(' ', '_')}.{ending}"


FILES = (JSON, TABLE, *PICTURES, *(_file(case, ending) for case in CASES for ending in ("parquet", "toml")))


def _contents(response: Response, command: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "command": dict(command),
        "scenario": response.scenario.resolved(),
        "asked": dict(response.asked),
        "cases": {name: _case(case) for name, case in response.cases.items()},
        "verdict": [dataclasses.asdict(reply) for reply in verdict(response)],
        "versions": versions(),
    }


def _case(case: Case) -> dict[str, Any]:
    """A case in plain data; a number that there is not is None."""
    falls = case.falls
    return {
        "gait": case.gait.name,
        "search": dict(case.gait.search),
        "converged": None if case.found is None else case.found.converged,
        "fell": case.walked.fell,
        "falls": None if falls is None else dataclasses.asdict(falls) | {"interval": list(falls.interval)},
        "numbers": {name: value if math.isfinite(value) else None for name, value in case.numbers.items()},
    }
