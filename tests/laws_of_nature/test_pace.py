"""Inverse dynamics hold at any pace: a healthy ankle follows the recorded one through changes and a stop."""

import numpy as np
import pytest

import afo_sim
from afo_sim.simulation import Recording

PACE = {"duration": "9 s", "gait.pace": [["2 s", 1.25], ["4 s", 0.0], ["6 s", 0.8]]}


@pytest.fixture(scope="module")
def healthy() -> Recording:
    return afo_sim.run("walk-healthy", PACE | {"gait.variability": 0.03, "reference": None})


def test_the_healthy_ankle_returns_the_recorded_one(healthy: Recording) -> None:
    assert healthy.ok
    off = np.degrees(healthy["ankle/angle"] - healthy["gait/ankle_angle"])
    assert np.abs(off).max() < 0.02  # as at an even pace


def test_the_rate_of_what_is_recorded_is_its_difference(healthy: Recording) -> None:
    time, angle, velocity = (healthy[name] for name in ("time", "ankle/angle", "ankle/velocity"))
    difference = np.gradient(angle, time)
    assert velocity == pytest.approx(difference, abs=0.02 * np.abs(difference).max())
    stands = (time > 4.6) & (time < 5.9)
    assert np.abs(velocity[stands]).max() < 1e-3


def test_strides_of_any_duration_have_metrics(healthy: Recording) -> None:
    found = list(healthy.strides.values())
    times = np.array([stride["stride_time"].value for stride in found])
    assert times.max() > 2.3 and times.min() < 1.0  # one has a stop of 1.5 s and its changes
    clearance = np.array([stride["toe_clearance"].value for stride in found])
    assert np.isfinite(clearance).all()
    assert np.ptp(clearance) < 1.0  # [mm]: the same path at any pace
    stance = np.array([stride["stance"].value for stride in found])
    assert np.ptp(stance) < 1.0  # [%] of the phase, not of the time
