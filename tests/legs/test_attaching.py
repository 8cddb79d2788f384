"""An orthosis on a leg of a whole model: the physics of a scenario, whatever axes, and nothing lost."""

import json
import math
import pathlib
import re
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from documents import PAGES, ROOT
from turned_leg import beside_its_scenario, seated

import afo_sim as afo
from afo_sim.common import GRAVITY, CallbackError, InputError
from afo_sim.description import Orthosis, Side
from afo_sim.legs import Attached, read_attached, write_attached
from afo_sim.legs.attaching import masses

MASS, CENTRE = (3.49, 0.929), ([0.0, 0.0, 0.2444], [0.0386054, 0.0, -0.0265339])
INERTIA = (np.diag([0.0591, 0.0591, 0.0055]), np.diag([0.0018, 0.00423392, 0.00423392]))


def numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values).ravel())


def quaternion(turn: np.ndarray) -> str:
    found = np.empty(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(turn).reshape(9))
    return numbers(found)


def turn_of(seed: int) -> np.ndarray:
    q, turn = np.random.default_rng(seed).normal(size=4), np.empty(9)
    mujoco.mju_quat2Mat(turn, q / np.linalg.norm(q))
    return turn.reshape(3, 3)


def leg_text(
    world: np.ndarray,
    shank: np.ndarray,
    foot: np.ndarray,
    sign: float = 1.0,
    zero: float = 0.0,
    head: str = "",
) -> str:
    """A leg turned as a whole, with bodies that have other axes, hinged the other way, and another zero.

    `shank` and `foot` are the leg's axes in the bodies' own. The hinge is at its own zero where the ankle's
    angle is −sign × zero, so that at the coordinate `zero` the segments are parallel.
    """
    bent = turned(np.array([0.0, -1.0, 0.0]), -sign * zero)  # in the leg's axes

    def inertial(segment: int, axes: np.ndarray) -> str:
        full = axes @ INERTIA[segment] @ axes.T
        six = [full[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        centre = axes @ np.array(CENTRE[segment])
        return f'<inertial pos="{numbers(centre)}" mass="{MASS[segment]}" fullinertia="{numbers(six)}"/>'

    def capsule(axes: np.ndarray, ends: list[list[float]]) -> str:
        fromto = numbers(np.array(ends) @ axes.T)
        return f'<geom type="capsule" fromto="{fromto}" size="0.02" contype="0" conaffinity="0"/>'

    return f"""<mujoco><compiler angle="radian" autolimits="true"/>{head}
      <option gravity="{numbers(world @ [0.0, 0.0, -GRAVITY])}" timestep="0.002"/>
      <worldbody>
      <body name="shank" pos="{numbers(world @ [0.1, 0.2, 0.3])}" quat="{quaternion(world @ shank.T)}">
        {inertial(0, shank)}{capsule(shank, [[0, 0, 0.02], [0, 0, 0.4]])}
        <body name="foot" quat="{quaternion(shank @ bent @ foot.T)}">
          {inertial(1, foot)}{capsule(foot, [[-0.06, 0, -0.06], [0.18, 0, -0.06]])}
          <joint name="ankle" axis="{numbers(foot @ [0.0, -sign, 0.0])}" damping="0.3"
            stiffness="20" springref="{zero}"/>
        </body></body></worldbody></mujoco>"""


def turned(axis: np.ndarray, angle: float) -> np.ndarray:
    q, turn = np.empty(4), np.empty(9)
    mujoco.mju_axisAngle2Quat(q, axis, angle)
    mujoco.mju_quat2Mat(turn, q)
    return turn.reshape(3, 3)


def leg_with(*changes: tuple[str, str], head: str = "") -> Callable[[], mujoco.MjSpec]:
    def make() -> mujoco.MjSpec:
        text = leg_text(*[np.eye(3)] * 3, head=head)
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        return mujoco.MjSpec.from_string(text)

    return make


PLAIN = leg_with()


def bent(leg: Attached, angle: float) -> np.ndarray:
    """The posture with the ankle at an angle."""
    posture = leg.model.qpos0.copy()
    posture[leg.model.joint(leg.found.ankle).qposadr[0]] = leg.found.zero + leg.found.sign * angle
    return posture


def stepped(leg: Attached, count: int = 1500, angle: float = -0.2) -> np.ndarray:
    """Angle, forces, contractions and pressures of a leg that is filled and vented (count, n)."""
    data, rows = leg.data(bent(leg, angle)), []
    with leg.callbacks():
        for k in range(count):
            leg.set_valves(data, dorsiflexor="inlet" if k < count // 2 else "outlet", plantarflexor="outlet")
            mujoco.mj_step(leg.model, data)
            read = (leg.force(data), leg.contraction(data), leg.pressure(data))
            rows.append([leg.angle(data), *(value for values in read for value in values.values())])
    return np.array(rows)


def test_shipped_leg_moves_as_in_its_scenario() -> None:
    """What differs is rounding: the anchors' frames are turned, and damping's force is added elsewhere."""
    run, (angle, *rows) = beside_its_scenario(
        "s1",
        {"duration": "6 s"},
        lambda leg, data: (*leg.force(data).values(), *leg.contraction(data).values()),
    )
    assert np.ptp(run["ankle/angle"]) > 0.3
    assert np.allclose(angle, run["ankle/angle"], rtol=0.0, atol=1e-11)
    names = [name.split("/")[1] for name in run.columns if re.fullmatch(r"muscle/[^/]*/force", name)]
    assert len(rows) == 2 * len(names)
    for name, force, own in zip(names, rows, rows[len(names) :], strict=False):
        assert np.allclose(force, run[f"muscle/{name}/force"], rtol=0.0, atol=1e-8)
        assert np.allclose(own, run[f"muscle/{name}/contraction"], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("sign", "zero"), [(1.0, 0.0), (-1.0, 0.0), (-1.0, 0.35), (1.0, -0.4)])
def test_numbers_do_not_depend_on_axes(sign: float, zero: float) -> None:
    straight = PLAIN()
    strange = mujoco.MjSpec.from_string(leg_text(turn_of(1), turn_of(2), turn_of(3), sign, zero))
    expected = stepped(afo.attach(straight, "s1", side="right"))
    leg = afo.attach(strange, "s1", side="right", zero=zero)
    assert leg.found.sign == sign
    assert expected[:, 1].max() > 5.0  # it pulls
    assert np.allclose(stepped(leg), expected, rtol=1e-9, atol=1e-9)


def lopsided() -> Orthosis:
    """S1 with its dorsiflexors aside, so that left and right differ."""
    ends = {"origin": ["6 cm", "2 cm", "30 cm"], "insertion": ["6.5 cm", "3 cm", "-1 cm"]}
    sets = {f"muscle.dorsiflexor.{end}.from_joint": at for end, at in ends.items()}
    return afo.load("orthosis", "s1", sets)


def test_on_a_left_leg_it_is_mirrored() -> None:
    sides: tuple[Side, Side] = ("right", "left")
    right, left = (afo.attach(PLAIN(), lopsided(), side=side) for side in sides)
    flip = np.array([1.0, -1.0, 1.0])
    centre = np.array([0.1, 0.2, 0.3])
    for name in right.muscles:
        for end in ("origin", "insertion"):
            at = [leg.data().site(f"afo_{name}_{end}").xpos - centre for leg in (right, left)]
            assert np.allclose(at[1], flip * at[0], atol=1e-12)
            assert abs(at[0][1]) > 0.004 or "plantar" in name
    assert np.allclose(stepped(left, 400)[:, 0], stepped(right, 400)[:, 0], rtol=0.0, atol=1e-9)


@pytest.fixture(scope="module")
def humanoid() -> pathlib.Path:
    suite = pytest.importorskip("dm_control.suite")
    return pathlib.Path(suite.__file__).parent / "humanoid.xml"


@pytest.fixture(scope="module")
def both(humanoid: pathlib.Path) -> Attached:
    left = afo.attach(humanoid, lopsided(), side="left", timestep="0.5 ms")
    return afo.attach(left, lopsided(), side="right", prefix="afo_right_")


def moments(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    found = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        found, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    return found


def test_both_legs_keep_air_and_energy(both: Attached) -> None:
    """Air that comes in and leaves is what the chambers gain; joints get the work that tendons give."""
    model, legs = both.model, both.legs
    data = both.data()
    both.legs["afo_"].fill(data, {"dorsiflexor": "3 bar"})
    muscles = [number for leg in legs.values() for number in leg.muscles.values()]
    held = {p: np.array(list(leg.air(data).values())) for p, leg in legs.items()}
    before, by_joints, by_paths = held, 0.0, 0.0
    flown = {p: np.zeros(2) for p in legs}
    last: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None = None
    step, moved = model.opt.timestep, np.empty(model.nv)
    with both.callbacks():
        for k in range(1200):
            legs["afo_"].set_valves(data, dorsiflexor=None if k < 600 else "outlet")
            legs["afo_right_"].set_valves(data, plantarflexor="inlet", dorsiflexor=None)
            here = data.qpos.copy()
            mujoco.mj_step(model, data)
            tension = np.array([f for leg in legs.values() for f in leg.force(data).values()])
            arm = moments(model, data)[muscles]
            length = data.actuator_length[muscles].copy()
            if last is not None:
                mujoco.mj_differentiatePos(model, moved, 1.0, last[0], here)
                by_joints += -0.5 * float((last[1] @ last[2] + tension @ arm) @ moved)
                by_paths += -0.5 * float((last[1] + tension) @ (length - last[3]))
            last = here, tension, arm, length
            for p, leg in legs.items():
                flow = list(leg.flow(data).values())
                flown[p] += step * np.array([flow[0] - flow[1], flow[2] - flow[3]])
    for p, leg in legs.items():
        gained = np.array(list(leg.air(data).values())) - before[p]
        assert np.allclose(flown[p], gained, rtol=1e-9, atol=1e-15)
    assert gained.max() > 1e-5
    assert abs(by_paths) > 0.01
    assert by_joints == pytest.approx(by_paths, rel=1e-4)


def test_userdata_and_states_of_two_legs_do_not_meet(both: Attached) -> None:
    from afo_sim import native

    places: list[int] = []
    for leg in both.legs.values():
        size = 7 * len(leg.chambers) + 14 * len(leg.circuit.muscles) + 2 * len(leg.circuit.anchors)
        places += range(leg.userdata, leg.userdata + size)
        networks = leg.ids.networks.values()
        assert max(networks) < min(*leg.muscles.values(), *leg.chambers.values())
    assert sorted(places) == list(range(both.model.nuserdata))
    asks = native.asks_for_callback(both.model)
    assert not asks[both.own_controls].any()
    assert asks[both.own_controls.stop :].all()
    assert both.own_controls == slice(0, 21)
    assert not both.model.actuator_ctrllimited[21:].any()  # the file's own motors are limited by default


def test_one_leg_does_not_fill_the_other(both: Attached) -> None:
    data = both.data()
    with both.callbacks():
        both.legs["afo_"].set_valves(data, dorsiflexor="inlet")
        mujoco.mj_step(both.model, data, 400)
    assert both.legs["afo_"].pressure(data)["dorsiflexor"] > 1e4
    assert abs(both.legs["afo_right_"].pressure(data)["dorsiflexor"]) < 5e3


def test_filling_one_leg_leaves_the_others_air_and_supply(both: Attached) -> None:
    left, right = both.legs["afo_"], both.legs["afo_right_"]
    data = both.data()
    left.set_supply(data, "2 bar")
    left.fill(data, {"dorsiflexor": "3 bar"})
    right.fill(data, {"dorsiflexor": "1 bar"})
    assert left.pressure(data)["dorsiflexor"] == pytest.approx(3e5)
    assert right.pressure(data)["dorsiflexor"] == pytest.approx(1e5)
    assert list(data.ctrl[list(left.chambers.values())]) == [2e5, 2e5]
    right.fill(data)
    assert max(map(abs, left.pressure(data).values())) < 1.0
    mujoco.mj_resetData(both.model, data)
    right.fill(data, {"dorsiflexor": "1 bar"})
    assert max(map(abs, left.pressure(data).values())) < 1.0
    assert list(data.ctrl[list(left.chambers.values())]) == [left.supply] * 2


def test_virtual_work_on_every_crossed_joint(both: Attached) -> None:
    """The moment on each joint is −T dL/dq, by central differences, and no other joint has one."""
    model, step = both.model, 1e-6
    rng = np.random.default_rng(5)
    posture = model.qpos0.copy()
    posture[7:] += 0.1 * rng.normal(size=model.nq - 7)
    for leg in both.legs.values():
        data = leg.data(posture)
        leg.fill(data, {"dorsiflexor": "3 bar", "plantarflexor": "2 bar"})
        crossed = [int(model.joint(name).dofadr[0]) for name in leg.joints]
        assert len(crossed) == 2
        muscles = list(leg.muscles.values())
        given = moments(model, data)[muscles].T @ data.actuator_force[muscles]
        tension = np.array(list(leg.force(data).values()))
        assert np.array_equal(-data.actuator_force[muscles], tension)
        assert tension.max() > 5.0
        expected = np.zeros(model.nv)
        for dof in range(model.nv):
            ends = []
            for way in (1.0, -1.0):
                other, velocity = mujoco.MjData(model), np.zeros(model.nv)
                other.qpos[:] = posture
                velocity[dof] = way * step
                mujoco.mj_integratePos(model, other.qpos, velocity, 1.0)
                mujoco.mj_fwdPosition(model, other)
                ends.append(other.actuator_length[muscles].copy())
            expected[dof] = -tension @ (ends[0] - ends[1]) / (2.0 * step)
        assert np.allclose(given, expected, rtol=1e-6, atol=1e-6)
        assert min(abs(given[crossed])) > 0.01
        assert abs(np.delete(given, crossed)).max() < 1e-12  # of the rounding of places in the world


def leg_that_tilts() -> mujoco.MjSpec:
    """The shipped leg with a second hinge of the foot, about its long axis."""
    spec = seated()
    foot = spec.body("foot")
    foot.add_joint(name="ankle_x", axis=[1.0, 0.0, 0.0], range=[-0.9, 0.9], pos=foot.joints[0].pos)
    return spec


def test_parallel_muscles_differ_where_another_joint_tilts_the_foot(tmp_path: pathlib.Path) -> None:
    """Two muscles of one group pull as two groups of one muscle each; the longer path pulls more."""
    pair = afo.load("orthosis", "s1", {"muscle.dorsiflexor.count": 2}).model_dump(mode="json")
    single = afo.load("orthosis", "s1", {"muscle.dorsiflexor.count": 2}).model_dump(mode="json")
    group = single["muscle"].pop("dorsiflexor")
    for name, aside in (("right", "-1.25 cm"), ("left", "1.25 cm")):
        ends = {
            end: group[end] | {"from_joint": list(group[end]["from_joint"])}
            for end in ("origin", "insertion")
        }
        for end in ends.values():
            end["from_joint"][1] = aside
        single["muscle"][name] = group | ends | {"count": 1, "chamber": "dorsiflexor"}
    found = []
    for device in (pair, single):
        leg = afo.attach(leg_that_tilts(), device, side="right", ankle="ankle")
        assert leg.joints == ("ankle", "ankle_x")
        posture = leg.model.qpos0.copy()
        posture[leg.model.joint("ankle_x").qposadr[0]] = 0.2
        write_attached(leg, tmp_path / f"{len(found)}.xml")
        again = read_attached(tmp_path / f"{len(found)}.xml")
        for one in (leg, again):
            data = one.data(posture)
            one.fill(data, {"dorsiflexor": "4 bar"})
            force = one.force(data)
            pulls = [
                force.get(f"dorsiflexor_{k}", force.get(f"{name}_1", 0.0))
                for k, name in ((1, "right"), (2, "left"))
            ]
            found.append(pulls)
    assert found[0][0] - found[0][1] > 10.0 or found[0][1] - found[0][0] > 10.0
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-9)


def test_two_models_stepped_in_turn() -> None:
    texts = [leg_text(turn_of(k), np.eye(3), turn_of(k)) for k in (4, 5)]
    legs = [afo.attach(mujoco.MjSpec.from_string(text), "s1", side="right") for text in texts]
    alone = [stepped(leg, 300) for leg in legs]
    data = [leg.data() for leg in legs]
    for leg, d in zip(legs, data, strict=True):
        leg.reset(d, bent(leg, -0.2))
    with legs[0].callbacks(), legs[1].callbacks():
        for k in range(300):
            for number, (leg, d) in enumerate(zip(legs, data, strict=True)):
                leg.set_valves(d, dorsiflexor="inlet" if k < 150 else "outlet", plantarflexor="outlet")
                mujoco.mj_step(leg.model, d)
                assert leg.angle(d) == alone[number][k, 0]
                assert leg.force(d)["dorsiflexor_1"] == alone[number][k, 1]


HOSTILE = """
  <size nuserdata="3" nuser_actuator="120"/>
  <default><geom margin="0.1" mass="7" condim="1" group="5"/><site group="4"/>
    <tendon stiffness="1000" damping="50" frictionloss="3" limited="true" range="0 0.1"/>
    <general gear="5" ctrllimited="true" ctrlrange="-1 1" forcelimited="true" forcerange="-1 1"/></default>
  <actuator><muscle name="own" joint="ankle" lengthrange="0.5 1" user="9 9.5" gear="0.001"/></actuator>
  <keyframe><key name="up" qpos="0.1" act="0.3" ctrl="0.4"/></keyframe>"""


def test_the_models_defaults_do_not_reach_the_orthosis() -> None:
    """Stiff tendons, gears and limits are the model's; its muscle, user data and keyframe stay."""
    plain = afo.attach(PLAIN(), "s1", side="right")
    spec = leg_with(head=HOSTILE)()
    leg = afo.attach(spec, "s1", side="right")
    assert len(spec.actuators) == 1 and spec.nuserdata == 3  # the user's own stays as it was
    model, bare = leg.model, spec.compile()
    assert masses(model, "afo_") == masses(plain.model, "afo_")
    assert leg.userdata == 3 and leg.own_controls == slice(0, 1)
    assert model.nuser_actuator == 120
    assert list(model.actuator_user[0, :3]) == [9.0, 9.5, 0.0]
    for name in ("actuator_gainprm", "actuator_gear", "actuator_lengthrange", "actuator_ctrlrange"):
        assert np.array_equal(getattr(model, name)[0], getattr(bare, name)[0])
    for name in ("tendon_stiffness", "tendon_damping", "tendon_frictionloss", "tendon_limited"):
        assert not getattr(model, name).any()
    assert (model.actuator_gear[1:, 0] == 1.0).all()
    assert not model.actuator_forcelimited[1:].any()
    data = leg.data()
    mujoco.mj_resetDataKeyframe(leg.spec.copy().compile(), data, 0)  # as it is written
    assert data.act[leg.model.actuator_actadr[next(iter(leg.chambers.values()))]] > 0.0
    assert (data.qpos[0], data.act[0], data.ctrl[0]) == (0.1, 0.3, 0.4)
    data.userdata[:3] = 1.0, 2.0, 3.0
    with leg.callbacks():
        mujoco.mj_step(model, data, 10)
    assert list(data.userdata[:3]) == [1.0, 2.0, 3.0]
    assert abs(leg.pressure(data)["dorsiflexor"]) < 2e4
    quiet, found = stepped(plain, 300), stepped(leg, 300)
    # its own muscle's gear makes at most a thousandth of a newton metre
    assert np.allclose(found[:, 0], quiet[:, 0], atol=0.02)


def test_the_models_defaults_do_not_reach_the_file(tmp_path: pathlib.Path) -> None:
    spec = mujoco.MjSpec.from_string(leg_text(turn_of(7), turn_of(8), np.eye(3), head=HOSTILE))
    leg = afo.attach(spec, "s1", side="right")
    write_attached(leg, tmp_path / "leg.xml")
    again = read_attached(tmp_path / "leg.xml").model
    for name in dir(again):
        ours, theirs = getattr(again, name), getattr(leg.model, name)
        if isinstance(ours, np.ndarray) and ours.dtype.kind in "fiu":
            assert np.allclose(ours, theirs, rtol=1e-12, atol=1e-12, equal_nan=True), name
    assert again.nuserdata == leg.model.nuserdata


def test_bodies_without_names_are_found_by_their_numbers() -> None:
    nameless = leg_with(*((f'name="{name}"', "") for name in ("shank", "foot", "ankle")))
    named = afo.attach(PLAIN(), "s1", side="right")
    with named.callbacks():  # a model may be attached to while others are stepped
        leg = afo.attach(nameless(), "s1", shank="body_1", foot="body_2", side="right")
    assert np.array_equal(stepped(leg, 200), stepped(named, 200))


def test_another_time_step_is_checked_for_both_legs(both: Attached) -> None:
    with pytest.raises(InputError, match="time step"):
        afo.attach(both, lopsided(), side="left", prefix="third_", timestep="40 ms")


def test_files_give_the_same_again(
    tmp_path: pathlib.Path, both: Attached, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "a folder" / "model.xml"
    write_attached(both, out, mjb=True)
    monkeypatch.chdir(tmp_path)
    again = read_attached(pathlib.Path("a folder") / "model.xml")
    assert list(again.legs) == list(both.legs)
    for prefix, leg in again.legs.items():
        before = both.legs[prefix]
        assert leg.orthosis == before.orthosis
        assert (vars(leg.ids), leg.bodies, leg.joints) == (vars(before.ids), before.bodies, before.joints)
    theirs, ours = both.model.actuator_user, again.model.actuator_user
    inverse = ~np.isclose(theirs, ours, rtol=0.0, atol=0.0)
    assert np.allclose(ours, theirs, rtol=1e-12, atol=0.0)
    assert inverse.sum() <= sum(
        len(leg.muscles) for leg in both.legs.values()
    )  # J M⁻¹ Jᵀ, of turns read again
    assert np.array_equal(again.model.site_pos, both.model.site_pos)
    binary = mujoco.MjModel.from_binary_path(str(out.with_suffix(".mjb")))
    assert np.array_equal(binary.actuator_user, theirs)
    plain = mujoco.MjModel.from_xml_path(str(out))
    assert np.array_equal(plain.actuator_user, theirs)


def test_meshes_are_found_from_another_folder(tmp_path: pathlib.Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    there = tmp_path / "there"
    (there / "meshes").mkdir(parents=True)
    trimesh.creation.box((0.1, 0.05, 0.05)).export(there / "meshes" / "a box & more.stl")
    text = leg_text(*[np.eye(3)] * 3)
    text = text.replace('angle="radian"', 'angle="radian" meshdir="meshes"')
    text = text.replace(
        "<worldbody>", '<asset><mesh name="b" file="a box &amp; more.stl"/></asset><worldbody>'
    )
    text = text.replace("</body></body>", '<geom type="mesh" mesh="b" mass="0"/></body></body>')
    (there / "leg.xml").write_text(text, encoding="utf-8")
    worn = tmp_path / "worn"
    (worn / "shapes").mkdir(parents=True)
    trimesh.creation.box((0.2, 0.2, 0.1)).export(worn / "shapes" / "a box & more.stl")
    cuff = '<mujoco><compiler meshdir="shapes"/><asset><mesh file="a box &amp; more.stl"/></asset><worldbody>'
    cuff += '<body><geom type="mesh" mesh="a box &amp; more" mass="0.2"/></body></worldbody></mujoco>'
    (worn / "cuff.xml").write_text(cuff, encoding="utf-8")
    device = afo.load("orthosis", "s1", {"cuff": str(worn / "cuff.xml")})
    leg = afo.attach(there / "leg.xml", device, side="right")
    extents = np.ptp(leg.model.mesh_vert.reshape(2, -1, 3), axis=1).max(axis=1)
    assert sorted(extents) == pytest.approx([0.1, 0.2])
    files = write_attached(leg, tmp_path / "here" / "leg.xml")
    for path in (there / "meshes", worn / "shapes"):
        (path / "a box & more.stl").unlink()
    moved = tmp_path / "moved"
    (tmp_path / "here").rename(moved)
    again = read_attached(moved / "leg.xml")
    assert np.array_equal(again.model.mesh_vert, leg.model.mesh_vert)
    assert again.orthosis.cuff is not None and again.orthosis.cuff.is_file()
    assert len(files) == 6


def test_the_bare_file_is_limp_without_callbacks_and_asks_for_air_with_them(tmp_path: pathlib.Path) -> None:
    leg = afo.attach(PLAIN(), "s1", side="right")
    write_attached(leg, tmp_path / "leg.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    assert not data.actuator_force.any()
    with leg.callbacks():
        with pytest.raises(mujoco.FatalError, match="pressure is not positive"):
            mujoco.mj_step(model, data)
        leg.reset(data)
        mujoco.mj_step(model, data)
    text = (tmp_path / "leg.xml").read_text(encoding="utf-8")
    assert "limp" in text


SHIPPED = ROOT / "models" / "mjcf" / "s1_afo.xml"
PLAIN_MUJOCO = """
import json, sys, mujoco
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data, lengths = mujoco.MjData(model), {}
for angle in json.loads(sys.argv[2]):
    data.joint("ankle").qpos = angle
    mujoco.mj_forward(model, data)
    for k in range(model.ntendon):
        lengths.setdefault(model.tendon(k).name, []).append(data.ten_length[k])
for _ in range(100):
    mujoco.mj_step(model, data)
print(json.dumps([lengths, abs(data.actuator_force).max(), [n for n in sys.modules if "afo_sim" in n]]))
"""


def test_the_shipped_mjcf_opens_in_plain_mujoco_with_five_tendons_of_s1s_geometry(
    tmp_path: pathlib.Path,
) -> None:
    """Their lengths are |o − R(θ) i| of the points in orthosis.toml, three in front and two behind."""
    angles = [-0.3, 0.0, 0.25]  # dorsiflexion positive, about −y
    alone = [sys.executable, "-I", "-c", PLAIN_MUJOCO, str(SHIPPED), json.dumps(angles)]
    told = subprocess.run(alone, check=True, capture_output=True, text=True, cwd=tmp_path).stdout
    lengths, force, ours = json.loads(told)
    assert force == 0.0 and ours == []
    ends = {
        "dorsiflexor": ((0.06, 0.3), (0.065, -0.01), 3),
        "plantarflexor": ((-0.06, 0.3), (-0.06, -0.03), 2),
    }
    assert len(lengths) == 5
    for name, ((x, z), (u, w), count) in ends.items():
        wanted = [
            math.hypot(x - (u * math.cos(a) - w * math.sin(a)), z - (u * math.sin(a) + w * math.cos(a)))
            for a in angles
        ]
        for k in range(1, count + 1):
            assert lengths[f"afo_{name}_{k}"] == pytest.approx(wanted, abs=1e-6)


def test_the_shipped_mjcf_is_what_the_package_builds() -> None:
    """Else write it anew, as docs/attach.md says."""
    command = re.findall(r"afo-sim attach adult_75kg .*models/mjcf/s1_afo.xml.*", PAGES["attach"])
    assert command and 'orthosis s1 --side right --timestep "1 ms"' in command[0]
    kept, now = read_attached(SHIPPED), afo.attach("adult_75kg", "s1", side="right", timestep="1 ms")
    seated = afo.build("seated").full_model
    for one, other in ((kept.model, now.model), (kept.model, mujoco.MjModel.from_xml_path(str(SHIPPED)))):
        assert [one.body(k).name for k in range(one.nbody)] == [
            other.body(k).name for k in range(other.nbody)
        ]
        for part in ("body_mass", "body_inertia", "body_ipos", "body_pos", "site_pos", "jnt_range"):
            np.testing.assert_allclose(getattr(one, part), getattr(other, part), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(kept.model.actuator_user, now.model.actuator_user)
    states = [mujoco.MjData(model) for model in (kept.model, now.model, seated)]
    for angle in (-0.3, 0.0, 0.25):
        for model, data in zip((kept.model, now.model, seated), states, strict=True):
            data.joint("ankle").qpos = angle
            mujoco.mj_kinematics(model, data)
            mujoco.mj_tendon(model, data)
        lengths = [data.ten_length for data in states]
        assert lengths[0] == pytest.approx(lengths[1], abs=1e-9)
        assert lengths[0] == pytest.approx(lengths[2], abs=1e-6)


def test_a_state_without_air_is_refused() -> None:
    leg = afo.attach(PLAIN(), "s1", side="right")
    data = leg.data()
    mujoco.mj_resetData(leg.model, data)
    with leg.callbacks(), pytest.raises(mujoco.FatalError):
        mujoco.mj_step(leg.model, data)
    leg.reset(data)
    assert leg.pressure(data)["dorsiflexor"] == pytest.approx(0.0, abs=1e-6)


def test_page_runs_as_printed(capsys: pytest.CaptureFixture[str]) -> None:
    code = re.findall(r"```python\n(.*?)```", PAGES["attach"], re.DOTALL)[0]
    exec(compile(code, "attach.md", "exec"), {})
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    pressures = [float(row[1]) for row in rows]
    assert len(rows) == 8
    assert pressures[3] == max(pressures) > 1.5e5


USER = '<actuator><general name="theirs" joint="ankle" biastype="user"/></actuator>'
REFUSED: dict[str, tuple[Callable[[], Any], dict[str, Any], str]] = {
    "no such body": (PLAIN, {"shank": "shink"}, "no such body.*shank"),
    "no such hinge": (PLAIN, {"ankle": "ankel"}, "ankel"),
    "no such foot": (PLAIN, {"foot": "feet"}, "feet"),
    "no foot at all": (lambda: mujoco.MjSpec.from_string("<mujoco/>"), {}, "no leg is found"),
    "a slide": (leg_with(('name="ankle"', 'type="slide" name="ankle"')), {"ankle": "ankle"}, "hinge"),
    "names that clash": (
        leg_with(('name="foot"', 'name="afo_foot"')),
        {"foot": "afo_foot", "shank": "shank"},
        "prefix.*afo_foot",
    ),
    "another program's actuator": (leg_with(head=USER), {}, "'theirs' asks for callbacks"),
    "a prefix that begins no name": (PLAIN, {"prefix": "1 "}, "prefix.*begins no name"),
    "actuators off": (leg_with(head='<option><flag actuation="disable"/></option>'), {}, "limp"),
    "a group of actuators off": (leg_with(head='<option actuatorgroupdisable="0"/>'), {}, "limp"),
    "masses rescaled": (
        leg_with(('autolimits="true"', 'autolimits="true" settotalmass="9"')),
        {},
        "compiler",
    ),
    "no number": (PLAIN, {"supply": "four bar"}, "supply"),
    "too much air": (PLAIN, {"supply": "400 bar"}, "20 bar"),
    "too long a step": (PLAIN, {"timestep": "40 ms"}, "at most.*ms"),
    "a step without a unit": (PLAIN, {"timestep": "1"}, "unit"),
    "not a model": (lambda: 7, {}, "is not a valid model"),
    "no file": (lambda: "nowhere.xml", {}, "there is no such file"),
    "a folder": (lambda: str(ROOT), {}, "is a folder"),
    "what no program reads": (lambda: str(ROOT / "README.md"), {}, "is of no kind that can be read"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_are_one_sentence(case: str) -> None:
    make, given, words = REFUSED[case]
    with pytest.raises(InputError, match=words) as caught:
        afo.attach(make(), "s1", **{"side": "right", **given})
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


SHORT = {"muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "0 cm", "10 cm"]}
THROUGH = {
    "muscle.plantarflexor.origin.from_joint": ["0 cm", "0 cm", "31 cm"],
    "muscle.plantarflexor.insertion.from_joint": ["0.2 cm", "0 cm", "-3 cm"],
}
TAUT = {
    "muscle.dorsiflexor.link_length": "1 cm",
    "muscle.dorsiflexor.cable.stiffness": "1e9 N/m",
    "anchor.shank.stiffness": "1e9 N/m",
    "anchor.foot.stiffness": "1e9 N/m",
}


@pytest.mark.parametrize(
    ("orthosis", "words"),
    [
        ("arm_s1", "pulley"),
        ("none", "has no muscle"),
        ("s3", "there is no such orthosis"),
        (SHORT, "fit.* 'shank' and 'foot'"),
        (THROUGH, "passes through the ankle.* 'shank' and 'foot'"),
        (TAUT, "mounted too taut.* 'shank' and 'foot'"),
    ],
)
def test_refused_orthoses(orthosis: Any, words: str) -> None:
    device = afo.load("orthosis", "s1", orthosis) if isinstance(orthosis, dict) else orthosis
    with pytest.raises(InputError, match=words) as caught:
        afo.attach(PLAIN(), device, side="right")
    assert "\n" not in str(caught.value)


def test_wrong_calls_are_told() -> None:
    leg = afo.attach(PLAIN(), "s1", side="right")
    data = leg.data()
    for call, words in (
        (lambda: leg.set_valves(data, dorsiflexer="inlet"), "did you mean 'dorsiflexor'"),
        (lambda: leg.set_valves(data, dorsiflexor="open"), "inlet"),  # type: ignore[arg-type]
        (lambda: leg.fill(data, {"calf": "1 bar"}), "is not a valid chamber"),
        (lambda: leg.data(np.array([np.nan])), "NaN"),
        (lambda: leg.data(np.zeros(3)), "shape"),
        (lambda: afo.attach(leg.spec, "s1", prefix="b_"), "asks for callbacks"),
        (lambda: afo.attach(leg, "s1"), "prefix"),
    ):
        with pytest.raises(InputError, match=words):
            call()
    with leg.callbacks() as held:
        held.close()
        with pytest.raises(CallbackError):
            held.check()


def test_changes_are_told() -> None:
    leg = afo.attach(
        leg_with(head='<option integrator="RK4"><flag limit="disable"/></option>')(), "s1", side="right"
    )
    told = {note.code: note for note in leg.notices}
    assert told["integrator-changed"].data["before"] == "rk4" and "autoreset-off" in told
    assert told["switched-off"].subject == "mjDSBL_LIMIT" and "ankle-without-stops" in told
    assert told["mass-added"].data["mass"] == pytest.approx(1.2)
    assert leg.model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert leg.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert sum(masses(leg.model, "afo_").values()) == pytest.approx(0.25 + 0.55 + 5 * 0.08)


def test_a_bare_number_is_no_pressure_in_bar(both: Attached) -> None:
    with pytest.raises(InputError, match="is a number of Pa: was it meant in bar"):
        both.set_supply(both.data(), 4)
    both.set_supply(both.data(), 4e5)
