"""CSV files over gait phase: just the columns that are asked for, in units that their names end in."""

import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.csv_table import read_table
from afo_sim.common.errors import MOST_FAULTS, InputError, nearest_name, refuse
from afo_sim.common.magnitude import plausible
from afo_sim.common.sealing import write_sealed


@dataclass(frozen=True, eq=False)
class PhaseTable:
    """Header and columns of a file, in the file's own units; an empty cell is NaN."""

    file: pathlib.Path
    header: dict[str, str]
    columns: dict[str, np.ndarray]

    def text(self, key: str) -> str:
        """A header key's text, or the `InputError` that says that it is missing."""
        if not self.header.get(key):
            near = nearest_name(key, self.header)
            problem = "is missing from the header" + (f" (there is {near!r})" if near else "")
            raise InputError(problem, file=self.file, field=key, allowed=f"a line '# {key}: …'")
        return self.header[key]

    def number(self, key: str) -> float:
        """A header key's number, or the `InputError` that says what is wrong with it."""
        return float(plausible(self.text(key), file=self.file, field=key))


def read_phase_table(path: pathlib.Path, columns: Sequence[str]) -> PhaseTable:
    """Read a file that has just these columns, in any order."""
    text = read_table(path, ", ".join(columns))
    names = list(text.titles)
    problems = []
    for name in columns:
        if name not in names:
            near = nearest_name(name, [other for other in names if other not in columns])
            problem = "this column is missing" + (f" (there is {near!r})" if near else "")
            problems.append(InputError(problem, file=path, field=name, allowed=", ".join(columns)))
    for name in dict.fromkeys(names):
        if name not in columns or names.count(name) > 1:
            problem = "is not a column of this format" if name not in columns else "is there twice"
            problems.append(InputError(problem, file=path, field=name, allowed=", ".join(columns)))
    values = np.empty((len(text.rows), len(names)))
    for k, (line, cells) in enumerate(text.rows):
        for column, cell in enumerate(cells if len(problems) < MOST_FAULTS else ()):
            try:
                values[k, column] = float(cell) if cell else np.nan
            except ValueError:
                problem = f"is not a number (line {line})"
                problems.append(InputError(problem, file=path, field=names[column], value=cell))
    refuse(problems)
    found = {name: values[:, names.index(name)] for name in columns}
    gated = {name: plausible(each, file=path, field=name, missing=True) for name, each in found.items()}
    return PhaseTable(path, text.facts, gated)


def write_phase_table(
    path: pathlib.Path, header: Mapping[str, str], columns: Mapping[str, np.ndarray]
) -> None:
    """Write a file, whole or not at all; NaN becomes an empty cell."""
    lines = [f"# {key}: {' '.join(text.split())}" for key, text in header.items()]
    lines.append(",".join(columns))
    for row in np.column_stack(list(columns.values())) + 0.0:  # no "-0"
        lines.append(",".join("" if np.isnan(value) else f"{value:.7g}" for value in row))
    write_sealed(path, "\n".join(lines) + "\n", "stride")
