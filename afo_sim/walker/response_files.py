"""The files of a response: numbers and answers, columns of each walk, gaits that were searched."""

import contextlib
import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from afo_sim.common import (
    JsonDict,
    JsonMapping,
    as_stored,
    check_writable,
    parquet_column,
    together,
    write_json,
    write_parquet,
    write_sealed,
)
from afo_sim.common.versions import versions
from afo_sim.walker.answer import CASES, Reply, verdict
from afo_sim.walker.gait_file import write_gait
from afo_sim.walker.gait_signs import signs_of
from afo_sim.walker.patients import Population, gaits_table
from afo_sim.walker.patients_answer import Recorded, replies, tables
from afo_sim.walker.respond import Case, Response

JSON, TABLE, GAITS, CURVES = "walk.json", "walk.csv", "patients.csv", "curves.parquet"
PICTURES = ("walk.png", "walk.gif", "walk.html", "walk.rrd")
_OF_CASES = (f"{name.replace(' ', '_')}.{end}" for name in CASES for end in ("parquet", "toml"))
FILES = (JSON, TABLE, GAITS, CURVES, *PICTURES, *_OF_CASES)


@contextlib.contextmanager
def _written(folder: pathlib.Path, contents: JsonMapping) -> Iterator[pathlib.Path]:
    check_writable(folder)
    with together(folder, FILES) as scratch:
        write_json(scratch / JSON, as_stored(dict(contents), folder), "walk")
        yield scratch


def _contents(response: Response | Population, command: JsonMapping, told: Iterable[Reply]) -> JsonDict:
    asked, scenario = dict(response.asked), response.scenario.resolved()
    contents = {"command": dict(command), "scenario": scenario, "asked": asked}
    return contents | {"verdict": [dataclasses.asdict(reply) for reply in told], "versions": versions()}


def save(
    response: Response,
    folder: str | os.PathLike[str],
    *,
    command: JsonMapping | None = None,
    draw: Callable[[Response, pathlib.Path], None] | None = None,
) -> pathlib.Path:
    """Write walk.json, the columns of each case as Parquet, gaits that were searched as TOML; all or none."""
    import pyarrow as pa

    cases = {name: _numbers(case) for name, case in response.cases.items()}
    contents = _contents(response, command or {}, verdict(response)) | {"cases": cases}
    with _written(place := pathlib.Path(folder), contents) as scratch:
        for name, case in response.cases.items():
            stem = name.replace(" ", "_")
            columns = {key: parquet_column(values) for key, values in case.walked.columns.items()}
            write_parquet(scratch / f"{stem}.parquet", pa.table(columns), "walked columns")
            if case.found is not None:
                write_gait(scratch / f"{stem}.toml", case.gait)
        if draw is not None:
            draw(response, scratch)
    return place


def _numbers(case: Case) -> JsonDict:
    found: JsonDict = {"gait": case.gait.name, "search": dict(case.gait.search)}
    found |= {"fell": case.walked.fell, "signs": signs_of(case)}
    found["falls"] = case.falls and dataclasses.asdict(case.falls) | {"interval": list(case.falls.interval)}
    return found | {"numbers": _finite(case.numbers)}


def _finite(numbers: Mapping[str, float]) -> dict[str, float | None]:
    return {name: x if math.isfinite(x) else None for name, x in numbers.items()}


def save_table(
    rows: Sequence[Mapping[str, str]], folder: pathlib.Path, command: JsonMapping, gaits: str = ""
) -> None:
    """Write wearers at several values as walk.csv, walk.json, and their gaits, if any; all or none."""
    kept = [{name: cell.replace("−", "-").replace('"', "'") for name, cell in row.items()} for row in rows]
    lines = [",".join(f'"{cell}"' for cell in cells) for cells in (kept[0], *(row.values() for row in kept))]
    with _written(folder, {"command": dict(command), "rows": kept}) as scratch:
        write_sealed(scratch / TABLE, "\n".join(lines) + "\n", "wearers")
        if gaits:
            write_sealed(scratch / GAITS, gaits, "wearers")


def save_population(
    population: Population,
    recorded: Recorded,
    folder: pathlib.Path,
    command: JsonMapping,
    draw: Callable[[Population, Recorded, pathlib.Path], None] | None = None,
) -> None:
    """Write walk.json, a row of each patient and case as walk.csv, curves, adapted gaits; all or none."""
    import pyarrow as pa

    names, rows, curves = list(population.condition.ranges), list[JsonDict](), list[JsonDict]()
    for case, patients in population.cases.items():
        for k, (one, drawn) in enumerate(zip(patients, population.drawn, strict=True), 1):
            who, falls = {"case": case, "patient": k}, dataclasses.asdict(one.falls)
            rows.append(who | {name: drawn[name] for name in names} | falls | dict(one.numbers))
            curves += [who | {"curve": n, "angle": angle.tolist()} for n, angle in one.curves.items()]
    shown = [{"title": t, "header": header, "rows": cells} for t, _, (header, cells) in tables(population)]
    contents = _contents(population, command, replies(population, recorded))
    contents |= {"recorded": _finite(dataclasses.asdict(recorded)), "tables": shown}
    lines = [",".join(map(str, cells)) for cells in (rows[0], *(row.values() for row in rows))]
    with _written(folder, contents) as scratch:
        write_sealed(scratch / TABLE, "\n".join(lines) + "\n", "wearers")
        write_sealed(scratch / GAITS, gaits_table(population), "wearers")
        write_parquet(scratch / CURVES, pa.Table.from_pylist(curves), "walked columns")
        if draw is not None:
            draw(population, recorded, scratch)
