"""Massless parts taken together with the one below."""

import mujoco
import numpy as np
import pytest
from leg_models import built, motion, random_mjcf
from urdf_texts import BODY, joint, link, robot

from afo_sim.legs import tree_of, write_urdf
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


@pytest.mark.parametrize("seed", range(6))
def test_several_joints_survive_urdf(seed: int, tmp_path) -> None:
    """Split into massless links for URDF and taken together again, a body moves like the model."""
    model = mujoco.MjModel.from_xml_string(random_mjcf(seed, most_joints=3))
    tree = tree_of(model)
    notes = write_urdf(tree, tmp_path / "leg.urdf", points=False)
    assert any("massless links" in note for note in notes)
    again = merged(read_urdf(tmp_path / "leg.urdf"))
    assert set(again.parts) == set(tree.parts)
    joints = list(tree.joints())
    position, speed = np.random.default_rng(seed).normal(size=(2, len(joints)))
    for ours, theirs in zip(
        motion(built(again), joints, position, speed), motion(model, joints, position, speed), strict=True
    ):
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-9)


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
