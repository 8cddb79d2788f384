"""The repeatability study's script: readings scatter as the sensor's steps and noise say."""

import math

import pytest
from documents import script


def test_scatter_follows_from_the_inverse_line() -> None:
    study = script("repeatability")
    filling = study.fill(4.0, repeats=200)
    # noise of 10 mV, and rounding to 10 mV: variance σ² + step²/12 in V; dx = x²/slope dV
    volts = math.sqrt(0.01**2 + 0.01**2 / 12.0)
    for name, distance in (("far", filling.length), ("near", filling.length - study.NEARER)):
        mean, deviation = filling.error(name)
        expected = distance**2 / 0.1038 * volts
        assert deviation == pytest.approx(expected, rel=0.2)
        assert abs(mean) < 4.0 * expected / math.sqrt(200.0) + 0.1 * expected
    mean, deviation = filling.error("pressure")
    assert deviation == pytest.approx(math.sqrt(0.005**2 + (5.0 / 1024.0) ** 2 / 12.0) / 6.429e-6, rel=0.2)
    assert "lost" in study.table([filling])
