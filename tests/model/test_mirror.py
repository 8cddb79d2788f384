"""A left leg is the right one's mirror image, and gives its numbers to the bit."""

import pathlib

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim import native
from afo_sim.common import InputError
from afo_sim.description import Scenario
from afo_sim.model.build import build
from afo_sim.model.mirror import mirror
from afo_sim.simulation import Recording

M = np.diag([1.0, -1.0, 1.0])
# Every way to tell an orientation, an inertia and an axis; frames, a class, a crooked mesh.
CROOKED = """
<mujoco>
  <compiler angle="degree" eulerseq="zyx" autolimits="true"/>
  <default><default class="turned"><geom euler="10 20 30"/></default></default>
  <asset>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .2 0  0 0 .3  .1 .05 .1" scale="1 2 1" refpos=".01 .02 .03"
          refquat=".9 .1 .3 .2"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="1 2 3" dir=".1 .2 -1"/>
    <frame pos=".1 .2 .3" euler="5 15 25">
      <body name="shank" pos="0 .3 1" euler="10 20 30">
        <inertial pos=".01 .02 .2" mass="3" fullinertia=".06 .065 .03 .004 .005 -.004"/>
        <joint name="slide" type="slide" axis="1 2 3" pos=".1 .2 .3"/>
        <joint name="knee" axis="1 -2 .5" pos=".1 .2 .3" range="-50 40"/>
        <geom name="bone" type="capsule" fromto="0 .1 0  .1 .2 .4" size=".03"/>
        <camera name="eye" pos="1 .5 0" xyaxes="0 1 .2 -.3 0 1"/>
        <body name="foot" pos=".02 .03 -.4" axisangle="1 2 3 40">
          <inertial pos=".03 .01 -.02" mass="1" diaginertia=".002 .004 .005" euler="20 -10 5"/>
          <joint name="ankle" axis=".2 -1 .1" pos="0 .01 0" range="-50 30"/>
          <geom class="turned" name="block" type="box" size=".1 .03 .02" pos=".05 .02 -.03"/>
          <geom name="wedge" type="mesh" mesh="wedge" pos=".1 .02 0" zaxis="1 2 3"/>
          <site name="tip" pos=".2 .03 -.04" zaxis="1 -1 2"/>
          <body name="toes" pos=".12 .01 -.03" xyaxes="1 .1 0 0 1 .2">
            <joint name="toe" axis="0 -1 .1"/>
            <geom name="toes" type="ellipsoid" size=".03 .04 .01" pos=".04 .01 0" quat=".9 .1 .2 .3"/>
          </body>
        </body>
      </body>
    </frame>
  </worldbody>
</mujoco>
"""


def posed(spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = [0.1, 0.4, -0.3, 0.5]
    data.qvel[:] = [0.3, -1.0, 2.0, 0.7]
    mujoco.mj_forward(model, data)
    return model, data


def test_everything_in_a_crooked_leg_is_mirrored() -> None:
    """Each world pose is reflected, worked out here; energies and accelerations are the same."""
    spec = mujoco.MjSpec.from_string(CROOKED)
    model, right = posed(spec)
    mirror(spec)
    other, left = posed(spec)
    for places in ("xpos", "xipos", "geom_xpos", "site_xpos", "cam_xpos", "light_xpos", "xanchor"):
        reflected = getattr(right, places) @ M
        if (
            places != "geom_xpos"
        ):  # a mesh's place is that of its principal axes; its corners are looked at below
            np.testing.assert_allclose(getattr(left, places), reflected, atol=1e-12, err_msg=places)
    np.testing.assert_allclose(left.light_xdir, right.light_xdir @ M, atol=1e-12)
    for turns in ("xmat", "site_xmat"):
        before, after = (getattr(data, turns).reshape(-1, 3, 3) for data in (right, left))
        np.testing.assert_allclose(after, M @ before @ M, atol=1e-12, err_msg=turns)
    for data, m in ((right, model), (left, other)):
        assert np.all(np.linalg.det(data.xmat.reshape(-1, 3, 3)) > 0.0), m
    # the picture of a mirrored camera is upright: its view and its upward direction are the mirror images
    view, up = (data.cam_xmat.reshape(3, 3).T[[2, 1]] for data in (right, left))
    np.testing.assert_allclose(up, view @ M, atol=1e-12)
    np.testing.assert_allclose(left.qacc, right.qacc, rtol=1e-9)
    np.testing.assert_allclose(left.qfrc_bias, right.qfrc_bias, atol=1e-11)
    for body in range(1, model.nbody):
        tensors = [
            data.ximat[body].reshape(3, 3) @ np.diag(m.body_inertia[body]) @ data.ximat[body].reshape(3, 3).T
            for m, data in ((model, right), (other, left))
        ]
        np.testing.assert_allclose(tensors[1], M @ tensors[0] @ M, atol=1e-12)
    for name in ("block", "bone", "toes"):
        np.testing.assert_allclose(left.geom(name).xpos, right.geom(name).xpos @ M, atol=1e-12)
    corners = [in_world(m, data, "wedge") for m, data in ((model, right), (other, left))]
    np.testing.assert_allclose(sorted(map(tuple, corners[1].round(6))), mirrored_rows(corners[0]), atol=2e-6)


URDF = """<robot name="leg"><link name="shank">
<inertial><origin xyz=".01 .02 .2" rpy=".1 .2 .3"/><mass value="3"/><inertia ixx=".06" iyy=".065" izz=".03"
ixy=".004" ixz=".005" iyz="-.004"/>
</inertial></link>
<link name="foot">
<inertial><origin xyz=".04 .01 -.03" rpy=".3 -.2 .1"/><mass value="1"/><inertia 
ixx=".002" iyy=".004" izz=".005" ixy=".0001" ixz=".0002" iyz=".0003"/></inertial>
<visual><origin xyz=".05 .02 -.03" rpy=".1 .2 -.3"/><geometry><box size=".2 .06 .04"/></geometry></visual>
</link>
<joint name="ankle" type="revolute"><parent link="shank"/><child link="foot"/>
<origin xyz="0 .02 -.4" rpy=".1 .2 .3"/>
<axis xyz=".1 -1 .2"/><limit lower="-.8" upper=".5" effort="1" velocity="1"/></joint></robot>"""


def test_urdf_leg_is_mirrored() -> None:
    spec = mujoco.MjSpec.from_string(URDF)
    spec.compiler.fusestatic = False
    found = []
    for turned in (False, True):
        if turned:
            mirror(spec)
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = 0.3, 1.0
        mujoco.mj_forward(model, data)
        found.append((model, data))
    (_, right), (_, left) = found
    np.testing.assert_allclose(left.xpos, right.xpos @ M, atol=1e-12)
    np.testing.assert_allclose(left.xipos, right.xipos @ M, atol=1e-12)
    np.testing.assert_allclose(left.xmat.reshape(-1, 3, 3), M @ right.xmat.reshape(-1, 3, 3) @ M, atol=1e-12)
    np.testing.assert_allclose(left.qacc, right.qacc, rtol=1e-10)


def in_world(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> np.ndarray:
    number = model.geom(geom).id
    mesh = model.geom_dataid[number]
    start = model.mesh_vertadr[mesh]
    corners = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
    found: np.ndarray = data.geom_xpos[number] + corners @ data.geom_xmat[number].reshape(3, 3).T
    return found


def mirrored_rows(corners: np.ndarray) -> list[tuple[float, ...]]:
    return sorted(map(tuple, (corners @ M).round(6)))


def test_mirrored_twice_is_the_same() -> None:
    spec = mujoco.MjSpec.from_string(CROOKED)
    _, before = posed(spec)
    mirror(spec)
    mirror(spec)
    _, after = posed(spec)
    for name in ("xpos", "xquat", "xipos", "site_xpos", "cam_xmat", "qacc"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), rtol=1e-10, atol=1e-12)


def test_what_has_no_mirror_image_is_refused() -> None:
    text = CROOKED.replace('<joint name="slide" type="slide" axis="1 2 3" pos=".1 .2 .3"/>', "<freejoint/>")
    text = text.replace('<joint name="knee" axis="1 -2 .5" pos=".1 .2 .3" range="-50 40"/>', "")
    spec = mujoco.MjSpec.from_string(text.replace('<frame pos=".1 .2 .3" euler="5 15 25">', "<frame>"))
    with pytest.raises(InputError, match="free or ball joint"):
        mirror(spec)


ASYMMETRIC = {
    "orthosis.muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "1.5 cm", "-1 cm"],
    "orthosis.muscle.plantarflexor.origin.from_joint": ["-6 cm", "-2 cm", "30 cm"],
}
LEFT: tuple[dict[str, str], ...] = ({"side": "left"}, {"leg.side": "left"}, {"orthosis.side": "left"})


def ran(scenario: Scenario) -> Recording:
    return afo_sim.run(scenario)


def assert_same_bits(left: Recording, right: Recording, but: tuple[str, ...] = ()) -> None:
    assert set(left.columns) == set(right.columns)
    for name, values in right.columns.items():
        if name not in but:
            np.testing.assert_array_equal(left.columns[name], values, err_msg=name)


@pytest.mark.parametrize("sides", LEFT, ids=lambda sides: next(iter(sides)))
@pytest.mark.parametrize("asymmetric", [{}, ASYMMETRIC], ids=["shipped", "asymmetric"])
def test_seated_left_leg_gives_the_right_legs_bits(sides: dict[str, str], asymmetric: dict[str, str]) -> None:
    seated = afo_sim.load("scenario", "seated").set({"duration": "4 s"} | asymmetric)
    # an orthosis on the other side than it is described for, with leg.side or side, is mirrored with the leg;
    # one that is described for the other side inverts where it everted
    but = ("ankle/moment/inversion",) if "orthosis.side" in sides else ()
    assert_same_bits(ran(seated.set(sides)), ran(seated), but)


@pytest.mark.parametrize("scenario", ["walk-dropfoot-afo", "walk-dropfoot"])
def test_walking_left_leg_gives_the_right_legs_bits(scenario: str) -> None:
    walk = afo_sim.load("scenario", scenario).set({"duration": "4 s"})
    assert_same_bits(ran(walk.set({"side": "left"})), ran(walk))


@pytest.mark.slow
def test_walking_left_leg_on_a_floor_gives_the_right_legs_bits() -> None:
    sets = {"duration": "4 s", "ground.mode": "contact", **ASYMMETRIC}
    walk = afo_sim.load("scenario", "walk-dropfoot-afo").set(sets)
    assert_same_bits(ran(walk.set({"side": "left"})), ran(walk))


def test_muscles_stand_on_the_mirror_side_and_pull_sideways_the_other_way() -> None:
    """Directions of the muscles' lines, from the sites of both models."""
    seated = afo_sim.load("scenario", "seated").set(ASYMMETRIC)
    lines = []
    for scenario in (seated, seated.set({"side": "left"})):
        built = build(scenario)
        data = native.scratch(built.model)
        data.qpos[built.index.ankle_qpos] = -0.2
        mujoco.mj_fwdPosition(built.model, data)
        ends = [
            [data.site(f"{m}_{end}").xpos for end in ("origin", "insertion")] for m in built.index.muscles
        ]
        lines.append(np.array([upper - lower for upper, lower in ends]))
    assert np.abs(lines[0][:, 1]).min() > 1e-3
    np.testing.assert_array_equal(lines[1], lines[0] @ M)


def crooked_leg(folder: pathlib.Path) -> pathlib.Path:
    """The shipped leg with its foot's centre of mass and sole 1 cm aside."""
    text = (pathlib.Path(afo_sim.__file__).parents[1] / "models/legs/adult_75kg/leg.xml").read_text()
    text = text.replace('pos="0.0386054 0 -0.0265339"', 'pos="0.0386054 0.01 -0.0265339"')
    text = text.replace('name="ball" pos="0.120 0 -0.068"', 'name="ball" pos="0.120 0.01 -0.068"')
    file = folder / "leg.xml"
    file.write_text(text)
    return file


def test_leg_file_of_a_left_leg_stays_as_it_is(tmp_path: pathlib.Path) -> None:
    """`leg.side` says whose leg the file is; only another simulated side mirrors it."""
    seated = afo_sim.load("scenario", "seated").set({"leg.file": str(crooked_leg(tmp_path))})
    for sets, aside in (
        ({}, 0.01),
        ({"leg.side": "left"}, 0.01),
        ({"side": "left"}, -0.01),
        ({"leg.side": "left", "side": "right"}, -0.01),
        ({"leg.side": "left", "side": "left"}, 0.01),
    ):
        model = build(seated.set(sets)).model
        assert model.body("foot").ipos[1] == pytest.approx(aside), sets


def test_shared_geometry_knows_sides() -> None:
    """Builds of either side one after the other are each their own."""
    seated = afo_sim.load("scenario", "seated").set(ASYMMETRIC)
    places = [
        build(seated.set({"side": side})).model.site("dorsiflexor_1_insertion").pos[1]
        for side in ("right", "left", "right", "left")
    ]
    assert places == [-places[1], places[1], -places[1], places[1]]
    assert places[0] != 0.0
