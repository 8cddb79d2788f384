"""Results of a sweep: one row per case, read from its folder, finished or not."""

import json
import math
import os
import pathlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from afo_sim.common import Foreign, InputError, JsonDict, Shown, optional, read_parquet, titles
from afo_sim.metrics import no_metric
from afo_sim.study.analysis import levels_of

if TYPE_CHECKING:
    import pandas

RESULTS, CHUNKS, MANIFEST = "results.parquet", "chunks", "sweep.json"
STEPS = "time_step.json"  # what a sample of the cases says of their time step
EVERY_ROW = ("case", "seed", "status", "reason")  # columns that are neither parameter nor metric …
OVERRIDES = "overrides"  # … nor this: all that a case sets, as JSON by dotted key …
OWN_SEED = "own seed"  # how the spread of a parameter is called that is every case's seed
WARNINGS = "warnings"  # … nor this: what a case warns of, a line each …
NOTICES = "notices"  # … nor this: what each of these lines is about, code and subject


@dataclass(frozen=True, repr=False)
class Results(Shown):
    """The cases of a sweep. Indexing gives a column: `results["toe_clearance"]` (n,).

    folder : with the results' files
    table : pyarrow Table, a row each case
    parameters : {name: unit}
    metrics : {name: unit}
    keys : {parameter: its key in the scenario}
    sweep : the design, as it was written with the results
    unfinished : these are only the cases computed so far
    """

    folder: pathlib.Path
    table: Foreign
    parameters: dict[str, str]
    metrics: dict[str, str]
    keys: dict[str, str]
    sweep: JsonDict
    unfinished: bool = False

    def __repr__(self) -> str:
        of = f" of {self.planned}" if self.unfinished else ""
        failed = len(self) - int(self.ok.sum())
        cases = f"{len(self)}{of} cases" + (f", {failed} failed" if failed else "")
        many = f"{len(self.metrics)} metric{'' if len(self.metrics) == 1 else 's'}"
        over = f"{', '.join(self.parameters)}; {many}"
        return f"<Results: {self.design} of {cases} over {over}>"

    def _ipython_key_completions_(self) -> list[str]:  # of results["…
        return list(self.table.column_names)

    def __len__(self) -> int:
        return int(self.table.num_rows)

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self.table.column_names:
            raise no_metric("the sweep has no such column", column, self.table.column_names, field="column")
        values = self.table[column].to_numpy()
        return values.astype(str) if values.dtype == object else values

    @property
    def design(self) -> str:
        """The sweep's design: grid, list, random, latin-hypercube, sobol or saltelli."""
        return str(self.sweep["design"])

    @property
    def planned(self) -> int:
        """Number of cases of the finished sweep."""
        return int(self.sweep.get("cases", len(self)))

    @property
    def ok(self) -> np.ndarray:
        """Mask of the cases that ran to their end (n,)."""
        return self["status"] == "ok"

    @property
    def warnings(self) -> np.ndarray:
        """Warnings of each case, a line each; "" where there are none (n,)."""
        return self[WARNINGS] if WARNINGS in self.table.column_names else np.full(len(self), "")

    @property
    def notices(self) -> np.ndarray:
        """What each line of `warnings` is about, code and subject; "" in older results (n,)."""
        return self[NOTICES] if NOTICES in self.table.column_names else np.full(len(self), "")

    def lacking(self, metric: str) -> int:
        """Number of the planned cases that have no value of a metric, yet or ever."""
        return self.planned - int(np.isfinite(self[metric]).sum())

    def levels(self) -> dict[str, np.ndarray] | None:
        """{parameter: its values, numbers ascending} where the cases are the cells of a grid, else None."""
        found = {name: levels_of(self[name]) for name in self.parameters}
        levels = {name: level for name, (level, _) in found.items()}
        cells = math.prod(map(len, levels.values()))
        if self.design != "grid" or cells > max(self.planned, len(self)):
            return None
        rows = np.column_stack([places for _, places in found.values()])
        return levels if len(np.unique(rows, axis=0)) == len(rows) else None

    def to_pandas(self) -> "pandas.DataFrame":
        """The cases as a pandas DataFrame, each number with its unit: "pressure [Pa]" (needs pandas).

        `attrs["units"]` holds the units by the columns' names in the results.
        """
        optional("pandas")
        units = self.parameters | self.metrics
        numbers = {name: unit for name, unit in units.items() if self[name].dtype.kind not in "US"}
        frame = self.table.to_pandas().rename(columns=titles(numbers))
        frame.attrs = {"units": units, "sweep": self.sweep}
        return frame

    def to_xarray(self) -> Foreign:
        """The cases as an xarray Dataset (needs xarray).

        Returns
        -------
        xarray.Dataset; a grid has a dimension for each parameter, with its values [SI] as coordinate, and
        cells that are not computed yet are NaN, or "" where there is text; any other design has the one
        dimension `case`. Units are in `attrs["units"]` of each variable.
        """
        xarray = optional("xarray")
        units = self.parameters | self.metrics
        levels = self.levels()
        if levels is None:
            columns = {n: ("case", self[n], _units(units, n)) for n in self.table.column_names if n != "case"}
            return xarray.Dataset(columns, {"case": self["case"]}, {"sweep": json.dumps(self.sweep)})
        place = tuple(levels_of(self[name])[1] for name in levels)
        shape = tuple(map(len, levels.values()))
        variables = {}
        for name in (*EVERY_ROW, *self.metrics):
            values = self[name]
            whole = values.dtype.kind in "US" or len(values) == math.prod(shape)
            cells = np.zeros(shape, values.dtype) if whole else np.full(shape, np.nan)  # "" of text
            cells[place] = values
            variables[name] = (tuple(levels), cells, _units(units, name))
        coordinates = {name: (name, level, _units(units, name)) for name, level in levels.items()}
        return xarray.Dataset(variables, coordinates, {"sweep": json.dumps(self.sweep)})


def read(folder: str | os.PathLike[str]) -> Results:
    """Read a sweep's results, or those of its cases that there are so far."""
    import pyarrow as pa

    folder = pathlib.Path(folder)
    whole = folder / RESULTS
    paths = [whole] if whole.is_file() else sorted((folder / CHUNKS).glob("*.parquet"))
    if not paths and ((folder / CHUNKS).is_dir() or (folder / MANIFEST).is_file()):
        raise InputError("no case of this sweep is computed yet", file=folder)
    if not paths:
        raise InputError(f"there is no sweep here ({RESULTS} is missing)", file=folder)
    tables = [read_parquet(path) for path in paths]
    for path, each in zip(paths, tables, strict=True):
        if not {*EVERY_ROW} <= {*each.column_names} or b"sweep" not in (each.schema.metadata or {}):
            raise InputError("is not a result of a sweep of this program", file=path)
    sweep = json.loads(tables[0].schema.metadata[b"sweep"])
    table = pa.concat_tables(tables, promote_options="permissive").sort_by("case")
    if not table.num_rows:
        raise InputError("this sweep has no case", file=folder)
    roles: dict[str, dict[str, str]] = {"parameter": {}, "metric": {}}
    keys = {}
    for field in table.schema:
        facts = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        if facts.get("role") in roles:
            roles[facts["role"]][field.name] = facts.get("unit", "")
        if facts.get("role") == "parameter":
            keys[field.name] = facts.get("key", field.name)
    return Results(folder, table, roles["parameter"], roles["metric"], keys, sweep, paths[0] != whole)


def _units(units: dict[str, str], name: str) -> dict[str, str]:
    return {"units": units[name]} if name in units else {}
