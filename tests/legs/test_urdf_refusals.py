"""Bad URDF files: one sentence each, with the name of what is wrong in it."""

import pathlib

import pytest
from urdf_texts import BODY, INERTIA, joint, link, robot, two

from afo_sim.common.errors import InputError
from afo_sim.legs.urdf import read_urdf

GOOD = two("continuous")


def with_inertia(ixx: object = 0.02, iyy: object = 0.03, izz: object = 0.04, ixy: object = 0) -> str:
    return BODY.replace(
        INERTIA, f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{ixy}" ixz="0" iyz="0"/>'
    )


def with_mass(mass: str) -> str:
    return BODY.replace('<mass value="2"/>', mass)


def limited(lower: object, upper: object) -> str:
    return f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'


THREE = link("shank") + link("foot") + link("toes")
BAD = {
    "negative mass": (two("fixed", foot=with_mass('<mass value="-2"/>')), ["link 'foot'", "-2 kg"]),
    "no mass": (two("fixed", foot=with_mass("")), ["link 'foot'", "<mass"]),
    "mass without value": (two("fixed", foot=with_mass("<mass/>")), ["'foot' <mass value>", "missing"]),
    "mass is a word": (two("fixed", foot=with_mass('<mass value="2 kg"/>')), ["link 'foot'", "'2 kg'"]),
    "mass is no number": (two("fixed", foot=with_mass('<mass value="nan"/>')), ["link 'foot'", "finite"]),
    "inertia of nothing": (two("continuous", foot=with_inertia(0, 0, 0)), ["link 'foot'", "not positive"]),
    "negative inertia": (two("fixed", foot=with_inertia(ixy=0.1)), ["link 'foot'", "not positive"]),
    "impossible inertia": (two("fixed", foot=with_inertia(izz=0.06)), ["link 'foot'", "0.06", "centre"]),
    "no inertia": (two("fixed", foot=BODY.replace(INERTIA, "")), ["link 'foot'", "<inertia>"]),
    "half an inertia": (two("fixed", foot=BODY.replace('iyy="0.03"', "")), ["link 'foot'", "<inertia iyy>"]),
    "two numbers": (two("fixed", '<origin xyz="0 1"/>'), ["joint 'ankle'", "2 numbers, not 3"]),
    "no axis": (two("continuous", '<axis xyz="0 0 0"/>'), ["joint 'ankle'", "axis", "no length"]),
    "range turned round": (two("revolute", limited(0.3, -0.5)), ["joint 'ankle'", "0.3 to -0.5", "exchange"]),
    "endless range": (two("revolute", limited(-1, "inf")), ["joint 'ankle'", "<limit upper>", "finite"]),
    "negative damping": (two("continuous", '<dynamics damping="-1"/>'), ["joint 'ankle'", "damping of -1"]),
    "unknown type": (two("revolut"), ["joint 'ankle'", "'revolut'", "did you mean 'revolute'?"]),
    "no type": (GOOD.replace(' type="continuous"', ""), ["joint 'ankle'", "no type"]),
    "unknown parent": (
        GOOD.replace('<parent link="shank"', '<parent link="shan"'),
        ["joint 'ankle' <parent link>", "'shan'", "did you mean 'shank'?"],
    ),
    "unknown child": (
        GOOD.replace('<child link="foot"', '<child link="fot"'),
        ["joint 'ankle' <child link>", "'fot'", "did you mean 'foot'?"],
    ),
    "no child": (GOOD.replace('<child link="foot"/>', ""), ["joint 'ankle'", "<child"]),
    "unreached": (robot(THREE + joint("continuous")), ["link 'toes'", "no joint", "'shank' is the root"]),
    "two parents": (
        robot(THREE + joint("fixed", name="a", child="toes") + joint("fixed", name="b")
              + joint("fixed", name="c", parent="toes")),
        ["link 'foot'", "two parents", "'b' and 'c'"],
    ),
    "circle": (
        robot(THREE + joint("fixed", name="a") + joint("fixed", name="b", parent="foot", child="toes")
              + joint("fixed", name="c", parent="toes", child="shank")),
        ["hangs on itself", "shank", "toes", "foot"],
    ),
    "on itself": (
        robot(THREE + joint("fixed", child="toes") + joint("fixed", name="b", parent="foot", child="foot")),
        ["link 'foot'", "hangs on itself"],
    ),
    "two links of a name": (
        robot(link("shank") + link("foot") + link("foot") + joint("fixed")), ["link 'foot'", "stands twice"],
    ),
    "two joints of a name": (
        robot(THREE + joint("fixed") + joint("fixed", child="toes")), ["joint 'ankle'", "stands twice"],
    ),
    "link without a name": (GOOD.replace('<link name="foot">', "<link>"), ["<link> in line 1", "no name"]),
    "a colour of words": (
        GOOD.replace("</robot>", '<material name="bone"><color rgba="white"/></material></robot>'),
        ["material 'bone' <color rgba>", "'white'"],
    ),
    "no links": (robot(""), ["no <link>"]),
    "mimic of nothing": (two("continuous", "<mimic/>"), ["joint 'ankle'", "mimic"]),
    "not a robot": ("<mujoco/>", ["<mujoco>", "no URDF"]),
    "xacro": (GOOD.replace("<robot", '<robot xmlns:xacro="http://ros.org/wiki/xacro"').replace(
        "</robot>", "<xacro:macro/></robot>"), ["xacro FILE.xacro"]),
    "unexpanded": (two("continuous", '<origin xyz="${length} 0 0"/>'), ["xacro"]),
    "empty": ("", ["is empty"]),
    "blank": (" \n ", ["is empty"]),
    "cut off": (GOOD[: len(GOOD) // 2], ["cut off"]),
    "a letter": ("Dear all, here is the leg.", ["is not XML"]),
    "two tops": (GOOD + GOOD, ["XML"]),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_one_sentence_with_the_name(case: str, tmp_path: pathlib.Path, capfd) -> None:
    text, words = BAD[case]
    file = tmp_path / "my leg.urdf"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_urdf(file)
    message = str(caught.value)
    assert "\n" not in message and not caught.value.others
    assert str(file) in message
    assert not [word for word in words if word not in message], message
    assert capfd.readouterr() == ("", "")


def test_everything_that_is_wrong_is_told_at_once(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "leg.urdf"
    bad = link("shank", with_mass('<mass value="-2"/>')) + link("foot", with_inertia(izz=9)) + link("toes")
    file.write_text(robot(bad + joint("revolute", limited(2, 1) + '<axis xyz="0 0 0"/>', child="fot")))
    with pytest.raises(InputError) as caught:
        read_urdf(file)
    lines = str(caught.value).splitlines()
    assert len(lines) == 6  # mass, inertia, axis, range, a name, and a link that nothing reaches
    assert all(line.startswith(f"{file}: ") for line in lines)


@pytest.mark.parametrize(
    "content", [b"\0" * 50, bytes(range(256)), b"PK\x03\x04" + b"\x99" * 80, b"\xff\xfe<"]
)
def test_binary_files(content: bytes, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "leg.urdf"
    file.write_bytes(content)
    with pytest.raises(InputError, match="XML") as caught:
        read_urdf(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("cut", range(1, len(GOOD) - 8, 7))
def test_a_file_that_is_cut_anywhere_is_refused(cut: int, tmp_path: pathlib.Path) -> None:
    """yourdfpy alone would read what is left."""
    file = tmp_path / "leg.urdf"
    file.write_text(GOOD[:cut])
    with pytest.raises(InputError, match="XML"):
        read_urdf(file)


def test_places_that_hold_no_file(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_urdf(tmp_path / "none.urdf")
    with pytest.raises(InputError, match="folder"):
        read_urdf(tmp_path)


def test_an_entity_is_not_followed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "secret").write_text("7")
    file = tmp_path / "leg.urdf"
    entity = f'<!DOCTYPE robot [<!ENTITY mass SYSTEM "{tmp_path}/secret">]>'
    file.write_text(entity + two("fixed", foot=with_mass('<mass value="2">&mass;</mass>')))
    assert read_urdf(file).parts["foot"].mass == 2
