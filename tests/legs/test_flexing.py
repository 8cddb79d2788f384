"""Which way a joint flexes, and what is one joint, on persons whose anatomy is known by construction."""

import re
import types
from typing import Any

import mujoco
import numpy as np
import pytest
from person import ARMS, person
from turned_leg import told_otherwise

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import JOINTS
from afo_sim.legs import Found, Part, Tree, tree_of
from afo_sim.legs.finding_joint import NAMED, find_worn
from afo_sim.legs.flexing import body_left, cluster_of
from afo_sim.legs.tree import Joint

FLEXORS = {
    "hip_pitch": "hip",
    "knee": "knee",
    "shoulder_pitch": "shoulder",
    "elbow": "elbow",
    "wrist": "wrist",
}
FLEXORS |= {"index_mcp": "finger", "ring_pip": "finger", "thumb_mcp": "thumb", "thumb_pip": "thumb"}
LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]).T  # on the back: forward is up
TURNS = {"facing x": np.eye(3), "facing y": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), "lying": LYING}


def found(
    text: str, kind: str, joint: str | None, sign: float | None = None, seed: int | None = None, **names: str
) -> Found:
    """What is found on a person; with a seed every body has axes of its own."""
    tree = tree_of(mujoco.MjModel.from_xml_string(text))
    tree = tree if seed is None else told_otherwise(tree, np.random.default_rng(seed))
    device: Any = types.SimpleNamespace(joint=kind, words=JOINTS[kind], name="")  # type: ignore[index]
    places = joint, names.get("proximal"), names.get("distal")
    return find_worn(tree, device, places, None, None, sign, None)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("arms", ARMS)
def test_each_joint_flexes_as_its_anatomy_says(arms: str, way: int, turn: str) -> None:
    """Both sides, coordinates that rise or fall in flexion, arms in any posture, a body facing anywhere."""
    text = person(arms, way, TURNS[turn])
    for side in ("left", "right"):
        for joint, kind in FLEXORS.items():
            if kind == "shoulder" and arms in ("spread", "oblique"):
                continue  # its axis lies along the arm, or leans by 35 deg
            leg = found(text, kind, f"{side}_{joint}")
            assert (leg.sign, leg.side) == (way, side), (joint, leg.how)
            assert found(text, kind, f"{side}_{joint}", seed=way + 1).sign == way
            forward = TURNS[turn] @ np.eye(3)[0]
            if kind in ("hip", "knee") or (kind in ("shoulder", "elbow") and arms == "hanging"):
                assert leg.axes[:, 0] == pytest.approx(forward, abs=0.1)


@pytest.mark.parametrize("way", [1, -1])
def test_a_kneecap_beside_the_shank_hides_no_knee(way: int) -> None:
    """It lies 5 cm ahead of the knee; unlimited, it would say that the knee bends forward."""
    cap = f'<body name="right_patella" pos="0 0 -0.3"><joint name="cap" axis="0 {way} 0"/>'
    cap += '<inertial pos="0.05 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/></body>'
    text = person(way=way, sides=("right",)).replace(
        '<body name="right_shank"', f'{cap}<body name="right_shank"'
    )
    leg = found(text, "hip", "right_hip_pitch")
    assert (leg.sign, leg.how["up"]) == (way, "from the joint 'right_knee' up to it")


def test_a_person_has_a_left_of_ones_own() -> None:
    """Another one in the scene, who has arms too, faces the first, who has legs alone."""
    legs = re.sub(
        r'(?s)<body name="(left|right)_arm_1".*?(?=<body name="left_hip_1"|<body name="right_hip_1")',
        "",
        person(),
    )
    other = person(turn=np.diag([-1.0, -1.0, 1.0])).split("<worldbody>")[1].split("</worldbody>")[0]
    text = legs.replace("</worldbody>", other.replace('name="', 'name="other_') + "</worldbody>")
    for joint, kind in (
        ("left_hip_pitch", "hip"),
        ("other_right_knee", "knee"),
        ("other_left_elbow", "elbow"),
    ):
        leg = found(text, kind, joint)
        assert leg.sign == 1.0 and "left and right of the body" in leg.how["sign"]


def test_crossed_hands_do_not_turn_the_body_round(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each hand with its eight hinges lies beyond the midline; no knee has stops."""
    monkeypatch.setitem(ARMS, "crossed", ((1, -1, -1), (0, -1, 0), (-1, 0, 0)))
    leg = found(person("crossed", knee=None), "hip", "left_hip_pitch")
    assert (leg.sign, leg.how["sign"]) == (1.0, "left and right of the body")


@pytest.mark.parametrize("way", [1, -1])
def test_a_subtalar_hinge_at_the_heel_does_not_turn_the_foot_round(way: int) -> None:
    """OpenSim's begins 49 mm behind the ankle and 42 mm below; the knee has no stops and no other side."""
    heel = (
        '<body name="right_calcn" pos="-0.049 0 -0.042"><joint name="right_subtalar" axis="0.79 0.12 0.6"/>'
    )
    heel += '<inertial pos="0.1 0 0.03" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body>'
    before, after = person(way=way, sides=("right",), knee=None).split('<body name="right_foot"')
    leg = found(
        before + '<body name="right_foot"' + after.replace("<geom", f"{heel}<geom", 1), "knee", "right_knee"
    )
    assert (leg.sign, leg.how["sign"]) == (way, "the fold of the ankle below it")


def test_stops_that_reach_farther_back_do_not_turn_a_bent_elbow_round() -> None:
    """Of 90 deg at zero it goes 60 deg on and 95 deg back: that it folds counts from straight."""
    text = person("bent by 90 deg", sides=("right",))
    assert found(text, "elbow", "right_elbow").sign == 1.0


@pytest.mark.parametrize(
    ("kind", "joint"), [("hip", "hip_pitch"), ("knee", "knee"), ("shoulder", "shoulder_pitch")]
)
@pytest.mark.parametrize("way", [1, -1])
def test_one_side_alone_shows_it_by_its_limb(kind: str, joint: str, way: int) -> None:
    """Without the other side: by knee, foot and elbow."""
    text = person(way=way, sides=("right",), knee=None if kind == "knee" else (-5.0, 140.0))
    leg = found(text, kind, f"right_{joint}")
    assert leg.sign == way and "body" not in leg.how["sign"]


@pytest.mark.parametrize(
    ("kind", "joint", "how", "words"),
    [
        ("knee", "left_knee", {"backward": True}, "left and right of the body says -1, its own fold says 1"),
        (
            "elbow",
            "left_elbow",
            {"arms": "spread", "elbow": (-90.0, 90.0)},
            "90 deg one way and 90 deg the other",
        ),
        ("elbow", "left_elbow", {"arms": "spread", "elbow": None}, "leans by 90 deg from left and right"),
        ("hip", "left_hip_pitch", {"backward": True}, "body says 1, the fold of the knee below it says -1"),
        ("hip", "left_hip_roll", {}, "its axis leans by 90 deg from left and right of the body"),
        (
            "wrist",
            "left_wrist_deviation",
            {},
            "its axis leans by 90 deg from the fold of the finger below it",
        ),
    ],
)
def test_what_is_not_clear_is_refused_and_told(
    kind: str, joint: str, how: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words) as refused:
        found(person(**how), kind, joint)
    assert refused.value.field == "sign" and "1 where its own coordinate rises" in str(refused.value)
    leg = found(person(**how), kind, joint, sign=-1)
    assert leg.sign == -1.0 and leg.how["sign"] == "given"


def test_a_hinge_along_its_limb_is_refused_by_its_axis() -> None:
    with pytest.raises(InputError, match=r"leans by (89|90) deg from the perpendicular") as refused:
        found(person(), "hip", "left_hip_yaw")
    assert refused.value.field == "joint"


def test_a_sign_against_the_anatomy_is_told() -> None:
    (note,) = found(person(), "elbow", "left_elbow", sign=-1).notes
    assert note.code == "sign-contradicted"  # type: ignore[attr-defined]
    assert found(person(), "elbow", "left_elbow", sign=1).notes == ()


def test_hinges_at_one_place_are_one_joint() -> None:
    """Between them stand links without mass to speak of; the thigh's own axis lies 13 cm down."""
    hip = found(person(), "hip", "left_hip_pitch")
    assert (hip.shank, hip.foot, hip.how["up"]) == (
        "trunk",
        "left_thigh",
        "from the joint 'left_knee' up to it",
    )
    arm = found(person(), "shoulder", "right_shoulder_pitch")
    assert (arm.shank, arm.foot, arm.how["up"]) == (
        "trunk",
        "right_upper_arm",
        "from the joint 'right_elbow' up to it",
    )
    hand = found(person(), "wrist", "left_wrist")
    assert (hand.shank, hand.foot) == ("left_forearm", "left_hand")
    knee = found(person(), "knee", "left_knee")
    assert (knee.shank, knee.foot) == ("left_thigh", "left_shank")
    alone = found(person(), "hinge", "right_shoulder_pitch")  # beside another axis at its very place
    assert (alone.shank, alone.foot) == ("trunk", "right_arm_1")
    finger = found(person(), "finger", "left_index_pip")
    assert (finger.shank, finger.foot) == ("left_index_base", "left_index_tip")


def test_named_bodies_are_taken_with_their_axes() -> None:
    """Of a hip down to the foot, up is from the foot's centre of mass, 5 cm ahead and 83 cm below."""
    plain = found(person(), "hip", "left_hip_pitch")
    leg = found(person(), "hip", "left_hip_pitch", distal="left_foot")
    assert (leg.shank, leg.foot) == ("trunk", "left_foot")
    assert leg.axes.T @ plain.axes[:, 2] == pytest.approx(
        [0.05 / np.hypot(0.83, 0.05), 0.0, 0.83 / np.hypot(0.83, 0.05)]
    )


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("right_shoulder_pitch_joint", {"shoulder"}),
        ("LLEG_KNEE", {"knee"}),
        ("left_hand_index_0_joint", {"finger"}),
        ("Right_pinky_q1", {"finger"}),
        ("mcp2_flexion_r", {"finger"}),
        ("robot0:FFJ2", {"finger"}),
        ("thumb_mcp", {"thumb"}),
        ("robot0:THJ1", {"thumb"}),
        ("LWristPitch", {"wrist"}),
        ("middle_cervical_X", set()),
        ("spring_2", set()),
    ],
)
def test_names_tell_the_joint(name: str, kinds: set[str]) -> None:
    from afo_sim.legs.candidates import has

    assert {kind for kind, words in NAMED.items() if has(words, name)} == kinds


def test_of_several_hinges_of_a_joint_the_one_that_flexes_is_taken() -> None:
    text = person(sides=("left",))
    assert found(text, "hip", None).ankle == "left_hip_pitch"
    with pytest.raises(InputError, match="allowed: left_wrist_deviation, left_wrist"):
        found(text, "wrist", None)


@pytest.mark.parametrize("off", [0.003, 0.015])
def test_a_mass_some_millimetres_off_the_axis_shows_the_way(off: float) -> None:
    text = """<mujoco><worldbody><body name="base"><inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/>
      <body name="bob"><joint name="pin" axis="0 1 0"/><inertial pos="{} 0 0" mass="1" diaginertia="1 1 1"/>
      </body></body></worldbody></mujoco>"""
    assert found(text.format(-off), "hinge", "pin").axes[:, 2] == pytest.approx([1.0, 0.0, 0.0])
    with pytest.raises(InputError, match="no joint, mass or shape lies 2 mm off the axis of 'pin'"):
        found(text.format(0.001), "hinge", "pin")
    shaped = text.format("0.001").replace(
        '<inertial pos="0.001', '<geom size="0.01" pos="0 0 -0.03"/><inertial pos="0.001'
    )
    assert found(shaped, "hinge", "pin").how["up"] == "from the middle of 'bob''s shapes up to it"


LEG = """<mujoco><compiler autolimits="true"/><worldbody>{}
  <body name="shank" pos="0 0 0.5"><inertial pos="0 0 0.2" mass="3" diaginertia="0.05 0.05 0.01"/>
  <body name="foot"><inertial pos="0.05 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
  <joint name="ankle" axis="0 -1 0" range="-50 30"/>
  <geom name="sole" type="box" size="0.12 0.04 0.03" pos="0.05 0 -0.05"/></body></body>
  <body name="door" pos="2 0 3"><joint name="latch" axis="0 0 1" {}/><geom size="0.1"/></body></worldbody>
  {}</mujoco>"""
JOINED = '<equality><joint name="coupled" joint1="latch" polycoef="0.3 0 0 0 0"/></equality>'


@pytest.mark.parametrize(
    ("parts", "code", "data"),
    [
        (("", "", ""), None, {}),
        (('<geom name="step" type="plane" size="1 1 1" pos="0 0 0.421"/>', "", ""), None, {}),
        (
            ('<geom type="plane" size="1 1 1" pos="0 0 0.44"/>', "", ""),
            "start-in-contact",
            {"depth": 20.0, "count": 4},
        ),
        (("", 'range="15 40"', ""), "start-out-of-bounds", {"names": "latch", "most": np.radians(15.0)}),
        (("", "", JOINED), "start-out-of-bounds", {"names": "coupled", "most": 0.3}),
    ],
)
def test_a_start_that_throws_bodies_apart_is_told_first(
    parts: tuple[str, str, str], code: str | None, data: dict[str, Any]
) -> None:
    """A sole 20 mm in the floor; a joint 15 deg beyond its stop; one that an equality wants 0.3 rad away."""
    leg = afo.attach(mujoco.MjSpec.from_string(LEG.format(*parts)), "s1", side="right")
    codes = [note.code for note in leg.notices]  # type: ignore[attr-defined]
    assert [each for each in codes if each.startswith("start")] == ([code] if code else [])
    if code:
        assert codes[0] == code
        told: Any = leg.notices[0]
        assert all(
            told.data[key] == (pytest.approx(value) if key != "names" else value)
            for key, value in data.items()
        )


def test_the_jaws_of_a_gripper_are_not_left_and_right_of_an_arm() -> None:
    """An arm by itself, whose elbow goes 150 deg either way, with a left and a right jaw."""

    jaws = "".join(
        f'<body name="{side}_jaw" pos="0 {y} -0.3"><joint name="{side}_jaw" axis="1 0 0"/><geom size="0.01"/>'
        "</body>"
        for side, y in (("left", 0.05), ("right", -0.05))
    )
    text = f"""<mujoco><compiler autolimits="true"/><worldbody><body name="upper"><geom size="0.05"/>
      <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 1 0" range="-150 150"/>
      <geom size="0.04" pos="0 0 -0.1"/>{jaws}</body></body></worldbody></mujoco>"""
    with pytest.raises(InputError, match="150 deg the other, nothing shows left and right of the body"):
        found(text, "elbow", "elbow")


def test_of_two_hinges_at_a_thumbs_base_neither_is_guessed() -> None:
    """Each folds one way alone, and no further joint of the thumb shows which of them flexes."""
    text = """<mujoco><compiler autolimits="true"/><worldbody><body name="palm"><geom size="0.03"/>
      <body name="thumb" pos="0.04 0 0"><geom size="0.01" pos="0.03 0 0"/>
      <joint name="thumb_z" axis="0 0 1" range="-10 60"/><joint name="thumb_y" axis="0 1 0" range="-60 10"/>
      </body></body></worldbody></mujoco>"""
    for joint in ("thumb_z", "thumb_y"):
        with pytest.raises(InputError, match="which of them flexes is open") as refused:
            found(text, "thumb", joint)
        assert refused.value.field == "sign"
    assert (
        found(
            text.replace('<joint name="thumb_y" axis="0 1 0" range="-60 10"/>', ""), "thumb", "thumb_z"
        ).sign
        == 1.0
    )


AWAY = np.sqrt(1.0 - 0.87**2)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("kind", "axis", "place", "one"),
    [
        ("knee", (1, 0, 0), (0, 0, 0.06), True),
        ("knee", (1, 0, 0), (0, 0, 0.0625), False),
        ("knee", (0, 1, 0), (0, 5.0, 0.01), True),  # along the same line
        ("knee", (0, 1, 0), (0, 0, 0.0105), False),
        ("knee", (AWAY, 0.87, 0), (0, 0, 0.03), True),
        ("knee", (AWAY - 0.01, 0.88, 0), (0, 0, 0.03), False),
        ("ankle", (1, 0, 0), (0, 0, -0.064), True),  # OpenSim's subtalar axis
        ("ankle", (1, 0, 0), (0, 0, -0.085), False),
        ("finger", (1, 0, 0), (0.014, 0, 0), True),
        ("finger", (1, 0, 0), (0.016, 0, 0), False),
        ("hip", (0, 0, 1), (0, 0, -0.3), True),  # along the thigh, which it lies in
        ("shoulder", (0, 0, 1), (0, 0, -0.3), True),
        ("knee", (0, 0, 1), (0, 0, -0.3), False),
        ("hip", (1, 0, 0), (0, 0, -0.3), False),
        ("hinge", (1, 0, 0), (0, 0, 0), False),
    ],
)
def test_hinges_are_one_joint_by_their_lines_and_not_by_the_sense_of_their_axes(
    kind: str, axis: tuple[float, ...], place: tuple[float, ...], one: bool, way: float
) -> None:
    """Close by, and where they are parallel on one line."""
    for first, second in ((way, 1.0), (1.0, way)):
        upper = Joint("upper", "hinge", np.array([0.0, first, 0.0]), np.zeros(3))
        lower = Joint("lower", "hinge", second * np.array(axis, float), np.array(place, float))
        bare = np.eye(4), 1.0, np.zeros(3), np.eye(3)
        parts = Part("a", None, *bare), Part("b", "a", *bare, (upper,)), Part("c", "b", *bare, (lower,))
        tree = Tree(None, {part.name: part for part in parts})
        assert [part.name for part in cluster_of(tree, "upper", kind)] == ["b", "c"][: 1 + one]


@pytest.mark.parametrize(
    ("hips", "knees", "seen"),
    [
        (0.001, 0.0, False),
        (0.0011, 0.0, True),
        (-0.1, 0.0, True),
        (0.1875, -0.0625, False),
        (0.1875, -0.06, True),
        (0.1, -0.1, False),
    ],
)
def test_left_and_right_show_left_where_they_lie_apart_and_about_agree(
    hips: float, knees: float, seen: bool
) -> None:
    """More than 2 mm apart, and what is against it less than a third of what is for it."""
    bare = np.eye(4), 1.0, np.zeros(3), np.eye(3)
    parts = {"base": Part("base", None, *bare)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        above = "base"
        for name, aside in (("hip", hips), ("knee", knees)):
            joint = Joint(f"{side}_{name}", "hinge", np.eye(3)[0], np.array([0.0, sign * aside, 0.0]))
            parts[f"{side} below {name}"] = Part(f"{side} below {name}", above, *bare, (joint,))
            above = f"{side} below {name}"
    left = body_left(Tree(None, parts), "right_knee")
    assert left is None if not seen else left == pytest.approx([0.0, np.sign(hips + knees), 0.0])
