"""Finished parts of a command, and the folder that it has for itself."""

import os
import pathlib
import pickle
import subprocess
import sys

import faults
import numpy as np
import pytest

from afo_sim.common import InputError, digest
from afo_sim.metrics import Metric
from afo_sim.simulation import kept, kept_each, occupy, released

TAKE = "import pathlib, sys, time; from afo_sim.simulation import occupy; occupy(pathlib.Path(sys.argv[1])"
CHILD = b"cafo_sim.common\nChild\n(Vos:getpid\ntR."  # a process of our own class
HOLD = f"{TAKE}, 1); print(flush=True); time.sleep(60)"


class Command(Exception):
    """Stands for whatever ends a command early."""


def ended(folder: pathlib.Path, of: object, *whats: object) -> str:
    """A command of some parts that ends by an error; what is said at its beginning."""
    with pytest.raises(Command), released():
        said = occupy(folder, of)
        for what in whats:
            kept(lambda what=what: what, lambda: [np.arange(3.0), Metric(0.1, "mm")])  # type: ignore[misc]
        raise Command
    return said


def computed(folder: pathlib.Path, of: object, *whats: object) -> list[object]:
    """The parts that a command computes, which ends well."""
    done: list[object] = []

    def rest(numbers: list[int]) -> list[tuple[int, int]]:
        done.extend(whats[k] for k in numbers)
        return [(k, k) for k in numbers]

    with released():
        occupy(folder, of)
        assert len(list(kept_each(whats, rest))) == len(whats)
    return done


def test_parts_are_taken_by_all_that_they_follow_from(tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "a" / "out"
    assert ended(folder, "one", (1, 2.0), np.arange(2)) == ""
    said = ended(folder, "one")
    assert "2" in said
    assert computed(folder, "one", (1, 2.0), np.arange(3), np.arange(2)) == [pytest.approx(np.arange(3))]
    assert not list(folder.iterdir())
    assert computed(tmp_path / "b" / "out", "one", 1) == [1] and not (tmp_path / "b").exists()


def test_a_part_comes_back_to_the_bit_and_a_damaged_one_is_computed_anew(tmp_path: pathlib.Path) -> None:
    ended(tmp_path, "one", "x")
    (file,) = tmp_path.glob(".afo-sim/*/*")
    with released():
        occupy(tmp_path, "one")
        array, metric = kept(lambda: "x", list)
        assert array.tobytes() == np.arange(3.0).tobytes() and repr(metric) == repr(Metric(0.1, "mm"))
    for content in (b"", b"x" * 50, file.name.encode()):
        ended(tmp_path, "one", "x")
        file.write_bytes(content)
        assert computed(tmp_path, "one", "x") == ["x"]


def test_a_part_of_somebody_else_runs_nothing(tmp_path: pathlib.Path) -> None:
    class Evil:
        def __reduce__(self) -> object:
            return os.mkdir, (str(tmp_path / "made"),)

    ended(tmp_path, "one", "x")
    (file,) = tmp_path.glob(".afo-sim/*/*")
    for content in (pickle.dumps(Evil()), b"cafo_sim.common.child\nsubprocess\n.", CHILD):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(digest(content).encode() + content)
        assert computed(tmp_path, "one", "x") == ["x"]
    assert not (tmp_path / "made").exists()


def test_parts_of_another_command_stay_until_a_command_ends(tmp_path: pathlib.Path) -> None:
    """Whoever mistyped an option loses nothing."""
    ended(tmp_path, "one", "x", "y")
    assert "anew" in ended(tmp_path, "two", "x")
    assert computed(tmp_path, "two", "x", "y") == ["y"]
    ended(tmp_path, "one", "x", "y")
    assert computed(tmp_path, "one", "x", "y") == []


def test_a_text_that_is_longer_than_a_name_of_a_file_is_no_file(tmp_path: pathlib.Path) -> None:
    what = {"description": "long " * 100, "other": "a\0b"}
    ended(tmp_path, what, what)
    assert computed(tmp_path, what, what) == []


def test_another_content_of_a_named_file_is_another_part(tmp_path: pathlib.Path) -> None:
    file, out = tmp_path / "mine.csv", tmp_path / "out"
    file.write_text("1", encoding="utf-8")
    what = {"gait": [{"cycle": str(file)}]}
    ended(out, "one", what)
    assert computed(out, "one", what) == []
    ended(out, "one", what)
    file.write_text("2", encoding="utf-8")
    assert computed(out, "one", what) == [what]
    ended(out, what, "x")
    file.write_text("3", encoding="utf-8")
    assert "anew" in ended(out, what, "x")


def test_parts_of_other_threads_are_not_taken(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """NumPy adds in another order with them."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    ended(tmp_path, "one", "x")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    assert "anew" in ended(tmp_path, "one", "x")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no flock")
def test_a_folder_is_one_commands_until_it_ends_or_is_killed(tmp_path: pathlib.Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()
    for of in ("one", None):
        with pytest.raises(InputError, match="another afo-sim") as error, released():
            occupy(tmp_path, of)
        assert error.value.field == "out" and error.value.value == str(tmp_path)
    child.kill()
    child.communicate()
    with released():
        assert occupy(tmp_path, "one") == ""
    with released():
        occupy(tmp_path)  # beside others
        assert subprocess.run([sys.executable, "-c", f"{TAKE})", str(tmp_path)]).returncode == 0


def test_a_full_disk_loses_no_part_that_is_there(tmp_path: pathlib.Path) -> None:
    whats = tuple(range(2))
    with released():
        occupy(tmp_path, "one")
    for at in range(1, 40):
        with pytest.raises((InputError, Command)), released():
            occupy(tmp_path, "one")
            with faults.DISK.acting(tmp_path, at, faults.refuse):
                list(kept_each(whats, lambda rest: [(k, k) for k in rest]))
            raise Command
        there = len(list(tmp_path.glob(".afo-sim/*/[!.]*")))
        if there == 2:
            break
    assert there == 2 and computed(tmp_path, "one", *whats) == []
