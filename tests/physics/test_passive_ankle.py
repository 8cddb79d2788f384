"""Passive ankle moment: Riener & Edrich 1999 at the precision of a printed table, and its continuation."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.physics import passive_moment, passive_moments
from afo_sim.physics.passive_ankle import LOWER, UPPER, riener_edrich_1999

# The published formula, tabulated apart from this code: moment [N m] by ankle angle, dorsiflexion positive
# [deg], for three knee angles [deg]; text, so that each number carries its printed precision. One cell
# is corrected: at knee 30, ankle 20 the sheet has -24.3, but 1.792 - e^(2.1016 + 1.686 - 0.528) = -24.247.
ANKLE = (-40, -30, -20, -10, 0, 5, 10, 15, 20)
TABLE = {
    0: "2.35 1.26 0.29 -1.73 -6.39 -10.7 -17.2 -27.2 -42.4",
    30: "2.48 1.53 0.92 -0.28 -3.03 -5.56 -9.42 -15.3 -24.2",
    60: "2.57 1.69 1.28 0.57 -1.05 -2.54 -4.82 -8.28 -13.6",
}
REST_ANGLE = {0: -17.9, 30: -11.7, 60: -5.5}  # [deg]
STIFFNESS_AT_ZERO = {0: 39.5, 30: 23.3, 60: 13.7}  # [N m/rad]


def _moment(ankle_degrees, knee_degrees):
    return riener_edrich_1999(math.radians(ankle_degrees), math.radians(knee_degrees))


def _slope(ankle, knee, step=1e-6):
    """Finite difference of the moment [N m/rad]."""
    return (riener_edrich_1999(ankle + step, knee) - riener_edrich_1999(ankle - step, knee)) / (2.0 * step)


@pytest.mark.parametrize("knee", TABLE)
def test_printed_table(knee):
    for ankle, printed in zip(ANKLE, TABLE[knee].split(), strict=True):
        half_a_digit = 0.5 * 10.0 ** -len(printed.partition(".")[2])
        assert _moment(ankle, knee) == pytest.approx(float(printed), rel=0.0, abs=half_a_digit), ankle


@pytest.mark.parametrize("knee", REST_ANGLE)
def test_rest_angle_and_stiffness(knee):
    rest = brentq(lambda ankle: _moment(ankle, knee), -40.0, 20.0)
    assert round(rest, 1) == REST_ANGLE[knee]
    assert round(-_slope(0.0, math.radians(knee)), 1) == STIFFNESS_AT_ZERO[knee]


@pytest.mark.parametrize("knee", [math.radians(k) for k in TABLE])
@pytest.mark.parametrize(("end", "outward"), [(LOWER, -1.0), (UPPER, 1.0)])
def test_continues_linearly_outside_the_measured_range(knee, end, outward):
    assert round(math.degrees(end)) in (-40, 20)
    inside = _slope(end - outward * 1e-5, knee)
    # 1e-5 rad inside the end, the exponential's own curvature changes the slope by 1e-4 at most
    for distance in (1e-5, 0.1, 0.5, 2.0):
        assert _slope(end + outward * distance, knee) == pytest.approx(inside, rel=2e-4)
    just_in, just_out = (riener_edrich_1999(end + side * 1e-9, knee) for side in (-1.0, 1.0))
    assert just_out == pytest.approx(just_in, abs=1e-6)


@pytest.mark.parametrize("knee", [math.radians(k) for k in TABLE])
def test_a_passive_joint_pushes_back(knee):
    # Never a negative stiffness: a relaxed ankle has one rest angle and returns to it.
    moment = [riener_edrich_1999(ankle, knee) for ankle in np.radians(np.linspace(-90.0, 60.0, 1501))]
    assert np.all(np.diff(moment) < 0.0)


def test_bending_the_knee_unloads_the_calf():
    # The gastrocnemius crosses the knee: at 20° of dorsiflexion the moment falls from knee 0 to 60°.
    moments = [_moment(20.0, knee) for knee in np.linspace(0.0, 60.0, 13)]
    assert np.all(np.diff(moments) > 0.0)


@pytest.mark.parametrize("knee", REST_ANGLE)
def test_scale_and_offset_of_one_person(knee):
    # The offset moves the rest angle by as much, the scale leaves it and multiplies the stiffness.
    offset = math.radians(3.0)

    def moment(ankle):
        return passive_moment(ankle, math.radians(knee), 2.5, offset)

    rest = brentq(moment, math.radians(-35.0), math.radians(20.0))
    assert round(math.degrees(rest) - 3.0, 1) == REST_ANGLE[knee]
    stiffness = -(moment(offset + 1e-6) - moment(offset - 1e-6)) / 2e-6
    assert stiffness == pytest.approx(2.5 * STIFFNESS_AT_ZERO[knee], abs=2.5 * 0.05)
    assert passive_moment(0.2, 0.5, 0.0, offset) == 0.0


def test_nan_comes_out():
    arguments = (0.1, 0.2, 1.0, 0.0)
    for i in range(4):
        assert math.isnan(passive_moment(*arguments[:i], math.nan, *arguments[i + 1 :])), i


def test_many_angles_give_the_bits_that_each_gives_alone() -> None:
    random = np.random.default_rng(0)
    ankle, knee = random.uniform(LOWER - 0.4, UPPER + 0.6, 5000), random.uniform(0.0, 1.2, 5000)
    alone = [passive_moment(a, k, 1.3, 0.07) for a, k in zip(ankle.tolist(), knee.tolist(), strict=True)]
    assert passive_moments(ankle, knee, 1.3, 0.07).tolist() == alone
