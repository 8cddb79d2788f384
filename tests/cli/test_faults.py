"""Every command with a disk that refuses at some change, or a kill: old or new, never half, no traceback."""

import bisect
import errno
import io
import json
import os
import pathlib
import random
import shutil
import signal
import sys
import tomllib
from collections.abc import Callable
from xml.etree import ElementTree

import faults
import numpy as np
import pyarrow.parquet as pq
import pytest
from campaign import NIGHTLY, size
from command import Call
from faults import DISK, contents, hidden, largest_file, refuse
from walking import known_walk, write_angles, write_forces, write_trc

import afo_sim
from afo_sim import cli
from afo_sim.common import writing
from afo_sim.lab import validation

ROOT = pathlib.Path(__file__).parents[2]
MUSCLE = ROOT / "models" / "muscles" / "dmsp_20"
SHORT = ("--set", "duration=0.05 s")
FIT = ("--law", "sarosi_2012", "--hold-out", "none")
TORQUE = ("--orthosis", "arm", "--chamber", "flexor", "--free", "offset", "--hold-out", "none")
TRIAL = ("GIVEN/ik.mot", "GIVEN/grf.mot", "GIVEN/walk.trc", "--mass", "67.2 kg")
COMMANDS: dict[str, tuple[str, ...]] = {
    "run": ("run", *SHORT, "--force", "--out", "OUT/new"),
    "run --no-rrd": ("run", *SHORT, "--no-rrd", "--force", "--out", "OUT/new"),
    "compare": ("compare", "arm", "--laws", "polynomial,sarosi_2012", *SHORT, "--out", "OUT/new"),
    "torque-map": ("torque-map", "--out", "OUT/new"),
    "figure": ("figure", "GIVEN/run", "--out", "OUT/new"),
    "report": ("report", "GIVEN/run", "--out", "OUT/new/report.html"),
    "export": ("export", "GIVEN/run", "--to", "csv", "--force", "--out", "OUT/new/run.csv"),
    "stand": ("stand", "isobaric", "dmsp_20", "--pressure", "3 bar", "--time", "1 s", "--out", "OUT/new"),
    "stand, one table": ("stand", "isobaric", "dmsp_20", "--static", "--out", "OUT/new/table.csv"),
    "fit": ("fit", str(MUSCLE / "characteristic.csv"), *FIT, "--out", "OUT/new"),
    "fit of a log": ("fit", "GIVEN/log.csv", "--scenario", "seated", "--out", "OUT/new"),
    "fit of torques": ("fit", "GIVEN/torque.csv", *TORQUE, "--out", "OUT/new"),
    "gait import": ("gait", "import", *TRIAL, "--walker", "healthy", "--out", "OUT/new/gait.csv"),
    "gait show": ("gait", "show", "gatk_stride1", "--out", "OUT/new/gait.png"),
    "paper": ("paper", "S3", "--out", "OUT/new"),
    "replay": ("replay", "GIVEN/swept", "1", "--no-rrd", "--out", "OUT/new"),
    "sweep --show": ("sweep", "--show", "GIVEN/swept", "--metric", "range_of_motion", "--out", "OUT/new"),
    "new muscle": ("new", "muscle", "mine", "--out", "OUT"),
    "new sweep": ("new", "sweep", "mine", "--out", "OUT"),
    "sweep": ("sweep", "GIVEN/sweep.toml", "--threads", "1", "--out", "OUT/new"),
    "optimise": ("optimise", "GIVEN/search.toml", "--threads", "1", "--out", "OUT/new"),
}
RESUMED = ("sweep", "optimise")  # the same command goes on where it was stopped
FRESH = ("new muscle", "new sweep", *RESUMED)  # do not write over what is there
WITH_RERUN = ("run", "compare", "stand")  # its threads do not outlive a fork
EVERY = bool(os.environ.get("AFO_SIM_EVERY_FAULT"))  # at every change of the disk, of every command: minutes
QUICK = ("run --no-rrd", "stand, one table", "new muscle", "sweep")
KILLED = ("sweep", "export", "run", "optimise", "fit", "gait import", "report", "replay")
Try = Callable[[], tuple[int, str, str]]

SWEEP = """
scenario = "seated"
design = "grid"
chunk = 2
metrics = ["range_of_motion", "air_per_cycle"]
[set]
duration = "0.05 s"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
steps = 3
"""
SEARCH = """
scenario = "seated"
generations = 2
population = 4
starts = 1
[set]
duration = "0.05 s"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
[objective]
metric = "range_of_motion"
goal = "highest"
"""


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """What the commands read: a run, a log, a walking trial, a sweep and its results, a search."""
    folder = tmp_path_factory.mktemp("given")
    run = afo_sim.run("seated", {"duration": "0.5 s"})
    run.save(folder / "run")
    rows = np.column_stack([run["time"], np.degrees(run["ankle/angle"])])[::10]
    lines = ["time [s],angle [deg]", *(f"{time:.4f},{angle:.6f}" for time, angle in rows)]
    (folder / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    arm = ["angle [deg],pressure [bar],torque [N*m]", "-10,3,18", "0,3,14", "10,3,11"]
    (folder / "torque.csv").write_text("\n".join(arm) + "\n", encoding="utf-8")
    (folder / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    (folder / "search.toml").write_text(SEARCH, encoding="utf-8")
    over = {"supply.pressure": ["2 bar", "3 bar", "4 bar"]}
    afo_sim.sweep("seated", over, {"duration": "0.05 s"}, out=folder / "swept", threads=1)
    walk, slow, fast = known_walk(), np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)
    write_angles(folder / "ik.mot", walk, slow)
    write_forces(folder / "grf.mot", walk, fast)
    write_trc(folder / "walk.trc", walk, slow)
    return folder


@pytest.fixture(autouse=True)
def quick(blank: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what takes seconds and writes nothing: curves on the pictures, what `validate` computes."""
    monkeypatch.setattr(validation, "validate", lambda report: [])


def words(command: str, out: pathlib.Path, given: pathlib.Path) -> list[str]:
    """The command line."""
    return [word.replace("OUT", str(out)).replace("GIVEN", str(given)) for word in COMMANDS[command]]


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


def read(file: pathlib.Path) -> None:
    """Raise where a file is not whole."""
    data, suffix = file.read_bytes(), file.suffix
    if suffix == ".json":
        assert data.endswith(b"}\n"), file
    elif suffix == ".parquet":
        pq.ParquetFile(file).read()
    elif suffix == ".toml":
        tomllib.loads(data.decode())
    elif suffix == ".xml":
        ElementTree.fromstring(data)
    else:
        ends = {".png": b"IEND\xaeB`\x82", ".pdf": b"%%EOF\n", ".html": b"</html>", ".csv": b"\n"}
        assert data.endswith(ends.get(suffix, b"")) and data, file


def judge(command: str, out: pathlib.Path, before: faults.Contents, made: set[str], what: object) -> bool:
    """Whether the folder is as before; it is that, or complete."""
    faults.settle(out)
    found = contents(out)
    if found == before:
        return True
    if command not in RESUMED:
        assert found.keys() == made, (what, found.keys() ^ made)
    assert b"old" not in found.values(), what
    for name in found:
        read(out / name)
    return False


def refusals(command: str, try_it: Try, out: pathlib.Path, every: bool) -> dict[str, int]:
    """Refuse at changes of the disk, and at sizes of files, of a command on a fresh and on an old folder."""
    told = {"full": 0, "too large": 0, "no permission": 0, "old": 0, "new": 0}
    code, _, complaint = try_it()
    assert code == 0, complaint
    made = contents(out)
    sizes = sorted(len(data) for data in made.values())
    limits = {0, *(size - 1 for size in sizes), *(size // 2 for size in sizes)} if every else {sizes[-1] // 2}
    for before in ({}, dict.fromkeys(made, b"old")) if command not in FRESH else ({},):
        lay(out, before)
        with DISK.acting(out, 0, lambda: None):
            code, _, complaint = try_it()
        assert code == 0, complaint
        assert contents(out).keys() == made.keys()
        numbers = sampled(DISK.count, every)
        tries = [("full", n) for n in numbers] + [("no permission", n) for n in (numbers if every else ())]
        for kind, number in [*tries, *(("too large", limit) for limit in sorted(limits))]:
            lay(out, before)
            act = refuse if kind == "full" else lambda: refuse(errno.EACCES)
            with largest_file(number) if kind == "too large" else DISK.acting(out, number, act):
                code, printed, complaint = try_it()
            told[kind] += 1
            assert "Traceback" not in printed + complaint, (kind, number)
            assert code in (0, 2), (kind, number, complaint)
            as_before = judge(command, out, before, set(made), (kind, number, code, complaint))
            assert hidden(out) == [], (kind, number, hidden(out))
            if as_before:
                told["old"] += 1
                assert code == 2, (kind, number, complaint)
            else:
                told["new"] += 1
            if command in RESUMED:
                again(try_it, out, set(made), (kind, number))
    return told


def again(try_it: Try, out: pathlib.Path, made: set[str], what: object) -> None:
    """The same command ends what was begun."""
    code, _, complaint = try_it()
    assert code == 0, (what, complaint)
    assert contents(out).keys() == made, what


def kills(command: str, line: list[str], try_it: Try, out: pathlib.Path) -> dict[str, int]:
    """Kill at every change of the disk, removals too, of a command on a fresh and on an old folder."""
    told = {"kill": 0, "old": 0, "new": 0}
    code, _, complaint = try_it()
    assert code == 0, complaint
    made = contents(out)

    def work() -> None:
        faults.silent()
        sys.argv = ["afo-sim", *line]
        try:
            cli.main()
        except SystemExit as stop:
            if stop.code:
                raise

    for before in ({}, dict.fromkeys(made, b"old")) if command not in FRESH else ({},):
        for number in range(1, 400):
            lay(out, before)
            if command in WITH_RERUN:
                status = faults.in_program(line, number, out)
            else:
                status = faults.in_child(work, number, out)
            assert status in (0, -9), (number, status)
            if status == 0:
                break
            told["kill"] += 1
            told["old" if judge(command, out, before, set(made), number) else "new"] += 1
            if command in RESUMED:
                again(try_it, out, set(made), number)
        assert status == 0
    return told


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS if EVERY else QUICK)
def test_full_disk_leaves_old_or_new(
    command: str, tmp_path: pathlib.Path, given: pathlib.Path, capsys: pytest.CaptureFixture[str], call: Call
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    told = refusals(command, lambda: call(*words(command, out, given)), out, EVERY)
    with capsys.disabled():
        print(f"\n{command}: {told}" if EVERY else "", end="")
    assert told["old"] >= (1 if command in FRESH else 3), told


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS if EVERY else ["new sweep"])
def test_killed_at_every_change_it_is_old_or_new(
    command: str, tmp_path: pathlib.Path, given: pathlib.Path, capsys: pytest.CaptureFixture[str], call: Call
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    line = words(command, out, given)
    told = kills(command, line, lambda: call(*line), out)
    with capsys.disabled():
        print(f"\n{command}: {told}" if EVERY else "", end="")
    assert told["old"] >= 2, told


@pytest.mark.slow
@pytest.mark.parametrize("exists", [True, False])
def test_killed_at_every_change_a_run_is_old_or_new(
    exists: bool, tmp_path: pathlib.Path, given: pathlib.Path
) -> None:
    recording = afo_sim.read_recording(given / "run")
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


def numbers(name: str, data: bytes) -> object:
    """What of a file a second run repeats: the rows of a Parquet file, else its bytes."""
    if not name.endswith(".parquet"):
        return data
    table = pq.read_table(io.BytesIO(data))
    return {column: table[column].to_pylist().__repr__() for column in table.column_names}


@pytest.mark.slow
@pytest.mark.parametrize("command", KILLED if NIGHTLY else KILLED[:2])
def test_stopped_at_a_random_moment_the_next_one_ends_as_if_it_had_not_been(
    command: str, tmp_path: pathlib.Path, given: pathlib.Path, capsys: pytest.CaptureFixture[str], call: Call
) -> None:
    """KILL, SIGTERM and Ctrl-C; one moment in eight is of the last 50 ms."""
    rng, times, out = random.Random(f"moments of {command}"), tmp_path / "times.json", tmp_path / "out"
    line = words(command, out, given)
    found = []
    for undisturbed in (lambda: faults.at_moment(line, times)[0], lambda: call(*line)[0]):
        out.mkdir(exist_ok=True)
        lay(out, {})
        assert undisturbed() == 0
        found.append({name: numbers(name, data) for name, data in contents(out).items()})
    made = contents(out)
    same = {name for name in made if found[0][name] == found[1][name]}
    assert same or command == "report", made.keys()  # pictures in a page have random names
    events = json.loads(times.read_text())
    told = {"old": 0, "new": 0, "ended": 0}
    for k in range(size(3, 25)):
        before = {} if command in FRESH or k % 2 else dict.fromkeys(made, b"old")
        lay(out, before)
        writing._remove_leftovers.cache_clear()  # as in a new process
        first = events[-1] - 0.05 if k % 8 == 0 else events[0]
        at = bisect.bisect(events, rng.uniform(first, events[-1]))
        number = rng.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
        what = (command, number.name, at, len(events), delay := rng.choice((0.0, rng.uniform(0.0, 0.02))))
        status, complaint = faults.at_moment(line, times, number, at, delay)
        assert status in (0, -number, 128 + number), (what, status, complaint)
        assert "Traceback" not in complaint and "a bug" not in complaint, (what, complaint)
        assert status != 128 + number or complaint.count("stopped") <= 1, (what, complaint)
        as_before = judge(command, out, before, set(made), what)
        assert not (as_before and status == 0), what
        told["ended" if status == 0 else "old" if as_before else "new"] += 1
        again(lambda: call(*line), out, set(made), what)
        assert hidden(out) == [], (what, hidden(out))
        now = {name: numbers(name, data) for name, data in contents(out).items()}
        assert all(now[name] == found[0][name] for name in same), what
    with capsys.disabled():
        print(f"\n{command}: {told}" if NIGHTLY else "", end="")
