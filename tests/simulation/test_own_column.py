"""Columns of a user's own: recorded, described, read by controllers and by sensors."""

import pathlib
import subprocess
import sys
import traceback
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from command import Call

import afo_sim as afo
from afo_sim.common import identities
from afo_sim.simulation.own_column import OwnColumn

SHORT = {"duration": "0.3 s"}
POWER = """import afo_sim as afo

@afo.column("ankle/power", "W", "lifting positive")
def power(columns):
    return columns["ankle/moment/orthosis"] * columns["ankle/velocity"]

@afo.column("ankle/bug", "W")
def bug(columns):
    return columns["ankle/angle"] / float("a")
"""


@afo.column("air/density", "kg/m^3", "of the dorsiflexor")
def density(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    return columns["chamber/dorsiflexor/mass"] / columns["chamber/dorsiflexor/volume"]


@afo.column("air/twice", "kg/m^3")
def twice(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    return 2.0 * columns["air/density"]


def made(function: Any, name: str = "my/column", unit: str = "") -> OwnColumn:
    return afo.column(name, unit)(function)


def test_it_is_a_column_of_a_run_and_may_read_another() -> None:
    afo.register(density, twice)
    run = afo.run("seated", SHORT)
    expected = run["chamber/dorsiflexor/mass"] / run["chamber/dorsiflexor/volume"]
    assert np.ptp(expected) > 0.1 and np.array_equal(run["air/density"], expected)
    assert np.array_equal(run["air/twice"], 2.0 * expected)
    assert run.describe("air/density") == ("kg/m^3", "of the dorsiflexor")
    assert run.to_pandas().attrs["units"]["air/density"] == "kg/m^3"
    assert np.array_equal(density(run.columns), expected)  # it is still the function


def test_what_is_kept_has_its_unit_where_nobody_has_registered_it(tmp_path: pathlib.Path) -> None:
    afo.register(density)
    folder = afo.run("seated", SHORT).save(tmp_path / "run", rrd=False)
    from afo_sim.simulation import own_column

    own_column.OWN.clear()
    kept = afo.read_recording(folder)
    assert kept.describe("air/density") == ("kg/m^3", "of the dorsiflexor")
    assert "air/density" not in afo.run("seated", SHORT).columns


def test_a_run_that_lacks_what_it_reads_does_not_have_it() -> None:
    afo.register(made(lambda columns: columns["ground/force/z"] / 9.81, "my/load", "kg"))
    assert "my/load" not in afo.run("seated", SHORT).columns
    afo.register(made(lambda columns: columns.get("ground/force/z", columns["ankle/angle"]), "my/either"))
    assert "my/either" in afo.run("seated", SHORT).columns


def test_a_column_that_no_run_has_is_told_with_the_nearest() -> None:
    afo.register(made(lambda columns: columns["ankle/angel"]))
    with pytest.raises(afo.InputError) as refused:
        afo.run("seated", SHORT)
    assert refused.value.value == "ankle/angel" and refused.value.nearest == "ankle/angle"


def test_a_settled_walk_has_it_as_of_one_run() -> None:
    """Also where what it reads goes on from stride to stride."""
    afo.register(made(lambda columns: 2.0 * columns["time"], "my/time", "s"))
    afo.register(made(lambda columns: columns["ankle/position/x"] + columns["my/time"], "my/place", "m"))
    sets = {"reference": None, "sensor": {"mine": {"column": "my/time"}}}
    run = afo.run("walk-dropfoot-afo", sets)
    assert run["gait/solved"].any() and not run["gait/solved"].all()
    assert np.array_equal(run["my/time"], 2.0 * run["time"])
    assert np.array_equal(run["my/place"], run["ankle/position/x"] + run["my/time"])
    assert np.array_equal(run["sensor/mine"], run["my/time"])


def test_a_controller_sees_it_as_it_is_recorded() -> None:
    afo.register(density)
    seen = []

    def control(view: Any) -> dict[str, str]:
        seen.append((view["time"], view["air/density"]))
        return {"dorsiflexor": "inlet"}

    run = afo.run("seated", SHORT, controller=control, rate=100)
    rows = np.searchsorted(run["time"], [time for time, _ in seen[1:]])
    assert len(rows) > 20 and np.array_equal(run["air/density"][rows], [value for _, value in seen[1:]])


def test_a_sensor_reads_it_in_its_unit() -> None:
    afo.register(density)
    sensor = {"column": "air/density", "offset": "2 kg/m^3", "delay": "10 ms"}
    run = afo.run("seated", {"sensor": {"mine": sensor}, **SHORT})
    step = round(0.01 / (run["time"][1] - run["time"][0]))
    assert np.allclose(run["sensor/mine"][step:], run["air/density"][:-step] + 2.0, atol=1e-12)
    assert run.describe("sensor/mine")[0] == "kg/m^3"
    with pytest.raises(afo.InputError) as refused:
        afo.run("seated", {"sensor": {"mine": sensor | {"offset": "2 N"}}, **SHORT})
    assert refused.value.field == "sensor.mine.offset"


@pytest.mark.parametrize(
    ("function", "error"),
    [
        (lambda columns: columns["ankle/angle"][0] / 0.0 * len([1][5:]) + [][0], IndexError),
        (lambda columns: columns["ankle/angle"][:-1], ValueError),
        (lambda columns: columns["ankle/angle"].__iadd__(1.0), ValueError),  # others read these rows, too
        (lambda columns: "a", ValueError),
    ],
)
def test_an_error_of_its_function_keeps_its_type_and_names_its_line(function: Any, error: type) -> None:
    afo.register(made(function))
    with np.errstate(all="ignore"), pytest.raises(error) as raised:
        afo.run("seated", SHORT).whole()
    line = function.__code__.co_firstlineno
    assert f"my/column, {__file__}:{line}" in "".join(traceback.format_exception(raised.value))


@pytest.mark.parametrize(
    "name", ["ankle/angle", "muscle/any/force", "sensor/x", "controller/state", "angle", "a b/c"]
)
def test_a_name_of_the_package_or_none_is_refused(name: str) -> None:
    with pytest.raises(afo.InputError) as refused:
        afo.register(made(lambda columns: columns["time"], name))
    assert refused.value.field == "name" and refused.value.value == name


def test_a_cell_that_runs_again_replaces_it_and_has_another_identity() -> None:
    afo.register(made(lambda columns: columns["time"]))
    first = identities()
    afo.register(made(lambda columns: 2.0 * columns["time"]))
    assert identities().keys() == first.keys() and identities() != first
    run = afo.run("seated", SHORT)
    assert np.array_equal(run["my/column"], 2.0 * run["time"])


def test_the_command_line_writes_it_and_says_the_line_of_an_error(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pathlib.Path("good.py").write_text(POWER[: POWER.index('@afo.column("ankle/bug')])
    pathlib.Path("bad.py").write_text(POWER)
    words = ("run", "seated", "--set", "duration=0.3 s", "--step", "fixed", "--no-rrd", "--out")
    assert call(*words, "run", "--extension", "good.py")[0] == 0
    assert afo.read_recording("run").describe("ankle/power")[0] == "W"
    code, _, err = call(*words, "other", "--extension", "bad.py")
    assert code == 2 and "bad.py:9: ValueError" in err and "ankle/bug" in err


@pytest.mark.parametrize("unit", ["deg", "percent", "furlong"])
def test_a_unit_that_is_not_of_si_is_refused(unit: str) -> None:
    """Thresholds and sensors take the numbers as SI."""
    with pytest.raises(afo.InputError) as refused:
        afo.register(afo.column("my/angle", unit)(lambda columns: columns["ankle/angle"]))
    assert refused.value.field == "unit"


def test_a_column_that_is_not_row_by_row_is_refused() -> None:
    """A controller, which sees a few rows, would see other numbers than the recording has."""
    afo.register(afo.column("my/sum", "rad")(lambda columns: np.cumsum(columns["ankle/angle"])))
    with pytest.raises(ValueError, match="own row"):
        _ = afo.run("seated", {"duration": "0.2 s"})["my/sum"]


def test_it_is_registered_before_anything_else_of_the_package_is_used(tmp_path: pathlib.Path) -> None:
    (tmp_path / "own.py").write_text(
        "import afo_sim as afo\n@afo.column('my/twice', 'rad')\ndef twice(columns):\n"
        "    return 2.0 * columns['ankle/angle']\n",
        encoding="utf-8",
    )
    program = "import afo_sim as afo; afo.register('own.py'); "
    program += (
        "run = afo.run('seated', {'duration': '0.1 s'}); print((run['my/twice'] / run['ankle/angle'])[0])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0 and float(done.stdout) == 2.0, done.stderr
