"""OpenSim's tables over time, .sto and .mot: a header to `endheader`, names, numbers between tabs."""

import csv
import pathlib
import re
from collections.abc import Mapping

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.export.csv_rows import Report, write_numbers
from afo_sim.export.rows import TIME

UNITS = (
    "Units are S.I. units (second, meters, Newtons, ...)",
    "If the header above contains a line with 'inDegrees', this indicates whether rotational values are in "
    "degrees (yes) or radians (no).",
)


def write_storage(
    path: pathlib.Path, name: str, columns: Mapping[str, np.ndarray], *, degrees: bool, report: Report
) -> None:
    """Write a table that OpenSim's Storage and its TimeSeriesTable read to the same bits.

    `version=1` is what Storage writes, and what GUI and tools of OpenSim 2.4 to 4.6 read; DataType is what
    the table adapters of 4.x look for. A line OpenSimVersion would say that OpenSim wrote the file.

    Units: columns [s], report (rows done, rows in all).
    """
    labels = list(columns)
    assert labels[0] == TIME and not any(re.search(r"\s", label) for label in labels)
    for label, values in columns.items():
        if not np.isfinite(values).all():
            raise InputError("is not a finite number in every row, which OpenSim cannot read", field=label)
    header = [
        re.sub(r"[\s=]+", " ", name).strip() or "run",
        "version=1",
        f"nRows={len(columns[TIME])}",
        f"nColumns={len(labels)}",
        f"inDegrees={'yes' if degrees else 'no'}",
        "DataType=double",
        "",
        *UNITS,
        "",
        "endheader",
        "\t".join(labels),
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write("\n".join(header) + "\n")
        writer = csv.writer(file, delimiter="\t", lineterminator="\n")
        write_numbers(writer.writerows, list(columns.values()), report)
