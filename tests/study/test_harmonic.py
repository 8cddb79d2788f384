"""The first harmonic of signals whose harmonics are known, and where curves cross a level."""

import math

import numpy as np
import pytest

from afo_sim.study.frequency_curve import Crossing, Curve, falls_to, first_harmonic, unwrapped
from afo_sim.study.frequency_response import settled_harmonic

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
