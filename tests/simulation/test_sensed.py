"""Sensors in runs: what a controller saw is what is recorded, and every field of a sensor acts."""

import functools
import pathlib
from typing import Any

import numpy as np
import pytest
from documents import PAGES
from scipy.signal import lfilter, lfiltic

import afo_sim as afo
from afo_sim.common import InputError, assets
from afo_sim.control import Observation
from afo_sim.description import Sensor, load
from afo_sim.description.control.sensor import FIELDS, Calibration
from afo_sim.simulation import Recording, sensor_columns
from afo_sim.simulation.sensed import SensorBank

PRESSURE, LENGTH = "chamber/dorsiflexor/pressure", "muscle/dorsiflexor_1/length"
SENSORS: dict[str, Any] = {
    "pressure": {"column": PRESSURE, "type": "mpx5700", "delay": "6 ms"},
    "angle": {"column": "ankle/angle", "type": "as5048", "rate": "100 Hz"},
    "length": {"column": LENGTH, "type": "gp2y0a41"},
    "coil": {"column": "valve/dorsiflexor_inlet/coil", "threshold": 0.5},
}
BRIEF = {"duration": "0.6 s", "sensor": SENSORS}


@functools.cache
def run() -> Recording:
    return afo.run("seated", BRIEF)


def test_columns_and_units() -> None:
    found = {name: run().describe(name)[0] for name in run().columns if name.startswith("sensor/")}
    assert found == {
        "sensor/pressure": "Pa",
        "sensor/pressure/output": "V",
        "sensor/angle": "rad",
        "sensor/length": "m",
        "sensor/length/output": "V",
        "sensor/coil": "",
    }


def test_units_leave_with_the_run(tmp_path: pathlib.Path) -> None:
    again = afo.read_recording(run().save(tmp_path / "run", rrd=False))
    assert again.describe("sensor/pressure") == run().describe("sensor/pressure")
    assert again.to_pandas().attrs["units"]["sensor/pressure/output"] == "V"
    assert (again["sensor/angle"] == run()["sensor/angle"]).all()
    file = run().export(tmp_path / "run.csv", columns=["sensor/*"])[0]
    assert "sensor/pressure" in file.read_text(encoding="utf-8")


def test_readings_are_of_the_true_columns() -> None:
    columns = run()
    assert np.abs(columns["sensor/angle"] - columns["ankle/angle"]).max() < np.radians(1.5)
    volts = columns["sensor/pressure/output"]
    step = 5.0 / 1024.0
    assert volts / step == pytest.approx(np.round(volts / step), abs=0.01)
    assert columns["sensor/pressure"] == pytest.approx((volts - 0.2) / 6.429e-6, rel=1e-9, abs=1e-6)
    assert (columns["sensor/coil"] == columns["valve/dorsiflexor_inlet/coil"]).all()


@pytest.mark.parametrize("rate", [100.0, 250.0])
def test_controller_sees_what_is_recorded(rate: float) -> None:
    seen: dict[str, list[np.ndarray]] = {name: [] for name in SENSORS}

    def watch(observed: Observation) -> dict[str, Any]:
        for name, rows in seen.items():
            rows.append(observed.rows(f"sensor/{name}"))
        return {"dorsiflexor": "inlet" if observed["sensor/pressure"] < 1e5 else "shut"}

    recording = afo.run("seated", BRIEF, controller=watch, rate=rate)
    assert recording.ok
    for name, rows in seen.items():
        told = np.concatenate(rows[1:])  # the first is a look at the start
        assert len(told) > 280
        assert (told == recording[f"sensor/{name}"][: len(told)]).all(), name


def test_simulator_sees_what_it_records_with_another_seed_too() -> None:
    with afo.Simulator("seated", BRIEF) as simulator:
        told = {}
        for seed in (None, 5):
            simulator.reset(seed)
            rows = [simulator.step(dt=dt).rows("sensor/angle") for dt in (0.002, 0.02, 0.006)]
            told[seed] = np.concatenate(rows)
            assert (simulator.recording()["sensor/angle"] == told[seed]).all()
        assert (told[None] == run()["sensor/angle"][:14]).all()
        assert (told[None] != told[5]).any()


def test_sensors_change_nothing_else() -> None:
    bare = afo.run("seated", {"duration": "0.6 s"})
    assert not any(name.startswith("sensor/") for name in bare.columns)
    assert all((bare[name] == run()[name]).all() for name in bare.columns)


def test_record_rate_thins_the_same_readings() -> None:
    slow = afo.run("seated", {**BRIEF, "record_rate": "100 Hz"})
    assert (slow["sensor/pressure"] == run()["sensor/pressure"][::5]).all()


def test_plain_python_reads_the_same() -> None:
    first = {name: values[:40] for name, values in run().columns.items()}
    for mode in ("native", "python"):
        built = afo.build(load("scenario", "seated", {**BRIEF, "callback": mode}))
        found = sensor_columns(built, first)
        assert all((found[name] == first[name]).all() for name in found), mode


def test_settled_walk_has_readings_of_both_parts() -> None:
    sensors = {"shank": {"column": "shank/angle", "noise": "0.1 deg"}, "ideal": {"column": "shank/angle"}}
    walk = afo.run("walk-dropfoot", {"sensor": sensors, "duration": "4 s"})
    assert set(walk["gait/solved"]) == {0.0, 1.0}
    assert (walk["sensor/ideal"] == walk["shank/angle"]).all()
    noise = walk["sensor/shank"] - walk["shank/angle"]
    assert np.std(noise) == pytest.approx(np.radians(0.1), rel=0.1)
    assert len(np.unique(noise)) > 0.99 * len(noise)  # it does not begin again where the parts meet


# Each field of a sensor: a base, and what is changed in it; the reading must move.
PLAIN = {"column": PRESSURE, "calibration": {"slope": "6 mV/kPa", "intercept": "0.2 V"}}
SWITCH = {"column": PRESSURE, "threshold": "0.1 bar", "noise": "20 mbar"}
MOVES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "gain": (PLAIN, {"gain": 1.01}),
    "offset": (PLAIN, {"offset": "10 mbar"}),
    "drift": (PLAIN, {"drift": "10 mbar/s"}),
    "hysteresis": (PLAIN, {"hysteresis": "10 mbar"}),
    "lowpass": (PLAIN, {"lowpass": "50 Hz"}),
    "rate": (PLAIN, {"rate": "50 Hz"}),
    "noise": (PLAIN, {"noise": "1 mV"}),
    "minimum": (PLAIN, {"minimum": "0.3 V"}),
    "maximum": (PLAIN, {"maximum": "0.2 bar"}),
    "resolution": (PLAIN, {"resolution": "10 mbar"}),
    "delay": (PLAIN, {"delay": "10 ms"}),
    "threshold": (SWITCH, {"threshold": "0.2 bar"}),
    "debounce": (SWITCH, {"debounce": "10 ms"}),
    "calibration.slope": (PLAIN, {"calibration": {"slope": "7 mV/kPa", "assumed_slope": "6 mV/kPa"}}),
    "calibration.intercept": (PLAIN, {"calibration": {"intercept": "0.3 V", "assumed_intercept": "0.2 V"}}),
    "calibration.shape": (
        PLAIN | {"resolution": "1 mV"},
        {"calibration": {"slope": "10 kPa*V", "shape": "inverse"}},
    ),
    "calibration.assumed_slope": (PLAIN, {"calibration": {"assumed_slope": "7 mV/kPa"}}),
    "calibration.assumed_intercept": (PLAIN, {"calibration": {"assumed_intercept": "0.3 V"}}),
    "column": (PLAIN, {"column": "chamber/plantarflexor/pressure"}),
    "type": (PLAIN, {"type": "mpx5700"}),
    "seed": (PLAIN | {"noise": "1 mV"}, {"seed": 1}),
}


def reading(sensor: dict[str, Any]) -> np.ndarray:
    built = afo.build(load("scenario", "seated", {"duration": "0.6 s", "sensor": {"it": sensor}}))
    return sensor_columns(built, run().columns)["sensor/it"]


# S3's instruments: column, V at its quantity [SI], accuracy [SI], by the ranges and outputs that S3 prints.
S3: dict[str, tuple[str, Any, float]] = {
    "cpl_1": (LENGTH, lambda x: 250.0 * (4e-3 + 16e-3 * (x - 0.1) / 0.18), 0.002 * 0.18),
    "pe5": (PRESSURE, lambda p: 10.0 * p / 10e5, 0.001 * 10e5),
    "tecsis_2kn": ("muscle/dorsiflexor_1/force", lambda f: 5.0 + 5.0 * f / 2000.0, 0.003 * 2000.0),
}


def test_s3s_instruments_read_a_run_within_the_accuracy_that_it_prints() -> None:
    sensors = {name: {"column": column, "type": name} for name, (column, *_) in S3.items()}
    read = afo.run("seated", {"duration": "4 s", "sensor": sensors})
    assert read.ok
    step, corner = 1e-5 * 30.5, {"cpl_1": 0.1, "pe5": 0.005 / np.log(9.0)}
    for name, (column, volts, accuracy) in S3.items():
        expected = volts(read[column])
        if name in corner:  # a first order of S3's time constant, or of its response time from 10 to 90 %
            share = -np.expm1(-(read["time"][1] - read["time"][0]) / corner[name])
            start = lfiltic([share], [1.0, share - 1.0], expected[:1])
            expected = lfilter([share], [1.0, share - 1.0], expected, zi=start)[0]
        off = read[f"sensor/{name}/output"] - expected
        assert np.abs(off).max() < 6.0 * step, name  # noise of a step, rounding
        assert np.std(off) == pytest.approx(step, rel=0.15), name  # noise, and rounding's 0.29
        settled = read["time"] > 3.8
        assert np.abs((read[f"sensor/{name}"] - read[column])[settled]).max() < accuracy, name
    for name in assets.names("sensor"):  # each number states its source, each sensor is on the page
        sensor = load("sensor", name)
        line = sensor.calibration.model_fields_set - {"provenance", "shape"} if sensor.calibration else set()
        told = sensor.model_fields_set - {"name", "description", "unit", "provenance", "calibration"}
        assert told == set(sensor.provenance), name
        assert line == set(sensor.calibration.provenance if sensor.calibration else ()), name
        assert f"`{name}`" in PAGES["sensors"], name


def test_every_field_is_declared() -> None:
    own = {*FIELDS, *Sensor.model_fields} - {"provenance", "calibration"}
    inner = {f"calibration.{name}" for name in Calibration.model_fields if name != "provenance"}
    assert own | inner == set(MOVES)


@pytest.mark.parametrize("field", MOVES)
def test_every_field_acts(field: str) -> None:
    base, changed = MOVES[field]
    new = base | changed
    if "calibration" in changed:
        new["calibration"] = base["calibration"] | changed["calibration"]
    assert (reading(base) != reading(new)).any()


def test_own_field_goes_before_the_types() -> None:
    scenario = load("scenario", "seated", {"sensor.it": {"column": "ankle/angle", "type": "as5048"}})
    assert scenario.sensor["it"].whole.noise == "0.06 deg"
    changed = scenario.set({"sensor.it.noise": "1 deg"}).sensor["it"].whole
    assert (changed.noise, changed.resolution) == ("1 deg", "0.0219 deg")


@pytest.mark.parametrize("name", assets.names("sensor"))
def test_shipped_sensor_names_the_source_of_each_number(name: str) -> None:
    sensor = load("sensor", name)
    numbers = {field for field in FIELDS if getattr(sensor, field) is not None} - {"calibration"}
    assert numbers == set(sensor.provenance)
    if sensor.calibration is not None:
        assert {"slope", "intercept"} == set(sensor.calibration.provenance)
        for value in (0.05, 0.2):
            assert sensor.value(sensor.volts(value)) == pytest.approx(value, rel=1e-9)


def test_calibration_lines_of_data_sheets() -> None:
    """MPX5700: 0.2 V at 0 and 4.7 V at 700 kPa; GP2Y0A41: 0.4 V at 30 cm, 2.25 V more at 4 cm."""
    pressure, distance = load("sensor", "mpx5700"), load("sensor", "gp2y0a41")
    assert pressure.volts([0.0, 7e5]) == pytest.approx([0.2, 4.7], abs=0.001)
    assert distance.volts(0.3) == pytest.approx(0.4, abs=0.005)
    assert distance.volts(0.04) - distance.volts(0.3) == pytest.approx(2.25, abs=0.005)
    assert distance.value(distance.volts([0.05, 0.12])) == pytest.approx([0.05, 0.12])


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"column": "chamber/dorsiflexr/pressure"}, r"sensor\.it\.column.*did you mean"),
        ({"column": "ankle/acceleration"}, "no such column that can be sensed"),
        ({"offset": "2 N"}, r"sensor\.it\.offset = '2 N': is in newton"),
        ({"offset": "nan Pa"}, "offset"),
        ({"noise": "-1 Pa"}, "is negative"),
        ({"noise": "much"}, r"sensor\.it\.noise = 'much'"),
        ({"noise": ["1 Pa"]}, "is not a quantity"),
        ({"resolution": "1 mV"}, r"resolution = '1 mV': is in millivolt"),
        ({"type": "as5048"}, "reads rad, and the column is .* in Pa"),
        ({"type": "mpx57"}, "did you mean 'mpx5700'"),
        ({"calibration": {"slope": "1 V/N"}}, r"calibration\.slope"),
        ({"calibration": {"slope": "0 V/Pa"}}, "carries no information"),
        ({"calibration": {}}, "slope: is missing"),
        ({"minimum": "2 bar", "maximum": "1 bar"}, "above the maximum"),
        ({"seed": -1}, "out of range"),
        ({"delay": "11 s"}, "out of range"),
        ({"dely": "1 s"}, "did you mean 'delay'"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(changed: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        afo.run("seated", {"duration": "0.01 s", "sensor": {"it": {"column": PRESSURE} | changed}})


@pytest.mark.parametrize(("name", "told"), [("a/b", "has a /"), ("", "is empty"), (" ", "is empty")])
def test_sensor_whose_name_is_none_is_refused(name: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        SensorBank(afo.build(load("scenario", "seated", {"sensor": {name: {"column": "ankle/angle"}}})))


def test_switch_that_one_can_buy_has_no_unit() -> None:
    sensors = {"heel": {"column": "muscle/dorsiflexor_1/force", "type": "fsr_footswitch"}}
    brief = afo.run("seated", {"duration": "0.02 s", "sensor": sensors})
    assert brief.describe("sensor/heel")[0] == ""
    assert set(brief["sensor/heel"]) <= {0.0, 1.0}


def test_unknown_sensor_of_a_recording() -> None:
    with pytest.raises(InputError, match="did you mean 'sensor/angle'"):
        run().describe("sensor/angl")
