"""The files of a response: numbers and answers, columns of each walk, gaits that were searched."""

import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from afo_sim.common import (
    as_stored,
    check_writable,
    parquet_column,
    together,
    write_json,
    write_parquet,
    write_sealed,
)
from afo_sim.common.versions import versions
from afo_sim.walker.answer import CASES, verdict
from afo_sim.walker.gait_file import write_gait
from afo_sim.walker.gait_signs import signs_of
from afo_sim.walker.patients import Population, gaits_table
from afo_sim.walker.patients_answer import Recorded, replies, tables
from afo_sim.walker.respond import Case, Response

JSON, TABLE, GAITS, CURVES = "walk.json", "walk.csv", "patients.csv", "curves.parquet"
PICTURES = ("walk.png", "walk.gif", "walk.html", "walk.rrd")
FILES = (
    JSON,
    TABLE,
    GAITS,
    CURVES,
    *PICTURES,
    *(f"{n.replace(' ', '_')}.{e}" for n in CASES for e in ("parquet", "toml")),
)


def save(
    response: Response,
    folder: str | os.PathLike[str],
    *,
    command: Mapping[str, Any] | None = None,
    draw: Callable[[Response, pathlib.Path], None] | None = None,
) -> pathlib.Path:
    """Write walk.json, the columns of each case as Parquet, gaits that were searched as TOML; all or none."""
    import pyarrow as pa

    place = pathlib.Path(folder)
    check_writable(place)
    contents = {
        "command": dict(command or {}),
        "scenario": response.scenario.resolved(),
        "asked": dict(response.asked),
        "cases": {name: _numbers(case) for name, case in response.cases.items()},
        "verdict": [dataclasses.asdict(reply) for reply in verdict(response)],
        "versions": versions(),
    }
    with together(place, FILES) as scratch:
        write_json(scratch / JSON, as_stored(contents, place), "walk")
        for name, case in response.cases.items():
            stem = name.replace(" ", "_")
            columns = {key: parquet_column(values) for key, values in case.walked.columns.items()}
            write_parquet(scratch / f"{stem}.parquet", pa.table(columns), "walked columns")
            if case.found is not None:
                write_gait(scratch / f"{stem}.toml", case.gait)
        if draw is not None:
            draw(response, scratch)
    return place


def _numbers(case: Case) -> dict[str, Any]:
    """A case in plain data; a number that there is not is None."""
    found: dict[str, Any] = {
        "gait": case.gait.name,
        "search": dict(case.gait.search),
        "fell": case.walked.fell,
        "signs": signs_of(case),
    }
    found["falls"] = case.falls and dataclasses.asdict(case.falls) | {"interval": list(case.falls.interval)}
    return found | {"numbers": {n: x if math.isfinite(x) else None for n, x in case.numbers.items()}}


def save_table(rows: Sequence[Mapping[str, str]], folder: pathlib.Path, command: Mapping[str, Any]) -> None:
    """Write wearers at several values as walk.csv, and walk.json; both or none."""
    check_writable(folder)
    kept = [{name: cell.replace("−", "-").replace('"', "'") for name, cell in row.items()} for row in rows]
    lines = [",".join(f'"{cell}"' for cell in cells) for cells in (kept[0], *(row.values() for row in kept))]
    with together(folder, FILES) as scratch:
        write_sealed(scratch / TABLE, "\n".join(lines) + "\n", "wearers")
        write_json(scratch / JSON, as_stored({"command": dict(command), "rows": kept}, folder), "walk")


def save_population(
    population: Population,
    recorded: Recorded,
    folder: pathlib.Path,
    command: Mapping[str, Any],
    draw: Callable[[Population, Recorded, pathlib.Path], None] | None = None,
) -> None:
    """Write walk.json, a row of each patient and case as walk.csv, curves, adapted gaits; all or none."""
    import pyarrow as pa

    check_writable(folder)
    names = list(population.condition.ranges)
    rows, curves = list[dict[str, Any]](), list[dict[str, Any]]()
    for case, patients in population.cases.items():
        for k, (one, drawn) in enumerate(zip(patients, population.drawn, strict=True), 1):
            who = {"case": case, "patient": k}
            rows.append(
                who | {n: drawn[n] for n in names} | dataclasses.asdict(one.falls) | dict(one.numbers)
            )
            curves += [who | {"curve": n, "angle": angle.tolist()} for n, angle in one.curves.items()]
    contents = {
        "command": dict(command),
        "scenario": population.scenario.resolved(),
        "asked": dict(population.asked),
        "recorded": {n: x if math.isfinite(x) else None for n, x in dataclasses.asdict(recorded).items()},
        "verdict": [dataclasses.asdict(reply) for reply in replies(population, recorded)],
        "tables": [
            {"title": title, "header": header, "rows": rows}
            for title, _, (header, rows) in tables(population)
        ],
        "versions": versions(),
    }
    lines = [",".join(map(str, cells)) for cells in (rows[0], *(row.values() for row in rows))]
    with together(folder, FILES) as scratch:
        write_json(scratch / JSON, as_stored(contents, folder), "walk")
        write_sealed(scratch / TABLE, "\n".join(lines) + "\n", "wearers")
        write_sealed(scratch / GAITS, gaits_table(population), "wearers")
        write_parquet(scratch / CURVES, pa.Table.from_pylist(curves), "walked columns")
        if draw is not None:
            draw(population, recorded, scratch)
