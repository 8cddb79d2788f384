"""Frequency responses of the seated device, against second computations."""

import json
import math
import pathlib
from typing import Any

import numpy as np
import pytest
from campaign import size

import afo_sim
from afo_sim.common import GAS_CONSTANT
from afo_sim.study import Curve, FrequencyResponse, bode, first_harmonic
from afo_sim.study.frequency_curve import Crossing, falls_to, unwrapped
from afo_sim.study.frequency_response import settled_harmonic

PRESSURE = "chamber/dorsiflexor/pressure"
PID = {
    "timer": None,
    "controller": {
        "rate": "100 Hz",
        "pid": {
            "lowers": "plantarflexor",
            "angle": {"proportional_band": "1 deg", "reference": {"amplitude": "2 deg"}},
        },
    },
}


@pytest.fixture(scope="module")
def valves() -> FrequencyResponse:
    return bode("seated", what="valves", frequencies=[0.5, 2.0])


def test_valves_in_turn_are_a_timer_in_turn(valves: FrequencyResponse) -> None:
    """The same square wave as a scenario's timer, and Fourier's sum over its last periods."""
    timer = {
        "period": "2 s",
        "dorsiflexor": {"inlet": [["0 s", "1 s"]], "outlet": [["1 s", "2 s"]]},
        "plantarflexor": {"outlet": [["0 s", "2 s"]]},
    }
    run = afo_sim.run("seated", {"timer": timer, "duration": "32 s"})
    last = run["time"] >= 24.0 - 1e-9
    turn = np.exp(-2j * math.pi * 0.5 * run["time"][last])
    for name in (PRESSURE, "ankle/angle"):
        phasor = 2.0 * np.mean(run[name][last] * turn)
        ratio = phasor / (-4j / math.pi)
        curve = valves[name]
        assert curve.gain[0] == pytest.approx(abs(ratio), rel=0.02)
        assert math.cos(curve.phase[0] - np.angle(ratio)) == pytest.approx(1.0, abs=2e-4)


def test_a_faster_square_wave_moves_less(valves: FrequencyResponse) -> None:
    for curve in valves.curves.values():
        assert curve.gain[1] < 0.5 * curve.gain[0]
        assert curve.phase[1] < curve.phase[0] < 0.0 or curve.output == PRESSURE
    assert (valves.what, valves.chamber, valves.input_unit) == ("valves", "dorsiflexor", "")


@pytest.mark.parametrize("frequency", [1.0, 0.25][: size(1, 2)])
def test_the_reference_is_what_the_angle_is_over(frequency: float) -> None:
    """The same sine as a run of as many periods, with Fourier's sum of the angle over its second half."""
    found = bode("seated", PID, frequencies=[frequency])
    duration = found.periods[0] / frequency
    sets = {"duration": f"{duration} s", "controller.pid.angle.reference.frequency": f"{frequency} Hz"}
    run = afo_sim.run("seated", PID | sets)
    last = run["time"] >= 0.5 * duration - 1e-9
    phasor = 2.0 * np.mean(run["ankle/angle"][last] * np.exp(-2j * math.pi * run["time"][last]))
    ratio = phasor / (-1j * math.radians(2.0))  # of sin
    curve = found["ankle/angle"]
    assert curve.is_ratio and found.amplitude == pytest.approx(math.radians(2.0))
    assert curve.gain[0] == pytest.approx(abs(ratio), rel=1e-4)
    assert curve.phase[0] == pytest.approx(np.angle(ratio), abs=1e-4)


RIGID: dict[str, Any] = {
    # one first-order lag: no dead band, fast valves; isothermal air; a foot that hardly moves the volume
    "drive": {
        "dorsiflexor": {
            "kind": "regulator",
            "dead_band": "0 bar",
            "full_at": "4 bar",
            "bandwidth": "100 Hz",
        }
    },
    "orthosis.chamber.dorsiflexor.wall_conductance": "20 W/K",
}


def test_a_regulator_in_its_linear_range_is_a_first_order_lag() -> None:
    """dp/dt = (dp/dm) (dG/de) e with e = asked − p: gain 1/√(1 + (f/fc)²), fc = (dp/dm)(dG/de)/2π.

    dp/dm is taken from the recorded air of the same device, dG/de from ISO 6358 by hand: about 2.77 bar
    gauge the inlet, subsonic, and the outlet, choked, let as much air through per opening.
    """
    amplitude, mean, full = 5e3, 2.77e5, 4e5
    supply, ambient, ratio = 4e5 + 101325.0, 101325.0, 0.3
    conductance, density = 0.055e-3 / 1e5, 1.185  # C [m³/(s·Pa)], ANR
    share = (mean + ambient) / supply
    inlet = conductance * density * supply * math.sqrt(1.0 - ((share - ratio) / (1.0 - ratio)) ** 2)
    outlet = conductance * density * (mean + ambient)
    assert inlet == pytest.approx(outlet, rel=0.03)
    run = afo_sim.run("seated", RIGID | {"duration": "4 s"})
    pressure, mass = run[PRESSURE], run["chamber/dorsiflexor/mass"]
    near = np.abs(pressure - mean) < 2e4
    per_mass = np.polyfit(mass[near], pressure[near], 1)[0]
    assert per_mass < GAS_CONSTANT * 293.0 / 1e-5  # of a volume of more than 10 ml
    corner = per_mass * 0.5 * (inlet + outlet) / full / (2.0 * math.pi)
    frequencies = corner * np.array([0.3, 0.6, 1.0, 2.0])
    found = bode("seated", RIGID, amplitude=amplitude, mean=mean, frequencies=frequencies.tolist())
    curve = found[PRESSURE]
    expected = 1.0 / (1.0 + 1j * curve.frequency / corner)
    assert curve.gain == pytest.approx(np.abs(expected), rel=0.02)
    assert curve.phase == pytest.approx(np.angle(expected), abs=0.03)


def test_what_is_written_is_what_was_found(valves: FrequencyResponse, tmp_path: pathlib.Path) -> None:
    folder = valves.save(tmp_path / "a folder")
    table = json.loads((folder / "bode.json").read_text(encoding="utf-8"))
    assert [curve["output"] for curve in table["curves"]] == list(valves.curves)
    assert table["curves"][0]["gain"] == pytest.approx(valves[PRESSURE].gain)
    lines = (folder / "bode.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + 2 * 2 and lines[1].split(",")[:2] == [PRESSURE, "0.5"]
    assert sorted(path.name for path in folder.iterdir()) == ["bode.csv", "bode.json"]


@pytest.mark.parametrize(
    ("scenario", "options", "says"),
    [
        ("walk-dropfoot-afo", {}, "walks"),
        ("seated", {"what": "reference"}, "no controller with a reference"),
        ("seated", {"what": "pressure"}, "\\[drive.dorsiflexor\\]"),
        ("seated", {"what": "valve"}, "did you mean 'valves'"),
        ("seated", {"chamber": "dorsiflexr"}, "did you mean 'dorsiflexor'"),
        ("seated", {"amplitude": "1 deg"}, "does not go with valves"),
        ("seated", {"frequencies": [2.0, 1.0]}, "not rising frequencies"),
        ("seated", {"frequencies": [math.nan]}, "not rising frequencies"),
        ("seated", {"frequencies": []}, "not rising frequencies"),
        ("seated", {"frequencies": [1e3]}, "an eighth of the control rate"),
        ("seated", {"sets": PID, "amplitude": "1 bar"}, "does not convert to rad"),
        ("seated", {"sets": PID, "amplitude": 0.0}, "is not above zero"),
        ("seated", {"sets": PID, "chamber": "dorsiflexor"}, "does not go with a reference"),
    ],
)
def test_what_is_refused(scenario: str, options: dict[str, Any], says: str) -> None:
    with pytest.raises(afo_sim.InputError, match=f"(?s){says}"):
        bode(scenario, **options)


TIME = np.arange(4000) * 1e-3


def test_mean_amplitude_and_phase_of_a_sine() -> None:
    found = first_harmonic(TIME, 3.0 + 2.0 * np.cos(2.0 * math.pi * 1.5 * TIME - 0.7), 1.5)
    assert (found.mean, abs(found.phasor), np.angle(found.phasor)) == pytest.approx((3.0, 2.0, -0.7))
    assert found.distortion == pytest.approx(0.0, abs=1e-12)


def test_a_square_wave_has_four_over_pi_and_its_known_distortion() -> None:
    square = np.where(np.arange(4000) % 1000 < 500, 1.0, -1.0)
    found = first_harmonic(TIME, square, 1.0)
    assert abs(found.phasor) == pytest.approx(4.0 / math.pi, rel=1e-4)
    # of the mean square 1 the first harmonic has 8/π²
    assert found.distortion == pytest.approx(math.sqrt(math.pi**2 / 8.0 - 1.0), rel=1e-3)


def test_a_first_order_system_has_its_gain_and_phase() -> None:
    """y' = (u − y)/τ from rest, solved whole with its transient; G = 1/(1 + jωτ)."""
    tau, frequency = 0.3, 0.8
    omega, time = 2.0 * math.pi * frequency, np.arange(20000) * 0.5e-3  # 8 periods
    wt = omega * tau
    y = (np.sin(omega * time) - wt * np.cos(omega * time) + wt * np.exp(-time / tau)) / (1.0 + wt**2)
    found, change = settled_harmonic(time, y, frequency)
    ratio = found.phasor / -1j
    assert abs(ratio) == pytest.approx(1.0 / math.sqrt(1.0 + wt**2), rel=1e-5)
    assert np.angle(ratio) == pytest.approx(-math.atan(wt), abs=1e-5)
    assert change < 1e-5


def test_what_has_not_settled_is_told() -> None:
    growing = np.sin(2.0 * math.pi * TIME) * (1.0 + TIME)
    _, change = settled_harmonic(TIME, growing, 1.0)
    # the amplitude is some 3.5 and then 4.5: the quarters of 4 s
    assert change == pytest.approx(1.0 / 4.5, rel=0.05)


def test_phases_are_followed_beyond_half_a_turn() -> None:
    true = np.radians([-100.0, -170.0, -250.0, -340.0, -430.0])
    assert unwrapped(np.angle(np.exp(1j * true))) == pytest.approx(true)
    assert unwrapped(np.radians([120.0, 60.0])) == pytest.approx(np.radians([-240.0, -300.0]))
    assert unwrapped(np.radians([20.0, -20.0])) == pytest.approx(np.radians([20.0, -20.0]))


def first_order(tau: float, frequencies: np.ndarray, unit: str = "Pa") -> Curve:
    response = 2.0 / (1.0 + 2j * math.pi * frequencies * tau)
    zero = np.zeros_like(frequencies)
    gain = np.abs(response) / (2.0 if unit == "Pa" else 1.0)
    return Curve("y", unit, "Pa", frequencies, gain, np.angle(response), zero, zero, zero)


def test_bandwidth_of_a_first_order_system() -> None:
    """1/(2πτ) at −3 dB, and never −90°; over the first gain where the units differ."""
    frequencies = np.geomspace(0.01, 20.0, 60)
    for unit in ("Pa", "rad"):
        curve = first_order(0.2, frequencies, unit)
        assert curve.bandwidth.frequency == pytest.approx(1.0 / (2.0 * math.pi * 0.2), rel=0.01)
        assert curve.quarter == Crossing(20.0, "above")
    assert first_order(50.0, frequencies).bandwidth.relation == "below"
    assert str(first_order(50.0, frequencies).bandwidth) == "below 0.01 Hz"


def test_quarter_turn_of_two_first_order_systems() -> None:
    frequencies = np.geomspace(0.01, 20.0, 60)
    phase = -2.0 * np.arctan(2.0 * math.pi * frequencies * 0.2)
    assert falls_to(frequencies, phase, -0.5 * math.pi).frequency == pytest.approx(0.7958, rel=0.01)


def test_a_gain_in_units_that_people_read() -> None:
    one = np.array([1.0])
    curve = Curve("ankle/angle", "rad", "Pa", one, one * 1e-6, -one, one, one, one)
    assert curve.gain_unit == "deg/bar"
    assert curve.shown_gain[0] == pytest.approx(math.degrees(1e-6) * 1e5)
