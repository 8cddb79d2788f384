"""The files of the stand: table, figure, summary, Rerun recording of the tests of one kind."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, titles, together, write_json
from afo_sim.lab import COLUMNS, Replay, Stand, write_csv, write_parquet
from afo_sim.lab.stand_table import summary
from afo_sim.show.stand_figure import draw_replay, draw_trials

_TABLES = {".csv": write_csv, ".parquet": write_parquet}


@dataclass(frozen=True)
class _Target:
    """A place for files: a folder, their stem, and the formats of the table."""

    folder: pathlib.Path
    stem: str
    formats: tuple[str, ...]

    def path(self, suffix: str) -> pathlib.Path:
        """The file of a suffix."""
        return self.folder / f"{self.stem}{suffix}"


def target(out: pathlib.Path, kind: str) -> _Target:
    """The place that `out` names: a table, or a folder for both tables."""
    suffix = out.suffix.lower()
    if suffix in _TABLES and kind != "all":
        return _Target(out.parent, out.stem, (suffix,))
    if suffix and not out.is_dir():
        problem, allowed = ("is not a table", "a name ending in .csv or .parquet, or a folder")
        if suffix in _TABLES:
            problem, allowed = "is one table", "a folder"
        raise InputError(problem, field="out", value=str(out), allowed=allowed)
    return _Target(out, kind, tuple(_TABLES))


def write_stand_files(tests: Stand, place: _Target, *, rrd: bool = True) -> list[pathlib.Path]:
    """Write table, figure, summary and recording of tests of one kind; all together or none."""
    trials, compared = tests.trials, tests.compared
    suffixes = [*place.formats, ".png", ".pdf", ".json"]
    suffixes += [".rrd"] if rrd and not trials[0].static else []
    group = [place.path(suffix).name for suffix in (*_TABLES, ".png", ".pdf", ".json", ".rrd")]
    with together(place.folder, group) as scratch:
        new = _Target(scratch, place.stem, place.formats)
        for suffix in place.formats:
            _TABLES[suffix](trials, new.path(suffix))
        for suffix in (".png", ".pdf"):
            draw_trials(trials, compared, new.path(suffix))
        write_json(new.path(".json"), summary(trials, compared), "stand summary")
        if ".rrd" in suffixes:
            from afo_sim.show.rerun.stand_recording import write_stand

            write_stand(trials, new.path(".rrd"))
    return [place.path(suffix) for suffix in suffixes]


def write_replays(replays: Sequence[Replay], folder: pathlib.Path) -> list[pathlib.Path]:
    """Write a table and a figure of each replay: what was measured beside what is predicted."""
    stems = [f"replay_{k}_{one.log.file.stem}" for k, one in enumerate(replays, 1)]
    names = [f"{stem}{suffix}" for stem in stems for suffix in (".csv", ".png")]
    with together(folder, names) as scratch:
        for table, figure, one in zip(names[::2], names[1::2], replays, strict=True):
            units = {name: COLUMNS[name][0] for name in one.predicted}
            columns = dict(zip(titles(units).values(), one.predicted.values(), strict=True))
            columns |= {f"measured {titles(units)[name]}": each.measured for name, each in one.errors.items()}
            rows = np.column_stack(list(columns.values()))
            np.savetxt(scratch / table, rows, "%.9g", ",", header=",".join(columns), comments="")
            draw_replay(one, scratch / figure)
    return [folder / name for name in names]
