"""CSV files that people bring: a table with units in its titles, below lines "# key: value"."""

import csv
import difflib
import math
import os
import pathlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.common.magnitude import LARGEST, LEAST, plausible
from afo_sim.common.reading import read_bytes
from afo_sim.common.sealing import check_text
from afo_sim.common.units import parse_quantity

_TITLE = re.compile(r"\s*([^\[\]()]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*$")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$")
_LARGEST_CSV = 2**26  # bytes; an hour of 15 columns at 100 Hz is less
RATIOS = {"-": 1.0, "1": 1.0, "%": 0.01}  # units of what has no dimension


@dataclass(frozen=True)
class Table:
    """The text of a CSV: titles, cells by line, and the header's facts as they were written."""

    file: pathlib.Path
    titles: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    facts: dict[str, str]


def read_table(file: pathlib.Path, example: str) -> Table:
    """Read a CSV as text."""
    try:
        text = read_bytes(file, _LARGEST_CSV).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"cannot be read: {error}", file=file) from None
    facts, numbered = {}, []
    for number, line in enumerate(check_text(text, file).splitlines(), 1):
        if line.lstrip().startswith("#"):
            key, colon, text = line.lstrip()[1:].partition(":")
            if colon:
                facts[key.strip().lower()] = text.strip()
        elif line.strip():
            numbered.append((number, line))
    if not numbered:
        raise InputError("holds no points", file=file, allowed=example)
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if separator in numbered[0][1]:
            raise InputError(
                f"its values stand between {word}",
                file=file,
                field="header",
                value=numbered[0][1].strip(),
                allowed=f"commas between the values, and a point for decimals: {example}",
            )
    titles = _cells(file, *numbered[0])
    rows = []
    for number, line in numbered[1:]:
        cells = _cells(file, number, line)
        if len(cells) != len(titles):
            problem = f"line {number} has {len(cells)} values where the header names {len(titles)}"
            allowed = "a point for decimals, and commas between the values only"
            raise InputError(problem, file=file, allowed=allowed)
        rows.append((number, cells))
    return Table(file, titles, tuple(rows), facts)


def table_of(data: Any, example: str, name: str) -> Table:
    """A table from a file, or from columns in memory."""
    if isinstance(data, str | os.PathLike):
        return read_table(pathlib.Path(data), example)
    facts = {str(key).lower(): str(value) for key, value in getattr(data, "attrs", {}).items()}
    values = {}
    for title in data:
        if isinstance(data[title], str):
            facts[str(title).lower()] = data[title]
        else:
            values[str(title)] = [x if isinstance(x, str) else repr(float(x)) for x in data[title]]
    lengths = {title: len(column) for title, column in values.items()}
    if len(set(lengths.values())) != 1:
        problem = "has columns of different lengths" if values else "holds no columns"
        raise InputError(problem, file=name, value=lengths or None, allowed=example)
    rows = tuple(enumerate(zip(*values.values(), strict=True), 1))
    return Table(pathlib.Path(name), tuple(values), rows, facts)


def titles(units: Mapping[str, str]) -> dict[str, str]:
    """Titles of columns by their names, such as "pressure [Pa]"; of what has no unit "phase [-]"."""
    return {name: f"{name} [{unit or '-'}]" for name, unit in units.items()}


def split_title(title: str) -> tuple[str, str]:
    """Name and unit of a title such as "pressure [bar]"; the unit is "" where there is none."""
    plain = " ".join(title.split())  # in a run of blanks the pattern would look for ever
    found = _TITLE.match(plain)
    return (found[1], found[2] or "") if found else (plain, "")


def scale_of(
    file: pathlib.Path, name: str, title: str, units: tuple[str, ...], example: str
) -> tuple[float, str]:
    """The factor that takes a column's values to the first of `units` (SI) that its unit fits, and that."""
    unit = split_title(title)[1]
    if not unit:
        raise InputError("has no unit", file=file, field=name, value=title, allowed=f"as in: {example}")
    if units == ("",):
        if unit not in RATIOS:
            raise InputError("has an unknown unit", file=file, field=name, value=title, allowed="[-] or [%]")
        return RATIOS[unit], ""
    problem = ""
    for si in units:
        try:
            scale = parse_quantity(f"1 {unit}", si)
            if math.isclose(parse_quantity(f"2 {unit}", si), 2.0 * scale):
                return scale, si
            problem = f"is in {unit}, whose zero is not that of {si}"
        except ValueError as error:
            problem = str(error)
    raise InputError(problem, file=file, field=name, value=title, allowed=f"as in: {example}")


def number(file: pathlib.Path, line: int, name: str, cell: str) -> float:
    """A cell as a finite number; anything else is an `InputError` with its line and column."""
    value = float(cell) if _NUMBER.match(cell) else math.nan
    if not math.isfinite(value):
        raise InputError(f"line {line}: is not a finite number", file=file, field=name, value=cell.strip())
    if value == 0.0 or LEAST <= abs(value) <= LARGEST:  # nearly all: by far the quickest
        return value
    return float(plausible(value, file=file, field=f"line {line}: {name}"))


def quantity_at(field: str, text: Any, unit: str, **others: Any) -> float:
    """A quantity in SI `unit`; what is wrong with it names the field, and what else is known of it."""
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=field, value=text, **others) from None


def read_facts(table: Table, units: dict[str, str | None]) -> dict[str, Any]:
    """The header's facts that have a meaning: by key their SI unit, None for text."""
    facts: dict[str, Any] = {}
    for key, text in table.facts.items():
        if key not in units:
            nearest = difflib.get_close_matches(key, list(units), n=1, cutoff=0.75)
            if nearest:
                raise InputError(
                    "is an unknown header line",
                    file=table.file,
                    field=key,
                    value=text,
                    allowed=", ".join(units),
                    nearest=nearest[0],
                )
            continue  # a comment
        unit = units[key]
        facts[key] = text if unit is None else quantity_at(key, text, unit, file=table.file)
    return facts


def _cells(file: pathlib.Path, number: int, line: str) -> tuple[str, ...]:
    try:
        return tuple(cell.strip() for cell in next(csv.reader([line], skipinitialspace=True)))
    except csv.Error as error:
        raise InputError(f"line {number} is not a line of a CSV: {error}", file=file) from None


def read_header(path: pathlib.Path) -> dict[str, str]:
    """The `# key: value` lines of a file."""
    return read_table(path, "").facts
