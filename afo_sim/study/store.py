"""A sweep's folder: what is swept, the chunks computed so far, the results; each file whole or not at all."""

import json
import pathlib
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from afo_sim.common import (
    MOST_GROUPS,
    Foreign,
    InputError,
    JsonDict,
    disk,
    identity,
    keeping,
    open_parquet,
    parquet_column,
    parquet_writer,
    read_parquet,
    write_parquet,
)
from afo_sim.common.versions import versions
from afo_sim.study.design import Cases
from afo_sim.study.engine import Jobs, Outcome
from afo_sim.study.folder import AGAIN, PARTS, FolderKind
from afo_sim.study.parameter import Choice, Joint, Normal, Range
from afo_sim.study.results import (
    CHUNKS,
    EVERY_ROW,
    MANIFEST,
    NOTICES,
    OVERRIDES,
    OWN_SEED,
    RESULTS,
    STEPS,
    WARNINGS,
)

RECORDINGS = "recordings"  # folder of the cases that are kept
_GATHERED = 64  # chunks in one row group of the results, or more
SWEEP = FolderKind("sweep", MANIFEST, CHUNKS, 7, (RESULTS, RECORDINGS, STEPS), PARTS | {"chunk": int})


@dataclass(frozen=True)
class Store:
    """The folder of one sweep. `metrics` {name: unit} are the columns, `chunk` the cases in a file."""

    folder: pathlib.Path
    cases: Cases
    metrics: dict[str, str]
    chunk: int
    sweep: str = ""
    mixed: bool = False

    @property
    def jobs(self) -> Jobs:
        """The cases, in chunks."""
        return Jobs(len(self.cases), self.chunk, self.cases.sets)

    @property
    def finished(self) -> bool:
        """True where the results are there."""
        return (self.folder / RESULTS).is_file()

    def pending(self) -> list[int]:
        """The chunks that are not computed yet."""
        if self.finished:
            return []
        there = {path.name for path in (self.folder / CHUNKS).glob("*.parquet")}
        return [chunk for chunk in range(self.jobs.count) if SWEEP.part(self.folder, chunk).name not in there]

    def write(self, chunk: int, outcomes: Sequence[Outcome]) -> None:
        """Put a chunk's rows on disk."""
        with self._beside_others(), keeping(SWEEP.part(self.folder, chunk)) as path:
            write_parquet(path, self.table(chunk, outcomes), "chunk")

    def table(self, chunk: int, outcomes: Sequence[Outcome]) -> Foreign:
        """A chunk's rows as a pyarrow Table."""
        import pyarrow as pa

        numbers = self.jobs.numbers(chunk)
        rows = slice(numbers.start, numbers.stop)
        columns: list[Foreign] = [
            np.arange(numbers.start, numbers.stop),
            self.cases.seeds[rows].astype(np.int64),
            [outcome.status for outcome in outcomes],
            [outcome.reason for outcome in outcomes],
        ]
        for parameter in self.cases.plan.parameters:
            values = self.cases.values[parameter.name][rows]
            columns.append(values if parameter.words else values.astype(float))
        for name in self.metrics:
            metrics = [outcome.metrics.get(name) for outcome in outcomes]
            columns.append([np.nan if m is None else m.value for m in metrics])
        columns.append([json.dumps(self.cases.sets(number), ensure_ascii=False) for number in numbers])
        for line in (str, lambda warning: " ".join(identity(warning))):
            columns.append(["\n".join(map(line, outcome.warnings)) for outcome in outcomes])
        return pa.table([parquet_column(column) for column in columns], schema=self.schema())

    def schema(self) -> Foreign:
        """Of chunks and results: role and unit in each column's metadata, the sweep in the schema's."""
        import pyarrow as pa

        kinds = dict(zip(EVERY_ROW, (pa.int64(), pa.int64(), pa.string(), pa.string()), strict=True))
        fields = [pa.field(name, kind, metadata={"role": "case"}) for name, kind in kinds.items()]
        plan = self.cases.plan
        for parameter in plan.parameters:
            facts = {"role": "parameter", "unit": parameter.unit, "key": ", ".join(parameter.keys)}
            kind = pa.string() if parameter.words else pa.float64()
            fields.append(pa.field(parameter.name, kind, metadata=facts))
        for name, unit in self.metrics.items():
            fields.append(pa.field(name, pa.float64(), metadata={"role": "metric", "unit": unit}))
        for name in (OVERRIDES, WARNINGS, NOTICES):
            fields.append(pa.field(name, pa.string(), metadata={"role": "case"}))
        sweep = {
            "design": plan.design,
            "scenario": plan.scenario_name,
            "fingerprint": self.sweep,
            "seed": plan.seed,
            "cases": len(self.cases),
            "parameters": [{"name": p.name, **_spread(p.spread)} for p in plan.parameters],
            "versions": versions(),
        } | ({"mixed": True} if self.mixed else {})
        sweep |= {"walkers": pathlib.Path(plan.walkers).stem} if plan.walkers else {}
        return pa.schema(fields, metadata={"sweep": json.dumps(sweep)})

    def finish(self) -> None:
        """Gather all chunks into the results."""
        import pyarrow as pa

        damaged = []
        with self._beside_others(), keeping(self.folder / RESULTS) as path:
            with parquet_writer(path, self.schema(), "results") as writer:
                gathered = max(_GATHERED, -(-self.jobs.count // MOST_GROUPS))
                for first in range(0, self.jobs.count, gathered):
                    some = range(first, min(first + gathered, self.jobs.count))
                    tables = {chunk: self._read(chunk) for chunk in some}
                    damaged += [chunk for chunk, table in tables.items() if table is None]
                    if not damaged:
                        writer.write_table(pa.concat_tables(tables.values()))
            for chunk in damaged:
                SWEEP.part(self.folder, chunk).unlink(missing_ok=True)
            if damaged:
                many = f"{len(damaged)} of {self.jobs.count} chunks"
                problem = f"{many} are damaged or of another sweep, and were taken away"
                allowed = "the same command again, which computes them anew"
                raise InputError(problem, file=self.folder, allowed=allowed)

    @contextmanager
    def _beside_others(self) -> Iterator[None]:
        with disk(self.folder, AGAIN):
            try:
                yield
            except FileNotFoundError:
                if not self.finished:
                    raise

    def tidy(self) -> None:
        """Take away what finished results make needless, or a killed process has left."""
        shutil.rmtree(self.folder / CHUNKS, ignore_errors=True)
        for name in (RESULTS, STEPS):
            for path in self.folder.glob(f".{name}.*"):
                path.unlink(missing_ok=True)

    def _read(self, chunk: int) -> Foreign:
        """A chunk's rows, or None if they are not what `write` has written for this sweep."""
        try:
            table = read_parquet(SWEEP.part(self.folder, chunk))
        except InputError:
            SWEEP.part(self.folder, chunk).stat()  # another process may have gathered it meanwhile
            return None
        schema = self.schema()
        if not table.schema.equals(schema) or table["case"].to_pylist() != list(self.jobs.numbers(chunk)):
            return None
        of = json.loads((table.schema.metadata or {}).get(b"sweep", b"{}")).get("fingerprint")
        return table.replace_schema_metadata(schema.metadata) if of == self.sweep else None


def recover(folder: pathlib.Path) -> tuple[int, int]:
    """Restore the intact parts of a sweep's damaged results as chunks, so that it can continue."""
    import pyarrow as pa

    chunk, whole = int(SWEEP.read(folder)["chunk"]), 0
    file = open_parquet(folder / RESULTS, damaged=True)
    with disk(folder, AGAIN):
        for group in range(file.num_row_groups):
            try:
                table = file.read_row_group(group)
            except (pa.ArrowException, OSError):
                continue
            for first in range(0, len(table), chunk):
                part = table.slice(first, chunk)
                number = part["case"][0].as_py() // chunk
                with keeping(SWEEP.part(folder, number)) as path:
                    write_parquet(path, part, "chunk")
                whole += len(part)
        (folder / RESULTS).rename((folder / RESULTS).with_suffix(".damaged.parquet"))
    return whole, file.metadata.num_rows


def _spread(spread: Foreign) -> JsonDict:
    if isinstance(spread, Range):
        scale = "log" if spread.logarithmic else "linear"
        return {"distribution": "uniform", "from": spread.lower, "to": spread.upper, "scale": scale}
    if isinstance(spread, Normal):
        kind = "lognormal" if spread.of_logarithm else "normal"
        return {"distribution": kind, "centre": spread.centre, "sd": spread.sd}
    if isinstance(spread, Choice):
        return {"distribution": "values", "values": list(spread.values)}
    if isinstance(spread, Joint):
        return {"distribution": "joint draw"}
    return {"distribution": OWN_SEED}
