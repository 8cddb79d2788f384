"""Capstan: Euler and Eytelwein's ratio, its heat, and its turn about zero speed."""

import math

import numpy as np
import pytest

from afo_sim.physics.series import CREEP, capstan, turn

FAST = 0.05  # [m/s]


@pytest.mark.parametrize("friction", [0.05, 0.2, 0.6])
@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 270.0])
def test_a_sliding_cable_has_the_ratio_of_euler_and_eytelwein(friction: float, angle: float) -> None:
    for sign in (1.0, -1.0):
        behind, _ = capstan(80.0, friction, math.radians(angle), sign * FAST)
        assert behind == pytest.approx(80.0 * math.exp(sign * friction * math.radians(angle)), rel=1e-12)


def test_friction_takes_and_never_gives_and_grows_with_speed() -> None:
    speeds = np.linspace(-5.0 * CREEP, 5.0 * CREEP, 401)
    found = [capstan(80.0, 0.3, 1.2, float(w)) for w in speeds]
    behind, secant = np.array(found).T
    assert np.all((behind - 80.0) * speeds >= 0.0)  # the power that is taken
    assert np.all(np.diff(behind) > 0.0)
    assert np.all(secant > 0.0)
    assert np.all(np.abs(80.0 + secant * speeds - behind) < 1e-9)


def test_the_secant_at_rest_is_the_slope() -> None:
    step = 1e-4 * CREEP
    slope = (capstan(80.0, 0.3, 1.2, step)[0] - capstan(80.0, 0.3, 1.2, -step)[0]) / (2.0 * step)
    assert capstan(80.0, 0.3, 1.2, 0.0)[1] == pytest.approx(slope, rel=1e-6)


def test_a_nan_stays_one() -> None:
    assert all(math.isnan(x) for x in capstan(math.nan, 0.3, 1.2, FAST))


def test_turn_is_the_angle_between_two_directions() -> None:
    for degrees in (0.0, 1e-4, 45.0, 90.0, 179.9):
        angle = math.radians(degrees)
        found = turn(2.0, 0.0, 0.0, 3.0 * math.cos(angle), 0.0, 3.0 * math.sin(angle))
        assert found == pytest.approx(angle, abs=1e-15)
