"""Trials with one fault each, and files that end what reads them: a sentence, or a right result."""

import pathlib
import re
from typing import Any

import pytest
from gait_lab.faulty_trials import FAULTS
from gait_lab.gait_truth import beyond, differences

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, import_gait

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
