"""Trees from MuJoCo's files, by hand and by its own compile, and which files are read at all."""

import pathlib

import mujoco
import numpy as np
import pytest
from leg_models import assert_moves_alike, built, random_mjcf
from urdf_texts import two

from afo_sim.common import InputError
from afo_sim.legs import read_tree, tree_of
from afo_sim.legs.mjcf import read_mjcf

LEG = """
<mujoco>
  <default>
    <joint damping="0.5"/><default class="soft"><joint stiffness="7" springref="10"/></default>
  </default>
  <asset><material name="steel" rgba="0.1 0.2 0.3 0.4"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/><site name="of_the_world"/>
    <body name="shank" pos="0 0 1" euler="0 90 0">
      <inertial pos="0 0 -0.2" mass="3" diaginertia="0.05 0.04 0.01" euler="0 0 90"/>
      <joint name="knee" axis="0 2 0" range="-120 0" pos="0 0 0.1" ref="-30"
        armature="0.02" frictionloss="0.3"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" mass="0" material="steel"/>
      <body name="foot" pos="0 0 -0.4">
        <joint name="ankle" class="soft" axis="0 -1 0"/>
        <geom name="sole" type="box" size="0.1 0.04 0.02" mass="1.2" pos="0.05 0 0"/>
        <site name="heel" pos="-0.05 0 -0.02"/>
        <body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" density="1000"/></body>
      </body>
    </body>
  </worldbody>
  <tendon><spatial name="soleus"><site site="heel"/><site site="of_the_world"/></spatial></tendon>
  <actuator><motor name="push" joint="ankle"/><motor joint="knee"/></actuator>
  <sensor><jointpos joint="ankle"/></sensor>
  <keyframe><key name="stand"/></keyframe>
</mujoco>
"""


@pytest.fixture
def leg(tmp_path: pathlib.Path):
    file = tmp_path / "my leg.xml"
    file.write_text(LEG)
    return read_mjcf(file)


def test_masses_are_those_of_the_file_and_of_volume_times_density(leg) -> None:
    assert leg.parts["shank"].mass == 3.0
    assert leg.parts["foot"].mass == pytest.approx(1.2, rel=1e-12)
    assert leg.parts["body_3"].mass == pytest.approx(1000 * 4 / 3 * np.pi * 1e-3, rel=1e-12)


def test_inertia_is_turned_into_the_part(leg) -> None:
    # about z by 90°: x and y change places
    assert leg.parts["shank"].inertia == pytest.approx(np.diag([0.04, 0.05, 0.01]), abs=1e-12)
    a, b, c = 0.2, 0.08, 0.04
    box = 1.2 / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    assert leg.parts["foot"].inertia == pytest.approx(np.diag(box), abs=1e-12)
    assert leg.parts["foot"].centre == pytest.approx([0.05, 0, 0], abs=1e-12)


def test_parts_stand_as_in_the_file(leg) -> None:
    assert list(leg.parts) == ["shank", "foot", "body_3"]
    assert [part.parent for part in leg.parts.values()] == [None, "shank", "foot"]
    # turned about y by 90°, down is backward: 0.4 m below the knee is 0.4 m behind it
    assert leg.world_pose("foot")[:3, 3] == pytest.approx([-0.4, 0, 1], abs=1e-12)


def test_joints_are_in_radians_with_their_defaults(leg) -> None:
    knee = leg.joints()["knee"][1]
    assert knee.axis == pytest.approx([0, 1, 0]) and knee.position == pytest.approx([0, 0, 0.1])
    assert knee.range == pytest.approx(np.radians([-120, 0]))
    assert knee.zero == pytest.approx(np.radians(-30))
    assert (knee.damping, knee.armature, knee.friction, knee.stiffness) == (0.5, 0.02, 0.3, 0.0)
    ankle = leg.joints()["ankle"][1]
    assert ankle.range is None and ankle.stiffness == 7
    assert ankle.spring_reference == pytest.approx(np.radians(10))
    assert leg.joints()["body_3_joint"][1].kind == "slide"


def test_shapes_and_points(leg) -> None:
    capsule, (sole,) = leg.parts["shank"].shapes[0], leg.parts["foot"].shapes
    assert (capsule.kind, capsule.name) == ("capsule", "shank_shape")
    assert capsule.size[:2] == pytest.approx([0.03, 0.2])
    assert capsule.pose[:3, 3] == pytest.approx([0, 0, -0.2])
    assert capsule.rgba == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert (sole.kind, sole.name, list(sole.size)) == ("box", "sole", [0.1, 0.04, 0.02])
    assert leg.parts["foot"].points["heel"] == pytest.approx([-0.05, 0, -0.02])
    assert not leg.parts["shank"].points


def test_what_else_stands_in_the_file_is_told(leg) -> None:
    assert leg.beside == {
        "tendons": ("soleus",),
        "actuators": ("push", "actuator_1"),
        "sensors": ("sensor_0",),
        "keyframes": ("stand",),
    }
    assert leg.notes == ("parts without a name are called body_3",)


def test_names_of_unnamed_bodies_are_their_own() -> None:
    geom = '<geom size="1"/>'
    bodies = f'<body name="body_2">{geom}</body><body>{geom}</body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    assert list(tree_of(model).parts) == ["body_2", "body_2_2"]


@pytest.mark.parametrize("seed", range(6))
def test_a_tree_moves_like_its_model(seed: int) -> None:
    """Built again from the tree alone, inertia matrix, bias and passive forces are the model's."""
    model = mujoco.MjModel.from_xml_string(random_mjcf(seed, most_joints=3))
    tree = tree_of(model)
    assert_moves_alike(built(tree), model, list(tree.joints()), seed)


def test_a_mesh_stands_where_mujoco_put_it(tmp_path: pathlib.Path) -> None:
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]]) * 0.1
    flat = " ".join(f"{x:g}" for x in corners.flatten())
    text = f"""<mujoco><asset><mesh name="m" vertex="{flat}" scale="1 1 2"/></asset><worldbody><body name="b"
        pos="1 2 3"><geom type="mesh" mesh="m" density="500"/></body></worldbody></mujoco>"""
    file = tmp_path / "mesh.xml"
    file.write_text(text)
    part = read_mjcf(file).parts["b"]
    (shape,) = part.shapes
    seen = shape.vertices @ shape.pose[:3, :3].T + shape.pose[:3, 3]
    wanted = corners * [1, 1, 2]
    assert np.abs(seen[:, None] - wanted[None]).max(-1).min(0) == pytest.approx(0, abs=1e-6)
    # a tetrahedron's volume is a sixth of its edges' product, its centre the mean of its corners
    assert part.mass == pytest.approx(500 * 0.2 * 0.3 * 0.8 / 6, rel=1e-6)
    assert part.centre == pytest.approx(wanted.mean(axis=0), abs=1e-7)
    assert shape.faces.shape == (4, 3)


@pytest.mark.parametrize("name", ["leg.xml", "leg.mjcf"])
def test_a_piece_is_included_and_meshdir_is_followed(tmp_path: pathlib.Path, name: str) -> None:
    import trimesh

    (tmp_path / "shapes").mkdir()
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "shapes/cube.stl")
    (tmp_path / "piece.xml").write_text(
        '<mujocoinclude><body name="foot"><geom type="mesh" mesh="cube" mass="2"/></body></mujocoinclude>'
    )
    (tmp_path / name).write_text(
        '<mujoco><compiler meshdir="shapes"/><asset><mesh file="cube.stl"/></asset>'
        '<worldbody><include file="piece.xml"/></worldbody></mujoco>'
    )
    foot = read_mjcf(tmp_path / name).parts["foot"]
    assert np.diag(foot.inertia) == pytest.approx([2 * 0.2**2 / 6] * 3, rel=1e-6)


def test_a_scaled_total_mass_is_read_and_the_warning_is_a_note(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "leg.xml"
    file.write_text(
        '<mujoco><compiler settotalmass="70"/><worldbody><body><geom size="1"/></body></worldbody></mujoco>'
    )
    tree = read_mjcf(file)
    assert tree.parts["body_1"].mass == pytest.approx(70)
    assert [note.code for note in tree.notes if "settotalmass" in note.subject] == ["mujoco-warning"]


def test_a_fixed_body_keeps_its_mass(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "leg.xml"
    file.write_text(
        '<mujoco><compiler fusestatic="true"/><worldbody><body name="a"><geom size="0.1" mass="1"/>'
        '<body name="b"><geom size="0.1" mass="2"/></body></body></worldbody></mujoco>'
    )
    assert {name: part.mass for name, part in read_mjcf(file).parts.items()} == pytest.approx(
        {"a": 1, "b": 2}
    )


MESH_MASS = (
    '<mujoco><asset><mesh file="bone.stl"/></asset><worldbody><body name="light"><joint/>'
    '<geom type="mesh" mesh="bone"/></body></worldbody></mujoco>'
)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<robots/>", "robots"),
        ('<mujoco><worldbody><body><joint type="hing"/></body></worldbody></mujoco>', "hing"),
        ('<mujoco><include file="other.xml"/></mujoco>', "other.xml"),
        (MESH_MASS, "bone.stl.*the body 'light' depends on it"),
        ('<mujoco><extension><plugin plugin="my.plugin"/></extension></mujoco>', "my.plugin"),
        ('<mujoco><worldbody><body name="light"><joint/></body></worldbody></mujoco>', "light"),
    ],
)
def test_bad_files_are_told_in_one_line(tmp_path: pathlib.Path, text: str, word: str) -> None:
    file = tmp_path / "leg.xml"
    file.write_text(text)
    with pytest.raises(InputError, match=word) as caught:
        read_mjcf(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("where", ['pos="0 nan 0"', "pos = 'NaN 0 0'", 'gravcomp="nan"'])
def test_a_number_that_is_none_is_refused_before_mujoco_leaves_it_out(
    where: str, tmp_path: pathlib.Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "leg.xml"
    file.write_text(
        f'<mujoco><worldbody><body name="nan" {where}><geom size="1"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match=r"(?i)nan.*is not a finite number"):
        read_mjcf(file)
    assert capfd.readouterr() == ("", "")
    file.write_text('<mujoco><worldbody><body name="nan"><geom size="1"/></body></worldbody></mujoco>')
    assert list(read_mjcf(file).parts) == ["nan"]


@pytest.mark.parametrize("content", [bytes(range(256)) * 20, b"\0" * 100, b"PK\x03\x04<mujoco"])
def test_binary_files_are_refused(tmp_path: pathlib.Path, content: bytes) -> None:
    file = tmp_path / "leg.xml"
    file.write_bytes(content)
    with pytest.raises(InputError):
        read_mjcf(file)


def test_files_that_are_not_there(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_mjcf(tmp_path / "none.xml")
    with pytest.raises(InputError, match="folder"):
        read_mjcf(tmp_path)


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
