"""Reading of static torques: units, settings, logs, what is taken away, and each refusal."""

import pathlib
from typing import Any

import numpy as np
import pytest

from afo_sim.common import AMBIENT_PRESSURE, InputError
from afo_sim.lab import Readings
from afo_sim.lab.torque_data import ONLY, read_torques

GOOD = {"angle [deg]": [0.0, 5.0, 10.0], "pressure [bar]": [2.0, 3.0, 3.0], "torque [N*m]": [1.0, 2.0, 1.5]}


def only(data: Any, **options: Any) -> Readings:
    (found,) = read_torques(data, **options).groups.values()
    return found


def test_units_and_names_are_read(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "x.csv"
    file.write_text(
        "# note: by hand\n"
        "Test,Angle [deg],absolute pressure (kPa),torque [N*cm],moment_arm [mm],length [mm]\n"
        "a,90,301.325,150,40,200\nb,-45,401.325,-20,40,210\n"
    )
    read = read_torques(file)
    found = read.groups
    assert list(found) == ["a", "b"] and any(
        "moment_arm [mm], length [mm]: not used" in r for r in read.remarks
    )
    assert found["a"].angle == pytest.approx([np.pi / 2.0])
    assert found["a"].pressure == pytest.approx([301_325.0 - AMBIENT_PRESSURE])
    assert not found["a"].path  # a muscle's own length and arm are not its path's
    assert found["a"].torque == pytest.approx([1.5]) and found["b"].torque == pytest.approx([-0.2])


def test_readings_of_one_setting_are_one_point_with_their_scatter() -> None:
    data = {
        "angle [deg]": [5.0, 0.0, 5.0, 5.0],
        "pressure [bar]": [3.0, 3.0, 3.0, 2.0],
        "torque [N*m]": [1.0, 7.0, 2.0, 4.0],
    }
    read = read_torques(data)
    found = read.groups[ONLY]
    assert np.degrees(found.angle) == pytest.approx([5.0, 0.0, 5.0])  # in the file's order
    assert found.torque == pytest.approx([1.5, 7.0, 4.0])
    assert found.weight == pytest.approx([2.0, 1.0, 1.0]) and found.scatter == pytest.approx([0.25, 0.0, 0.0])
    assert "4 readings are of 3 settings" in read.remarks[0]


def held_log(noise: float = 0.0) -> dict[str, np.ndarray]:
    """Three postures held for 4 s each at 50 Hz, a second of turning between them, one of filling."""
    time = np.arange(0.0, 18.0, 0.02)
    angle = np.interp(time, [0, 4, 5, 9, 10, 18], [-10.0, -10.0, 0.0, 0.0, 8.0, 8.0])
    pressure = np.interp(time, [0, 13, 14, 18], [2.0, 2.0, 4.0, 4.0])
    scatter = noise * np.random.default_rng(0).normal(size=len(time))
    return {
        "time [s]": time,
        "angle [deg]": angle,
        "pressure [bar]": pressure,
        "torque [N*m]": pressure - 0.1 * angle + scatter,
    }


def test_of_a_log_only_what_is_held_is_taken() -> None:
    read = read_torques(held_log())
    found = read.groups[ONLY]
    assert np.degrees(found.angle) == pytest.approx([-10.0, 0.0, 8.0, 8.0], abs=0.3)
    assert found.pressure == pytest.approx([2e5, 2e5, 2e5, 4e5], rel=0.02)
    expected = 1e-5 * found.pressure - 0.1 * np.degrees(found.angle)
    assert found.torque == pytest.approx(expected, abs=1e-9)  # means of what is linear
    assert (found.weight == 1.0).all()
    assert "of 900 samples are still (slower than 2 deg/s and 0.05 bar/s" in read.remarks[0]
    share = int(read.remarks[0].split()[0])
    assert 12.0 / 18.0 * 900 < share < 15.5 / 18.0 * 900  # 15 s are held, less the windows' halves


def test_a_noisy_posture_is_one_reading_or_two() -> None:
    """Noise that moves single samples over the edges of cells does not multiply the readings."""
    log, rng = held_log(0.2), np.random.default_rng(4)
    log["angle [deg]"] = log["angle [deg]"] + rng.normal(0.0, 0.2, 900)
    log["pressure [bar]"] = log["pressure [bar]"] + rng.normal(0.0, 0.01, 900)
    assert 4 <= len(read_torques(log).groups[ONLY]) <= 10


def test_a_logs_bounds_can_be_told() -> None:
    fast = read_torques(held_log(), rates=(np.radians(20.0), 1e6)).groups[ONLY]
    assert len(fast) > 15  # a slow turn is cut into degrees
    assert np.ptp(np.degrees(fast.angle)) == pytest.approx(18.0, abs=1.0)


def test_a_log_that_never_rests_is_refused() -> None:
    time = np.arange(0.0, 4.0, 0.02)
    data = {
        "time [s]": time,
        "angle [deg]": 20.0 * np.sin(6.0 * time) + 10.0 * time,
        "pressure [bar]": 2.0 + time,
        "torque [N*m]": time,
    }
    with pytest.raises(InputError, match="is never still"):
        read_torques(data)


def test_what_is_read_without_air_is_taken_away() -> None:
    angle = np.array([-10.0, 0.0, 10.0])
    limb = 0.1 * angle + 2.0  # a straight line, as between two readings
    data = {
        "angle [deg]": [-10.0, 10.0, *angle, 15.0],
        "pressure [bar]": [0.0, 0.0, 3.0, 3.0, 3.0, 3.0],
        "torque [N*m]": [limb[0], limb[2], *(limb + np.array([5.0, 4.0, 3.0])), 9.0],
    }
    read = read_torques(data, difference=True)
    assert read.groups[ONLY].torque == pytest.approx([5.0, 4.0, 3.0])
    assert "2 readings without air" in read.remarks[0] and "1 at other angles" in read.remarks[0]


def test_rows_of_another_chamber_are_left_out() -> None:
    data = {**GOOD, "chamber": ["front", "back", "front"]}
    found = only(data, chamber="front")
    assert np.degrees(found.angle) == pytest.approx([0.0, 10.0])
    with pytest.raises(InputError, match="did you mean 'front'"):
        read_torques(data, chamber="frant")


def test_absolute_pressures_in_a_gauges_column_are_doubted() -> None:
    data = {
        "angle [deg]": [0.0, 0.0, 0.0],
        "pressure [bar]": [1.01, 3.0, 4.0],
        "torque [N*m]": [0.0, 5.0, 8.0],
    }
    assert any("absolute" in remark for remark in read_torques(data).remarks)
    gauge = data | {"pressure [bar]": [0.0, 3.0, 4.0]}
    assert not any("absolute" in remark for remark in read_torques(gauge).remarks)


def lacking(name: str) -> dict[str, Any]:
    return {title: values for title, values in GOOD.items() if title != name}


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (lacking("angle [deg]"), "lacks an angle"),
        (lacking("torque [N*m]"), "lacks a torque"),
        (lacking("pressure [bar]"), "lacks a pressure"),
        ({**GOOD, "angle [rad]": [0.0, 0.1, 0.2]}, "angle .*occurs twice"),
        ({**GOOD, "absolute pressure [bar]": [3.0, 4.0, 4.0]}, "has pressure and absolute pressure"),
        ({**lacking("torque [N*m]"), "torque [N]": [0.0, 1.0, 2.0]}, "torque"),
        ({**lacking("torque [N*m]"), "torqe [N*m]": [0.0, 1.0, 2.0]}, "did you mean 'torque'"),
        ({**GOOD, "pressure [bar]": [300.0, 200.0, 300.0]}, "pressure .*out of range.*gauge, 0 to 20 bar"),
        ({**GOOD, "pressure [bar]": [-0.9, 0.0, 1.0]}, "pressure .*out of range"),
        ({**GOOD, "angle [deg]": [0.0, 5.0, 700.0]}, "angle .*out of range"),
        ({**GOOD, "time [s]": [0.0, 1.0, 2.0]}, "holds 3 samples"),
        (
            {**GOOD, "path length [mm]": [1.0, 2.0, 3.0]},
            "path length: is given without its partner.*moment arm",
        ),
        ({**GOOD, "moment arm flexor [mm]": [1.0, 2.0, 3.0]}, "without its partner.*path length flexor"),
        ({"angle [deg]": [], "pressure [bar]": [], "torque [N*m]": []}, "holds no points"),
    ],
)
def test_what_cannot_be_read_is_told(data: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_torques(data)


def test_times_that_do_not_rise_are_told() -> None:
    log = held_log()
    log["time [s]"][5] = log["time [s]"][3]
    with pytest.raises(InputError, match="does not increase"):
        read_torques(log)
