"""A gait cycle that a spreadsheet has opened and saved is the same, or a sentence with the way out."""

import csv
import dataclasses
import io
import pathlib

import numpy as np
import pytest
from kept_inputs import FOLDER, kept

from afo_sim.common import InputError, assets
from afo_sim.gait import file as gait
from afo_sim.gait.cycle import COLUMNS


def saved(text: str, reads: str, writes: str, comma: bool, quoted: bool = False) -> str:
    """As a spreadsheet saves it: split at one mark, padded to the table's width, joined by another.

    Its General format shows 11 characters, an exponent in capitals; `comma` is its decimal mark.
    """
    table = list(csv.reader(io.StringIO(text), delimiter=reads))
    width = max(map(len, table))
    out = io.StringIO()
    writer = csv.writer(
        out,
        delimiter=writes,
        lineterminator="\r\n",
        quoting=csv.QUOTE_NONNUMERIC if quoted else csv.QUOTE_MINIMAL,
    )
    for row in table:
        writer.writerow([shown(cell, comma) for cell in row] + [""] * (width - len(row)))
    return out.getvalue()


def shown(cell: str, comma: bool) -> str:
    try:
        text = f"{float(cell):.6g}".replace("e", "E")
    except ValueError:
        return cell
    return text.replace(".", ",") if comma else text


# What the spreadsheet splits at, what it writes between cells, and whether it writes decimal commas.
WAYS = {
    "american": (",", ",", False),
    "american, quoted": (",", ",", False),
    "european": (",", ";", True),
    "european, points": (",", ";", False),
    "european, in one column": (";", ";", False),
    "unicode text": (",", "\t", False),
    "european unicode text": (",", "\t", True),
}
ENCODED = {
    "as it is": ("{}", "utf-8"),
    "with a mark": ("{}", "utf-8-sig"),
    "with its separator": ("sep={mark}\r\n{}", "utf-8"),
    "in UTF-16": ("{}", "utf-16"),
    "in Windows' letters": ("{}", "cp1252"),
}


@pytest.fixture
def written(tmp_path: pathlib.Path) -> pathlib.Path:
    """A cycle as this program writes it, with a note in which marks, a quote and a letter stand."""
    cycle = gait.read(assets.find_gait("gatk_stride1"))
    notes = {"cut": '3.3 to 4.4 s; "by force", its end by Müller', "numbers": "1, 2"}
    path = tmp_path / "mine.csv"
    gait.write(path, dataclasses.replace(cycle, notes=notes))
    return path


@pytest.mark.parametrize("encoded", ENCODED)
@pytest.mark.parametrize("way", WAYS)
def test_the_cycle_is_the_same(written: pathlib.Path, way: str, encoded: str) -> None:
    """Angles, forces and places within the six digits that a spreadsheet shows."""
    text = written.read_text(encoding="utf-8").split("\n", 1)[1]  # its owner deletes the digest
    expected = gait.read(written)
    frame, encoding = ENCODED[encoded]
    reads, mark, comma = WAYS[way]
    new = frame.format(saved(text, reads, mark, comma, "quoted" in way), mark=mark)
    written.write_bytes(new.encode(encoding))
    found = gait.read(written)
    for name, _ in COLUMNS.values():
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-5, abs=1e-9, nan_ok=True)
    assert found.stride_time == expected.stride_time
    assert found.source == expected.source and found.walker == expected.walker
    assert found.notes["numbers"].replace(" ", "") == "1,2"


def test_a_padded_file_of_the_same_numbers_keeps_its_digest(written: pathlib.Path) -> None:
    expected = gait.read(written)
    lines = written.read_text(encoding="utf-8").splitlines()
    padded = [line + 9 * "," if line.startswith("#") else line.replace("e-", "E-") for line in lines]
    written.write_text("\r\n".join(padded) + "\r\n", encoding="utf-8")
    np.testing.assert_array_equal(gait.read(written).ankle_angle, expected.ankle_angle)


def test_a_file_of_rounded_numbers_is_told_how_to_be_read(written: pathlib.Path) -> None:
    """The digest is of numbers that the spreadsheet has rounded."""
    reads, mark, comma = WAYS["american"]
    written.write_text(saved(written.read_text(encoding="utf-8"), reads, mark, comma), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        gait.read(written)
    assert "spreadsheet" in str(caught.value.allowed) and "deletes the first line" in str(
        caught.value.allowed
    )


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("\n0.5;", "\n0,5;", "decimal commas and decimal points"),  # one typed by hand
        ("\n0.5;", "\n01. Mai;", "is not a number (line"),  # read as a date
        ("\n0.5;", "\n0.5;1;", "has 11 values where the header names 10"),
    ],
)
def test_what_is_not_clear_is_refused(written: pathlib.Path, old: str, new: str, what: str) -> None:
    text = written.read_text(encoding="utf-8").split("\n", 1)[1].replace(",", ";")
    assert old in text
    written.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        gait.read(written)
    assert what in str(caught.value)


@kept("csv_saved_by_excel")
def test_a_file_that_a_spreadsheet_has_saved() -> None:
    cycle = gait.read(FOLDER / "csv_saved_by_excel" / "gait.csv")
    assert cycle.stride_time == 1.0588 and cycle.source == "HC038A11.c3d"
