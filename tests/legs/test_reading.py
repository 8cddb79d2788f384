"""Which reader reads a file."""

import pathlib

import pytest
from urdf_texts import two

from afo_sim.common.errors import InputError
from afo_sim.legs.reading import read_tree

MJCF = '<mujoco><worldbody><body name="foot"><geom size="0.1"/></body></worldbody></mujoco>'


@pytest.mark.parametrize("suffix", [".xml", ".mjcf", ".urdf", ".XML", ".URDF"])
def test_the_root_element_decides(suffix: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / f"leg{suffix}"
    file.write_text(MJCF)
    assert list(read_tree(file).parts) == ["foot"]
    file.write_text(two("continuous"))
    assert list(read_tree(file).parts) == ["shank", "foot"]


@pytest.mark.parametrize(
    ("name", "text", "word"),
    [
        ("leg.xacro", "<robot/>", "xacro FILE.xacro > FILE.urdf"),
        ("leg.urdf.xacro", "<robot/>", "xacro FILE.xacro > FILE.urdf"),
        ("leg.sdf", "<sdf/>", "Gazebo"),
        ("leg.xml", "<sdf/>", "Gazebo"),
        ("leg.osim", "<OpenSimDocument/>", "MyoConverter"),
        ("leg.xml", "<OpenSimDocument/>", "MyoConverter"),
        ("leg.zip", "PK", "unpacked"),
        ("leg.mjb", "x", "MJCF"),
        ("leg.xml", "<mujocoinclude/>", "includes"),
        ("leg.xml", "<html/>", "<html>"),
        ("leg.txt", "<mujoco/>", r"\.urdf"),
        ("leg", "<mujoco/>", r"\.urdf"),
        ("leg.xml", "", "empty"),
        ("leg.xml", "<mujoco><worldbody>", "XML parse error"),
        ("leg.xml", "<robot><link", "cut off"),
        ("leg.xml", "leg", "not XML"),
    ],
)
def test_other_files_are_told_what_to_do(name: str, text: str, word: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(InputError, match=word) as caught:
        read_tree(file)
    assert "\n" not in str(caught.value) and str(file) in str(caught.value)


@pytest.mark.parametrize("name", ["none.xml", "none.urdf", "none.zip", "none.osim"])
def test_no_file(name: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_tree(tmp_path / name)
    with pytest.raises(InputError, match="folder"):
        read_tree(tmp_path)


@pytest.mark.parametrize("text", [MJCF, two("continuous")])
def test_hyphens_in_a_comment_are_no_fault(text: str, tmp_path: pathlib.Path) -> None:
    """MuJoCo and ROS read them, and laboratories write them."""
    file = tmp_path / "leg.xml"
    file.write_text(text.replace("</", "<!-- foot -- left --></", 1))
    assert "foot" in read_tree(file).parts
