"""Trials with one fault each, and files that end what reads them: a sentence, or a right result."""

import pathlib
import re
import sys
from typing import Any

import pytest
from c3d_plates import write
from gait_lab.faulty_trials import FAULTS
from gait_lab.gait_truth import beyond, differences

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, import_gait, read_trial
from afo_sim.gait_lab.readers import c3d_file


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
    "gap of 0.4 s in one stride's ankle",
    "ankle unseen for 1.9 s",
    "mass given 30 % high",
    "heel and toe exchanged",
    "left and right exchanged",
    "knee and ankle exchanged",
    "millimetres said to be metres",
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
