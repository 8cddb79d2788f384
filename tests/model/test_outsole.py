"""Points of the outsole of foot, shoe and orthosis, and the shoe as a body, against sums by hand."""

import math

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim.common import GRAVITY, assets
from afo_sim.description import Outsole, load
from afo_sim.model import Built, Foot
from afo_sim.model.build import build
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


def test_the_model_stands_on_what_is_worn() -> None:
    """Sites of the compiled model, and the path of the ankle above the floor."""
    bare, shod = walker(**SIZE), walker(shoe="trainer", **SIZE)
    assert bare.foot.points == pytest.approx(
        {name: pytest.approx(point, abs=1e-9) for name, point in BARE.items()}
    )
    sides = [
        shod.full_model.site(f"{side}{name}").pos[1] for side in ("", "sole_") for name in ("heel", "ball")
    ]
    assert sides[:2] == sides[2:]
    raised = shod.foot.ankle_height - bare.foot.ankle_height
    assert 0.024 < raised < 0.030  # 30 mm under the heel, 20 under the ball: some 26.7 under the ankle
    assert (shod.walk.pose[:, 1] - bare.walk.pose[:, 1]).mean() == pytest.approx(raised, abs=2e-3)
    assert shod.walk.ankle - bare.walk.ankle == pytest.approx(
        np.full(len(bare.walk.ankle), shod.foot.level), abs=1e-12
    )


SHORT = {"duration": "3 s"}
SHOES = assets.names("shoe")


def walker(scenario: str = "walk-dropfoot", **sets: object) -> Built:
    return build(load("scenario", scenario, sets))


def test_a_foot_and_its_shoe_are_one_body_by_steiner() -> None:
    """Mass, first moment and inertia about the ankle add up, for a heavier and taller person too."""
    for heavier, taller in ((1.0, 1.0), (1.3, 1.1)):
        who = {"patient.body_mass": f"{75.0 * heavier} kg", "patient.body_height": f"{1.75 * taller} m"}
        bare, shod = walker(**who).foot, walker(shoe="leather", **who).foot
        shoe = load("shoe", "leather")
        mass, (x, z) = heavier * shoe.mass, taller * np.array(shoe.centre)
        assert shod.mass - bare.mass == pytest.approx(mass, rel=1e-9)
        moment = shod.mass * np.array(shod.centre) - bare.mass * np.array(bare.centre)
        assert moment == pytest.approx([mass * x, mass * z], abs=1e-9)
        own = heavier * taller**2 * shoe.inertia
        assert shod.inertia - bare.inertia == pytest.approx(own + mass * (x**2 + z**2), rel=1e-6)


def test_a_person_of_another_mass_shares_the_compiled_model_and_not_the_shoe() -> None:
    """The model that is shared is the one that is compiled for that person alone."""
    for mass in ("60 kg", "75 kg", "110 kg"):
        built = walker(shoe="trainer", **{"patient.body_mass": mass})
        full, own = built.full_model, built.model
        assert own.body("shoe").mass == pytest.approx(full.body("shoe").mass, rel=1e-9)
        assert own.body("shoe").inertia == pytest.approx(full.body("shoe").inertia, rel=1e-9)


def test_the_shoes_weight_hangs_on_the_ankle() -> None:
    """0.35 kg, 6 cm ahead: 0.21 N·m."""
    adult = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}  # the leg's own
    bare, shod = walker(**adult).foot, walker(shoe="trainer", **adult).foot
    pitch = np.zeros(1)
    more = shod.gravity_moment(pitch) - bare.gravity_moment(pitch)
    assert more == pytest.approx(-0.35 * GRAVITY * 0.06, rel=1e-9)


def test_an_outsole_of_the_orthosis_is_worn_instead_of_the_shoe() -> None:
    outsole = {"heel_stack": "22 mm", "ball_stack": "22 mm"}
    sets = SIZE | {"shoe": "trainer", "orthosis.outsole": outsole}
    built, without = walker("walk-dropfoot-afo", **sets), walker("walk-dropfoot-afo", **sets | {"shoe": None})
    assert mujoco.mj_name2id(built.full_model, mujoco.mjtObj.mjOBJ_BODY, "shoe") < 0
    assert built.foot.points["heel"] == pytest.approx((-0.06, -0.09))
    assert built.foot.level == 0.0
    assert built.foot.mass == without.foot.mass


@pytest.mark.parametrize("name", SHOES)
def test_shapes_weigh_nothing_and_touch_nothing(name: str) -> None:
    built = walker(shoe=name)
    full = built.full_model
    drawn = [g for g in range(full.ngeom) if full.geom(g).name.startswith("shoe_")]
    assert len(drawn) >= 6
    assert not full.geom_contype[drawn].any() and not full.geom_conaffinity[drawn].any()
    assert full.body_mass.sum() == pytest.approx(built.model.body_mass.sum(), rel=1e-12)
    assert built.model.ngeom == 0


@pytest.mark.parametrize("name", SHOES)
def test_the_drawn_sole_ends_at_the_outsoles_points(name: str) -> None:
    """Heel to ball on the foot, pulp to tip on the toes, which turn by the hinge's angle."""
    model = walker(shoe=name).full_model
    data = mujoco.MjData(model)
    for angle in (0.0, 0.5):
        data.joint("toe").qpos[0] = angle
        mujoco.mj_kinematics(model, data)
        for geom, points in (("shoe_sole", ("heel", "ball")), ("shoe_tip", ("pulp", "tip"))):
            box = model.geom(geom).id
            ends = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0]]) * model.geom_size[box]
            space = ends @ data.geom_xmat[box].reshape(3, 3).T + data.geom_xpos[box]
            sites = np.array([data.site(f"sole_{point}").xpos for point in points])
            assert space[:, [0, 2]] == pytest.approx(sites[:, [0, 2]], abs=1e-9)


@pytest.mark.parametrize("name", SHOES)
def test_a_healthy_walker_keeps_the_recorded_sole(name: str) -> None:
    """The outsole goes as the recorded sole does: the foot in it stands steeper by the drop's angle."""
    shoe = load("shoe", name)
    # the leg's own height, and the path as it was recorded
    adult = {"patient.body_height": "1.75 m", "ground.mode": "recorded"}
    bare, shod = (afo_sim.run("walk-healthy", SHORT | adult | sets) for sets in ({}, {"shoe": name}))
    model = walker(shoe=name, **adult).full_model
    heel, ball = (model.site(f"sole_{point}").pos for point in ("heel", "ball"))
    turn = math.atan2(ball[2] - heel[2], ball[0] - heel[0])
    assert turn == pytest.approx((shoe.heel_stack - shoe.ball_stack) / (ball[0] - heel[0]), rel=0.01)
    assert shod["ankle/angle"] - bare["ankle/angle"] == pytest.approx(-turn, abs=math.radians(0.05))
    flat = (shod["gait/phase"] > 0.2) & (shod["gait/phase"] < 0.3)
    assert np.abs(shod["heel/height"] - bare["heel/height"])[flat].max() < 1e-3


def test_a_stiff_sole_bends_less_at_push_off_as_told() -> None:
    """Peak extension, 60° barefoot: 45 to 50 in soft, 25 to 30 in stiff shoes (Bojsen-Møller, Lamoreux 1979).

    The moment and the toes' own rest angle are the same in all of them.
    """
    toes = load("leg", "adult_75kg").toes
    for name, low, high in (("trainer", 45.0, 50.0), ("leather", 25.0, 30.0), ("rocker", 25.0, 30.0)):
        left = 60.0 * toes.stiffness / (toes.stiffness + load("shoe", name).toe_stiffness)
        assert low <= left <= high


def test_a_plate_that_nobody_can_stand_on_is_told() -> None:
    """An orthosis with a plate and no outsole: the foot goes as if there were no plate."""
    told = load("scenario", "walk-dropfoot-afo")
    orthosis = told.orthosis.with_values(outsole=None)
    built = build(told.with_values(orthosis=orthosis, reference=None))
    assert [warning for warning in built.warnings if "no [outsole]" in warning]
    assert not [warning for warning in build(told).warnings if "no [outsole]" in warning]
    assert built.foot is not None and built.foot.mass > 1.09 + 0.55 + 0.35  # the shoe is worn with the plate
