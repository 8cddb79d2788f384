"""Files of other people: a size that memory has room for, and numbers that can be calculated with."""

import pathlib
import zlib
from collections.abc import Callable

import pytest

from afo_sim.common import InputError, number, read_bytes, read_table, split_title, unpack


def test_a_file_is_read_up_to_its_limit(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes(b"x" * 2**20)
    assert read_bytes(file, 2**20) == b"x" * 2**20
    with pytest.raises(InputError, match=r"a\.csv: is too large"):
        read_bytes(file, 2**20 - 1)


@pytest.mark.skipif(not pathlib.Path("/dev/zero").exists(), reason="a file without end is Unix's")
def test_a_table_without_end_is_refused() -> None:
    with pytest.raises(InputError, match=r"is too large|a device"):
        read_table(pathlib.Path("/dev/zero"), "time [s]")


def test_a_title_of_many_blanks_is_a_title() -> None:
    assert split_title("pressure" + " " * 5000 + "[bar") == ("pressure [bar", "")
    assert split_title("tube  length [ mm ]") == ("tube length", "mm")


@pytest.mark.parametrize(("cell", "value"), [("1e12", 1e12), ("-5e-324", 0.0), ("1e-31", 0.0), ("0", 0.0)])
def test_a_cell_that_can_be_calculated_with(cell: str, value: float) -> None:
    assert number(pathlib.Path("a.csv"), 3, "force", cell) == value


@pytest.mark.parametrize("cell", ["1e308", "-1.1e12"])
def test_a_cell_that_nothing_measures_is_refused(cell: str) -> None:
    with pytest.raises(InputError, match=r"a\.csv: line 3: force = .*: is not a magnitude"):
        number(pathlib.Path("a.csv"), 3, "force", cell)


PLAIN = bytes(range(256)) * 40


@pytest.mark.parametrize("most", [len(PLAIN), len(PLAIN) + 1, 10**9])
def test_data_come_back(most: int) -> None:
    assert unpack(zlib.compress(PLAIN), most) == PLAIN


@pytest.mark.parametrize(
    "damaged",
    [
        lambda: zlib.compress(PLAIN + b"x"),
        lambda: zlib.compress(bytes(2**28)),
        lambda: zlib.compress(PLAIN)[:-1],
        lambda: b"",
        lambda: b"no such data",
    ],
    ids=["one byte more", "256 MB of 260 kB", "cut short", "empty", "something else"],
)
def test_what_is_larger_or_damaged_is_refused(damaged: Callable[[], bytes]) -> None:
    with pytest.raises((ValueError, zlib.error)):
        unpack(damaged(), len(PLAIN))
