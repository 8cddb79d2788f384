"""The toes' rest extension over the gait cycle, against the published curve."""

import numpy as np
import pytest

from afo_sim.gait.toe_extension import FLAT, OXFORD, toe_extension

PUBLISHED = np.array(OXFORD)


def test_swing_is_as_asked_at_the_least_clearance() -> None:
    """11 deg at 86 % of the cycle, and 6 and 16; the smoothing may take half a degree."""
    for degrees in (0.0, 6.0, 11.0, 16.0):
        found = np.degrees(toe_extension(np.radians(degrees))(0.86))
        assert found == pytest.approx(degrees, abs=0.5)


def test_stance_is_the_mean_curve_against_the_flat_foot() -> None:
    """From 12 to 60 % nothing is shifted: the published points, less their mean over the flat foot."""
    stance = (PUBLISHED[:, 0] >= 12) & (PUBLISHED[:, 0] <= 52)
    found = np.degrees(toe_extension(np.radians(11.0))(0.01 * PUBLISHED[stance, 0]))
    assert found == pytest.approx(PUBLISHED[stance, 1] - FLAT, abs=1.5)
    flat = np.degrees(toe_extension(np.radians(11.0))(np.linspace(0.20, 0.36, 17)))
    assert abs(flat.mean()) < 0.5


def test_push_off_extends_by_a_third_of_a_right_angle() -> None:
    phase = np.linspace(0.0, 1.0, 1001)
    curve = np.degrees(toe_extension(np.radians(11.0))(phase))
    assert 30.0 < curve.max() < 40.0
    assert 0.57 < phase[np.argmax(curve)] < 0.63


def test_it_repeats_and_its_rate_is_its_derivative() -> None:
    series = toe_extension(0.2)
    phase = np.linspace(0.0, 1.0, 2001)
    assert series(phase + 3.0) == pytest.approx(series(phase), abs=1e-12)
    rate = np.gradient(series(phase), phase)[1:-1]
    assert series(phase, 1)[1:-1] == pytest.approx(rate, abs=2e-3)
