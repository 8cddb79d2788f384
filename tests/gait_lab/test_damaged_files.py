"""Files damaged at random: cut, with changed bytes, with lines in another order. A sentence or a result."""

import pathlib
import random
import re
import sys
from typing import Any

import numpy as np
import pytest
from c3d_plates import ORIGIN, channels, turned, write
from gait_lab.faulty_trials import FAULTS
from gait_lab.gait_truth import beyond, differences
from walking import known_walk, write_angles, write_forces, write_trc

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, import_gait, read_trial
from afo_sim.gait_lab.readers import c3d_file

TIME = np.arange(0.0, 0.4, 0.02)
COPIES = 60  # of each file and kind of damage


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder, walk = tmp_path_factory.mktemp("whole"), known_walk()
    files = [
        write_angles(folder / "ik.mot", walk, TIME),
        write_forces(folder / "grf.mot", walk, TIME),
        write_trc(folder / "walk.trc", walk, TIME),
    ]
    rows = [
        "time [s],R.Knee x [mm],R.Knee y [mm],R.Knee z [mm],knee_angle_r [deg],p fx [N],p fy [N],p px [m]"
    ]
    rows += [f"{t:g},{1e3 * t:g},500,100,{30 * t:g},0,{700 + t:g},0.4" for t in TIME]
    files.append(folder / "all.csv")
    files[-1].write_text("\n".join(rows) + "\n")
    return {file.name: file.read_bytes() for file in files}


def cut(raw: bytes, dice: random.Random) -> bytes:
    return raw[: dice.randrange(len(raw))]


def changed(raw: bytes, dice: random.Random) -> bytes:
    found = bytearray(raw)
    for _ in range(dice.choice((1, 1, 3, 30))):
        found[dice.randrange(len(found))] = dice.choice((dice.randrange(256), *b"\t\n ,;.-e9#"))
    return bytes(found)


def shuffled(raw: bytes, dice: random.Random) -> bytes:
    lines = raw.split(b"\n")
    first, second = dice.randrange(len(lines)), dice.randrange(len(lines))
    how = dice.randrange(3)
    if how == 0:
        lines[first], lines[second] = lines[second], lines[first]
    elif how == 1:
        del lines[first]
    else:
        dice.shuffle(lines)
    return b"\n".join(lines)


@pytest.mark.parametrize("damage", [cut, changed, shuffled])
@pytest.mark.parametrize("name", ["ik.mot", "grf.mot", "walk.trc", "all.csv"])
def test_damaged_text_is_a_result_or_a_sentence(whole, tmp_path: pathlib.Path, name: str, damage) -> None:
    dice = random.Random(f"{name} {damage.__name__}")
    refused = 0
    for _ in range(COPIES):
        path = tmp_path / name
        path.write_bytes(damage(whole[name], dice))
        try:
            read_trial([path])
        except InputError as error:
            refused += 1
            assert len(str(error)) < 1000
    assert 0 < refused < COPIES  # some are beyond help, some are not


@pytest.mark.slow
def test_damaged_c3d_is_a_result_or_a_sentence(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes changed, mostly in header and parameters, which decide; ezc3d breaks off or hangs at some."""
    pytest.importorskip("ezc3d")
    monkeypatch.setattr(c3d_file, "PATIENCE", 1.5)
    turn, path = turned(0.0), tmp_path / "walk.c3d"
    raw = write(path, [channels(2, turn, ORIGIN, 1e-3)], [2], [turn]).read_bytes()
    dice, refused, copies = random.Random(1), 0, 40
    for _ in range(copies):
        found = bytearray(raw)
        for _ in range(dice.choice((1, 3, 10))):
            found[dice.randrange(dice.choice((512, 4096, len(found))))] = dice.randrange(256)
        path.write_bytes(bytes(found[: dice.choice((len(found), len(found), dice.randrange(len(found))))]))
        try:
            read_trial([path])
        except InputError as error:
            refused += 1
            assert len(str(error)) < 1000
    assert 0 < refused < copies


def test_a_file_that_ends_ezc3d_does_not_end_the_program(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reading process that takes too long, and one that ends with an error, are a sentence each."""
    pytest.importorskip("ezc3d")
    path = write(tmp_path / "walk.c3d", [], [], [])
    monkeypatch.setattr(c3d_file, "PATIENCE", 0.0)
    monkeypatch.setattr(c3d_file, "SECONDS_A_BYTE", 1e-9)
    with pytest.raises(InputError, match="ezc3d did not come to an end"):
        read_trial([path])
    monkeypatch.setattr(c3d_file, "PATIENCE", 30.0)
    monkeypatch.setattr(c3d_file, "CHILD", "no_such_module")
    with pytest.raises(InputError, match="ezc3d broke off"):
        read_trial([path])


ANSWERS = {
    "a pickle that would run": "sys.stdout.write('cos\\nmkdir\\n(Vran\\ntR.')",
    "more than is read": "sys.stdout.write(' ' * 2**23)",
    "more memory than the file can need": "c3d_child._limit(1000); bytes(2**31)",
    "other counts than numbers": 'print(\'{"points": [4, 9, 3], "residuals": [0], "analogs": [0, 0]}\')',
    "no table": "print('[1]')",
    "deep": "print('[' * 200000)",
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such limits")
@pytest.mark.parametrize("answer", ANSWERS.values(), ids=ANSWERS)
def test_an_answer_of_the_reading_process_is_not_trusted(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, answer: str
) -> None:
    """Of one that a damaged file has taken over, say."""
    pytest.importorskip("ezc3d")
    monkeypatch.chdir(tmp_path)
    path, child = write(tmp_path / "walk.c3d", [], [], []), tmp_path / "child.py"
    child.write_text(
        f"import sys\nsys.path.append({str(c3d_file.CHILD.parent)!r})\nimport c3d_child\n{answer}\n"
    )
    monkeypatch.setattr(c3d_file, "CHILD", child)
    with pytest.raises(InputError, match="ezc3d broke off"):
        read_trial([path])
    assert not (tmp_path / "ran").exists()


# One of each kind; the others take ten seconds together.
QUICK = (
    "noise of 3 mm",
    "gap of 50 ms in the ankle's markers",
    "mass given 30 % high",
    "heel and toe exchanged",
    "left and right exchanged",
    "knee and ankle exchanged",
    "millimetres said to be metres",
    "recording of 0.97 of a period",
    "radians under a header of degrees",
    "a label twice, other points",
    "no force plates",
    "plate not zeroed, 30 N",
    "left-handed axes",
    "no knee, no ankle, no toe",
    "both feet on one plate",
)


def _param(name: str) -> Any:
    return pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])


@pytest.mark.parametrize("name", [_param(name) for name in FAULTS])
def test_a_fault_is_told_and_does_no_harm(tmp_path: pathlib.Path, name: str) -> None:
    fault = FAULTS[name]
    files = fault.write(tmp_path)
    try:
        done = import_gait(files, Choices(**fault.choices))
    except InputError as error:
        message = str(error)
        assert "\n" not in message
        assert fault.refuses is not None, message
        assert re.search(fault.refuses, message, re.IGNORECASE), message
        return
    found = differences(done, fault.laboratory, fault.side)
    assert fault.warns is not None, ("it should be refused", found, done.warnings)
    if fault.right:
        assert not beyond(found, fault.loose), (beyond(found, fault.loose), done.warnings)
    if fault.warns:
        told = (*done.warnings, *done.remarks) if fault.remark else done.warnings
        assert any(re.search(fault.warns, text, re.IGNORECASE) for text in told), told
