"""A metric of a user's own: what its function gets, where its value stands, and what goes wrong in it."""

import json
import pathlib
import subprocess
import sys
import warnings
from typing import Any

import numpy as np
import pytest
from command import Call
from sweep_runs import exact

import afo_sim as afo
from afo_sim.common import extending
from afo_sim.description import load
from afo_sim.metrics import WORDS, OwnMetric, words
from afo_sim.metrics.metric_words import METRICS
from afo_sim.simulation import Asked, run_checks
from afo_sim.simulation.checks import check_metric
from afo_sim.study import engine
from afo_sim.study.processes import Processes

WALK = {"duration": "2.6 s"}
SHORT = {"duration": "0.3 s"}


def mean_angle(name: str = "mean_angle", **of: Any) -> OwnMetric:
    @afo.metric(name, "deg", "Ankle angle, mean", "of a stride", **of)
    def found(columns: Any) -> float:
        return float(np.degrees(columns["ankle/angle"].mean()))

    return found


def lowest(of: float = 0.0) -> OwnMetric:
    """One that fails where the ankle never passes an angle [deg]."""

    @afo.metric("lowest_angle", "deg", "Ankle angle, lowest")
    def found(columns: Any) -> float:
        angle = np.degrees(columns["ankle/angle"])
        if angle.max() < of:
            raise ZeroDivisionError("never there")
        return float(angle.min())

    return found


def test_it_gets_each_whole_stride_and_the_run_has_the_mean_of_those_that_count() -> None:
    @afo.metric("own_time", "s", "Stride time")
    def own_time(columns: Any) -> float:
        time = columns["time"]
        return float(len(time) * (time[1] - time[0]))

    sets = {"duration": "6 s", "gait.settled": "walked"}
    run = afo.run("walk-dropfoot", sets, metrics=[own_time, mean_angle(of="run")])
    for metrics in run.strides.values():
        assert abs(metrics["own_time"] - metrics["stride_time"]) < run["time"][1]
    counted = range(max(run.strides) + 1)[-int(run.metrics["strides_counted"]) :]
    each = [float(run.strides[number]["own_time"]) for number in counted]
    assert len(each) > 1 and float(run.metrics["own_time"]) == pytest.approx(np.mean(each), abs=1e-12)
    rows = np.isin(run["gait/stride"], counted)
    assert float(run.metrics["mean_angle"]) == pytest.approx(np.degrees(run["ankle/angle"][rows].mean()))


@pytest.mark.parametrize("of", ["stride", "run"])
def test_where_nobody_walks_it_gets_the_whole_run(of: str) -> None:
    run = afo.run("seated", SHORT, metrics=[mean_angle(of=of)])
    assert float(run.metrics["mean_angle"]) == pytest.approx(np.degrees(run["ankle/angle"].mean()), abs=1e-9)
    assert mean_angle()(run) == pytest.approx(float(run.metrics["mean_angle"]), abs=1e-9)


def test_a_metric_of_another_unit_is_converted_and_rows_are_its_own_to_spoil() -> None:
    @afo.metric("spoilt", "deg", "Angle in radians")
    def spoilt(columns: Any) -> float:
        angle = columns["ankle/angle"]
        found = afo.Metric(angle[-1], "rad")
        angle[:] = np.nan
        return found

    plain = afo.run("seated", SHORT)
    run = afo.run("seated", SHORT, metrics=[spoilt])
    assert float(run.metrics["spoilt"]) == pytest.approx(np.degrees(run["ankle/angle"][-1]))
    assert {name: str(run.metrics[name]) for name in plain.metrics} == {
        n: str(m) for n, m in plain.metrics.items()
    }


def test_what_a_file_holds_is_read_where_nobody_registered_it(tmp_path: pathlib.Path, call: Call) -> None:
    run = afo.run("walk-dropfoot", WALK, metrics=[mean_angle()])
    value = float(run.metrics["mean_angle"])
    folder = run.save(tmp_path / "run", rrd=False)
    stored = json.loads((folder / "summary.json").read_text())["metrics"]["mean_angle"]
    assert stored == {"value": value, "unit": "deg"}
    assert words("mean_angle").group == "Your own"
    page = pathlib.Path(afo.report(folder, tmp_path / "own.html")).read_text(encoding="utf-8")
    assert page.index("Your own") < page.index("Ankle angle, mean")
    _, listed, _ = call("list", "metrics")
    assert "Ankle angle, mean [deg] of a stride" in listed and "air_per_stride_…" in listed
    code = f"""
import afo_sim as afo
run = afo.read_recording({str(folder)!r})
assert run.metrics["mean_angle"] == {value!r} and run.metrics["mean_angle"].unit == "deg"
page = open(afo.report({str(folder)!r}, {str(tmp_path / "other.html")!r}), encoding="utf-8").read()
assert "Your own" not in page and "mean angle" in page
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    checks = tmp_path / "checks.toml"
    checks.write_text('[[check]]\nmetric = "mean_angle"\nbetween = ["-0.1 rad", "0.1 rad"]\n')
    assert [result.ok for result in run_checks(run, checks)] == [abs(value) < np.degrees(0.1)]
    assert not check_metric(run, "mean_angle", f"{value + 1.0} deg", f"{value + 2.0} deg").ok


def test_the_table_of_a_run_has_it(tmp_path: pathlib.Path, call: Call) -> None:
    afo.register(mean_angle())
    words = ("--set", "duration=0.3 s", "--numbers", "--no-rrd", "--out", tmp_path / "run")
    code, said, _ = call("run", "seated", *words)
    assert code == 0 and "mean_angle" in said


def test_a_sweep_and_a_search_take_it_beside_names() -> None:
    over = {"supply.pressure": ["2 bar", "3 bar"]}
    found = afo.sweep("seated", over, SHORT, metrics=[mean_angle(), "range_of_motion"], threads=1)
    assert found.metrics == {"mean_angle": "deg", "range_of_motion": "deg"}
    for pressure, value in zip(("2 bar", "3 bar"), found["mean_angle"], strict=True):
        run = afo.run("seated", SHORT | {"supply.pressure": pressure})
        assert value == float(run.metrics["mean_angle"])
    limits = ["mean_angle <= -5.2 deg"]
    best = afo.optimise(
        "seated", {"supply.pressure": ("2 bar", "4 bar")}, SHORT, highest=mean_angle(), limits=limits,
        generations=2, population=4, threads=1,
    )  # fmt: skip
    assert best.metrics["mean_angle"].unit == "deg"


@pytest.mark.slow
def test_it_has_bands() -> None:
    walk = {"timestep": "4 ms", "duration": "4 s"}
    run = afo.uncertainty("walk-dropfoot-afo", walk, draws=20, threads=1, metrics=[mean_angle()])
    band = run.studies["uncertainty"]["metrics"]["mean_angle"]
    low, _, high = band["quantiles"]
    assert (band["unit"], band["own"], band["undefined"]) == ("deg", float(run.metrics["mean_angle"]), 0)
    assert low < band["own"] < high


def test_what_fails_in_a_run_is_raised_and_says_where(call: Call, tmp_path: pathlib.Path) -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        afo.run("seated", SHORT, metrics=[lowest(90.0)])
    (note,) = caught.value.__notes__
    line = 1 + [*pathlib.Path(__file__).read_text().splitlines()].index(
        '            raise ZeroDivisionError("never there")'
    )
    assert "lowest_angle" in note and note.endswith(f"{pathlib.Path(__file__).name}:{line}")
    code, _, said = call("run", "seated", "--set", "duration=0.3 s", "--no-rrd", "--out", tmp_path / "run")
    assert code == 2 and f":{line}: ZeroDivisionError: never there" in said and "bug" not in said

    @afo.metric("lowest_angle", "deg", "of no column")
    def misspelt(columns: Any) -> float:
        return float(columns["ankle/angel"].mean())

    with pytest.raises(KeyError, match="ankle/angle"):
        afo.run("seated", SHORT, metrics=[misspelt])


def test_what_fails_in_a_case_is_no_number_there_with_one_warning(tmp_path: pathlib.Path) -> None:
    """The case's other numbers stand; the metric is named with its error and line."""
    over = {"supply.pressure": ["2 bar", "3 bar", "4 bar", "4.1 bar"]}
    sets = {"duration": "3.9 s"}
    plain = afo.sweep("seated", over, sets, metrics=["peak_dorsiflexion_angle"], threads=1)
    peaks = plain["peak_dorsiflexion_angle"]
    own = lowest(float(peaks[1:3].mean()))
    with pytest.warns(UserWarning, match="lowest_angle") as told:
        found = afo.sweep("seated", over, sets, metrics=[own, "peak_dorsiflexion_angle"], threads=1)
    assert len(told) == 1
    np.testing.assert_array_equal(np.isnan(found["lowest_angle"]), [True, True, False, False])
    np.testing.assert_array_equal(found["peak_dorsiflexion_angle"], peaks)
    assert found.ok.all()
    for case in range(4):
        codes = [line for line in found.notices[case].splitlines() if line.startswith("own-metric-failed")]
        assert codes == ["own-metric-failed lowest_angle"] * (case < 2)
    assert f"{pathlib.Path(__file__).name}:" in found.warnings[0] and "never there" in found.warnings[0]


def test_a_walk_beside_a_run_is_not_ended_by_it(tmp_path: pathlib.Path) -> None:
    """A report walks the reference again, in which the orthosis and its columns are missing."""

    @afo.metric("own_pressure", "bar", "Pressure")
    def own_pressure(columns: Any) -> float:
        return float(1e-5 * columns["chamber/dorsiflexor/pressure"].max())

    run = afo.run("walk-dropfoot-afo", WALK, metrics=[own_pressure])
    assert run.metrics["own_pressure"] > "1 bar"
    run.save(tmp_path / "run", rrd=False)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        afo.report(tmp_path / "run", tmp_path / "run.html")
    assert {"own_pressure" in str(each.message) for each in told} <= {True}


def test_the_same_name_again_replaces_it() -> None:
    """As a notebook's cell does, also where its unit and what it looks at are others."""
    assert afo.run("seated", SHORT, metrics=[mean_angle()]).metrics["mean_angle"].unit == "deg"

    @afo.metric("mean_angle", "rad", "In radians", of="run")
    def again(columns: Any) -> float:
        return float(columns["ankle/angle"].mean())

    run = afo.run("seated", SHORT, metrics=[again])
    assert run.metrics["mean_angle"].unit == "rad" and words("mean_angle").label == "In radians"
    assert float(run.metrics["mean_angle"]) == pytest.approx(run["ankle/angle"].mean())


@pytest.mark.parametrize(
    ("name", "unit", "of", "field", "value"),
    [
        ("toe_clearance", "mm", "stride", "name", "toe_clearance"),
        ("air_per_stride_front", "g", "stride", "name", "air_per_stride_front"),  # of a chamber
        ("swings_without_toe_dip", "", "stride", "name", "swings_without_toe_dip"),  # of a former version
        ("mean angle", "deg", "stride", "name", "mean angle"),
        ("own_angle", "degg", "stride", "", "1 degg"),
        ("own_angle", "deg", "strides", "of", "strides"),
    ],
)
def test_what_goes_not_is_refused_and_nothing_is_registered(
    name: str, unit: str, of: Any, field: str, value: str
) -> None:
    before = dict(METRICS), dict(WORDS)
    with pytest.raises(afo.InputError) as caught:
        afo.register(afo.metric(name, unit, "Label", of=of)(lambda columns: 0.0))
    assert (caught.value.field, caught.value.value) == (field, value)
    assert before == (METRICS, WORDS)


def test_another_process_computes_it(tmp_path: pathlib.Path) -> None:
    """Packed by value: its file need not be found there."""
    afo.register(mean_angle())
    (tmp_path / "packed").write_bytes(extending.packed())
    code = f"""
from afo_sim.common import take
take(open({str(tmp_path / "packed")!r}, "rb").read())
import afo_sim as afo
run = afo.run("seated", {SHORT!r}, step="fixed")
print(repr(float(run.metrics["mean_angle"])))
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert float(done.stdout) == float(afo.run("seated", SHORT).metrics["mean_angle"])


@pytest.mark.filterwarnings("ignore:the metric lowest_angle")
def test_the_processes_of_a_sweep_compute_it_and_tell_where_it_fails() -> None:
    sets = [{"duration": "1 s", "supply.pressure": f"{2.0 + 0.1 * k} bar"} for k in range(24)]
    scenario, asked = load("scenario", "seated").resolved(), Asked(frozenset({"lowest_angle"}))
    plain = [afo.run("seated", each).metrics["peak_dorsiflexion_angle"] for each in (sets[0], sets[-1])]
    afo.register(lowest(float(np.mean(plain))))
    expected = {n: exact(each) for n, each in engine.outcomes(scenario, enumerate(sets), asked=asked)}
    assert 0 < sum("never there" in repr(each) for each in expected.values()) < len(sets)
    with Processes(1, 0.0) as beside:
        assert {n: exact(e) for n, e in beside.outcomes(scenario, enumerate(sets), asked=asked)} == expected
        assert len(beside.children) == 1


def test_a_sweep_goes_on_with_the_same_metric_only(tmp_path: pathlib.Path) -> None:
    def of(factor: float) -> OwnMetric:
        @afo.metric("last_angle", "deg", "Last angle")
        def found(columns: Any) -> float:
            return factor * float(columns["ankle/angle"][-1])

        return found

    def swept(factor: float) -> Any:
        over = {"supply.pressure": ["2 bar", "3 bar"]}
        metrics = [of(factor)]
        return afo.sweep("seated", over, SHORT, out=tmp_path / "sweep", metrics=metrics, threads=1)

    assert (swept(2.0)["last_angle"] == swept(2.0)["last_angle"]).all()
    with pytest.raises(afo.InputError) as caught:
        swept(3.0)
    assert caught.value.field == "out"
