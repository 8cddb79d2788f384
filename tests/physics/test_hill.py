"""Hill's muscle: a spring and a damper, in tension only."""

import math

import numpy as np
import pytest

from afo_sim.physics.hill import (
    BRAID_BLEND,
    FORCE_BLEND,
    braid_force,
    hill_force,
    tension,
    three_element_damping,
)

R = 2e-4  # damping of the S1 muscle [m²·s]
ABSOLUTE = 5e5  # [Pa]
BRAID = 20e3  # [N]


def plain(static, contraction, rate, absolute, damping, stiffness):
    """Hill's muscle without friction, with S2's damping R × absolute pressure."""
    return hill_force(static, contraction, rate, damping * absolute, 0.0, 0.0, 0.0, stiffness)


def _slope(function, x, step):
    return (function(x + step) - function(x - step)) / (2.0 * step)


@pytest.mark.parametrize("width", [0.5, FORCE_BLEND, 10.0])
def test_tension_is_a_clamp_with_its_own_slope(width):
    # Steps chosen so that no grid point sits on 0 or on `width`, where only the second derivative jumps.
    forces = np.linspace(-2.0, 3.0, 997) * width
    for force in forces:
        clamped, slope = tension(force, width)
        assert 0.0 <= clamped <= max(force, 0.0)
        step = 1e-6 * width
        assert slope == pytest.approx(_slope(lambda f: tension(f, width)[0], force, step), abs=1e-5)
    assert tension(-1.0, width) == (0.0, 0.0)
    assert tension(2.0 * width, width) == (2.0 * width, 1.0)


@pytest.mark.parametrize("width", [0.5, FORCE_BLEND, 10.0])
def test_tension_meets_both_ends_in_value_and_slope(width):
    for joint in (0.0, width):
        below, above = (tension(joint + side * 1e-9 * width, width) for side in (-1.0, 1.0))
        assert above[0] == pytest.approx(below[0], abs=1e-8 * width)
        assert above[1] == pytest.approx(below[1], abs=1e-8)


def test_nan_comes_out():
    assert math.isnan(tension(math.nan, FORCE_BLEND)[0])
    assert math.isnan(braid_force(math.nan, BRAID))
    arguments = (50.0, 0.1, 0.2, ABSOLUTE, R, BRAID)
    assert all(map(math.isfinite, plain(*arguments)))
    for i in range(5):  # the braid's stiffness has no say in a muscle that is not stretched
        assert math.isnan(plain(*arguments[:i], math.nan, *arguments[i + 1 :])[0]), i
    assert math.isnan(plain(50.0, -0.02, 0.2, ABSOLUTE, R, math.nan)[0])
    # a slack muscle hides no NaN either
    for i in range(4):
        slack = [-50.0, 0.3, 0.2, ABSOLUTE, R, BRAID]
        slack[i] = math.nan
        assert math.isnan(plain(*slack)[0]), i


def test_braid_stiffness_starts_smoothly_and_ends_linear():
    assert braid_force(0.1, BRAID) == 0.0
    assert braid_force(0.0, BRAID) == 0.0
    for kappa in np.linspace(-0.03, 0.01, 401):
        assert braid_force(kappa, BRAID) >= braid_force(kappa + 1e-5, BRAID)
    for joint in (0.0, -BRAID_BLEND):
        below, above = joint - 1e-8, joint + 1e-8
        assert braid_force(below, BRAID) == pytest.approx(braid_force(above, BRAID), abs=1e-3)
        slopes = [_slope(lambda k: braid_force(k, BRAID), kappa, 1e-9) for kappa in (below, above)]
        assert slopes[0] == pytest.approx(slopes[1], abs=1e-4 * BRAID)
    # beyond the blend the tangent is the stiffness itself
    assert _slope(lambda k: braid_force(k, BRAID), -0.02, 1e-4) == pytest.approx(-BRAID, rel=1e-9)


def test_muscle_force_is_spring_less_damper():
    # S2: F = F_s − R P κ̇ with absolute pressure. 50 N − 2e-4 · 5e5 · 0.2 = 30 N; contracting lowers it.
    assert plain(50.0, 0.1, 0.2, ABSOLUTE, R, BRAID)[0] == pytest.approx(30.0, rel=1e-12)
    assert plain(50.0, 0.1, -0.2, ABSOLUTE, R, BRAID)[0] == pytest.approx(70.0, rel=1e-12)
    # 2 % of stretch: half a blend less than 20 kN · 0.02 = 400 N, on top of the static force
    assert plain(50.0, -0.02, 0.0, ABSOLUTE, R, BRAID)[0] == pytest.approx(400.0, rel=1e-12)


@pytest.mark.parametrize("static", [-100.0, -1.0, 0.0])
@pytest.mark.parametrize("rate", [-50.0, -1.0, 0.0, 50.0])
def test_a_slack_muscle_carries_nothing(static, rate):
    # Lengthening fast (rate < 0), a damper alone would pull with hundreds of newtons.
    assert plain(static, 0.2, rate, ABSOLUTE, R, BRAID) == (0.0, 0.0)


def test_a_muscle_never_pushes():
    for static in np.linspace(-5.0, 200.0, 42):
        for rate in np.linspace(-20.0, 20.0, 41):
            force, coefficient = plain(static, 0.1, rate, ABSOLUTE, R, BRAID)
            assert force >= 0.0
            assert coefficient >= 0.0  # a damper takes energy, it never gives any


def test_a_damper_drawn_out_holds_at_most_as_much_again_as_the_muscle_carries():
    # Up to half of it the law is exact: 50 N and 2e-4 · 5e5 · 0.25 = 25 N; from 75 N of damper on it is 50 N.
    full = R * ABSOLUTE
    assert plain(50.0, 0.1, 0.0, ABSOLUTE, R, BRAID)[1] == pytest.approx(full, rel=1e-12)
    assert plain(50.0, 0.1, -0.25, ABSOLUTE, R, BRAID)[0] == pytest.approx(75.0, rel=1e-12)
    for rate in (-0.75, -1.0, -50.0):
        assert plain(50.0, 0.1, rate, ABSOLUTE, R, BRAID) == (pytest.approx(100.0, rel=1e-12), 0.0)
    for static in np.linspace(0.0, 3.0, 61):
        assert plain(static, 0.1, -9.0, ABSOLUTE, R, BRAID)[0] <= 2.0 * static


def test_coefficient_is_the_slope_by_contraction_rate():
    # In the blends, in full tension, and where the damper takes all of it.
    for static in (0.05, 0.3, 0.61, 0.97, 5.3, 80.0):
        for rate in np.linspace(-0.9, 0.9, 77):
            _, coefficient = plain(static, 0.1, rate, ABSOLUTE, R, BRAID)
            slope = _slope(lambda v, s=static: plain(s, 0.1, v, ABSOLUTE, R, BRAID)[0], rate, 1e-7)
            assert coefficient == pytest.approx(-slope, abs=2e-3)


def test_force_and_damping_are_continuous_through_the_nominal_length_and_through_slack():
    # Where the grid is twice as fine, the largest jump of a continuous curve is half as large.
    def largest_jump(n):
        curves = (
            [plain(20.0, k, 0.1, ABSOLUTE, R, BRAID)[0] for k in np.linspace(-0.03, 0.03, n)],
            [plain(f, 0.1, -0.5, ABSOLUTE, R, BRAID)[0] for f in np.linspace(-3.0, 3.0, n)],
            # the damping fades as a shortening damper takes the last newton off a spring of 20 N
            [plain(20.0, 0.1, v, ABSOLUTE, R, BRAID)[1] for v in np.linspace(0.1, 0.3, n)],
        )
        return np.array([np.max(np.abs(np.diff(curve))) for curve in curves])

    assert np.all(largest_jump(16_001) < 0.51 * largest_jump(8001))


def test_bladder_does_not_hold_the_stretched_braid_back():
    """At ambient pressure S1's muscle is −136 N by its law; the braid still carries its own stretch."""
    force, _ = plain(-136.0, -0.01, 0.0, 101_325.0, 2e-4, 2e4)
    assert force == pytest.approx(2e4 * (0.01 - 0.0025), rel=1e-12)


def test_at_rest_the_clamp_acts_once():
    assert plain(0.5, 0.1, 0.0, 4e5, 2e-4, 2e4)[0] == tension(0.5, 1.0)[0]


def test_friction_is_taken_off_while_taut():
    assert hill_force(50.0, 0.1, 0.2, 0.0, 12.0, 300.0, 0.0, BRAID) == (38.0, 300.0)
    assert hill_force(50.0, 0.1, -0.2, 0.0, -12.0, 300.0, 0.0, BRAID) == (62.0, 300.0)
    # a slack muscle has none, and friction never makes a muscle push
    assert hill_force(-5.0, 0.1, -0.2, 0.0, -12.0, 300.0, 0.0, BRAID) == (0.0, 0.0)
    assert hill_force(50.0, 0.1, 0.2, 0.0, 80.0, 300.0, 0.0, BRAID) == (0.0, 0.0)
    for i in range(8):
        arguments = [50.0, -0.01, 0.2, 10.0, 5.0, 300.0, 40.0, BRAID]
        arguments[i] = math.nan
        assert any(map(math.isnan, hill_force(*arguments))), i


@pytest.mark.parametrize("taken", [40.0, 400.0])
def test_coefficient_is_the_slope_of_friction_that_the_static_force_holds_too(taken):
    # As of a friction in pressure: what the muscle carries changes with the rate, and the damper's bound too.
    def force(rate):
        return hill_force(60.0 - taken * rate, 0.1, rate, R * ABSOLUTE, 0.0, 0.0, taken, BRAID)

    for rate in np.linspace(-5.0, 0.1, 103):
        slope = _slope(lambda v: force(v)[0], rate, 1e-6)
        assert force(rate)[1] == pytest.approx(-slope, rel=1e-6)


# Reynolds 2003 and Serres 2009 as published: p in kPa, B in N·s/mm.
REYNOLDS = (1010.0, 6.91e-3, 0.0, 600.0, -8.03e-4, 600.0, -8.03e-4)
SERRES = (2900.0, 0.0, 372e3, 1570.0, 0.0, 311.0, 3.38e-3)


@pytest.mark.parametrize(
    ("set_", "pressure", "contracting", "relaxing"),
    [
        (REYNOLDS, 206.8e3, 1.01 + 0.00691 * 206.8, 0.6 - 0.000803 * 206.8),
        (REYNOLDS, 620.5e3, 1.01 + 0.00691 * 620.5, 0.6 - 0.000803 * 620.5),
        (SERRES, 200e3, 2.90, 1.57),
        (SERRES, 500e3, 2.90, 0.311 + 0.00338 * 500),
    ],
)
def test_three_element_damping_as_published(set_, pressure, contracting, relaxing):
    assert three_element_damping(pressure, 0.1, *set_) == pytest.approx(1000.0 * contracting, rel=1e-12)
    assert three_element_damping(pressure, -0.1, *set_) == pytest.approx(1000.0 * relaxing, rel=1e-12)
    # the sign error in circulation would give more than 1 N·s/mm while relaxing at 6 bar
    assert three_element_damping(6e5, -0.1, *REYNOLDS) < 200.0


def test_three_element_damping_never_feeds_energy():
    for pressure in np.linspace(0.0, 2e6, 41):
        for rate in (-1.0, 0.0, 1.0):
            assert three_element_damping(pressure, rate, *REYNOLDS) >= 0.0
    assert math.isnan(three_element_damping(math.nan, 1.0, *REYNOLDS))
    assert math.isnan(three_element_damping(1e5, math.nan, *REYNOLDS))
