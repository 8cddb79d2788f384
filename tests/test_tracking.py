"""scripts/tracking.py: its measures on a motion that is known, and what faster valves must do."""

import math
import types

import documents
import numpy as np
import pytest


@pytest.fixture(scope="module")
def script() -> types.ModuleType:
    return documents.script("tracking")


def test_measures_of_a_motion_that_is_known(script: types.ModuleType) -> None:
    """80 % of the sine, 30° late: the error's amplitude is |1 − 0.8 exp(−j 30°)| of it."""
    sine = script.Sine(5.0, 0.5)
    time = np.arange(10000) * 2e-3
    angle = np.radians(4.0 * np.sin(math.pi * time - math.radians(30.0)))
    run = {"time": time, "ankle/angle": angle, "controller/output": np.where(time % 2.0 < 1.0, -1.0, 0.5)}
    found = script.tracked(run, sine)
    left = 5.0 * abs(1.0 - 0.8 * np.exp(-1j * math.radians(30.0)))
    assert (found.rms, found.peak) == pytest.approx((left / math.sqrt(2.0), left), rel=1e-4)
    assert (found.ratio, found.lag, found.full) == pytest.approx((0.8, 30.0, 0.5), rel=1e-4)
    assert (found.lowest, found.highest) == pytest.approx((-4.0, 4.0), rel=1e-4)


@pytest.mark.slow
def test_faster_valves_follow_better_and_nothing_leaves_the_muscles_range(script: types.ModuleType) -> None:
    gains, sine = script.Gains(1.0, 0.01, None), script.Sine(10.0, 0.5)
    slow, fast = (script.follow(factor, gains, sine)[1] for factor in script.FACTORS)
    assert fast.rms < 0.7 * slow.rms and fast.lag < slow.lag and fast.ratio > slow.ratio
    # filled for good, one chamber alone holds 7.2 deg and the other −7.3 deg
    assert -7.4 < fast.lowest < fast.highest < 7.4


@pytest.mark.slow
def test_the_least_error_of_a_grid_is_taken(script: types.ModuleType) -> None:
    grid = [(8.0, 0.1, None), (1.0, 0.01, None)]
    assert script.tuned(4.0, grid) == script.Gains(1.0, 0.01, None)
