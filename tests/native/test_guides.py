"""Friction at guides on a rig: one muscle whose cable turns about an eye by a right angle, more or less."""

import itertools
import math

import mujoco
import numpy as np
import pytest
from rig import BRAID, muscle_row

import afo_sim
from afo_sim import native
from afo_sim.native.guides import turned
from afo_sim.native.install import _flat, _FlatData
from afo_sim.native.slots import MUSCLE_ROW
from afo_sim.physics.series import CREEP

ORIGIN, EYE, END = np.array([-0.25, 0.05]), np.array([0.05, 0.05]), np.array([0.05, -0.01])  # forward, up [m]
PRESSURE = 2e5  # gauge [Pa]
TAUT = 0.30 + 0.06  # path at angle zero [m]


def rig(
    friction: float, *, timestep: float = 1e-3, inertia: float = 1e6, count: int = 1, guide: str = "site"
) -> mujoco.MjModel:
    """A hinge about the origin, toe up positive; the muscle pulls it up over an eye that stands still.

    Its air is so much that its pressure stays, and it has no damping: its tension follows from its length.
    """
    places = "".join(
        f'<site name="o{k}" pos="{ORIGIN[0]} 0 {ORIGIN[1]}"/><site name="e{k}" pos="{EYE[0]} 0 {EYE[1]}"/>'
        f'<geom name="g{k}" type="cylinder" size=".02 .01" pos="{EYE[0] - 0.02} 0 {EYE[1] - 0.02}" '
        'euler="90 0 0" contype="0" conaffinity="0" mass="0"/>'
        for k in range(count)
    )
    ends = "".join(f'<site name="i{k}" pos="{END[0]} 0 {END[1]}"/>' for k in range(count))
    through = {"site": '<site site="e{}"/>', "geom": '<geom geom="g{}"/>'}[guide]
    tendons = "".join(
        f'<spatial name="m{k}"><site site="o{k}"/>{through.format(k)}<site site="i{k}"/></spatial>'
        for k in range(count)
    )
    spec = mujoco.MjSpec.from_string(f"""<mujoco>
    <option timestep="{timestep!r}" integrator="implicitfast" gravity="0 0 0">
    <flag contact="disable"/></option>
    <worldbody>{places}<body><joint name="ankle" axis="0 -1 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>{ends}</body></worldbody>
    <tendon>{tendons}</tendon></mujoco>""")
    valve = native.CircuitValve(1e-9, 0.3, 4e-3, 4e-3)
    muscle = native.CircuitMuscle(
        "m0",
        tuple(f"m{k}" for k in range(count)),
        muscle_row(damping=1e-9),
        TAUT - 0.97 * BRAID.nominal_length,
        "air",
        cable_stiffness=1e5,
        wrap_friction=friction,
    )
    circuit = native.Circuit((muscle,), (native.CircuitChamber("air", "ankle", 10.0, 0.0, valve, valve),))
    native.add_circuit(spec, circuit)
    model = spec.compile()
    native.fill_circuit(model, circuit)
    return model


def turning(angle: float) -> float:
    """Angle by which the cable turns at the eye [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    low = np.array([c * END[0] - s * END[1], s * END[0] + c * END[1]])
    above, below = EYE - ORIGIN, low - EYE
    return math.acos(float(above @ below) / float(np.hypot(*above) * np.hypot(*below)))


def driven(model: mujoco.MjModel, speed: float, start: float, stop: float) -> dict[str, np.ndarray]:
    """The rig turned at constant speed, whatever pulls: angle, path, torque, tension and its velocity."""
    data = mujoco.MjData(model)
    data.qpos[0] = start
    rows = []
    muscle = model.actuator("m0").id
    native.fill_chambers(model, data, PRESSURE)
    data.qvel[0] = speed
    for _ in range(round((stop - start) / speed / model.opt.timestep)):
        angle = float(data.qpos[0])
        mujoco.mj_step(model, data)
        tension = float(native.read_own(model, data.userdata, muscle).tension)
        rows.append((angle, data.ten_length[0], data.qfrc_actuator[0], tension, -data.actuator_force[muscle]))
    names = ("angle", "path", "torque", "tension", "felt")
    return dict(zip(names, np.array(rows).T, strict=True))


@pytest.mark.parametrize("friction", [0.1, 0.2, 0.5])
def test_torque_of_a_slow_cycle_has_the_ratio_of_the_capstan(friction: float) -> None:
    with native.installed():
        model = rig(friction)
        up, down = driven(model, 0.1, -0.2, 0.2), driven(model, -0.1, 0.2, -0.2)
    assert math.degrees(turning(0.0)) == pytest.approx(90.0, abs=1e-9)
    at = np.linspace(-0.18, 0.18, 13)
    shortening = np.interp(at, up["angle"], up["torque"])
    lengthening = np.interp(at, down["angle"][::-1], down["torque"][::-1])
    expected = [math.exp(2.0 * friction * turning(angle)) for angle in at]
    assert shortening.min() > 0.3  # [N·m]: there is something to compare
    assert lengthening / shortening == pytest.approx(expected, rel=1e-3)
    # the muscle's own tension does not know of it
    own = np.interp(at, up["angle"], up["tension"]), np.interp(at, down["angle"][::-1], down["tension"][::-1])
    assert own[0] == pytest.approx(own[1], rel=1e-3)


def test_the_loop_of_a_cycle_is_the_heat() -> None:
    """∮ τ dθ against ∫ T (e^(μβ) − e^(−μβ)) |dx| of the muscle's own tension, by geometry."""
    friction = 0.3
    with native.installed():
        model = rig(friction)
        up, down = driven(model, 0.1, -0.2, 0.2), driven(model, -0.1, 0.2, -0.2)
    done = [
        float(np.sum(0.5 * (r["torque"][1:] + r["torque"][:-1]) * np.diff(r["angle"]))) for r in (up, down)
    ]
    turns = friction * np.array([turning(angle) for angle in up["angle"]])
    power = up["tension"] * (np.exp(turns) - np.exp(-turns))
    heat = -float(np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(up["path"])))
    assert -sum(done) == pytest.approx(heat, rel=3e-3)
    for rows in (up, down):
        taken = (rows["felt"] - rows["tension"])[1:] * np.diff(rows["path"])
        assert taken.min() >= 0.0


@pytest.mark.parametrize("timestep", [2.5e-4, 1e-3, 4e-3])
def test_a_load_within_the_friction_is_held_but_for_its_creep(timestep: float) -> None:
    """Between T e^(−μβ) and T e^(μβ) the path creeps at w0 artanh(ln(T'/T)/μβ), at any step."""
    friction, share = 0.4, 0.6  # of the friction that is used
    with native.installed():
        model = rig(friction, timestep=timestep, inertia=0.02)
        data = mujoco.MjData(model)
        native.fill_chambers(model, data, PRESSURE)
        mujoco.mj_forward(model, data)
        for _ in range(round(0.5 / timestep)):
            tension = float(native.read_own(model, data.userdata, model.actuator("m0").id).tension)
            turn = turned(_flat(model), _FlatData(data), 0)
            arm = -float(data.ten_J.reshape(-1)[0])
            data.qfrc_applied[0] = -tension * math.exp(share * friction * turn) * arm
            mujoco.mj_step(model, data)
        speed = float(data.ten_velocity[0])
    assert speed == pytest.approx(CREEP * math.atanh(share), rel=2e-3)
    assert abs(data.qpos[0]) < 2.0 * 0.5 * CREEP / 0.05


def test_halving_the_step_halves_the_error() -> None:
    """A swing against a load, which friction brings to rest: against a step 32 times as short."""
    found = {}
    with native.installed():
        for timestep in (2e-3, 1e-3, 5e-4, 1.25e-4 / 2):
            model = rig(0.1, timestep=timestep, inertia=0.02)
            data = mujoco.MjData(model)
            native.fill_chambers(model, data, PRESSURE)
            mujoco.mj_forward(model, data)
            data.qfrc_applied[0] = -data.qfrc_actuator[0]
            data.qvel[0] = 1.0
            mujoco.mj_step(model, data, round(0.05 / timestep))
            found[timestep] = float(data.qpos[0])
    finest = found.pop(1.25e-4 / 2)
    errors = [abs(angle - finest) for angle in found.values()]
    assert errors[0] < 4e-4
    assert all(later < 0.7 * earlier for earlier, later in itertools.pairwise(errors))


@pytest.mark.parametrize("guide", ["site", "geom"])
def test_turning_is_that_of_the_straight_pieces(guide: str) -> None:
    """At an eye the angle between two pieces; around a roller that between the two tangents."""
    model = rig(0.0, guide=guide)
    data = mujoco.MjData(model)
    for angle in np.linspace(-0.5, 0.5, 21):
        data.qpos[0] = angle
        mujoco.mj_fwdPosition(model, data)
        points = data.wrap_xpos.reshape(-1, 3)[: int(data.ten_wrapnum[0])]
        first, last = points[1] - points[0], points[-1] - points[-2]
        expected = math.atan2(float(np.linalg.norm(np.cross(first, last))), float(first @ last))
        assert turned(_flat(model), _FlatData(data), 0) == pytest.approx(expected, abs=1e-9)
        if guide == "site":
            assert expected == pytest.approx(turning(angle), abs=1e-9)


def test_parallel_muscles_pull_as_many_times() -> None:
    with native.installed():
        one, three = (driven(rig(0.3, count=count), 0.1, -0.1, 0.1) for count in (1, 3))
    # three of them move the pressure of the one chamber three times as much, by some 1e-5
    assert three["torque"] == pytest.approx(3.0 * one["torque"], rel=2e-4)


def test_without_friction_nothing_is_asked_of_the_guides() -> None:
    """The row's slot is zero, and the joint feels the muscle's tension to the last bit."""
    with native.installed():
        model = rig(0.0)
        rows = driven(model, 0.1, -0.1, 0.1)
    assert model.actuator_user[model.actuator("m0").id, MUSCLE_ROW.wrap_friction] == 0.0
    assert np.array_equal(rows["felt"], rows["tension"])


@pytest.mark.slow
def test_compiled_and_plain_python_agree() -> None:
    sets = {"orthosis": "guided", "duration": "1.2 s"}
    one, two = (afo_sim.run("seated", sets | {"callback": mode}) for mode in ("native", "python"))
    for column in ("ankle/angle", "muscle/dorsiflexor_1/joint_force", "muscle/dorsiflexor_side_2/force"):
        assert one[column] == pytest.approx(two[column], rel=1e-9, abs=1e-12), column
    assert np.abs(one["muscle/dorsiflexor_1/joint_force"] - one["muscle/dorsiflexor_1/force"]).max() > 1e-3


def test_friction_on_the_other_segment_does_nothing() -> None:
    """The cable ends there: it does not slide. Only turns on the origin's body count."""
    built = afo_sim.build(afo_sim.load("scenario", "seated", {"orthosis": "guided"}))
    data = mujoco.MjData(built.model)
    mujoco.mj_fwdPosition(built.model, data)
    found = {
        name: turned(_flat(built.model), _FlatData(data), built.model.tendon(name).id)
        for name in ("plantarflexor_1", "dorsiflexor_side_1")
    }
    assert found["plantarflexor_1"] == 0.0
    assert found["dorsiflexor_side_1"] > 0.1
