"""Parts of Hill's muscle: the braid's own stiffness, the damper of the three-element model."""

import math

import numpy as np
import pytest

from afo_sim.physics import BRAID_BLEND, braid_force, three_element_damping

BRAID = 20e3  # [N]


def _slope(function, x, step):
    return (function(x + step) - function(x - step)) / (2.0 * step)


def test_nan_comes_out():
    assert math.isnan(braid_force(math.nan, BRAID))
    assert math.isnan(braid_force(-0.02, math.nan))
    for i in range(9):  # while contracting b0 and b1 act, while relaxing r0 and r1 or r2 and r3
        used = {True: (0, 1, 2, 3), False: (0, 1, 4, 5, 6)}
        for contracting in (True, False):
            arguments = [2e5, 0.1 if contracting else -0.1, *SERRES]
            arguments[i] = math.nan
            assert math.isnan(three_element_damping(*arguments)) == (i in used[contracting]), (i, contracting)


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


def test_braid_force_by_hand():
    # 2 % of stretch: half a blend less than 20 kN · 0.02 = 400 N
    assert braid_force(-0.02, BRAID) == pytest.approx(400.0 - 50.0, rel=1e-12)


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
