"""Trials of extreme numbers and sizes are refused before anything is calculated of them."""

import pathlib
import re

import numpy as np
import pytest
from walking import known_walk, write_forces, write_trc

from afo_sim.common import InputError
from afo_sim.gait_lab import read_trial
from afo_sim.gait_lab.readers import text
from afo_sim.gait_lab.readers.c3d import _plates_of_c3d
from afo_sim.gait_lab.readers.c3d_file import C3dFile, _Layout, _Parameter
from afo_sim.gait_lab.readers.signals import check_clock
from afo_sim.gait_lab.readers.text import unique_names

TIME = np.arange(0.0, 0.4, 0.02)


def write_csv(path: pathlib.Path) -> pathlib.Path:
    rows = [f"{t:g},{30 * t:g},0,{700 + t:g},0.4" for t in TIME]
    path.write_text("\n".join(["time [s],knee_angle_r [deg],p fx [N],p fy [N],p px [m]", *rows]) + "\n")
    return path


@pytest.fixture(params=["walk.trc", "grf.mot", "all.csv"])
def file(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> pathlib.Path:
    path = tmp_path / request.param
    if path.suffix == ".csv":
        return write_csv(path)
    return (write_trc if path.suffix == ".trc" else write_forces)(path, known_walk(), TIME)


@pytest.mark.parametrize(
    ("bound", "words"), [("_MOST_CELLS", r"\d+ rows of \d+ numbers"), ("_MOST_LINES", "too many lines")]
)
def test_a_table_for_which_memory_has_no_room(file, monkeypatch, bound: str, words: str) -> None:
    read_trial([file])
    monkeypatch.setattr(text, bound, 15)
    with pytest.raises(InputError, match=rf"{re.escape(str(file))}: has {words}"):
        read_trial([file])


@pytest.mark.parametrize(
    ("first", "words"),
    [
        ("-1e308", r"(?i)time( \[s\])? = -1e\+308: is not a magnitude"),
        ("nan", "has no finite time"),
        ("9", "(?i)time: time does not increase after 9 s"),
        ("-9", "(?i)time: time leaps from -9 to"),
    ],
)
def test_a_time_that_is_none_of_a_trial(file, first: str, words: str) -> None:
    changed, count = re.subn(r"(?m)^(1\t)?0[.0]*(?=[\t,])", rf"\g<1>{first}", file.read_text(), count=1)
    assert count == 1
    file.write_text(changed)
    with pytest.raises(InputError, match=words):
        read_trial([file])


@pytest.mark.parametrize(
    "steps", [[1e-30] * 20, [1e-6] * 20, [*[1e-5] * 20, 0.15]], ids=["no step", "too fast", "uneven"]
)
def test_a_clock_that_would_make_samples_without_end(steps: list[float]) -> None:
    with pytest.raises(InputError, match="its time runs in steps of"):
        check_clock(pathlib.Path("a.mot"), np.cumsum([0.0, *steps]))


def test_names_that_are_all_the_same() -> None:
    """A search for the next free number would look at each before it: five thousand million."""
    names, notices = unique_names(["a", "a.2", *["a"] * 99_999], "column")
    assert (
        names[:4] == ["a", "a.2", "a.3", "a.4"] and names[-1] == "a.100001" and len(set(names)) == len(names)
    )
    assert "and 99993 more" in str(notices[0])


def test_a_plate_of_no_type_is_left_out() -> None:
    said = {"USED": _Parameter(2, (1,), np.array([1])), "TYPE": _Parameter(4, (1,), np.array([np.nan]))}
    layout, empty = _Layout(0, 0, 1, 3, 1, 1, -1.0, 100.0), np.empty((1, 1, 0))
    file = C3dFile(pathlib.Path("a.c3d"), {"FORCE_PLATFORM": said}, layout, empty, empty, ())
    plates, left_out = _plates_of_c3d(file.file, file, np.empty(0), 1e-3)
    assert not plates and "its type is not stated" in str(left_out[0])
