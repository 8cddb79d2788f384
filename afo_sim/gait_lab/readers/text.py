"""Text files of other people's making: any encoding, any line end, numbers written in any manner."""

import math
import pathlib
import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from afo_sim.common import InputError, Notice, plausible, read_foreign

_MISSING = re.compile(
    r"-?(nan(\(.*\))?|n/?a|null|none|-+|\?+|[+-]?1[.,]#(qnan|snan|ind|nan)[0-9]*)?$", re.IGNORECASE
)
_INFINITE = re.compile(r"([+-]?)(inf(inity)?|1[.,]#inf[0-9]*)$", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,4})?$", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eEdD][+-]?\d{1,4})?$", re.ASCII)

_LARGEST = 2**28  # bytes of a file; ten minutes of 20 columns at 1000 Hz are half of it
_MOST_LINES = 10_000_000  # ten minutes at 5000 Hz, with line ends of two characters, are 6 million
_MOST_CELLS = 25_000_000  # of a table: ten minutes of 40 columns at 1000 Hz are fewer

CUT_SHORT = Notice("last-row-cut", "its last row is cut short and was left out")


def read_lines(path: pathlib.Path) -> tuple[list[str], bool]:
    """Lines of a text file in UTF-8, UTF-16 with its mark, or Latin-1."""
    text = read_foreign(path, _LARGEST)
    if text.count("\n") + text.count("\r") > _MOST_LINES:
        raise InputError("has too many lines", file=path, allowed=f"up to {_MOST_LINES:.0e}")
    ended = text.endswith(("\n", "\r"))
    lines = re.split("\r\n|\r|\n", text)  # not splitlines, which splits at Latin-1's 0x85 too
    return (lines[:-1] if ended else lines), ended


def _parse_number(cell: str) -> float:
    """A cell as a number; NaN for all the ways in which programs write that there is none."""
    text = cell.strip().strip('"').strip()
    if _NUMBER.match(text):
        return float(text.replace("D", "e").replace("d", "e"))
    if _MISSING.match(text):
        return math.nan
    infinite = _INFINITE.match(text)
    if infinite:
        return -math.inf if infinite[1] == "-" else math.inf
    if _DECIMAL_COMMA.match(text):
        return _parse_number(text.replace(",", "."))
    raise ValueError(f"{text!r} is not a number")


def parse_row(cells: list[str]) -> list[float]:
    """All of a row's cells as numbers; ValueError as `_parse_number`."""
    try:
        return [float(cell) for cell in cells]  # by far the most rows
    except ValueError:
        return [_parse_number(cell) for cell in cells]


def parse_rate(text: str) -> float | None:
    """A stated rate [Hz]; None if it is none."""
    try:
        rate = _parse_number(text)
    except ValueError:
        return None
    return rate if 1.0 <= rate <= 1e5 else None


def rate_of(path: pathlib.Path, field: str, text: str) -> float:
    """A rate that must be stated [Hz]."""
    rate = parse_rate(text)
    if rate is None:
        raise InputError("is not a valid rate", file=path, field=field, value=text, allowed="1 to 1e5 Hz")
    return rate


def require_size(path: pathlib.Path, rows: int, columns: int) -> None:
    """Refuse a table for which memory has no room, before it is made."""
    if rows * columns > _MOST_CELLS:
        problem = f"has {rows} rows of {columns} numbers"
        raise InputError(problem, file=path, allowed=f"up to {_MOST_CELLS:.0e} numbers")


def measured(path: pathlib.Path, names: Sequence[str], rows: ArrayLike) -> np.ndarray:
    """Rows of numbers as a table (n, columns), NaN where nothing was measured."""
    table = np.array(rows)
    for k, name in enumerate(names):
        rest = ~np.isinf(table[:, k])
        table[rest, k] = plausible(table[rest, k], file=path, field=name, missing=True)
    return table


def numbers(
    path: pathlib.Path, lines: list[str], names: list[str], mark: str | None, ended: bool, gaps: bool = True
) -> tuple[np.ndarray, list[Notice]]:
    """A table (n, names), NaN where a cell is empty or lacks at a row's end, and a warning on a cut row."""
    width, rows, notices = len(names), list[list[float]](), list[Notice]()
    require_size(path, len(lines), width)
    if mark in ("\t", ";") and all(any(sign in line for line in lines) for sign in ",."):
        raise InputError("has decimal commas and decimal points", file=path, allowed="one of them throughout")
    # "12.345" cut to "12" is a number too, but the row is shorter than those before it
    if not (gaps or ended) and len(lines) > 11 and len(lines[-1]) < min(map(len, lines[-11:-1])):
        text = "its last row ends with the file and may be cut: left out"
        lines, notices = lines[:-1], [Notice("last-row-cut", text)]
    for k, line in enumerate(lines):
        last = 2 <= k == len(lines) - 1 and not (gaps and ended)
        cells = cells_of(line, mark)
        if len(cells) != width:
            cells = without_empty_end(cells) if gaps or len(cells) > width else cells_of(line, None)
        try:
            if len(cells) > width or (len(cells) < width and (last or mark == "," or not gaps)):
                raise ValueError
            rows.append(parse_row(cells + [""] * (width - len(cells))))
        except ValueError:
            if last:
                return measured(path, names, rows), [CUT_SHORT]
            problem = f"row {k + 1} of its table is not {width} numbers"
            allowed = "decimal commas only where semicolons or tabs stand between the cells"
            allowed = allowed if mark == "," and len(cells) > width else "numbers or empty cells"
            raise InputError(problem, file=path, value=" ".join(line.split()), allowed=allowed) from None
    if len(rows) < 2:
        raise InputError("has fewer than two rows of numbers", file=path)
    return measured(path, names, rows), notices


def separator_of(line: str) -> str | None:
    """Separator of the cells of a line: tab, semicolon or comma; None: any blanks."""
    return next((mark for mark in "\t;," if mark in line), None)


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line, without blanks about them; None separates at any blanks."""
    if separator is None:
        return line.split()
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def without_empty_end(cells: list[str]) -> list[str]:
    """Cells up to the last that is not empty: some programs end each line with tabs."""
    last = len(cells)
    while last and not cells[last - 1]:
        last -= 1
    return cells[:last]


def unique_names(names: list[str], what: str) -> tuple[list[str], list[Notice]]:
    """Names of which none comes twice, and a warning if one did: the second NAME becomes NAME.2."""
    last: dict[str, int] = {}  # number of each name that is taken
    found, renamed = [], []
    for name in names:
        new, number = name, last.get(name, 0)
        while new in last:
            number += 1
            new = f"{name}.{number}"
        if new != name:
            renamed.append(new)
        last[name] = max(number, 1)
        last.setdefault(new, 1)
        found.append(new)
    if not renamed:
        return found, []
    shown = ", ".join(renamed[:6]) + (f" and {len(renamed) - 6} more" if len(renamed) > 6 else "")
    text = "some {subject} names come more than once; what came later is called {renamed} here"
    return found, [Notice("names-doubled", text, subject=what, renamed=shown)]


def miscounts(header: Mapping[str, str], counts: Mapping[str, tuple[str, int]]) -> list[Notice]:
    """Warnings where a header's keys count rows, columns, frames or markers otherwise than the file has."""
    found = []
    for key, (what, count) in counts.items():
        if re.fullmatch("[0-9]{1,9}", header.get(key, "")) and (stated := int(header[key])) != count:
            text = "has {count} {subject}, its header says {stated}"
            text += ": cut short?" if what in ("rows", "frames") and stated > count else ""
            found.append(Notice("header-miscounts", text, subject=what, count=count, stated=stated))
    return found
