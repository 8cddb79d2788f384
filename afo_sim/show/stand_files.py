"""The files of the stand: a table as CSV or Parquet with units, a figure, a summary, a Rerun recording."""

import csv
import json
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.bench.compare import Comparison
from afo_sim.bench.trial import COLUMNS, Trial
from afo_sim.common.errors import InputError
from afo_sim.common.versions import versions
from afo_sim.common.writing import together, write_json
from afo_sim.show.stand_figure import draw_trials, set_point_text

FORMATS = (".csv", ".parquet")
TABLE_ROWS = 4000  # of a curve in a table, about; sweeps have fewer anyway
LABELS = ("test", "muscle", "law", "friction", "set_point", "way")


@dataclass(frozen=True)
class Target:
    """Where the files go: a folder, their stem, and the formats of the table."""

    folder: pathlib.Path
    stem: str
    formats: tuple[str, ...]

    def path(self, suffix: str) -> pathlib.Path:
        """The file of a suffix."""
        return self.folder / f"{self.stem}{suffix}"


def target(out: pathlib.Path, kind: str) -> Target:
    """What `--out` means: a table's name, or a folder for both tables.

    Raises
    ------
    InputError
        A file of another kind is asked for.
    """
    suffix = out.suffix.lower()
    if suffix in FORMATS:
        return Target(out.parent, out.stem, (suffix,))
    if suffix and not out.is_dir():
        raise InputError(
            "is no table",
            field="--out",
            value=str(out),
            allowed="a name ending in .csv or .parquet, or a folder",
        )
    return Target(out, kind, FORMATS)


def write(
    trials: Sequence[Trial], compared: Sequence[Comparison], place: Target, *, rrd: bool = True
) -> list[pathlib.Path]:
    """Write table, figure, summary and recording of tests of one kind; all together or none.

    Parameters
    ----------
    trials : at least one
    compared : per trial, or none
    place : where
    rrd : also the Rerun recording

    Returns
    -------
    the files
    """
    writers = {".csv": write_csv, ".parquet": write_parquet}
    suffixes = [*place.formats, ".png", ".pdf", ".json"]
    suffixes += [".rrd"] if rrd and not trials[0].static else []
    group = [place.path(suffix).name for suffix in (*FORMATS, ".png", ".pdf", ".json", ".rrd")]
    with together(place.folder, group) as scratch:
        new = Target(scratch, place.stem, place.formats)
        for suffix in place.formats:
            writers[suffix](trials, new.path(suffix))
        for suffix in (".png", ".pdf"):
            draw_trials(trials, compared, new.path(suffix), suffix.removeprefix("."))
        write_json(new.path(".json"), summary(trials, compared))
        if ".rrd" in suffixes:
            from afo_sim.show.rerun.stand import write_stand

            write_stand(trials, new.path(".rrd"))
    return [place.path(suffix) for suffix in suffixes]


def labels(trial: Trial, curve: int) -> list[Any]:
    """What names the rows of a curve: all of LABELS but the way, which changes along it."""
    muscle = trial.plan.muscle
    test = f"{trial.plan.kind}, formula" if trial.static else trial.plan.kind
    return [test, muscle.name, muscle.law, muscle.friction, set_point_text(trial, curve)]


def ways(columns: dict[str, np.ndarray]) -> list[str]:
    """ "up" or "down" for every row."""
    return ["down" if branch % 2 else "up" for branch in columns["branch"]]


def write_csv(trials: Sequence[Trial], path: pathlib.Path) -> None:
    """One row per sample, SI, the units in the titles."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*LABELS, *(f"{name} [{unit or '-'}]" for name, (unit, _) in COLUMNS.items())])
        for trial in trials:
            for k, whole in enumerate(trial.curves):
                named, columns = labels(trial, k), _thinned(whole)
                for way, *values in zip(ways(columns), *columns.values(), strict=True):
                    writer.writerow([*named, way, *(f"{value:.9g}" for value in values)])


def _thinned(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    every = -(-len(columns["time"]) // TABLE_ROWS)
    return {name: values[::every] for name, values in columns.items()}


def write_parquet(trials: Sequence[Trial], path: pathlib.Path) -> None:
    """The same; unit and meaning in each column's metadata, the summary in the schema's."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    told: list[list[Any]] = [[] for _ in LABELS]
    values: dict[str, list[np.ndarray]] = {name: [] for name in COLUMNS}
    for trial in trials:
        for k, whole in enumerate(trial.curves):
            columns = _thinned(whole)
            for column, text in zip(told, labels(trial, k), strict=False):
                column += [text] * len(columns["time"])
            told[-1] += ways(columns)
            for name in COLUMNS:
                values[name].append(np.asarray(columns[name], float))
    fields = [pa.field(name, pa.string()) for name in LABELS]
    fields += [
        pa.field(name, pa.float64(), metadata={"unit": unit, "meaning": meaning})
        for name, (unit, meaning) in COLUMNS.items()
    ]
    schema = pa.schema(fields, metadata={"afo_sim": json.dumps(summary(trials, ()))})
    arrays = [pa.array(column) for column in told] + [pa.array(np.concatenate(v)) for v in values.values()]
    pq.write_table(pa.table(arrays, schema=schema), path)


def summary(trials: Sequence[Trial], compared: Sequence[Comparison]) -> dict[str, Any]:
    """Muscles, numbers per curve, warnings, errors against measured points, versions."""
    return {
        "tests": [
            {
                "test": labels(trial, 0)[0],
                "muscle": trial.plan.muscle.model_dump(mode="json"),
                "timestep": trial.plan.timestep,
                "duration_of_a_branch": trial.plan.duration,
                "curves": {
                    set_point_text(trial, k): {
                        name: {"value": _number(m.value), "unit": m.unit} for name, m in found.items()
                    }
                    for k, found in enumerate(trial.metrics)
                },
                "warnings": list(trial.warnings),
            }
            for trial in trials
        ],
        "compared": [
            {"data": c.name, "points": len(c.x), "left_out": c.left_out, "rms": c.rms, "worst": c.worst}
            for c in compared
        ],
        "versions": versions(),
    }


def _number(value: float) -> float | None:
    """NaN is no JSON."""
    return value if np.isfinite(value) else None
