"""The shoe on the foot: its mass where it says, its toe bent with the toes, its drop in the ankle's zero."""

import math

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim.common import assets
from afo_sim.common.units import GRAVITY
from afo_sim.description.reader import load
from afo_sim.model.build import Built, build

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
        assert bare is not None and shod is not None
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
    assert bare is not None and shod is not None
    pitch = np.zeros(1)
    more = shod.gravity_moment(pitch) - bare.gravity_moment(pitch)
    assert more == pytest.approx(-0.35 * GRAVITY * 0.06, rel=1e-9)


def test_an_outsole_of_the_orthosis_is_worn_instead_of_the_shoe() -> None:
    built, without = walker("walk-dropfoot-afo"), walker("walk-dropfoot-afo", reference="barefoot")
    assert built.scenario.shoe is not None
    assert mujoco.mj_name2id(built.full_model, mujoco.mjtObj.mjOBJ_BODY, "shoe") < 0
    assert built.foot is not None and without.foot is not None
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
    adult = {"patient.body_height": "1.75 m"}  # the leg's own
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
    assert toes is not None
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
