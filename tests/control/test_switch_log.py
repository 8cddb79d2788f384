"""Logs of switchings: what is read, what is refused, how two differ, and a log played again."""

import pathlib

import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.control import Log, RecordedController, differences, read_log
from afo_sim.description import load
from afo_sim.export import commanded

CHAMBERS = ("dorsiflexor", "plantarflexor")
ROWS = "time_ms,chamber,inlet,outlet\n0,dorsiflexor,0,0\n10.5,dorsiflexor,1,0\n20,dorsiflexor,0,1\n"


def read(text: str, folder: pathlib.Path) -> Log:
    (folder / "log.csv").write_text(text, encoding="utf-8")
    return read_log(folder / "log.csv", CHAMBERS)


def test_a_log_is_the_same_when_written_and_read(tmp_path: pathlib.Path) -> None:
    log = read(ROWS + "30,dorsiflexor,0,1\n", tmp_path)
    assert [s.time for s in log.switches["dorsiflexor"]] == [0.0, 0.0105, 0.02] and log.end == 0.03
    assert read(log.text(), tmp_path) == log


@pytest.mark.parametrize(
    ("change", "first", "largest"),
    [
        (("\n20,", "\n20.4,"), "", 4e-4),
        (("\n20,", "\n22,"), "switching 2: outlet at 22.000 ms, simulated outlet at 20.000 ms", 2e-3),
        ((",1,0", ",1,1"), "switching 1: both at 10.500 ms, simulated inlet at 10.500 ms", 0.0),
        (("20,dorsiflexor,0,1\n", ""), "switching 2: nothing, simulated outlet at 20.000 ms", 0.0),
    ],
)
def test_differences(change: tuple[str, str], first: str, largest: float, tmp_path: pathlib.Path) -> None:
    end = "40,dorsiflexor,0,1\n"
    simulated = read(ROWS + end, tmp_path)
    log = read(ROWS.replace(*change) + (end if change[1] else "40,dorsiflexor,1,0\n"), tmp_path)
    found = differences(log, simulated, 1e-3)[0]
    assert found.first == first
    assert found.largest == pytest.approx(largest, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no points"),
        ("time_ms,chamber,inlet,outlet\n", "holds no switching"),
        ("time,chamber,inlet,outlet\n0,dorsiflexor,0,0\n", "the column 'time_ms' is missing"),
        (ROWS.replace("10.5", "nan"), "line 3: is not a valid time"),
        (ROWS.replace("1,0", "0.5,0"), "line 3: is not a coil that is on or off"),
        (ROWS.replace("20,", "2,"), "line 4: the time falls"),
        (ROWS.replace("20,dorsi", "20,dorso"), "line 4: .*did you mean 'dorsiflexor'"),
    ],
)
def test_what_is_no_log(text: str, words: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=words):
        read(text, tmp_path)


def test_a_file_that_is_no_text(tmp_path: pathlib.Path) -> None:
    (tmp_path / "log.csv").write_bytes(b"\x80\x00\x01")
    with pytest.raises(InputError, match="cannot be read"):
        read_log(tmp_path / "log.csv", CHAMBERS)


def test_a_log_played_again_is_the_same_run(tmp_path: pathlib.Path) -> None:
    events = {"timer.period": "0.4 s", "timer.dorsiflexor.inlet": [["0.0003 s", "0.2 s"]]}
    events |= {"timer.dorsiflexor.outlet": [["0.2517 s", "0.4 s"]], "timer.plantarflexor.outlet": []}
    scenario = load("scenario", "seated", events | {"duration": "1 s"})
    file = tmp_path / "commands.csv"
    file.write_text(commanded(scenario).log.text(), encoding="utf-8")
    timed = afo_sim.run(scenario)
    other = scenario.set({"timer.dorsiflexor.inlet": [], "timer.dorsiflexor.outlet": []})
    played = afo_sim.run(other, controller=RecordedController(file, CHAMBERS), rate=500.0)
    # switched within steps: on at 0.3 ms and every 0.4 s from there, off and on at 251.7 ms and 651.7 ms
    for name, count in (("valve/dorsiflexor_inlet/coil", 3), ("valve/dorsiflexor_outlet/coil", 2)):
        np.testing.assert_allclose(played[name], timed[name], atol=1e-6)
        assert np.sum((timed[name] > 0.0) & (timed[name] < 1.0)) == count
    np.testing.assert_allclose(played["ankle/angle"], timed["ankle/angle"], atol=1e-7)
