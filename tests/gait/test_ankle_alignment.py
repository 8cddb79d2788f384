"""The recorded ankle is brought to a leg's: along the shank, and vertically by soles."""

import dataclasses

import numpy as np
import pytest
from gait_lab.rigid_leg import BALL, FLAT, HEEL, RigidLeg

from afo_sim.common import GRAVITY, assets
from afo_sim.gait import KINEMATICS, GaitCycle, examine, fit_to_leg
from afo_sim.gait import file as gait
from afo_sim.gait.ankle_alignment import standing_height

OUTSOLE = (HEEL, BALL)
TRUE = RigidLeg().recorded()  # about the axis itself


NAMES = ("shank_angle", "ankle_angle", "ankle_z")


def lowest(
    cycle: GaitCycle, outsole: tuple[tuple[float, float], ...] = OUTSOLE, *, walked: bool = False
) -> np.ndarray:
    """Height of the lowest point of the outsole above the floor where flat, in samples or as walked [m]."""
    found = (cycle.signal(n, cycle.phase) if walked else getattr(cycle, n) for n in NAMES)
    shank, ankle, height = (values[cycle.foot_flat()] for values in found)
    pitch = ankle - shank
    points = [height + x * np.sin(pitch) + z * np.cos(pitch) for x, z in outsole]
    return np.min(points, axis=0)


@pytest.mark.parametrize("marker", [0.03, 0.012, -0.015])
def test_a_marker_along_the_shank_is_put_back_and_its_moment_with_it(marker: float) -> None:
    recorded = RigidLeg(marker=marker).recorded()
    placed = fit_to_leg(recorded, OUTSOLE)
    assert placed.along == pytest.approx(-marker, abs=1e-4)
    assert placed.vertical == 0.0
    for name in ("ankle_x", "ankle_z", "cop_x"):
        found, true = getattr(placed.cycle, name), getattr(TRUE, name)
        assert np.allclose(found, true, atol=1e-4, equal_nan=True), name
    peak = np.abs(TRUE.ankle_moment).max()
    assert np.abs(placed.cycle.ankle_moment - TRUE.ankle_moment).max() < 1e-3 * peak
    assert np.abs(recorded.ankle_moment - TRUE.ankle_moment).max() > 5.0 * abs(marker) / 0.03 * 1e-2 * peak
    flat = placed.cycle.foot_flat()
    assert placed.cycle.ankle_height == pytest.approx(TRUE.ankle_z[flat].mean(), abs=1e-4)
    assert placed.cycle.ankle_height == pytest.approx(-HEEL[1], abs=5e-4)  # its ends turn by 1 deg


@pytest.mark.parametrize("told", ["by the cycle", "by the caller"])
def test_a_walker_in_a_sole_is_lowered_vertically(told: str) -> None:
    recorded = RigidLeg(sole=0.025).recorded()
    if told == "by the cycle":
        placed = fit_to_leg(dataclasses.replace(recorded, sole_thickness=0.025), OUTSOLE)
    else:
        placed = fit_to_leg(dataclasses.replace(recorded, sole_thickness=0.1), OUTSOLE, sole_thickness=0.025)
    assert placed.vertical == -0.025
    assert placed.along == pytest.approx(0.0, abs=1e-4)
    assert np.allclose(placed.cycle.ankle_x, recorded.ankle_x, atol=1e-4)
    assert np.allclose(placed.cycle.ankle_z, recorded.ankle_z - 0.025, atol=1e-4)
    change = placed.cycle.ankle_moment - recorded.ankle_moment  # of the horizontal force alone
    assert np.allclose(change, 0.025 * recorded.grf_x * GRAVITY, atol=1e-3)
    assert placed.cycle.sole_thickness == 0.0


def test_marker_and_sole_are_told_apart() -> None:
    recorded = RigidLeg(marker=0.03, sole=0.025).recorded()
    placed = fit_to_leg(recorded, OUTSOLE, sole_thickness=0.025)
    assert placed.along == pytest.approx(-0.03, abs=1e-4)
    assert (
        np.abs(placed.cycle.ankle_moment - TRUE.ankle_moment).max() < 1e-3 * np.abs(TRUE.ankle_moment).max()
    )


def test_a_shoe_lifts_the_body_and_does_not_move_the_axis() -> None:
    """The same walker barefoot and in a shoe: along the shank alike, and 26 mm higher."""
    recorded = RigidLeg(marker=0.03).recorded()
    shod = tuple((x, z - 0.026) for x, z in OUTSOLE)
    bare, placed = fit_to_leg(recorded, OUTSOLE), fit_to_leg(recorded, shod, stack=0.026)
    assert placed.along == pytest.approx(bare.along, abs=1e-4)
    assert placed.vertical == 0.026
    assert placed.cycle.ankle_z == pytest.approx(bare.cycle.ankle_z + 0.026, abs=1e-4)
    assert placed.cycle.ankle_x == pytest.approx(bare.cycle.ankle_x, abs=1e-4)
    assert lowest(placed.cycle, shod) == pytest.approx(0.0, abs=1e-4)


def test_an_equinus_of_25_degrees_does_not_sink() -> None:
    """It stands on its ball, which a height of the flat foot alone would put 5 cm into the floor."""
    recorded = RigidLeg(equinus=np.radians(25.0), marker=0.03).recorded()
    placed = fit_to_leg(recorded, OUTSOLE)
    flat = placed.cycle.foot_flat()
    assert recorded.flat.steady
    assert lowest(placed.cycle) == pytest.approx(0.0, abs=2e-4)
    assert placed.along == pytest.approx(-0.03, abs=2e-4)
    sunk = recorded.ankle_z - recorded.ankle_z[flat].mean() - HEEL[1]
    pitch = np.radians(-25.0)
    ball = sunk[flat] + BALL[0] * np.sin(pitch) + BALL[1] * np.cos(pitch)
    assert ball.mean() == pytest.approx(-0.044, abs=0.001)


def test_an_outsole_with_a_drop_stands_where_its_own_slope_is_level() -> None:
    """A heel 10 mm thicker than the ball: pitch 0 is where both touch, after the ankle's zero has moved."""
    heel, ball = (HEEL[0], HEEL[1] - 0.030), (BALL[0], BALL[1] - 0.020)
    level = -np.arctan2(ball[1] - heel[1], ball[0] - heel[0])
    recorded = RigidLeg(marker=0.03).recorded()
    moved = dataclasses.replace(recorded, ankle_angle=recorded.ankle_angle + level)
    under = 0.030 - 0.010 * HEEL[0] / (HEEL[0] - BALL[0])  # thickness under the ankle
    placed = fit_to_leg(moved, (heel, ball), stack=under)
    assert placed.along == pytest.approx(-0.03, abs=3e-4)
    still = (placed.cycle.phase >= FLAT[0]) & (placed.cycle.phase <= FLAT[1])
    pitch = placed.cycle.foot_pitch()[still]
    for x, z in (heel, ball):
        height = placed.cycle.ankle_z[still] + x * np.sin(pitch) + z * np.cos(pitch)
        assert height == pytest.approx(0.0, abs=3e-4)


def test_standing_height_is_that_of_the_lowest_point() -> None:
    pitch = np.radians([-20.0, 0.0, 20.0])
    found = standing_height(((-0.1, -0.05), (0.2, -0.05)), pitch)
    low = 0.05 * np.cos(np.radians(20.0))
    expected = [0.2 * np.sin(np.radians(20.0)) + low, 0.05, 0.1 * np.sin(np.radians(20.0)) + low]
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("name", ["gatk_stride1", "gatk_stride2"])
def test_shipped_stride_is_placed(name: str) -> None:
    cycle = gait.read(assets.find_gait(name))
    placed = fit_to_leg(cycle, OUTSOLE)
    assert lowest(placed.cycle, walked=True).mean() == pytest.approx(0.0, abs=1e-4)
    # its moment is the ground's about the new point, as exactly as it was about the old one
    before, after = (c.ankle_moment - c.ground_moment() for c in (cycle, placed.cycle))
    stood = np.isfinite(cycle.cop_x)
    assert np.allclose(before[stood], after[stood], atol=1e-12)
    examine(placed.cycle)
    for kept in ("shank_angle", "knee_angle", "ankle_angle"):
        assert placed.cycle.series[kept] is cycle.series[kept]
    anew = dataclasses.replace(placed.cycle).series
    for each in KINEMATICS:
        assert placed.cycle.signal(each, 0.37) == pytest.approx(float(anew[each](0.37)), abs=1e-12)
    assert placed.cycle.notes["ankle_shift_along_shank_m"] == f"{placed.along:.4f}"


def test_the_moment_changes_by_that_of_the_force_about_the_way_between_both_points() -> None:
    placed = fit_to_leg(RigidLeg(marker=0.03).recorded(), OUTSOLE).cycle
    recorded = RigidLeg(marker=0.03).recorded()
    way = np.column_stack([placed.ankle_x - recorded.ankle_x, placed.ankle_z - recorded.ankle_z])
    force = np.column_stack([recorded.grf_x, recorded.grf_z]) * GRAVITY
    expected = way[:, 0] * force[:, 1] - way[:, 1] * force[:, 0]  # r × F, dorsiflexion positive
    assert placed.ankle_moment - recorded.ankle_moment == pytest.approx(expected, abs=1e-12)
    assert FLAT[0] <= placed.flat.start + 0.02 <= placed.flat.end <= FLAT[1] + 0.06
