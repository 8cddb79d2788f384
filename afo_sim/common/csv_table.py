"""CSV files that people bring: a table with units in its titles, below lines "# key: value"."""

import csv
import io
import math
import os
import pathlib
import re
from collections.abc import Mapping
from dataclasses import dataclass

from afo_sim.common.errors import InputError, likeness, nearest_name
from afo_sim.common.magnitude import LARGEST, LEAST, plausible
from afo_sim.common.open_types import JsonDict, TableLike
from afo_sim.common.reading import read_foreign
from afo_sim.common.sealing import SEALED, check_text
from afo_sim.common.units import parse_quantity, quantity_at

_TITLE = re.compile(r"\s*([^\[\]()]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*$")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$")
_SHOWN = re.compile(r"[+-]?\d*[.,]?\d+(?:[eE][+-]?\d+)?")  # a number in a spreadsheet
_SEPARATOR = re.compile(r'"?sep=.?"?[,;\t]*', re.IGNORECASE)  # a spreadsheet's first line
_MARKS, _PADDING = (",", ";", "\t"), ",;\t "  # between cells; what follows the last one
_MISTYPED = 0.75  # likeness from which on a header line is no comment
_LARGEST_CSV = 2**26  # bytes; an hour of 15 columns at 100 Hz is less
_MOST_COLUMNS = 5000
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
    text, first = _without_spreadsheet(file, read_foreign(file, _LARGEST_CSV))
    facts, numbered = {}, []
    for number, line in enumerate(check_text(text, file).splitlines(), first):
        if line.lstrip().startswith("#"):
            key, colon, text = line.lstrip()[1:].partition(":")
            if colon:
                facts[key.strip().lower()] = text.strip()
        elif line.strip():
            numbered.append((number, line))
    if not numbered:
        raise InputError("holds no points", file=file, allowed=example)
    titles = _cells(file, *numbered[0])
    if len(titles) > _MOST_COLUMNS:
        raise InputError(f"has {len(titles)} columns", file=file, allowed=f"up to {_MOST_COLUMNS}")
    rows = []
    for number, line in numbered[1:]:
        cells = _cells(file, number, line)
        if len(cells) != len(titles):
            problem = f"line {number} has {len(cells)} values where the header names {len(titles)}"
            allowed = "a point for decimals, and commas between the values only"
            raise InputError(problem, file=file, allowed=allowed)
        rows.append((number, cells))
    return Table(file, titles, tuple(rows), facts)


def _without_spreadsheet(file: pathlib.Path, text: str) -> tuple[str, int]:
    """A text as before a spreadsheet saved it, which pads, quotes and separates otherwise; its first line."""
    lines = re.split("\r\n|\r|\n", text)
    said = _SEPARATOR.fullmatch(lines[0])
    first, lines = (2, lines[1:]) if said else (1, lines)
    notes = [line.lstrip(' "').startswith("#") for line in lines]
    top = next((k for k, line in enumerate(lines) if line.strip(_PADDING) and not notes[k]), 0)
    names = lines[top].rstrip(_PADDING)
    mark = max(_MARKS, key=names.count)  # the first of those that are most
    looked = [lines[top], *(line for line, note in zip(lines, notes, strict=True) if note)]
    padded = any(line.endswith(_MARKS) or line.startswith('"') for line in looked)
    if lines[0].endswith(SEALED) or not (said or padded or mark != ","):
        return text, 1
    width, found, numbers = len(_cells(file, first + top, names, mark)), list[str](), list[str]()
    for k, line in enumerate(lines):
        if notes[k]:
            found.append(",".join(_cells(file, first + k, line, mark, trim=False)).rstrip(_PADDING))
            continue
        cells = _cells(file, first + k, line.rstrip("; \t") if mark == "," else line, mark)
        cells = cells if any(cells[width:]) else cells[:width]
        numbers += filter(_SHOWN.fullmatch, cells)
        cells = tuple(c.replace(",", ".").replace("E", "e") if _SHOWN.fullmatch(c) else c for c in cells)
        written = io.StringIO()
        csv.writer(written, lineterminator="").writerow(cells if any(cells) else ())
        found.append(written.getvalue())
    if all(any(sign in cell for cell in numbers) for sign in ",."):
        raise InputError("has decimal commas and decimal points", file=file, allowed="one of them throughout")
    return "\n".join(found), first


def table_of(data: TableLike, example: str, name: str) -> Table:
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


def read_facts(table: Table, units: dict[str, str | None]) -> JsonDict:
    """The header's facts that have a meaning: by key their SI unit, None for text."""
    facts: JsonDict = {}
    for key, text in table.facts.items():
        if key not in units:
            nearest = nearest_name(key, units)
            if nearest and likeness(key, nearest) > _MISTYPED:
                raise InputError(
                    "is an unknown header line",
                    file=table.file,
                    field=key,
                    value=text,
                    allowed=", ".join(units),
                    nearest=nearest,
                )
            continue  # a comment
        unit = units[key]
        facts[key] = text if unit is None else quantity_at(key, text, unit, file=table.file)
    return facts


def _cells(file: pathlib.Path, number: int, line: str, mark: str = ",", trim: bool = True) -> tuple[str, ...]:
    try:
        cells = line.split(mark)  # nearly all: by far the quickest
        if '"' in line or len(line) > csv.field_size_limit():
            cells = next(csv.reader([line], delimiter=mark, skipinitialspace=trim), [])
        return tuple(cell.strip() if trim else cell for cell in cells)
    except csv.Error as error:
        raise InputError(f"line {number} is not a line of a CSV: {error}", file=file) from None


def read_header(path: pathlib.Path) -> dict[str, str]:
    """The `# key: value` lines of a file."""
    return read_table(path, "").facts
