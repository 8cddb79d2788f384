"""The floor under the sole: the pads' kernel, the pads in the model, the floor's registration."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from afo_sim import native
from afo_sim.common import GRAVITY
from afo_sim.description import load
from afo_sim.model import POINTS, SOLE, Built, walking_start
from afo_sim.model.build import build
from afo_sim.model.contact import pad_stiffness, shares, standing
from afo_sim.model.muscle_weakness import ground_moment
from afo_sim.model.supply_and_timer import controls
from afo_sim.physics import pad_force


def contact_built() -> Built:
    own_size = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}  # the leg's
    return build(load("scenario", "walk-healthy", {"ground.mode": "contact", "duration": "3.7 s"} | own_size))


# ---- the kernel


def test_a_pad_is_a_spring_at_rest_and_never_pulls() -> None:
    assert pad_force(0.0, -0.01, 0.0, 5e4, 1.0)[0] == pytest.approx(500.0)
    assert pad_force(0.0, 0.01, -3.0, 5e4, 1.0)[0] == 0.0
    rng = np.random.default_rng(2)
    for floor, height, velocity in rng.uniform(-3.0, 3.0, (500, 3)):
        force, damping = pad_force(floor, height, velocity, 5e4, 1.0)
        assert force >= 0.0
        assert damping >= 0.0
        ahead, behind = (pad_force(floor, height, velocity + v, 5e4, 1.0)[0] for v in (1e-6, -1e-6))
        if abs(1.0 - velocity) > 1e-5:
            assert (behind - ahead) / 2e-6 == pytest.approx(damping, rel=1e-6, abs=1e-4)


def test_a_mass_dropped_on_a_pad_comes_back_slower() -> None:
    """Restitution by the first integral of m v̇ = k d (1 + c ḋ): ln((1 + c v)/(1 − c u)) = c (v + u)."""
    c, v = 1.0, 0.3

    def rhs(t: float, y: np.ndarray) -> list[float]:
        return [y[1], pad_force(0.0, y[0], y[1], 5e4, c)[0] / 2.0]

    found = solve_ivp(rhs, (0.0, 0.1), [0.0, -v], rtol=1e-10, atol=1e-12, max_step=1e-4)
    u = found.y[1, -1]
    assert 0.0 < u < v
    assert math.log((1.0 + c * v) / (1.0 - c * u)) == pytest.approx(c * (v + u), rel=1e-5)


@pytest.mark.parametrize("place", range(5))
def test_a_pad_does_not_hide_what_is_no_number(place: int) -> None:
    for above in (-0.01, 0.01):
        arguments = [0.0, above, 0.1, 5e4, 1.0]
        arguments[place] = math.nan
        assert math.isnan(pad_force(*arguments)[0])


# ---- the pads in the model


def test_pads_push_straight_up_at_the_points_of_the_sole() -> None:
    built = contact_built()
    model, data = built.model, mujoco.MjData(built.model)
    data.qpos[:] = [0.3, 0.05, 0.01, 0.4, -0.3, 0.2]
    data.qvel[:] = [0.8, -0.2, 0.1, 1.5, -2.5, 3.0]
    data.ctrl[[built.index.walking[f"pad_{p}"] for p in POINTS]] = 0.1  # the floor's height
    with native.installed():
        mujoco.mj_forward(model, data)
    whole = np.zeros(model.nv)
    jacobian = np.zeros((3, model.nv))
    dense = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        dense, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    for point in POINTS:
        pad, site = built.index.walking[f"pad_{point}"], model.site(f"{SOLE}{point}").id
        mujoco.mj_jacSite(model, data, jacobian, None, site)
        z, speed = data.site_xpos[site, 2], jacobian[2] @ data.qvel
        assert data.actuator_length[pad] == pytest.approx(z, abs=1e-12)
        assert data.actuator_velocity[pad] == pytest.approx(speed, abs=1e-12)
        assert built.foot is not None
        stiffness = pad_stiffness(built.scenario.ground, built.foot)[point]
        force = pad_force(0.1, z, speed, stiffness, 1.0)[0]
        assert data.actuator_force[pad] == pytest.approx(force, rel=1e-12)
        whole += jacobian.T @ [0.0, 0.0, force]
        assert dense[pad] == pytest.approx(jacobian[2], abs=1e-12)
    assert whole[4] > 1.0  # the ankle
    assert whole[5] > 1.0  # the toes


def test_a_rigid_foots_toe_pad_is_the_toe_joint_over_its_lever() -> None:
    """25 N·m/rad, 55 mm from the ball; toes that bend have pads like the others."""
    built = contact_built()
    assert built.foot is not None
    ground = built.scenario.ground
    assert pad_stiffness(ground, built.foot) == dict.fromkeys(POINTS, 5e4)
    rigid = dataclasses.replace(built.foot, toes=None)
    expected = {"heel": 5e4, "ball": 5e4, "pulp": 25.0 / 0.055**2}
    assert pad_stiffness(ground, rigid) == pytest.approx(expected)


def test_a_pads_force_is_its_law_whatever_its_gain_was_told() -> None:
    built = contact_built()
    model, data = built.model, mujoco.MjData(built.model)
    with native.installed():
        start = walking_start(built, controls(built, 1)[0])
    mujoco.mj_setState(model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
    pads = [built.index.walking[f"pad_{p}"] for p in POINTS]
    data.ctrl[pads] = 0.2  # the floor, above all of them
    forces = []
    with native.installed():
        for left in (0.0, 77.0, 4e3):
            data.act[model.actuator_actadr[pads]] = left  # N·s/m that the gain carries
            mujoco.mj_forward(model, data)
            forces.append(data.actuator_force[pads].copy())
    assert forces[0].min() > 100.0
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    assert forces[2] == pytest.approx(forces[0], rel=1e-9)


# ---- the registration


def test_the_force_is_shared_by_the_lever_rule() -> None:
    ahead = np.tile([-0.06, 0.12, 0.19], (5, 1))
    place = np.array([-0.09, -0.06, 0.03, 0.155, 0.25])
    expected = [[1, 0, 0], [1, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.5], [0, 0, 1]]
    share = shares(place, ahead, np.zeros((5, 3)))
    assert share == pytest.approx(np.array(expected), abs=1e-12)
    inside = slice(1, 4)
    assert np.sum(share * ahead, axis=1)[inside] == pytest.approx(place[inside])


def test_a_point_high_in_the_air_bears_nothing() -> None:
    ahead = np.array([[-0.06, 0.12, 0.19]])
    share = shares(np.array([0.03]), ahead, np.array([[-0.01, 0.03, 0.05]]))
    assert share == pytest.approx(np.array([[1.0, 0.0, 0.0]]))
    share = shares(np.array([0.03]), ahead, np.array([[0.03, 0.0, 0.05]]))
    assert share == pytest.approx(np.array([[0.0, 1.0, 0.0]]))


def test_the_floor_passes_smoothly_between_its_heights() -> None:
    over = np.full((200, 3), -1.0)
    over[80:120, 1] = 1.0
    weight = standing(over, 20.0)
    assert np.all(weight[:, [0, 2]] == 0.0)
    assert np.all(weight[80:120, 1] == 1.0)
    assert np.all(weight[:60, 1] == 0.0)
    assert np.abs(np.diff(weight[:, 1])).max() < math.pi / 2.0 / 20.0


def test_the_floor_does_not_move_with_the_time_step() -> None:
    """A load that rises and falls in straight lines begins and ends at one time, however it is sampled."""
    fine = np.arange(0.0, 200.0, 0.125)
    over = (40.3 - np.abs(fine - 100.6))[:, None]
    assert standing(over[::8], 20.0) == pytest.approx(standing(over, 160.0)[::8], abs=1e-12)
    begins = 0.5 + 0.5 * math.cos(math.pi * 10.3 / 20.0)  # the load does, 10.3 samples later
    assert standing(over[::8], 20.0)[50, 0] == pytest.approx(begins, abs=1e-12)


def test_pads_and_the_rest_are_the_recorded_moment() -> None:
    """The pads bear all of the recorded force but what plates hum where none stands, 1 N of each at most."""
    built = contact_built()
    walk, foot, contact = built.walk, built.foot, built.contact
    assert walk is not None and foot is not None and contact is not None
    pitch = (walk.ankle - walk.pose[:, 2])[1:-1]
    assert walk.toe is not None
    points = foot.outsole(pitch, walk.toe[1:-1])
    ahead = np.stack([points[name][0] for name in POINTS], axis=1)
    total = np.sum(contact.load * ahead, axis=1) + contact.moment
    assert total == pytest.approx(ground_moment(walk, built.body_mass), abs=1e-9)
    weight = built.body_mass * GRAVITY * walk.cycle.ground(walk.phase[1:-1])[1]
    heights = walk.pose[1:-1, 1, None] + np.stack([points[name][1] for name in POINTS], axis=1)
    told = np.maximum(weight, 0.0)[:, None] * shares(walk.cycle.ground(walk.phase[1:-1])[2], ahead, heights)
    assert told.sum(axis=1) == pytest.approx(np.maximum(weight, 0.0), abs=1e-9)
    assert contact.load[told > 1.0] == pytest.approx(told[told > 1.0], abs=1e-9)
    assert np.all((contact.load <= told + 1e-9) & (contact.load >= 0.0))


def test_the_leg_weighs_what_it_weighs() -> None:
    """Over whole strides the accelerations cancel: support and ground bear the leg's weight, 4.58 kg."""
    built = contact_built()
    assert built.walk is not None and built.contact is not None
    stride = round(built.walk.cycle.stride_time / built.walk.timestep)
    lift = (built.contact.support + built.contact.load.sum(axis=1))[: 2 * stride]
    assert lift.mean() == pytest.approx((3.49 + 1.09) * GRAVITY, rel=0.01)
