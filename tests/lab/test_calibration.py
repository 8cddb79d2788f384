"""Calibrating a sensor: coefficients with their errors, hysteresis and nonlinearity of constructed cases."""

import pathlib
import tomllib
from typing import Any

import numpy as np
import pytest
from command import Call
from scipy.stats import linregress

import afo_sim as afo
from afo_sim.common import GRAVITY, parse_toml
from afo_sim.description import load
from afo_sim.lab import calibrate

UP = np.arange(11.0)
BOTH = np.concatenate([UP, UP[::-1]])  # up and down, both ends in each


def log(x: np.ndarray, volts: np.ndarray, unit: str = "bar") -> dict[str, Any]:
    return {f"reference [{unit}]": x, "reading [V]": volts}


def csv(folder: pathlib.Path, data: dict[str, Any]) -> pathlib.Path:
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(*(map(float, v) for v in data.values()), strict=True))
    file = folder / "log.csv"
    file.write_text(",".join(data) + "\n" + rows)
    return file


def test_quantised_readings_give_the_known_line_back_within_its_standard_error() -> None:
    """Of 300 logs 68 % are within one standard error and 95 % within two; the errors are scipy's."""
    random, within = np.random.default_rng(7), []
    for _ in range(300):
        x = random.uniform(0.0, 6.0, 25)
        volts = 0.01 * np.round((0.2 + 0.643 * x) / 0.01)
        found, sensor = calibrate(log(x, volts))
        line = linregress(x, volts)
        numbers = [value for name, (value, _) in found.items() if name.startswith(("slope", "inter"))]
        expected = [line.slope, line.stderr, line.intercept, line.intercept_stderr]
        assert numbers == pytest.approx(expected, rel=1e-9)
        within.append([abs(numbers[0] - 0.643) / numbers[1], abs(numbers[2] - 0.2) / numbers[3]])
        assert "hysteresis" not in found and "hysteresis =" not in sensor  # no runs up and down
    assert np.mean(np.array(within) < 1.0, axis=0) == pytest.approx([0.68, 0.68], abs=0.08)
    assert np.mean(np.array(within) < 2.0, axis=0) == pytest.approx([0.95, 0.95], abs=0.04)


def test_hysteresis_and_nonlinearity_of_a_constructed_case_are_the_analytic_ones() -> None:
    """c (t² − 10) is left of a parabola c t² at t = −5 … 5, at most 15 c; h (1 − t²/25) is a lens of 2 h."""
    c, h, t = 0.002, 0.03, BOTH - 5.0
    side = np.repeat([-1.0, 1.0], 11)
    volts = 0.5 + 0.4 * BOTH + c * t**2 + side * h * (1.0 - t**2 / 25.0)
    found, sensor = calibrate(log(BOTH, volts, "N"), step=1e-3)
    assert found["slope"] == (pytest.approx(0.4), "V/N")
    assert found["intercept"] == (pytest.approx(0.5 + 10.0 * c), "V")
    assert found["nonlinearity"] == (pytest.approx(100.0 * 15.0 * c / 4.0), "% of full scale")
    assert found["hysteresis"] == (pytest.approx(100.0 * 2.0 * h / 4.0), "% of full scale")
    rms = np.sqrt(np.mean(c**2 * (t**2 - 10.0) ** 2 + h**2 * (1.0 - t**2 / 25.0) ** 2))
    assert found["RMS residual"] == (pytest.approx(rms), "V")
    read = load("sensor", parse_toml(sensor))
    assert read.hysteresis == "0.15 N" and read.line.slope == pytest.approx(0.4)  # 2 h / (0.4 V/N)
    left = np.sqrt(np.sum(c**2 * (t**2 - 10.0) ** 2) / 20.0)
    assert float(str(read.noise).split()[0]) == pytest.approx(left)


def test_an_infrared_sensor_needs_the_inverse_curve() -> None:
    """Sharp's curve, 10.38 V·cm/x + 0.055 V: a step of 0.01 V is 0.01 x²/10.38, 0.154 mm and 8.67 mm."""
    x = np.linspace(4.0, 30.0, 14)
    data = log(x, 10.38 / x + 0.055, "cm")
    found, sensor = calibrate(data, inverse=True)
    assert found["slope"] == (pytest.approx(10.38), "V*cm")
    assert found["0.01 V at 4 cm"] == (pytest.approx(0.01 * 16.0 / 10.38), "cm")
    assert found["0.01 V at 30 cm"] == (pytest.approx(0.01 * 900.0 / 10.38), "cm")
    assert load("sensor", parse_toml(sensor)).value(10.38 / 17.0 + 0.055) == pytest.approx(0.17)
    assert calibrate(data)[0]["RMS residual"][0] > 0.1 > 1e-9 > found["RMS residual"][0]


def test_a_falling_line_has_the_numbers_of_a_rising_one() -> None:
    """All but the sign of the slope, and an intercept at the other end."""
    volts = 0.5 + 0.3 * BOTH + 0.002 * BOTH**2 + np.repeat([-0.01, 0.01], 11)
    rising, falling = (calibrate(log(BOTH, each))[0] for each in (volts, 5.0 - volts))
    rising["slope"], rising["intercept"] = (-rising["slope"][0], "V/bar"), (5.0 - rising["intercept"][0], "V")
    assert falling.keys() == rising.keys() and rising["0.01 V at 10 bar"] > (0.0, "")
    for name, (value, unit) in rising.items():
        assert falling[name] == (pytest.approx(value), unit), name


@pytest.mark.parametrize(
    ("unit", "si", "slope"),
    [
        ("kg", "N", 0.1 / GRAVITY),
        ("lbf", "N", 0.1 / 4.4482216152605),
        ("mm", "m", 100.0),
        ("deg", "rad", 18.0 / np.pi),
    ],
)
def test_any_unit_of_the_reference_gives_a_line_in_si(unit: str, si: str, slope: float) -> None:
    _, sensor = calibrate(log(UP, 0.3 + 0.1 * UP, unit))
    read = load("sensor", parse_toml(sensor))
    assert (read.unit, read.line.slope, read.line.intercept) == (si, pytest.approx(slope), pytest.approx(0.3))
    assert read.provenance["noise"].kind == read.calibration.provenance["slope"].kind == "fitted"


def test_a_scenario_takes_what_the_command_writes(call: Call, tmp_path: pathlib.Path) -> None:
    """On a transducer of 0.643 V/bar the readings are the pressures, within noise, play and a step."""
    file = csv(tmp_path, log(BOTH, 0.01 * np.round((0.2 + 0.643 * BOTH) / 0.01)))
    code, out, err = call("calibrate", file, "--out", tmp_path / "own")
    assert (code, err) == (0, "") and "hysteresis" in out and "% of full scale" in out
    own = {"column": "chamber/dorsiflexor/pressure", "type": str(tmp_path / "own")}
    run = afo.run("seated", {"duration": "1 s", "sensor.own": own})
    off = run["sensor/own"] - run["chamber/dorsiflexor/pressure"]
    assert np.abs(off).max() < 1e5 * (5.0 * 0.004 + 0.01) / 0.643
    volts = 0.2 + 6.43e-6 * run["chamber/dorsiflexor/pressure"]
    assert np.abs(run["sensor/own/output"] - volts).max() < 5.0 * 0.004 + 0.01


GOOD = "reference [bar], reading [V]\n1,1\n2,2.01\n3,2.99\n"


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        (GOOD.replace("reading", "readin"), (), "did you mean 'reading'"),
        (GOOD.replace(" [bar]", ""), (), "has no unit"),
        (GOOD.replace("[bar]", "[K]"), (), "kelvin"),
        ("reference [bar]\n1\n2\n3\n", (), "lacks a reading"),
        (GOOD[: GOOD.index("3,")], (), "3 readings"),
        (GOOD.replace("2,", "1,").replace("3,", "1,"), (), "two references"),
        (GOOD.replace("3,2.99", "0,2.99"), ("--inverse",), "above 0"),
        (GOOD.replace("2.01", "7").replace("2.99", "1"), (), "does not depend"),
        (GOOD.replace("2.01", "x"), (), "line 3"),
        (GOOD, ("--step", "0.01"), "--step = '0.01': has no unit"),
        (GOOD, ("--step", "0 V"), "--step = '0 V'"),
        (GOOD, ("--step", "1 bar"), "--step = '1 bar'"),
    ],
)
def test_refusals_name_file_field_and_what_is_allowed(
    text: str, options: tuple[str, ...], says: str, call: Call, tmp_path: pathlib.Path
) -> None:
    (tmp_path / "log.csv").write_text(text)
    code, _, err = call("calibrate", tmp_path / "log.csv", *options, "--out", tmp_path / "own")
    assert code == 2 and len(err.splitlines()) == 1 and says in err, err
    assert not (tmp_path / "own").exists()


def test_the_line_is_written_with_the_digits_that_its_residual_bears() -> None:
    """Four or five where the readings scatter; as many as a line without scatter asks for."""
    noise = np.random.default_rng(1).normal(0.0, 0.01, len(UP))
    for volts, fewest, most in (
        (0.3123456 + 0.1234567 * UP + noise, 4, 5),
        (0.3123456 + 0.1234567 * UP, 6, 9),
    ):
        table = tomllib.loads(calibrate(log(UP, volts))[1])["calibration"]
        digits = [
            len(table[key]["value"].split()[0].replace(".", "").strip("0")) for key in ("slope", "intercept")
        ]
        assert fewest <= max(digits) <= most
