"""The cases of a list design, row by row in a CSV."""

import pathlib
from collections.abc import Mapping
from typing import Any

from afo_sim.common.csv_table import RATIOS, number, read_table, split_title
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.study.parameter_table import ParameterTable

EXAMPLE = "pressure [bar],patient"


def values_of(
    sweep: pathlib.Path, name: str, parameters: Mapping[str, ParameterTable]
) -> dict[str, tuple[Any, ...]]:
    """Every parameter's values, as [parameters.NAME] would tell them."""
    beside = sweep.parent / name
    file = beside if beside.is_file() else pathlib.Path(name)
    table = read_table(file, EXAMPLE)
    columns = [split_title(title) for title in table.titles]
    titles = [title for title, _ in columns]
    wanted = [parameter for parameter, table in parameters.items() if not table.from_seed]
    for title in titles:
        if title not in wanted or titles.count(title) > 1:
            problem = "is there twice" if title in wanted else "is no parameter of the sweep"
            near = nearest_name(title, wanted)
            raise InputError(problem, file=file, field=title, allowed=", ".join(wanted), nearest=near)
    for parameter in wanted:
        if parameter not in titles:
            raise InputError("this column is missing", file=file, field=parameter, allowed=", ".join(wanted))
    if not table.rows:
        raise InputError("has no rows: one per case", file=file, allowed=EXAMPLE)
    return {
        title: tuple(_value(file, line, title, unit, cells[k]) for line, cells in table.rows)
        for k, (title, unit) in enumerate(columns)
    }


def _value(file: pathlib.Path, line: int, title: str, unit: str, cell: str) -> Any:
    """A cell as a TOML value: a quantity in the title's unit, else a whole number, a number or a text."""
    if unit in RATIOS:
        return number(file, line, title, cell) * RATIOS[unit]
    if unit:
        number(file, line, title, cell)
        return f"{cell} {unit}"
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell
