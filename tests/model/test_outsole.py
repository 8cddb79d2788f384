"""Points of the outsole, and how the foot stands on them."""

import numpy as np
import pytest

from afo_sim.description.leg import Outsole
from afo_sim.description.reader import load
from afo_sim.model.build import Built, build
from afo_sim.model.foot import Foot
from afo_sim.model.outsole import outsole_points

BARE = {"heel": (-0.06, -0.068), "ball": (0.12, -0.068), "pulp": (0.175, -0.068), "tip": (0.19, -0.060)}


def sole(**changed: float) -> Outsole:
    told = {"heel_stack": 0.03, "ball_stack": 0.02} | changed
    return Outsole.model_validate({name: f"{value} m" for name, value in told.items()})


def standing(points: dict[str, tuple[float, float]]) -> Foot:
    return Foot(1.0, (0.0, 0.0), 0.01, points)


def test_barefoot_stands_on_its_own_points() -> None:
    assert outsole_points(BARE, None) == BARE
    assert standing(BARE).level == 0.0
    assert standing(BARE).ankle_height == pytest.approx(0.068)


def test_an_even_sole_raises_the_ankle_by_its_thickness() -> None:
    points = outsole_points(BARE, sole(heel_stack=0.022, ball_stack=0.022))
    assert standing(points).level == 0.0
    assert standing(points).ankle_height == pytest.approx(0.09)


def test_a_drop_turns_the_foot_toe_down() -> None:
    """10 mm over 180 mm: 3.18 deg. Heel and ball are then level."""
    foot = standing(outsole_points(BARE, sole()))
    assert np.degrees(foot.level) == pytest.approx(-np.degrees(np.arctan(0.010 / 0.180)))
    turned = foot.outsole(np.array(foot.level))
    assert turned["heel"][1] == pytest.approx(turned["ball"][1], abs=1e-15)
    # of the ankle from the straight line through both ends of the outsole
    (x1, z1), (x2, z2) = (-0.06, -0.098), (0.12, -0.088)
    distance = abs((x2 - x1) * z1 - (z2 - z1) * x1) / np.hypot(x2 - x1, z2 - z1)
    assert foot.ankle_height == pytest.approx(distance)


def test_toe_spring_lifts_the_tip_above_the_floor_and_the_ends_reach_farther() -> None:
    points = outsole_points(BARE, sole(heel_stack=0.02, toe_spring=0.015, tip_ahead=0.012, heel_behind=0.005))
    assert points["tip"] == pytest.approx((0.202, -0.088 + 0.015))
    assert points["heel"] == pytest.approx((-0.065, -0.088))
    share = (0.175 - 0.12) / (0.202 - 0.12)
    assert points["pulp"] == pytest.approx((0.175, -0.088 + 0.015 * share**2))


def test_a_shoe_grows_with_its_wearer() -> None:
    tall = {name: (1.1 * x, 1.1 * z) for name, (x, z) in BARE.items()}
    big = outsole_points(tall, sole(toe_spring=0.01), 1.1)
    small = outsole_points(BARE, sole(toe_spring=0.01))
    for name, (x, z) in small.items():
        assert big[name] == pytest.approx((1.1 * x, 1.1 * z))


SIZE = {"duration": "1.3 s", "patient.body_height": "1.75 m", "patient.body_mass": "75 kg"}  # the leg's own


def walker(**sets: object) -> Built:
    return build(load("scenario", "walk-dropfoot", SIZE | sets))


def test_the_model_stands_on_what_is_worn() -> None:
    """Sites of the compiled model, and the path of the ankle above the floor."""
    bare, shod = walker(), walker(shoe="trainer")
    assert bare.foot is not None and shod.foot is not None and bare.walk is not None and shod.walk is not None
    assert bare.foot.points == pytest.approx(
        {name: pytest.approx(point, abs=1e-9) for name, point in BARE.items()}
    )
    raised = shod.foot.ankle_height - bare.foot.ankle_height
    assert 0.024 < raised < 0.030  # 30 mm under the heel, 20 under the ball: some 26.7 under the ankle
    assert (shod.walk.pose[:, 1] - bare.walk.pose[:, 1]).mean() == pytest.approx(raised, abs=2e-3)
    assert shod.walk.ankle - bare.walk.ankle == pytest.approx(
        np.full(len(bare.walk.ankle), shod.foot.level), abs=1e-12
    )


def test_an_orthosis_with_an_outsole_is_worn_instead_of_the_shoe() -> None:
    outsole = {"heel_stack": "22 mm", "ball_stack": "22 mm"}
    sets = SIZE | {"shoe": "trainer", "orthosis.outsole": outsole}
    worn = build(load("scenario", "walk-dropfoot-afo", sets)).foot
    assert worn is not None
    assert worn.points["heel"] == pytest.approx((-0.06, -0.09))
    assert worn.level == 0.0
