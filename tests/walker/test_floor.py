"""Slopes and uneven floors: against the same floor put in MuJoCo's world, and a floor laid out anew."""

import math

import mujoco
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from afo_sim import native
from afo_sim.common import GRAVITY, InputError
from afo_sim.model import POINTS
from afo_sim.model.build import build
from afo_sim.walker import (
    ROOT,
    Body,
    Walked,
    build_body,
    floor_of,
    numbers,
    prepared,
    read_gait,
    strides_of,
    walk_body,
)
from afo_sim.walker.body import BARE, FLOOR
from afo_sim.walker.gait import start
from afo_sim.walker.walking import Engine

HEALTHY = {**BARE, "patient": "healthy"}


def on(**ground: object) -> Body:
    keys = {f"ground.{key}": value for key, value in ground.items()}
    return build_body(prepared("walk-dropfoot-afo", HEALTHY | keys))


@pytest.mark.parametrize("degrees", [6.0, -6.0])
def test_a_slope_is_a_tilted_floor_under_plumb_gravity(degrees: float) -> None:
    """The level body, its floor turned in the world: MuJoCo has the floor's forces along the turned axes."""
    slope, vector = math.radians(degrees), read_gait("natural").vector
    leaning, world = on(slope=f"{degrees} deg"), on()
    place = world.model.site(FLOOR).id
    world.model.site_sameframe[place] = 0
    world.model.site_quat[place] = math.cos(0.5 * slope), 0.0, -math.sin(0.5 * slope), 0.0
    assert world.model.opt.gravity == pytest.approx([0.0, 0.0, -GRAVITY], abs=0.0)
    first, second = start(leaning, vector), start(world, vector)
    turn = np.array([[math.cos(slope), -math.sin(slope)], [math.sin(slope), math.cos(slope)]])
    for own in ("qpos", "qvel", "act", "ctrl", "userdata"):
        getattr(second, own)[:] = getattr(first, own)
    second.qpos[:2], second.qvel[:2] = turn @ first.qpos[:2], turn @ first.qvel[:2]
    second.qpos[2] += slope
    second.userdata[:4] = np.repeat(second.qvel[:2], 2)
    with native.installed():
        for body, data in ((leaning, first), (world, second)):
            mujoco.mj_forward(body.model, data)
            data.qvel -= 0.5 * body.model.opt.timestep * data.qacc
            mujoco.mj_step(body.model, data, nstep=1600)
    assert first.qpos[0] > 0.5 and np.ptp(second.act - first.act) < 1e-6
    assert np.abs(second.qpos[3:] - first.qpos[3:]).max() < 1e-6
    assert second.qpos[2] - slope == pytest.approx(first.qpos[2], abs=1e-6)
    assert np.abs(second.qpos[:2] - turn @ first.qpos[:2]).max() < 1e-6


def posed(walked: Walked, row: int) -> mujoco.MjData:
    """The body at a row of its walk, in the floor's coordinates, from the columns."""
    model = walked.body.model
    data = mujoco.MjData(model)
    for joint in range(model.njnt):
        name = model.joint(joint).name
        side = "left" if name.startswith("left_") else "trunk" if name in ROOT else "right"
        data.qpos[joint] = walked[f"{side}/{name.removeprefix('left_')}"][row]
    data.qpos[2] -= floor_of(walked.body.scenario).slope
    mujoco.mj_kinematics(model, data)
    return data


@pytest.mark.parametrize("degrees", [-3.0, 1.0])
def test_trunk_and_thigh_are_to_the_vertical_and_the_sole_to_the_floor(degrees: float) -> None:
    walked = walk_body(on(slope=f"{degrees} deg"), read_gait("natural").vector, 8.0)
    begins, pitches, slope = strides_of(walked, "right").begins[:-1], [], math.radians(degrees)
    for row in begins:
        data = posed(walked, row)
        (ax, _, az), (bx, _, bz) = (data.site(f"sole_{point}").xpos for point in POINTS[:2])
        pitches.append(math.degrees(math.atan2(bz - az, bx - ax)))
        down = data.body("thigh").xmat.reshape(3, 3) @ [0.0, 0.0, -1.0]  # of the thigh, in the floor's axes
        ahead, up = [math.cos(slope), 0.0, -math.sin(slope)], [math.sin(slope), 0.0, math.cos(slope)]
        thigh = math.atan2(down @ ahead, -down @ up)
        assert walked["trunk/pitch"][row] + walked["right/hip"][row] == pytest.approx(thigh, abs=1e-9)
    assert len(begins) > 2
    assert numbers(walked)["right/pitch_contact"] == pytest.approx(np.mean(pitches), abs=1e-6)


def test_no_slope_is_the_level_floor_to_the_bit() -> None:
    vector = read_gait("natural").vector
    level, stated = (
        walk_body(on(), vector, 3.0),
        walk_body(on(slope="0 deg", uneven="0 mm", seed=5), vector, 3.0),
    )
    for column, values in level.columns.items():
        assert (values == stated[column]).all(), column


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_clearance_is_over_the_local_floor(engine: Engine) -> None:
    """Beside the soles' points of the recorded coordinates, over a spline through the drawn heights."""
    walked, off = walk_body(on(uneven="40 mm", seed=7), read_gait("natural").vector, 6.0, engine=engine), []
    drawn = np.random.default_rng(7).uniform(0.0, 0.04, 1021)
    floor = CubicHermiteSpline(np.arange(12.0), np.r_[0.0, 0.0, 0.0, drawn[:9]], np.zeros(12))
    for row in range(0, len(walked["time"]), 7):
        data = posed(walked, row)
        x, _, z = np.array([data.site(f"sole_{point}").xpos for point in POINTS]).T
        off.append((z - floor(np.maximum(x, 0.0))).min() - walked["right/clearance"][row])
    assert walked["trunk/forward"][-1] > 5.0
    assert np.abs(off).max() < 2e-3  # the soles' points are of half a millisecond before


def test_an_uneven_floor_begins_level_and_ends_level() -> None:
    body = on(uneven="50 mm")
    place, slots = int(body.model.actuator_user[0, native.REFLEX_ROW.floor]), []
    for high in (0.0, 0.05):
        data = start(body, read_gait("natural").vector)
        data.userdata[place + 3 : place + native.FLOOR_POINTS] = high
        slots.append([native.floor_at(data.userdata, place, x) for x in (-1.0, 1.0, 2.0, 2.5, 3.0, 5000.0)])
    assert slots[0] == [0.0] * 6
    assert slots[1] == pytest.approx([0.0, 0.0, 0.0, 0.025, 0.05, 0.05])


@pytest.mark.parametrize(("key", "value"), [("slope", "3 deg"), ("uneven", "10 mm")])
def test_the_recorded_walk_refuses_another_floor(key: str, value: str) -> None:
    with pytest.raises(InputError) as error:
        build("walk-dropfoot-afo", {f"ground.{key}": value})
    assert error.value.field == f"ground.{key}" and error.value.value == value
    assert "afo-sim walk" in error.value.allowed
