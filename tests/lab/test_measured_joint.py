"""Torques measured on a pin knee: its path, the law on it, and one stiffness that predicts a test."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.lab import FITTINGS, KneeTest, knee_tests, paper_values, validation_knee
from afo_sim.lab.validation_knee import (
    law_force,
    path,
    posture,
    rigid_torque,
    torque,
)
from afo_sim.lab.validation_row import Row

# Typed from the author's files: points, largest and mean torque [N·m], first and last (angle [deg], torque).
READ = {
    "48": (90, 17.3, 9.59, (-5.5, -13.55), (-2.0, -16.16)),
    "46": (36, 22.77, 8.92, (-41.0, -17.62), (-26.5, -19.34)),
    "47": (18, 17.07, 10.67, (-63.4, -1.99), (-4.9, -9.93)),
    "40t": (19, 20.2, 8.57, (-113.5, -0.05), (-29.2, -19.95)),
    "41": (22, 23.04, 10.01, (-103.9, -2.46), (-63.0, -18.98)),
}
# By a separate computation on the same points [N·m], [kN/m].
ONE_STIFFNESS = {"48": 2.26, "46": 2.29, "47": 2.28, "40t": 1.17, "41": 1.55}
LEFT_OUT = {"48": 14.44, "46": 11.86, "47": 12.88, "40t": 12.9, "41": 13.0}
PROFILE = {  # stiffness [kN/m] → RMS of 48, 46, 47, 40t, 41
    6.0: (3.0, 4.2, 3.7, 3.3, 3.3),
    9.0: (2.3, 3.1, 2.7, 1.9, 2.0),
    18.0: (2.7, 1.8, 2.5, 1.9, 2.2),
    25.0: (3.3, 1.7, 3.2, 3.1, 3.3),
    40.0: (4.3, 2.1, 4.2, 5.0, 5.0),
}


def rms(errors: np.ndarray) -> float:
    return math.sqrt(float(np.mean(np.square(errors))))


def printed_force(test: KneeTest, kappa: float, pressure: float) -> float:
    """The law as it is printed: l0 and lengths in m, kPa over 620."""
    l0 = test.muscle.nominal_length
    l620 = {"48": 0.398, "46": 0.380, "47": 0.403, "40t": 0.338, "41": 0.335}[test.name]
    eps = kappa / ((l0 - l620) / l0)
    bracket = 0.5682 * (math.exp(-4.254 * eps) - 1.0) + pressure / 620e3 * math.exp(-0.5597 * eps**2)
    return 303.5 * math.atan(19.03 * (l0 - 0.0075)) * bracket


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    told = [one for one in paper_values.validated() if "knee" in one.get("by", "")]
    return [row for one in told for row in paper_values.rows_of(one)]


def test_path_is_that_of_the_knee() -> None:
    """Lengths and arms from the author's coordinates, by hand."""
    length, arm = path(np.radians([0.0, -60.0, -120.0]))
    assert 1e3 * length == pytest.approx([541.60, 475.16, 434.88], abs=5e-3)
    assert 1e3 * arm == pytest.approx([52.48, 63.31, 3.82], abs=5e-3)
    angle = np.radians(np.linspace(-120.0, 20.0, 29))
    slope = (path(angle + 1e-6)[0] - path(angle - 1e-6)[0]) / 2e-6
    assert path(angle)[1] == pytest.approx(slope, abs=1e-8)


def test_points_are_those_that_were_read() -> None:
    tests = knee_tests()
    assert sum(map(len, tests.values())) == 185
    for name, (count, largest, mean, first, last) in READ.items():
        test = tests[name]
        assert len(test) == count
        assert np.abs(test.torque).max() == pytest.approx(largest, abs=5e-3)
        assert np.abs(test.torque).mean() == pytest.approx(mean, abs=1e-2)  # of rounded points, and rounded
        for k, (degrees, moment) in ((0, first), (-1, last)):
            assert (np.degrees(test.angle[k]), test.torque[k]) == pytest.approx((degrees, moment), abs=1e-9)
        assert test.pressure.min() >= 605e3
        assert test.pressure.max() <= 626e3
        slipped = path(test.angle)[0] - FITTINGS - test.tendon - test.length
        assert slipped.min() > 8e-3  # the muscle is shorter than its path says, at every point
        assert slipped.max() < 43.1e-3


def test_force_is_the_printed_formula() -> None:
    for test in knee_tests().values():
        kappa = posture(test)[0]
        expected = [printed_force(test, k, p) for k, p in zip(kappa, test.pressure, strict=True)]
        assert law_force(test, kappa) == pytest.approx(np.maximum(expected, 0.0), rel=1e-12, abs=1e-9)


def balanced(test: KneeTest, k: int, stiffness: float, offset: float) -> float:
    """Contraction at which the printed law and the spring agree, by another solver."""
    l0 = test.muscle.nominal_length
    room = path(test.angle)[0][k] - FITTINGS - test.tendon - offset

    def excess(kappa: float) -> float:
        pull = stiffness * max(room - l0 * (1.0 - kappa), 0.0)
        return printed_force(test, kappa, test.pressure[k]) - pull

    return float(brentq(excess, -0.1, 0.5, xtol=1e-14))


def test_tension_balances_the_spring() -> None:
    for test in knee_tests().values():
        for stiffness, offset in ((12.9e3, 0.0), (21.6e3, 7.5e-3), (1e5, 0.0)):
            found = torque(test, stiffness, offset)
            for k in range(0, len(test), 5):
                kappa = balanced(test, k, stiffness, offset)
                if kappa > 0.0:
                    tension = max(printed_force(test, kappa, test.pressure[k]), 0.0)
                    assert found[k] == pytest.approx(-tension * path(test.angle)[1][k], abs=1e-6)


def test_no_muscle_is_stretched_behind_one_stiffness() -> None:
    """The fit does not hang on what a stretched muscle does."""
    for test in knee_tests().values():
        assert min(balanced(test, k, 12.9e3, 0.0) for k in range(len(test))) > 0.0
    stretched = [int(np.sum(posture(test)[0] < 0.0)) for test in knee_tests().values()]
    assert sum(stretched) == 31


def test_a_stiff_spring_is_rigid_and_a_long_path_pulls_no_more_than_the_law() -> None:
    for test in knee_tests().values():
        shortened = posture(test)[0] > 0.01
        stiff = torque(test, 1e9)[shortened]
        assert stiff == pytest.approx(rigid_torque(test)[shortened], abs=2e-3)
        assert np.all(np.abs(torque(test, 12.9e3)) <= np.abs(rigid_torque(test)) + 1e-9)


def test_one_stiffness_errs_as_computed_separately() -> None:
    stiffness = validation_knee.fit(tuple(t for n, t in knee_tests().items() if n != "47"))[0]
    for name, test in knee_tests().items():
        assert rms(torque(test, stiffness) - test.torque) == pytest.approx(ONE_STIFFNESS[name], abs=0.01)
    for kilo, expected in PROFILE.items():
        errors = [rms(torque(test, 1e3 * kilo) - test.torque) for test in knee_tests().values()]
        assert errors == pytest.approx(expected, abs=0.06)  # told to 0.1


def test_leaving_one_test_out_hardly_moves_the_stiffness() -> None:
    for name, expected in LEFT_OUT.items():
        stiffness, offset = validation_knee.fit(tuple(t for n, t in knee_tests().items() if n != name))
        assert 1e-3 * stiffness == pytest.approx(expected, abs=0.05)
        assert offset == 0.0


def test_offset_and_stiffness_are_not_told_apart() -> None:
    """Two pairs of numbers that differ by far predict alike."""
    four = tuple(t for n, t in knee_tests().items() if n != "47")
    stiffness, offset = validation_knee.fit(four, offset=True)
    assert 1e-3 * stiffness == pytest.approx(21.6, abs=0.05)
    assert 1e3 * offset == pytest.approx(7.5, abs=0.05)
    left_out = knee_tests()["47"]
    both = rms(torque(left_out, stiffness, offset) - left_out.torque)
    alone = rms(torque(left_out, validation_knee.fit(four)[0]) - left_out.torque)
    assert both == pytest.approx(alone, abs=0.02)


def test_the_law_is_right_where_its_muscle_was_measured() -> None:
    for test in knee_tests().values():
        assert rms(rigid_torque(test, measured=True) - test.torque) < 2.2
        assert np.mean(test.moment_arm - path(test.angle)[1]) > 8e-3  # the bracket bends away from the pin


def test_bound_is_what_one_angle_reads_on_two_ways(rows: list[Row]) -> None:
    """Test 47 goes up with its first eleven points and down with the rest."""
    test = knee_tests()["47"]
    up = np.argsort(test.angle[:11])
    on_the_way_up = np.interp(test.angle[11:], test.angle[:11][up], test.torque[:11][up])
    inside = test.angle[11:] < test.angle[:11].max()
    apart = np.abs(on_the_way_up - test.torque[11:])[inside].max()
    assert apart == pytest.approx(2.55, abs=0.01)
    (bound,) = (row.tolerance for row in rows if "which the fit did not see" in row.quantity)
    assert apart + 0.05 == pytest.approx(bound, abs=0.01)


def test_rows_hold_what_is_asked(rows: list[Row]) -> None:
    assert all(row.passed and (row.expected is None or "not printed" in row.sourcing) for row in rows)
    rigid = {r.quantity.split(",")[0]: r for r in rows if r.quantity.endswith("rigid anchors: RMS")}
    assert [r.expected for r in rigid.values()] == [7.57, 4.55, 7.67, 13.61, 12.04]
    assert all(abs(r.error or math.nan) <= 0.3 for r in rigid.values())
    (predicted,) = (r for r in rows if "which the fit did not see" in r.quantity)
    assert predicted.error is not None
    assert (predicted.points, predicted.error) == (18, pytest.approx(2.28, abs=0.01))
