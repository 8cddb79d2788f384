"""The compiled model: the right body, the right device, and refusal of what cannot work."""

import re
import sys

import mujoco
import numpy as np
import pytest
from changed_leg import changed_leg

from afo_sim.common import InputError, with_code
from afo_sim.description import load
from afo_sim.model import AIR_ACCURATE, sweep_ankle
from afo_sim.model.assemble import collides, unused
from afo_sim.model.build import build
from afo_sim.physics import Braid

FORWARD = "orthosis.muscle.dorsiflexor"
BACK = "orthosis.muscle.plantarflexor"


def built(**sets: object):
    return build(load("scenario", "seated", sets))


def test_leg_has_an_adults_segments() -> None:
    """75 kg, 1.75 m: 0.0145 M and 0.0465 M (Winter); foot inertia about the ankle 0.010–0.017 kg·m²."""
    model = mujoco.MjSpec.from_file(str(load("leg", "adult_75kg").file)).compile()
    assert model.body_subtreemass[model.body("foot").id] == pytest.approx(0.0145 * 75.0, rel=0.01)
    assert model.body("toes").mass[0] == pytest.approx(0.148 * 0.0145 * 75.0, rel=0.01)  # OpenSim's share
    assert model.body("shank").mass[0] == pytest.approx(0.0465 * 75.0, rel=0.01)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert 0.010 <= data.M[0] <= 0.017
    assert np.degrees(model.joint("ankle").range) == pytest.approx([-50.0, 30.0])
    mujoco.mj_kinematics(model, data)
    heights = [data.site(name).xpos[2] - data.xanchor[0][2] for name in ("heel", "ball", "pulp", "tip")]
    assert heights == pytest.approx([-0.039 * 1.75] * 3 + [-0.039 * 1.75 + 0.008], abs=1e-3)


def test_dorsiflexion_lifts_the_toe() -> None:
    b = built()
    data = mujoco.MjData(b.model)
    heights = []
    for angle in (0.0, 0.2):
        data.qpos[b.index.ankle_qpos] = angle
        mujoco.mj_forward(b.model, data)
        heights.append(data.site("pulp").xpos[2])
    assert heights[1] - heights[0] == pytest.approx(
        0.175 * np.sin(0.2) + 0.068 * (1 - np.cos(0.2)), abs=1e-12
    )


def test_device_adds_to_the_foots_inertia() -> None:
    """Half of each muscle at its insertion, and the plate: recomputed from the parallel-axis theorem."""
    b = built()
    _, _, inertia = sweep_ankle(b.model, b.index, np.zeros(1))
    plate = 0.0
    for mass, x, z, length, height in (
        (0.40, 0.060, -0.079, 0.276, 0.022),
        (0.10, -0.070, -0.048, 0.016, 0.060),
        (0.05, 0.070, -0.010, 0.030, 0.012),
    ):
        plate += mass * (x * x + z * z + (length**2 + height**2) / 12.0)
    muscles = 0.04 * (3 * (0.065**2 + 0.01**2) + 2 * (0.06**2 + 0.03**2)) + 5 * 0.04 * 0.4 * 0.006**2
    foot = 0.0061 + 1.09 * (0.055**2 + 0.030**2)
    assert inertia[0] == pytest.approx(foot + plate + muscles, rel=1e-6)
    assert inertia[0] > 1.5 * foot


def test_moment_arms_and_range() -> None:
    """5–9 cm; plantarflexors are not stretched by dorsiflexion up to the stop."""
    b = built()
    contraction, arm, _ = sweep_ankle(b.model, b.index, np.radians(np.arange(-20.0, 31.0)))
    assert 0.05 < arm[:41, :3].min() < arm[:41, :3].max() < 0.09
    assert -0.09 < arm[:41, 3:].min() < arm[:41, 3:].max() < -0.045
    assert contraction[:, 3:].min() >= 0.0


def test_tendons_are_straight_lines_between_the_described_points() -> None:
    b = built()
    length = np.linalg.norm(np.array([0.06, 0.0, 0.30]) - np.array([0.065, 0.0, -0.01]))
    ids = [b.index.muscles[f"dorsiflexor_{k}"] for k in (1, 2, 3)]
    assert (b.model.ntendon, b.full_model.ntendon) == (2, 5)  # of alike muscles one is followed
    for model in (b.model, b.full_model):
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        assert data.actuator_length[ids] == pytest.approx(length, abs=1e-12)


def test_too_taut_is_refused_with_the_slack_that_would_do() -> None:
    """At its limit of −3 % the braid bears 20 kN (0.03 − 0.005/2) = 550 N: 5.5 mm of a cable of 100 kN/m."""
    taut = {f"{FORWARD}.link_length": "5 cm", "orthosis.anchor": {}}
    with pytest.raises(InputError, match="too taut") as refused:
        built(**taut)
    assert refused.value.field == f"{FORWARD}.slack"
    enough = refused.value.allowed.split(" mm")[0].removeprefix("at least ")
    cured = built(**taut, **{f"{FORWARD}.slack": f"{enough} mm"})
    contraction, _, _ = sweep_ankle(cured.model, cured.index, np.radians([-20.0]))
    limit = -0.03 - 5.5e-3 / 0.1631  # nominal length
    assert limit <= contraction[0, 0] < limit + 0.01
    assert not any("stretched" in warning for warning in cured.warnings)


def test_a_cuff_that_gives_spares_the_braid() -> None:
    """What locks on rigid anchors does not on a cuff of 4 kN/m, which follows the muscles' pull."""
    assert built(**{f"{FORWARD}.link_length": "5 cm"}).warnings == built().warnings


def test_muscle_too_short_for_its_arm_is_said() -> None:
    far = {f"{FORWARD}.type": "s1_120mm", f"{FORWARD}.link_length": "21 cm"}
    assert any("cannot follow the whole range of motion" in w for w in built(**far).warnings)
    assert not any("cannot follow" in w for w in built().warnings)


def test_lock_is_where_the_ideal_braid_encloses_nothing() -> None:
    assert Braid(0.2, 0.01, np.radians(22.0)).lock == pytest.approx(-0.0785, abs=1e-4)


def test_no_air_is_too_fast_and_the_step_that_would_do_is_told() -> None:
    big = {"orthosis.chamber.dorsiflexor.inlet.conductance": "20 dm^3/(s*bar)"}
    coarse = built(**big)
    said = next(w for w in coarse.warnings if "coarse at this time step" in w)
    step = re.search(r"take a step of ([\d.]+ ms)", said)
    assert step is not None and coarse.stability["air"] > AIR_ACCURATE
    fine = built(**big, timestep=step[1], duration="1 s", record_rate=f"{1 / float(step[1].split()[0])} kHz")
    assert not any("coarse" in w for w in fine.warnings) and fine.stability["air"] <= 1.05 * AIR_ACCURATE


def test_joint_named_otherwise_is_found_and_called_ankle() -> None:
    with pytest.raises(InputError, match="no such body or joint") as refused:
        built(**{"leg.ankle": "ankel"})
    assert refused.value.nearest == "ankle"


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_every_geometry_number_runs_clean_or_is_refused(factor: float) -> None:
    """Half and one and a half of every length of the mounting and the muscle, one at a time."""
    from afo_sim.common import format_quantity
    from afo_sim.simulation import run_built

    scenario = load("scenario", "seated")
    outcomes = []
    for role, group in scenario.orthosis.muscle.items():
        numbers = {
            "link_length": group.link_length,
            "slack": group.slack,
            "type.total_length": group.type.total_length,
            "type.end_length": group.type.end_length,
            "type.bore": group.type.bore,
        }
        changes = {f"{role}.{k}": format_quantity(v * factor, "m") for k, v in numbers.items() if v}
        for end in ("origin", "insertion"):
            point = getattr(group, end).from_joint
            for axis in range(3):
                moved = [x * factor if k == axis else x for k, x in enumerate(point)]
                changes[f"{role}.{end}.from_joint"] = [format_quantity(x, "m") for x in moved]
                outcomes.append(_outcome(changes, run_built))
                del changes[f"{role}.{end}.from_joint"]
        outcomes += [_outcome({key: value}, run_built) for key, value in changes.items()]
    assert outcomes.count("clean") > 10
    assert set(outcomes) <= {"clean", "refused"}


def _outcome(changes, run_built) -> str:
    key, value = list(changes.items())[-1]
    try:
        description = load("scenario", "seated", {f"orthosis.muscle.{key}": value, "duration": "8 s"})
        recording = run_built(build(description))
    except InputError as error:
        assert error.allowed or error.problem
        return "refused"
    finite = all(np.isfinite(values).all() for values in recording.columns.values())
    return "clean" if recording.ok and finite else "broken"


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="dm-control cannot be installed on Python 3.13")
def test_dm_control_reads_the_model() -> None:
    from dm_control import mujoco as dm

    physics = dm.Physics.from_xml_string(built().xml)
    physics.step()
    assert physics.named.data.qpos["ankle"].size == 1


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('axis="0 -1 0"', 'axis="0 1 0"', "axis"),
        (' range="-50 30"', "", "no range"),
        ('<body name="foot">', '<body name="foot" euler="0 10 0">', "turned"),
        (
            '<inertial pos="0 0 0.2444"',
            '<freejoint/><inertial pos="0 0 0.2444"',
            "beside the ankle there is the joint",
        ),
    ],
)
def test_leg_put_together_otherwise_is_refused(old: str, new: str, problem: str, tmp_path) -> None:
    with pytest.raises(InputError, match=problem):
        built(**changed_leg(tmp_path, lambda text: text.replace(old, new)))


def test_shank_and_foot_must_be_the_ankles_bodies() -> None:
    with pytest.raises(InputError, match="does not hang on"):
        built(**{"leg.shank": "foot"})


def parts(tmp_path, cuff: str) -> dict[str, str]:
    (tmp_path / "cuff.xml").write_text(f"<mujoco><worldbody>{cuff}</worldbody></mujoco>")
    return {"orthosis.cuff": str(tmp_path / "cuff.xml")}


def test_muscles_stay_where_described_wherever_the_cuff_is(tmp_path) -> None:
    geom = '<geom size=".05" mass="0.25" contype="0" conaffinity="0"/>'
    moved = built(**parts(tmp_path, f'<body pos="0 0 -0.01" euler="0 30 0">{geom}</body>'))
    angles = np.radians([-10.0, 10.0])
    assert np.array_equal(
        sweep_ankle(moved.model, moved.index, angles)[0], sweep_ankle(built().model, moved.index, angles)[0]
    )


@pytest.mark.parametrize(
    "cuff",
    [
        '<geom size=".1"/><body><geom size=".1"/></body>',
        '<body><geom size=".1"/></body><body><geom size=".1"/></body>',
        '<body><joint/><geom size=".1"/></body>',
    ],
)
def test_cuff_that_is_not_one_rigid_part_is_refused(cuff: str, tmp_path) -> None:
    with pytest.raises(InputError, match="one rigid part"):
        built(**parts(tmp_path, cuff))


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("orthosis.muscle.dorsiflexor.type.laws", 3, "not a table"),
        ("provenance", 3, "not a table"),
        ("orthosis.muscle", {}, "no muscle"),
        ("name", "../esc", "not a valid name for a folder"),
        ("name", "a\u0000b", "not a valid name for a folder"),
    ],
)
def test_odd_descriptions_are_refused(key: str, value: object, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        built(**{key: value})


def test_a_whole_is_set_before_its_parts() -> None:
    scenario = load("scenario", "seated", {f"{FORWARD}.count": 2, "orthosis": "s1"})
    assert scenario.orthosis.muscle["dorsiflexor"].count == 2


def test_a_changed_file_that_a_leg_includes_is_read_again(tmp_path) -> None:
    original = load("leg", "adult_75kg").file.read_text()
    start, end = original.index("<worldbody>"), original.index("</worldbody>") + len("</worldbody>")
    part, leg = tmp_path / "part.xml", tmp_path / "leg.xml"
    leg.write_text(original[:start] + '<include file="part.xml"/>' + original[end:])
    lowest = []
    for place in ("-0.068", "-0.090"):
        part.write_text(f"<mujocoinclude>{original[start:end]}</mujocoinclude>".replace("-0.068", place))
        model = built(**{"leg.file": str(leg)}).model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        ankle = data.xanchor[model.joint("ankle").id]
        lowest.append(data.site("ball").xpos[2] - ankle[2])
    assert lowest[1] - lowest[0] == pytest.approx(-0.022, abs=1e-9)


def test_contacts_are_sought_only_where_geoms_may_touch() -> None:
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT
    built = build(load("scenario", "seated"))
    assert built.model.opt.disableflags & off
    assert mujoco.MjModel.from_xml_string(built.xml).opt.disableflags & off
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><geom size='1'/><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    assert collides(spec.compile())
    for geom in spec.geoms:
        geom.contype = 0
    assert not collides(spec.compile())


BITS = mujoco.mjtDisableBit
PARTS = {
    "joint spring": (BITS.mjDSBL_SPRING, 'stiffness="3" springref="20"', "", ""),
    "polynomial spring": (BITS.mjDSBL_SPRING, 'stiffness="0 2" springref="20"', "", ""),
    "tendon spring": (BITS.mjDSBL_SPRING, "", 'stiffness="300" springlength="0.1"', ""),
    "joint friction": (BITS.mjDSBL_FRICTIONLOSS, 'frictionloss="0.2"', "", ""),
    "tendon friction": (BITS.mjDSBL_FRICTIONLOSS, "", 'frictionloss="2"', ""),
    "input limit": (BITS.mjDSBL_CLAMPCTRL, "", "", 'ctrllimited="true" ctrlrange="0 0.1"'),
}


def pendulum(joint: str = "", tendon: str = "", motor: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option integrator="implicitfast"/><worldbody>
        <site name="a" pos="0.1 0 0.1"/>
        <body><joint name="j" axis="0 1 0" damping="0.01" {joint}/>
        <geom size="0.02" pos="0 0 -0.2"/><site name="b" pos="0 0 -0.1"/></body></worldbody>
        <tendon><spatial name="t" {tendon}><site site="a"/><site site="b"/></spatial></tendon>
        <actuator><motor joint="j" {motor}/></actuator></mujoco>""")


def states(model: mujoco.MjModel, flags: int) -> np.ndarray:
    model.opt.disableflags = flags
    data = mujoco.MjData(model)
    data.ctrl[:], found = 0.3, []
    for _ in range(200):
        mujoco.mj_step(model, data)
        found.append([*data.qpos, *data.qvel, *data.qfrc_actuator])
    return np.array(found)


@pytest.mark.parametrize("part", [None, *PARTS])
def test_what_a_model_has_acts_and_what_it_has_not_is_passed_over(part: str | None) -> None:
    bit, *attributes = PARTS[part] if part else (0,)
    model = pendulum(*attributes)
    flags = unused(model)
    everything = BITS.mjDSBL_SPRING | BITS.mjDSBL_FRICTIONLOSS | BITS.mjDSBL_CLAMPCTRL
    assert flags == int(everything) & ~int(bit)
    with_all = states(model, 0)
    np.testing.assert_array_equal(states(model, flags), with_all)
    if part:
        assert not np.array_equal(states(model, int(bit)), with_all)  # there is something to switch off


def test_the_model_that_runs_carries_the_flags_and_the_saved_one_does_not() -> None:
    built = build(load("scenario", "seated"))
    assert built.model.opt.disableflags & BITS.mjDSBL_SPRING
    assert not mujoco.MjModel.from_xml_string(built.xml).opt.disableflags & BITS.mjDSBL_SPRING


def test_warnings_of_building_have_a_code_a_subject_and_numbers() -> None:
    chamber = {"inlet": [["0 s", "4 s"]], "outlet": [["3.5 s", "5 s"], ["1 s", "2 s"]]}
    timer = {"period": "8 s", "dorsiflexor": chamber}
    found = build(load("scenario", "seated", {"timer": timer, "orthosis.muscle.dorsiflexor.slack": "9 cm"}))
    [open_together] = with_code(found.warnings, "valves-open-together")
    assert open_together.subject == "dorsiflexor"
    assert open_together.data["overlaps"] == [(3.5, 4.0), (1.0, 2.0)]
    assert "from 3.5 s to 4 s, from 1 s to 2 s" in open_together
    [slack] = with_code(found.warnings, "muscle-too-slack")
    assert slack.data["contraction"] > slack.data["limit"]
    shorter = {"orthosis.muscle.dorsiflexor.slack": f"{90 - slack.data['shorter']} mm"}
    assert not with_code(build(load("scenario", "seated", shorter)).warnings, "muscle-too-slack")
