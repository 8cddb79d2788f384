"""Massless parts taken together with the one below."""

import pytest
from urdf_texts import BODY, joint, link, robot

from afo_sim.legs.massless import merged
from afo_sim.legs.urdf import read_urdf


def test_a_hip_of_three_hinges_is_one_part(tmp_path) -> None:
    links = link("pelvis") + link("a", "") + link("b", "") + link("thigh", BODY)
    joints = (
        joint("continuous", '<origin xyz="0 0 1"/><axis xyz="1 0 0"/>', name="x", parent="pelvis", child="a")
        + joint("continuous", '<origin rpy="0 0 1.5707963267948966"/>', name="y", parent="a", child="b")
        + joint("continuous", '<origin xyz="0 0 0.1"/>', name="z", parent="b", child="thigh")
    )
    file = tmp_path / "hip.urdf"
    file.write_text(robot(links + joints))
    tree = merged(read_urdf(file))
    assert list(tree.parts) == ["pelvis", "thigh"]
    thigh = tree.parts["thigh"]
    assert [one.name for one in thigh.joints] == ["x", "y", "z"]
    # turned about z by 90°, the first hinge's x axis is the thigh's −y; it is 0.1 m below the thigh's frame
    assert thigh.joints[0].axis == pytest.approx([0, -1, 0], abs=1e-12)
    assert thigh.joints[0].position == pytest.approx([0, 0, -0.1], abs=1e-12)
    assert thigh.pose[:3, 3] == pytest.approx([0, 0, 1.1])
    assert "a, b" in tree.notes[-1]


def test_what_has_mass_or_two_children_stays(tmp_path) -> None:
    links = link("pelvis") + link("a", "") + link("left") + link("right")
    joints = joint("continuous", name="x", parent="pelvis", child="a")
    joints += joint("fixed", name="l", parent="a", child="left")
    joints += joint("fixed", name="r", parent="a", child="right")
    file = tmp_path / "hip.urdf"
    file.write_text(robot(links + joints))
    tree = read_urdf(file)
    again = merged(tree)
    assert again.parts == tree.parts and again.notes == tree.notes
