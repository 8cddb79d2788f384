"""Shank, foot and ankle are found by names and by how they hang together; what does not fit is refused."""

import ast
import dataclasses
import itertools
import pathlib

import numpy as np
import pytest
from turned_leg import hinge, in_a_body, in_axes, shipped, told_otherwise, turned_round, with_ankle

from afo_sim.common import InputError
from afo_sim.description.orthosis import Side
from afo_sim.legs import Part, Shape, Tree, find
from afo_sim.legs.candidates import side_of
from afo_sim.legs.mjcf import read_mjcf
from afo_sim.legs.tree import Joint


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def body(
    name: str,
    parent: str | None,
    pose: np.ndarray,
    *joints: Joint,
    centre: tuple[float, float, float] = (0, 0, 0),
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None,
) -> Part:
    shapes = () if box is None else (Shape(f"{name}_box", "box", at(*box[0]), np.array(box[1])),)
    return Part(name, parent, pose, 1.0, np.array(centre, float), 1e-3 * np.eye(3), joints, shapes)


def tree(*parts: Part) -> Tree:
    return Tree(pathlib.Path("robot.urdf"), {part.name: part for part in parts})


def robot(pitch: str = "left_ankle_pitch_joint", roll: str = "left_ankle_roll_joint") -> Tree:
    """The two ankle hinges that humanoid robots have, on a link each; x forward, z up."""
    foot = ((0.04, 0.0, -0.03), (0.1, 0.03, 0.01))
    return tree(
        body("pelvis", None, at(0, 0, 1)),
        body("left_hip_link", "pelvis", at(0, 0.1, 0), hinge("left_hip", (0, 1, 0))),
        body("left_knee_link", "left_hip_link", at(0, 0, -0.4), hinge("left_knee", (0, 1, 0))),
        body("left_ankle_pitch_link", "left_knee_link", at(0, 0, -0.4), hinge(pitch, (0, 1, 0))),
        body(
            "left_ankle_roll_link", "left_ankle_pitch_link", at(0, 0, -0.02), hinge(roll, (1, 0, 0)), box=foot
        ),
    )


def test_a_robots_ankle_is_its_pitch() -> None:
    found = find(robot())
    names = found.shank, found.foot, found.ankle, found.side
    assert names == ("left_knee_link", "left_ankle_pitch_link", "left_ankle_pitch_joint", "left")
    assert found.welded == ("left_ankle_roll_joint",)
    assert found.sign == -1.0  # +y turns the toes down
    np.testing.assert_allclose(found.axes, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(found.centre, [0.0, 0.1, 0.2], atol=1e-15)
    assert found.shank_length == pytest.approx(0.4)
    assert found.foot_length == pytest.approx(0.2)


def test_of_hinges_without_telling_names_the_lateral_one_is_the_ankle() -> None:
    found = find(robot("left_a", "left_b"), shank="left_knee_link")
    assert found.ankle == "left_a" and "left_a" not in found.how["ankle"] and "left_b" in found.how["ankle"]


def test_the_foot_may_be_named_by_what_hangs_on_it() -> None:
    found = find(robot(), foot="left_ankle_roll_link")
    assert (found.foot, found.ankle) == ("left_ankle_pitch_link", "left_ankle_pitch_joint")


def test_an_opensim_foot_hangs_on_the_talus() -> None:
    """talus, calcn, toes; the talocrural axis of gait2392, in x forward, y up, z right."""
    axis = np.array([-0.10501355, -0.17402245, 0.97912632])
    toe = ((0.03, 0.0, 0.0), (0.03, 0.01, 0.03))
    found = find(
        tree(
            body("pelvis", None, np.eye(4)),
            body("femur_r", "pelvis", at(0, -0.07, 0.08), hinge("hip_r", (0, 0, 1))),
            body("tibia_r", "femur_r", at(0, -0.4, 0), hinge("knee_angle_r", (0, 0, 1))),
            body("talus_r", "tibia_r", at(0, -0.43, 0), Joint("ankle_angle_r", "hinge", axis, np.zeros(3))),
            body(
                "calcn_r",
                "talus_r",
                at(-0.049, -0.042, 0.008),
                hinge("subtalar_angle_r", (0.787, 0.605, -0.121)),
                centre=(0.1, 0.03, 0.0),
                box=((0.08, 0.0, 0.0), (0.1, 0.02, 0.03)),
            ),
            body(
                "toes_r", "calcn_r", at(0.179, -0.002, 0.001), hinge("mtp_angle_r", (-0.58, 0, 0.81)), box=toe
            ),
        )
    )
    names = found.shank, found.foot, found.ankle, found.side
    assert names == ("tibia_r", "talus_r", "ankle_angle_r", "right")
    assert found.welded == ("subtalar_angle_r", "mtp_angle_r")
    assert found.sign == 1.0  # OpenSim's ankle angle is dorsiflexion positive
    assert found.tilt == pytest.approx(np.arcsin(0.17402245), rel=1e-6)  # against the vertical shank
    np.testing.assert_allclose(found.axes[:, 1], -axis, atol=1e-8)  # left is −z, along the axis
    assert found.axes[0, 0] > 0.9


@pytest.mark.parametrize("seed", range(4))
def test_up_and_forward_turn_with_the_leg(seed: int) -> None:
    turned = told_otherwise(in_a_body(turned_round(shipped(), 0.3)), np.random.default_rng(seed))
    found = find(turned, zero=0.3)
    foot = turned.world_pose("foot")[:3, :3]
    points = turned.parts["foot"].points
    np.testing.assert_allclose(found.axes[:, 0], foot @ (points["ball"] - points["heel"]) / 0.18, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found.axes), 1.0)


def test_a_mirrored_foot_is_the_left_one() -> None:
    body_of = in_a_body(shipped())
    thigh = body_of.parts["thigh"]
    left = dataclasses.replace(thigh, pose=at(0, 0.1, 0))
    assert find(body_of).side == "right"  # 0.1 m to the right of the pelvis
    assert find(dataclasses.replace(body_of, parts=body_of.parts | {"thigh": left})).side == "left"


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("right_shin", "right"),
        ("tibia_l", "left"),
        ("R_foot", "right"),
        ("LeftFoot", "left"),
        ("lfoot", "left"),
        ("RAnklePitch", "right"),
        ("r_lleg", None),  # of both
        ("lower_leg", None),
        ("calf", None),
        ("FR_calf", None),
    ],
)
def test_names_tell_a_side(name: str, side: str | None) -> None:
    assert side_of(name) == side


def test_a_steep_sole_is_refused_and_a_zero_suggested() -> None:
    """With the file's zero 30 deg plantarflexed, a zero of 30 deg of the file's lays the sole flat."""
    angle = np.radians(30.0)
    plain = shipped()
    turn = np.eye(4)
    turn[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    foot = dataclasses.replace(plain.parts["foot"], pose=turn)
    drooped = dataclasses.replace(plain, parts=plain.parts | {"foot": foot})
    with pytest.raises(InputError, match=r"stands (29|3[01]) deg toe down.*foot (29|3[01]) deg would be the"):
        find(drooped)
    assert find(drooped, zero=0.0).sole == pytest.approx(-np.radians(30.0), abs=0.04)  # as it was meant
    flat = find(plain).sole
    assert flat is not None
    again = find(drooped, zero=angle)
    assert again.sole == pytest.approx(flat, abs=1e-9)


SHANK_AND_FOOT = (
    body("shank", None, np.eye(4), centre=(0, 0, 0.2)),
    body("foot", "shank", np.eye(4), hinge("ankle", (0, -1, 0)), centre=(0.05, 0, 0)),
)


def test_refusals_name_what_there_is() -> None:
    plain = tree(*SHANK_AND_FOOT)
    for arguments, words in (
        ({"shank": "shnk"}, ["shank = 'shnk'", "no such body", "did you mean 'shank'"]),
        ({"foot": "foott"}, ["foot = 'foott'", "did you mean 'foot'"]),
        ({"ankle": "ankel"}, ["ankle = 'ankel'", "no such joint", "did you mean 'ankle'"]),
        ({"shank": "foot", "foot": "shank"}, ["swapped"]),
        ({"shank": "foot", "foot": "foot"}, ["is also given as the foot"]),
        ({"shank": "foot"}, ["no hinge hangs below the body 'foot'"]),
        ({"foot": "shank"}, ["is attached to no hinge"]),
        ({"zero": float("nan")}, ["is not a valid angle"]),
        ({"zero": "10 deg"}, ["zero = '10 deg'", "is not a valid angle", "[rad]"]),
        ({"zero": 1e9}, ["is not a valid angle", "within a turn"]),
        ({"side": "both"}, ["side = 'both'", "right, left"]),
    ):
        with pytest.raises(InputError) as caught:
            find(plain, **arguments)  # type: ignore[arg-type]
        assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize("kind", ["slide", "ball", "free"])
def test_an_ankle_is_a_hinge(kind: str) -> None:
    joint = dataclasses.replace(hinge("ankle", (0, -1, 0)), kind=kind)  # type: ignore[arg-type]
    wrong = tree(SHANK_AND_FOOT[0], dataclasses.replace(SHANK_AND_FOOT[1], joints=(joint,)))
    with pytest.raises(InputError, match=f"is a {kind} joint, and an ankle is a hinge"):
        find(wrong, ankle="ankle")
    for given in ({"shank": "shank", "foot": "foot"}, {}):
        with pytest.raises(InputError, match=rf"no hinge lies between 'shank' and 'foot': ankle \({kind}\)"):
            find(wrong, **given)


def leg_of(prefix: str = "", suffix: str = "", y: float = 0.0) -> tuple[Part, Part]:
    """A shin on a pelvis, and its foot."""
    shin, knee, foot, ankle = (f"{prefix}{name}{suffix}" for name in ("shin", "knee", "foot", "ankle"))
    return (
        body(shin, "pelvis", at(0, y, -0.4), hinge(knee, (0, 1, 0))),
        body(foot, shin, at(0, 0, -0.4), hinge(ankle, (0, 1, 0)), centre=(0.05, 0, 0)),
    )


BOTH = (body("pelvis", None, np.eye(4)), *leg_of("left_", y=0.1), *leg_of("right_", y=-0.1))


def test_the_one_leg_of_a_body_is_not_taken_for_the_other() -> None:
    one = tree(body("left_shin", None, np.eye(4)), leg_of("left_")[1])
    with pytest.raises(InputError, match=r"left_shin and left_foot, is the left one by its name"):
        find(one, side="right")
    assert find(one, side="right", shank="left_shin").side == "right"  # who names it knows better


def test_what_hangs_on_a_shank_hides_no_leg() -> None:
    """A cuff's frame on the right shank is called a shank, too: the right leg is still there."""
    both = tree(*BOTH, body("frame_shank", "right_shin", np.eye(4)))
    assert find(both, side="right").foot == "right_foot"


def test_an_axis_along_the_shank_is_no_ankles() -> None:
    with pytest.raises(InputError, match=r"leans by 90 deg from the perpendicular to the shank"):
        find(with_ankle(shipped(), {"axis": np.array([0.0, 0.0, 1.0])}))
    oblique = np.array([0.0, -np.cos(np.radians(20.0)), np.sin(np.radians(20.0))])
    assert np.degrees(find(with_ankle(shipped(), {"axis": oblique})).tilt) == pytest.approx(20.0)


@pytest.mark.parametrize("lateral_end", ["up", "down"])
def test_an_oblique_axis_tells_where_the_shank_is(lateral_end: str) -> None:
    """The middle of the shank 30 cm up, in the axes that the leg is cut out in."""
    rise = np.radians(10.0 if lateral_end == "up" else -10.0)
    oblique = np.array([0.0, -np.cos(rise), np.sin(rise)])
    found = find(with_ankle(shipped(), {"axis": oblique}))
    middle = found.axes.T @ np.array([0.0, 0.0, 1.0])  # of the shank's own up
    aside = 300.0 * middle[1] / middle[2]
    assert abs(aside) == pytest.approx(300.0 * np.tan(np.radians(10.0)))
    way = "left" if aside > 0.0 else "right"
    assert any(f"leans to the {way}" in n and f"y = {aside:.0f} mm" in n for n in found.notes)


def test_two_legs_need_a_side_and_strange_names_need_naming() -> None:
    both = tree(*BOTH)
    with pytest.raises(InputError, match=r"there are two legs: .*allowed: right or left"):
        find(both)
    assert find(both, side="left").shank == "left_shin"
    assert find(both, foot="right_foot").side == "right"
    strange = tree(
        body("a", None, np.eye(4)),
        body("b", "a", at(0, 0, -1), hinge("p", (0, 1, 0)), centre=(0.1, 0, 0)),
        body("c", "b", at(0, 0, -1), hinge("q", (0, 1, 0)), centre=(0.1, 0, 0)),
    )
    with pytest.raises(InputError, match=r"no leg is found in robot\.urdf.*its bodies are a, b, c"):
        find(strange)
    assert find(strange, ankle="q").shank == "b"


@pytest.mark.parametrize("kind", ["hinge", "free"])
def test_a_knee_on_the_world_tells_up(kind: str) -> None:
    """A laboratory's leg without a thigh; the shank's centre of mass lies 9 deg ahead of the line."""
    knee = dataclasses.replace(hinge("knee", (0, 1, 0)), kind=kind)  # type: ignore[arg-type]
    ahead = float(np.tan(np.radians(9.0)) * 0.2)
    shank = body("shank", None, np.eye(4), knee, centre=(ahead, 0, -0.2))
    foot = body("foot", "shank", at(0, 0, -0.4), hinge("ankle", (0, 1, 0)), centre=(0.05, 0, 0))
    found = find(tree(shank, foot))
    lean = np.degrees(np.arctan2(found.axes[0, 2], found.axes[2, 2]))
    assert lean == pytest.approx(0.0 if kind == "hinge" else 9.0, abs=1e-9)
    assert found.shank_length == (pytest.approx(0.4) if kind == "hinge" else None)


def two_legs() -> Tree:
    """Legs by capital names, with a sensor's frame on each shank."""
    foot = ((0.04, 0.0, -0.03), (0.1, 0.03, 0.01))
    parts = [body("PELVIS", None, at(0, 0, 1))]
    for side, y in (("LEFT", 0.1), ("RIGHT", -0.1)):
        shank, ankle = f"{side}_SHIN", f"{side}_ANKLE_Y_LINK"
        parts += [
            body(shank, "PELVIS", at(0, y, -0.4), hinge(f"{side}_KNEE_Y", (0, 1, 0))),
            body(f"{side}_SHIN_IMU_LINK", shank, at(0, 0, -0.1)),
            body(ankle, shank, at(0, 0, -0.4), hinge(f"{side}_ANKLE_Y", (0, 1, 0))),
            body(f"{side}_FOOT", ankle, np.eye(4), hinge(f"{side}_ANKLE_X", (1, 0, 0)), box=foot),
        ]
    return tree(*parts)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_sensor_on_the_shank_does_not_hide_the_leg(side: Side) -> None:
    found = find(two_legs(), side=side)
    name = side.upper()
    names = f"{name}_SHIN", f"{name}_ANKLE_Y_LINK", f"{name}_ANKLE_Y"
    assert (found.shank, found.foot, found.ankle) == names
    assert found.side == side and found.how["shank"] == "by its name"


@pytest.mark.parametrize("side", ["left", "right"])
def test_legs_that_only_joints_name_are_one_a_side(side: Side) -> None:
    """LLEG is a left leg, not a lower one; pitch and roll on links without a telling name are one ankle."""
    parts = [body("WAIST", None, at(0, 0, 1))]
    for letter, y in (("L", 0.1), ("R", -0.1)):
        leg = f"{letter}LEG"
        parts += [
            body(f"{leg}_LINK4", "WAIST", at(0, y, -0.4), hinge(f"{leg}_KNEE", (0, 1, 0))),
            body(f"{leg}_LINK5", f"{leg}_LINK4", at(0, 0, -0.4), hinge(f"{leg}_ANKLE_P", (0, 1, 0))),
        ]
        roll, end = hinge(f"{leg}_ANKLE_R", (1, 0, 0)), f"{letter.lower()}_ankle"
        parts.append(body(end, f"{leg}_LINK5", np.eye(4), roll, centre=(0.05, 0, 0)))
    found = find(tree(*parts), side=side)
    leg = f"{side[0].upper()}LEG"
    assert (found.shank, found.foot, found.ankle) == (f"{leg}_LINK4", f"{leg}_LINK5", f"{leg}_ANKLE_P")
    assert found.side == side and found.welded == (f"{leg}_ANKLE_R",)


@pytest.mark.parametrize("side", ["left", "right"])
def test_of_two_legs_the_one_without_a_side_is_the_other_one(side: Side) -> None:
    """Gymnasium's walker in the plane has leg and foot beside leg_left and foot_left."""
    parts = body("pelvis", None, at(0, 0, 1)), *leg_of(), *leg_of(suffix="_left")
    found = find(tree(*parts), side=side)
    assert (found.foot, found.side, found.notes) == ("foot_left" if side == "left" else "foot", side, ())


def test_a_foot_that_is_fixed_or_on_a_ball_is_told() -> None:
    foot = body("r_foot", "r_shin", at(0, 0, -0.4), centre=(0.05, 0, 0))
    shin = body("r_shin", "pelvis", at(0, 0, -0.4), hinge("knee", (0, 1, 0)))
    bodies = (body("pelvis", None, at(0, 0, 1)), shin, foot)
    with pytest.raises(InputError, match="between 'r_shin' and 'r_foot': they are fixed to each other"):
        find(tree(*bodies))
    ball = dataclasses.replace(hinge("ankle", (0, 1, 0)), kind="ball")
    with pytest.raises(InputError, match=r"between 'r_shin' and 'r_foot': ankle .ball."):
        find(tree(*bodies[:2], dataclasses.replace(foot, joints=(ball,))))


def test_a_zero_that_the_ankle_does_not_reach_is_refused() -> None:
    """A hinge that counts 90 deg where the sole is flat: its coordinate 0 would turn the foot by 90 deg."""
    flat = find(shipped())
    right_angle = np.radians(90.0)
    joint = shipped().parts["foot"].joints[0]
    assert joint.range is not None
    stops = joint.range[0] + right_angle, joint.range[1] + right_angle
    counted = with_ankle(shipped(), {"range": stops, "zero": right_angle})
    with pytest.raises(InputError, match=r"does not reach its coordinate 0.*stands at 90 deg.*"):
        find(counted)
    found = find(counted, zero=right_angle)
    assert found.sign == flat.sign
    np.testing.assert_allclose(found.axes, flat.axes, atol=1e-12)


def test_millimetres_are_no_metres() -> None:
    grown = {
        name: dataclasses.replace(part, pose=at(*1000 * part.pose[:3, 3]), centre=1000 * part.centre)
        for name, part in two_legs().parts.items()
    }
    with pytest.raises(InputError, match=r"is 400 m long: the file's lengths look like millimetres"):
        find(tree(*grown.values()), side="right")


def test_a_foot_that_is_wider_than_long_is_doubted() -> None:
    wide = robot().parts["left_ankle_roll_link"]
    box = dataclasses.replace(wide.shapes[0], size=np.array([0.05, 0.13, 0.01]))
    odd = tree(*(robot().parts | {wide.name: dataclasses.replace(wide, shapes=(box,))}).values())
    (wide,) = [note for note in find(odd).notes if note.code == "foot-wide"]
    assert wide.data["width"] == pytest.approx(0.26)
    assert "foot-wide" not in [note.code for note in find(robot()).notes]


def test_a_foot_that_points_nowhere_is_refused() -> None:
    blind = tree(SHANK_AND_FOOT[0], dataclasses.replace(SHANK_AND_FOOT[1], centre=np.zeros(3)))
    with pytest.raises(
        InputError, match=r"reaches 0 mm to one side of the ankle's axis and 0 mm to the other.*--forward"
    ):
        find(blind)
    box = Shape("box", "box", at(0, 0, -0.03), np.array([0.1, 0.03, 0.01]))
    alike = dataclasses.replace(SHANK_AND_FOOT[1], centre=np.array([0.01, 0.0, -0.03]), shapes=(box,))
    with pytest.raises(InputError) as caught:  # of a foot that is seen, its mass does not show it
        find(tree(SHANK_AND_FOOT[0], alike))
    assert caught.value.field == "foot"


def test_a_direction_is_shown_as_it_can_be_given() -> None:
    with pytest.raises(InputError) as caught:
        find(tree(*SHANK_AND_FOOT), forward=(0.0, 2.0, 0.0))
    assert caught.value.field == "forward" and ast.literal_eval(str(caught.value.value)) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("lean", [3.0, -3.0, 8.0])
def test_the_shanks_own_axis_is_up_whichever_of_the_six_it_is(lean: float) -> None:
    """A mass 3 deg off it is on it; of one 8 deg off the line there is up, and the axis is none."""
    ahead = 0.2 * float(np.tan(np.radians(lean)))
    shank = body("shank", None, np.eye(4), centre=(ahead, 0, 0.2))
    up = np.array([ahead, 0.0, 0.2]) if abs(lean) > 5.0 else np.array([0.0, 0.0, 1.0])
    for axes in itertools.permutations(np.eye(3)):
        for signs in itertools.product([1.0, -1.0], repeat=3):
            own = np.eye(4)
            own[:3, :3] = np.array(axes) * np.array(signs)[:, None]
            if np.linalg.det(own) < 0.0:
                continue
            parts = in_axes(shank, own, np.eye(4)), in_axes(SHANK_AND_FOOT[1], np.eye(4), own)
            found = find(tree(*parts))
            np.testing.assert_allclose(found.axes[:, 2], up / np.linalg.norm(up), atol=1e-12)


@pytest.mark.parametrize("side", [0.2, -0.2])
def test_a_mass_beside_the_shank_shows_no_up(side: float) -> None:
    """It lies along the ankle's axis, on either side of it: the shank's longest side is up."""
    long = ((0, 0, 0.2), (0.02, 0.02, 0.2))
    found = find(tree(body("shank", None, np.eye(4), centre=(0, side, 0.02), box=long), SHANK_AND_FOOT[1]))
    np.testing.assert_allclose(found.axes[:, 2], [0.0, 0.0, 1.0], atol=1e-12)


def test_dm_controls_humanoid() -> None:
    """Its file tells: knee 0.33 m above the ankle, ankle 0.08 m above the foot's origin, axis +y."""
    package = pytest.importorskip("dm_control")
    file = pathlib.Path(package.__file__).parent / "suite" / "humanoid.xml"
    for side, y in (("right", -0.09), ("left", 0.09)):
        found = find(read_mjcf(file), side=side)  # type: ignore[arg-type]
        names = [f"{side}_shin", f"{side}_foot", f"{side}_ankle_y"]
        assert [found.shank, found.foot, found.ankle] == names
        assert (found.side, found.sign, found.welded) == (side, -1.0, (f"{side}_ankle_x",))
        assert found.shank_length == pytest.approx(0.33)
        assert found.centre[1] == pytest.approx(y)
        assert found.axes[0, 0] > 0.999


@pytest.mark.parametrize(
    ("aside", "side"), [(0.1, "left"), (-0.1, "right"), (0.04, "right"), (-0.04, "right")]
)
def test_the_side_is_that_of_the_ankle_wherever_the_bodies_origins_are(aside: float, side: str) -> None:
    """Of a CAD export all bodies have one origin; the leg's own mass stands aside of it."""
    ankle = dataclasses.replace(hinge("ankle", (0, -1, 0)), position=np.array([0.0, aside, -0.4]))
    knee = dataclasses.replace(hinge("knee", (0, 1, 0)), position=np.array([0.0, aside, 0.0]))
    one = tree(
        body("trunk", None, np.eye(4), centre=(0, -0.3 * aside, 0.5)),
        body("shank", "trunk", np.eye(4), knee, centre=(0, aside, -0.2)),
        body("foot", "shank", np.eye(4), ankle, centre=(0.05, aside, -0.45)),
    )
    found = find(one)  # 0.043 m off the centre of mass, or 0.017 m, which is no side
    assert found.side == side
    assert (found.how["side"] == "assumed") is (abs(aside) < 0.05)


@pytest.mark.parametrize("ahead", [1.0, -1.0])
def test_a_foot_alike_before_and_behind_points_as_the_body_does(ahead: float) -> None:
    """Left of the body is where the joints called left are; no knee shows where its back is."""
    box = ((0.0, 0.0, -0.03), (0.1, 0.03, 0.01))
    parts = [body("pelvis", None, np.eye(4))]
    for side, y in (("left", 0.1), ("right", -0.1)):
        shin, foot = f"{side}_shin", f"{side}_foot"
        parts.append(body(shin, "pelvis", at(0, ahead * y, -0.4), hinge(f"{side}_knee", (0, 1, 0))))
        parts.append(body(foot, shin, at(0, 0, -0.4), hinge(f"{side}_ankle", (0, 1, 0)), box=box))
    found = find(tree(*parts), side="left")
    assert (found.sign, found.side) == (-ahead, "left")
    np.testing.assert_allclose(found.axes[:, :2], np.diag([ahead, ahead, 0])[:, :2], atol=1e-15)
