"""Rows as CSV: RFC 4180, UTF-8, a header of names with units, numbers to the last bit."""

import csv
import pathlib
from collections.abc import Callable, Iterable

import numpy as np

from afo_sim.export.rows import Rows

BLOCK = 2000  # rows from one report to the next
Report = Callable[[int, int], object]
Write = Callable[[Iterable[Iterable[float]]], object]


def titles(rows: Rows) -> list[str]:
    """Names with units: "ankle/angle [rad]", "gait/phase [-]"."""
    return [f"{name} [{rows.units[name] or '-'}]" for name in rows.columns]


def write_csv(rows: Rows, path: pathlib.Path, report: Report) -> None:
    """Write rows as CSV; a number that is none stands there as nan, inf or -inf.

    Units: report (rows done, rows in all).
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)  # CR LF after each line
        writer.writerow(titles(rows))
        write_numbers(writer.writerows, list(rows.columns.values()), report)


def write_numbers(write: Write, columns: list[np.ndarray], report: Report) -> None:
    """Write columns (n,) row by row, each number as the shortest text that is read back to the same bits.

    Units: columns (n,), report (rows done, rows in all).
    """
    count = len(columns[0])
    for start in range(0, count, BLOCK):
        block = [column[start : start + BLOCK].tolist() for column in columns]
        write(zip(*block, strict=True))
        report(min(start + BLOCK, count), count)
