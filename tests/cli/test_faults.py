"""Every command with a disk that refuses at some change, or a kill: old or new, never half, no traceback."""

import os
import pathlib
import shutil
from collections.abc import Callable

import faults
import pytest
from command import call
from faults import DISK, contents, hidden, largest_file, refuse

import afo_sim

ROOT = pathlib.Path(__file__).parents[2]
MUSCLE = ROOT / "models" / "muscles" / "dmsp_20"
SHORT = ("--set", "duration=0.05 s")
FIT = ("--law", "sarosi_2012", "--hold-out", "none")
COMMANDS: dict[str, tuple[str, ...]] = {
    "run": ("run", *SHORT, "--force", "--out", "OUT/new"),
    "compare": ("compare", "arm", "--laws", "polynomial,sarosi_2012", *SHORT, "--out", "OUT/new"),
    "torque-map": ("torque-map", "--out", "OUT/new"),
    "figure": ("figure", "RUN", "--out", "OUT/new"),
    "report": ("report", "RUN", "--out", "OUT/new/report.html"),
    "stand": ("stand", "isobaric", "dmsp_20", "--pressure", "3 bar", "--time", "1 s", "--out", "OUT/new"),
    "stand, one table": ("stand", "isobaric", "dmsp_20", "--static", "--out", "OUT/new/table.csv"),
    "fit": ("fit", str(MUSCLE / "characteristic.csv"), *FIT, "--out", "OUT/new"),
    "gait show": ("gait", "show", "gatk_stride1", "--out", "OUT/new/gait.png"),
}
EVERY = bool(os.environ.get("AFO_SIM_EVERY_FAULT"))  # at every change of the disk, of every command: minutes
LONG = ("figure", "stand", "fit")  # seconds each time
Try = Callable[[], tuple[int, str, str]]


@pytest.fixture(scope="module")
def a_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return afo_sim.run("seated", {"duration": "0.5 s"}).save(tmp_path_factory.mktemp("run") / "run")


def prepared(command: str, out: pathlib.Path, run: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> Try:
    words = {"OUT": str(out), "RUN": str(run)}
    arguments = list(COMMANDS[command])
    for key, text in words.items():
        arguments = [argument.replace(key, text) for argument in arguments]
    return lambda: call(capsys, *arguments)


def sampled(count: int, every: bool) -> list[int]:
    """The changes at which to refuse: all of them, or one in the middle and the last."""
    return list(range(1, count + 1)) if every else sorted({count // 2, count} - {0})


def lay(out: pathlib.Path, files: dict[str, bytes]) -> None:
    """Make a folder anew, with these files."""
    shutil.rmtree(out)
    out.mkdir()
    for name, data in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(data)


def refusals(try_it: Try, out: pathlib.Path, every: bool) -> dict[str, int]:
    """Refuse at changes of the disk, and at sizes of files, of a command on a fresh and on an old folder."""
    told = {"changes": 0, "sizes": 0, "old": 0, "new": 0}
    code, _, complaint = try_it()
    assert code == 0, complaint
    made = contents(out)
    sizes = sorted(len(data) for data in made.values())
    limits = {0, *(size - 1 for size in sizes), *(size // 2 for size in sizes)} if every else {sizes[-1] // 2}
    for before in ({}, dict.fromkeys(made, b"old")):
        lay(out, before)
        with DISK.acting(out, 0, lambda: None):
            code, _, complaint = try_it()
        assert code == 0, complaint
        assert contents(out).keys() == made.keys()
        tries = [("changes", number) for number in sampled(DISK.count, every)]
        for kind, number in [*tries, *(("sizes", limit) for limit in sorted(limits))]:
            lay(out, before)
            with DISK.acting(out, number, refuse) if kind == "changes" else largest_file(number):
                code, printed, complaint = try_it()
            faults.settle(out)
            found = contents(out)
            told[kind] += 1
            assert "Traceback" not in printed + complaint, (kind, number)
            assert hidden(out) == [], (kind, number)
            if found == before:
                told["old"] += 1
                assert code == 2, (kind, number, complaint)
            else:
                told["new"] += 1
                assert found.keys() == made.keys(), (kind, number, code, complaint)
                assert b"old" not in found.values(), (kind, number)
    return told


@pytest.mark.parametrize("command", COMMANDS if EVERY else [name for name in COMMANDS if name not in LONG])
def test_full_disk_leaves_old_or_new(
    command: str, tmp_path: pathlib.Path, a_run: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    told = refusals(prepared(command, out, a_run, capsys), out, EVERY)
    with capsys.disabled():
        print(f"\n{command}: {told}" if EVERY else "", end="")
    assert told["old"] >= 3, told


@pytest.mark.parametrize("exists", [True, False])
def test_killed_at_every_change_a_run_is_old_or_new(
    exists: bool, tmp_path: pathlib.Path, a_run: pathlib.Path
) -> None:
    recording = afo_sim.read_recording(a_run)
    out = tmp_path / "out"
    out.mkdir()
    old = {"run/recording.parquet": b"old", "run/recording.rrd": b"old", "run/mine.txt": b"mine"}
    old = old if exists else {}
    told = {"old": 0, "new": 0}
    for number in range(1, 60):
        lay(out, old)
        status = faults.in_child(lambda: recording.save(out / "run", rrd=False), number, out)
        assert status in (0, -9), number
        faults.settle(out)
        found = contents(out)
        if found == old:
            told["old"] += 1
        else:
            told["new"] += 1
            names = {"recording.parquet", "summary.json", "model.xml"} | ({"mine.txt"} if exists else set())
            assert {name.removeprefix("run/") for name in found} == names, number
            assert b"old" not in found.values(), number
        if status == 0:
            break
    assert status == 0
    assert told["old"] > 4 and told["new"] > 2 * exists, told
