"""Trees from URDF files: numbers by hand, parallel axes, MuJoCo's importer; and what is refused."""

import logging
import pathlib

import mujoco
import numpy as np
import pytest
from leg_models import random_inertia
from urdf_texts import BODY, INERTIA, inertial, joint, link, robot, two

from afo_sim.common import InputError
from afo_sim.legs import Tree, tree_of
from afo_sim.legs.mjcf_out import movable
from afo_sim.legs.urdf import read_urdf


def noted(tree: Tree) -> dict[str, list[str]]:
    """{code: names} of what was noted on reading."""
    return {note.code: note.data.get("all", [note.subject]) for note in tree.notes}


@pytest.fixture
def read(tmp_path: pathlib.Path):
    def reading(text: str, **options) -> Tree:
        file = tmp_path / "leg.urdf"
        file.write_text(text, encoding="utf-8")
        return read_urdf(file, **options)

    return reading


def test_a_rod_has_the_inertia_of_the_parallel_axis_theorem(read) -> None:
    """A thin rod along the turned z axis: m L²/12 about its middle, m L²/3 about its end."""
    mass, length, radius = 3.0, 0.4, 0.01
    across, along = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
    turned = (
        f'<inertial><origin xyz="0.2 0 0" rpy="0 {np.pi / 2:.17g} 0"/><mass value="3"/>'
        f'<inertia ixx="{across}" iyy="{across}" izz="{along}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    part = read(two("fixed", shank=turned)).parts["shank"]
    assert part.inertia == pytest.approx(np.diag([along, across, across]), abs=1e-12)
    about_end = part.inertia + part.mass * (
        part.centre @ part.centre * np.eye(3) - np.outer(part.centre, part.centre)
    )
    assert about_end[1, 1] == pytest.approx(mass * (length**2 / 3 + radius**2 / 4), rel=1e-12)


def test_roll_pitch_yaw_turn_about_fixed_axes(read) -> None:
    """URDF: roll about x, then pitch about y, then yaw about z of the parent."""
    roll, pitch, yaw = 0.3, -0.7, 1.1
    pose = read(two("revolute", f'<origin xyz="1 2 3" rpy="{roll} {pitch} {yaw}"/>')).parts["foot"].pose
    c, s = np.cos, np.sin
    about_x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    about_y = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    about_z = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    assert pose[:3, :3] == pytest.approx(about_z @ about_y @ about_x, abs=1e-12)
    assert list(pose[:3, 3]) == [1, 2, 3]


def test_a_revolute_joint(read) -> None:
    more = '<axis xyz="0 -2 0"/><limit lower="-0.5" upper="0.3" effort="inf" velocity="inf"/>'
    tree = read(two("revolute", more + '<dynamics damping="0.4" friction="0.1"/>'))
    part, found = tree.joints()["ankle"]
    assert (part.name, part.parent, found.kind) == ("foot", "shank", "hinge")
    assert list(found.axis) == [0, -1, 0] and found.range == (-0.5, 0.3)
    assert (found.damping, found.friction, found.zero) == (0.4, 0.1, 0.0)
    assert not tree.notes


@pytest.mark.parametrize("more", ["", "<limit/>", '<limit lower="0" upper="0" effort="0" velocity="0"/>'])
def test_a_range_that_was_never_set_is_none_and_noted(read, more: str) -> None:
    tree = read(two("revolute", more))
    assert tree.joints()["ankle"][1].range is None
    assert noted(tree) == {"joints-endless": ["ankle"]}


def test_other_joints(read) -> None:
    limited = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    assert read(two("continuous", limited)).joints()["ankle"][1].range is None
    slide = read(two("prismatic", limited)).joints()["ankle"][1]
    assert (slide.kind, slide.range) == ("slide", (-1.0, 1.0))
    assert not read(two("fixed", '<origin xyz="0 0 1"/>')).parts["foot"].joints
    assert read(two("floating")).joints()["ankle"][1].kind == "free"


@pytest.mark.parametrize("length", ["1e12", "1e-300", "0.5"])
def test_an_axis_of_any_length_has_length_one(read, length: str) -> None:
    axis = read(two("continuous", f'<axis xyz="0 -{length} {length}"/>')).joints()["ankle"][1].axis
    assert axis == pytest.approx(np.array([0, -1, 1]) / np.sqrt(2), abs=1e-12)


def test_a_planar_joint_is_two_slides_across_its_axis(read) -> None:
    tree = read(two("planar", '<axis xyz="0 0.6 0.8"/>'))
    slides, turn = tree.parts["foot"].joints[:2], tree.parts["foot"].joints[2]
    assert [one.kind for one in tree.parts["foot"].joints] == ["slide", "slide", "hinge"]
    assert turn.axis == pytest.approx([0, 0.6, 0.8])
    frame = np.array([one.axis for one in (*slides, turn)])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert noted(tree) == {"joints-planar": ["ankle"]}


def test_a_link_without_mass_stays_and_is_noted(read) -> None:
    light = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
    tree = read(two("continuous", shank="", foot=light))
    assert [part.mass for part in tree.parts.values()] == [0, 0]
    assert noted(tree) == {"massless-links": ["shank", "foot"]}


@pytest.mark.parametrize("moment", [0.0, 9e-15, 1e-14])
def test_a_point_mass_is_read_where_it_is_fixed(read, moment: float) -> None:
    """It is noted where a joint needs more inertia than that, and where it does not, not."""
    point = inertial(2, "0.1 0 -0.2", f"{moment} {moment} {moment}")
    tree = read(two("continuous", foot=point))
    assert tree.parts["foot"].mass == 2
    raised = noted(movable(tree)).get("inertias-raised", [])
    assert noted(tree).get("point-masses", []) == raised == (["foot"] if moment < 1e-14 else [])


def test_a_joint_that_follows_another_is_noted(read) -> None:
    tree = read(two("continuous", '<mimic joint="knee" multiplier="0.5" offset="0.1"/>'))
    assert noted(tree) == {"joint-mimics": ["ankle"]} and tree.couplings == (("ankle", "knee", 0.1, 0.5),)
    assert tree.beside == {"mimic joints": ("ankle",)}


def test_parents_come_before_children_whatever_the_file_s_order(read) -> None:
    links = "".join(f'<link name="{name}">{BODY}</link>' for name in ("toes", "foot", "shank"))
    joints = joint("fixed", name="a", parent="foot", child="toes") + joint("continuous", name="b")
    assert list(read(robot(links + joints)).parts) == ["shank", "foot", "toes"]


def test_a_link_that_no_joint_reaches_stands_by_itself(read) -> None:
    tree = read(robot(THREE + joint("continuous")))
    assert [part.parent for part in tree.parts.values()] == [None, None, "shank"]
    assert noted(tree) == {"roots-several": ["shank", "toes"]}


def test_a_root_called_world_is_the_world(read) -> None:
    links = "".join(f'<link name="{name}">{BODY}</link>' for name in ("shank", "foot"))
    fixed = joint("fixed", '<origin xyz="0 0 1"/>', name="a", parent="world", child="shank")
    tree = read(robot(f'<link name="world"/>{links}{fixed}{joint("continuous")}'))
    assert list(tree.parts) == ["shank", "foot"]
    assert tree.parts["shank"].parent is None and list(tree.parts["shank"].pose[:3, 3]) == [0, 0, 1]
    assert tree.notes == ()


@pytest.fixture
def bone(tmp_path: pathlib.Path) -> pathlib.Path:
    import trimesh

    folder = tmp_path / "my_leg/meshes"
    folder.mkdir(parents=True)
    trimesh.creation.box((0.1, 0.2, 0.4)).export(folder / "bone.stl")
    return folder.parent


def mesh(name: str, scale: str = "") -> str:
    return (
        f'{BODY}<visual><origin xyz="0 0 1"/><geometry><mesh filename="{name}" {scale}/></geometry></visual>'
    )


@pytest.mark.parametrize("name", ["package://my_leg/meshes/bone.stl", "model://my_leg/meshes/bone.stl"])
def test_packages_are_found_above_the_file_and_where_told(
    read, bone: pathlib.Path, name: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = two("fixed", shank=mesh(name))
    assert read(text).parts["shank"].shapes[0].kind == "mesh"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    other = bone.rename(elsewhere / "my_leg")
    assert not read(text).parts["shank"].shapes
    for packages in ({"my_leg": other}, (elsewhere,), (str(other),), str(other), elsewhere):
        assert len(read(text, packages=packages).parts["shank"].shapes) == 1
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{elsewhere}")
    assert len(read(text).parts["shank"].shapes) == 1


def test_relative_absolute_and_file_names(read, bone: pathlib.Path) -> None:
    path = bone / "meshes/bone.stl"
    for name in ("my_leg/meshes/bone.stl", r"my_leg\meshes\bone.stl", str(path), f"file://{path}"):
        (shape,) = read(two("fixed", shank=mesh(name))).parts["shank"].shapes
        assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.4])
        assert shape.pose[:3, 3] == pytest.approx([0, 0, 1])


def test_a_scaled_mesh(read, bone: pathlib.Path) -> None:
    import trimesh

    (shape,) = (
        read(two("fixed", shank=mesh("my_leg/meshes/bone.stl", 'scale="1 -2 3"'))).parts["shank"].shapes
    )
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.1, 0.4, 1.2])
    # mirrored, its faces still look outward: the volume stays positive
    assert trimesh.Trimesh(shape.vertices, shape.faces).volume == pytest.approx(0.1 * 0.2 * 0.4 * 6)


def test_millimetres_are_noted_unless_they_are_scaled(read, tmp_path: pathlib.Path) -> None:
    import trimesh

    trimesh.creation.box((100, 80, 400)).export(tmp_path / "bone.stl")
    assert noted(read(two("fixed", shank=mesh("bone.stl")))) == {"meshes-large": ["bone.stl, 400 m long"]}
    assert not read(two("fixed", shank=mesh("bone.stl", 'scale="0.001 0.001 0.001"'))).notes
    trimesh.creation.box((0.1, 0.08, 0.4)).export(tmp_path / "small.stl")
    assert not read(two("fixed", shank=mesh("small.stl"))).notes
    # of a crane, whose joints are as far apart
    assert not read(two("fixed", '<origin xyz="0 0 -300"/>', shank=mesh("bone.stl"))).notes


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
<unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 2 0 0 0 4</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p>
</triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def test_a_mesh_in_inches_is_turned_into_metres(read, tmp_path: pathlib.Path) -> None:
    (tmp_path / "bone.dae").write_text(DAE)
    (shape,) = read(two("fixed", shank=mesh("bone.dae"))).parts["shank"].shapes
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.0254, 0.0508, 0.1016])


def test_missing_and_broken_meshes_do_not_stop_a_leg(read, tmp_path: pathlib.Path, capfd) -> None:
    (tmp_path / "broken.stl").write_bytes(b"\1\2")
    (tmp_path / "broken.obj").write_text("no mesh")
    several = "".join(mesh(f"broken.{end}").removeprefix(BODY) for end in ("stl", "obj", "dae"))
    tree = read(two("fixed", shank=mesh("package://gone/bone.stl") + several))
    assert tree.parts["shank"].mass == 2 and not tree.parts["shank"].shapes
    assert noted(tree)["meshes-missing"] == ["package://gone/bone.stl", "broken.dae"]
    assert [name.split()[0] for name in noted(tree)["meshes-broken"]] == ["broken.stl", "broken.obj"]
    assert capfd.readouterr() == ("", "")


def test_shapes(read) -> None:
    shapes = (
        '<visual name="a"><geometry><box size="0.2, 0.4,0.6"/></geometry></visual>'
        '<visual><geometry><cylinder radius="0.1" length="0.6"/></geometry><material name="red"/></visual>'
        '<visual><geometry><sphere radius="0.3"/></geometry></visual>'
        '<visual><geometry><cone radius="0.3" length="1"/></geometry></visual>'
    )
    red = '<material name="red"><color rgba="1 0 0 0.5"/></material>'
    tree = read(two("fixed", shank=BODY + shapes).replace("</robot>", f"{red}</robot>"))
    box, cylinder, sphere = tree.parts["shank"].shapes
    assert (box.name, list(box.size)) == ("a", [0.1, 0.2, 0.3])  # half lengths
    assert list(cylinder.size) == [0.1, 0.3, 0] and cylinder.rgba == (1, 0, 0, 0.5)
    assert list(sphere.size) == [0.3, 0, 0]
    assert noted(tree)["shapes-left-out"] == ["shank"]


def test_a_capsule_is_as_mujoco_reads_it(read, tmp_path: pathlib.Path) -> None:
    shapes = (
        '<collision><geometry><sphere radius="0.3"/></geometry></collision>'
        '<collision><geometry><capsule radius="0.1" length="0.6"/></geometry></collision>'
    )
    sphere, capsule = read(two("fixed", shank=BODY + shapes)).parts["shank"].shapes
    assert (sphere.kind, capsule.kind) == ("sphere", "capsule")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.urdf"))
    assert model.geom_type[1] == mujoco.mjtGeom.mjGEOM_CAPSULE
    assert list(model.geom_size[1]) == list(capsule.size)


def test_what_only_collides_is_shown(read) -> None:
    collision = '<collision><geometry><sphere radius="0.3"/></geometry></collision>'
    assert len(read(two("fixed", shank=BODY + collision)).parts["shank"].shapes) == 1


def test_a_controller_s_settings_are_no_fault(read, tmp_path: pathlib.Path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    more = '<safety_controller soft_lower_limit=""/><calibration rising="x"/><mimic joint="knee"/>'
    tree = read(two("floating", more))
    assert "foot" in tree.parts and capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == ["leg.urdf"]


def test_a_version_of_xml_that_is_none_is_no_fault(read) -> None:
    assert list(read('<?xml version="0.0" ?>' + two("fixed")).parts) == ["shank", "foot"]


def test_simulators_additions_are_no_fault(read, caplog: pytest.LogCaptureFixture, capfd) -> None:
    more = (
        '<drake:joint/><gazebo reference="foot"><mu1>1</mu1></gazebo><transmission name="t"/><!-- words -->'
    )
    with caplog.at_level(logging.DEBUG):
        tree = read(two("continuous").replace("</robot>", f"{more}</robot>"))
    assert tree.beside == {"transmissions": ("t",), "simulator's additions": ("gazebo foot",)}
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert capfd.readouterr() == ("", "")


# ------------------------------------------------------------------------------------- MuJoCo's own importer


def random_robot(seed: int) -> str:
    rng = np.random.default_rng(seed)

    def some(count: int, most: float) -> str:
        return " ".join(f"{x:.17g}" for x in rng.uniform(-most, most, count))

    links, joints = "", ""
    for number in range(6):
        mass, full = random_inertia(rng)
        numbers = full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        words = " ".join(f'{name}="{value:.17g}"' for name, value in zip(names, numbers, strict=True))
        links += (
            f'<link name="l{number}"><inertial><origin xyz="{some(3, 0.3)}" rpy="{some(3, 3)}"/>'
            f'<mass value="{mass:.17g}"/><inertia {words}/></inertial></link>'
        )
        if number:
            kind = str(rng.choice(["revolute", "continuous", "prismatic", "fixed"]))
            more = f'<origin xyz="{some(3, 0.4)}" rpy="{some(3, 3)}"/><axis xyz="{some(3, 1)}"/>'
            if kind != "continuous":
                lower, upper = -rng.uniform(0.1, 1), rng.uniform(0.1, 1)
                more += f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'
            above = f"l{rng.integers(0, number)}"
            joints += joint(kind, more, name=f"j{number}", parent=above, child=f"l{number}")
    return robot(links + joints)


@pytest.mark.parametrize("seed", range(12))
def test_mujoco_reads_the_same(read, seed: int) -> None:
    tree = read(random_robot(seed))
    spec = mujoco.MjSpec.from_file(str(tree.file))
    spec.compiler.fusestatic = False
    other = tree_of(spec.compile())
    for name, part in tree.parts.items():
        theirs = other.parts[name]
        for field in ("mass", "centre", "inertia", "pose"):
            assert getattr(part, field) == pytest.approx(getattr(theirs, field), rel=1e-6, abs=1e-9), field
        for ours, other_joint in zip(part.joints, theirs.joints, strict=True):
            assert (ours.name, ours.kind) == (other_joint.name, other_joint.kind)
            assert ours.axis == pytest.approx(other_joint.axis, abs=1e-9)
            assert ours.range == (None if other_joint.range is None else pytest.approx(other_joint.range))


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
    "mass without value": (two("fixed", foot=with_mass("<mass/>")), ["'foot' <mass value>", "missing"]),
    "mass is a word": (two("fixed", foot=with_mass('<mass value="2 kg"/>')), ["link 'foot'", "'2 kg'"]),
    "mass is not a number": (two("fixed", foot=with_mass('<mass value="nan"/>')), ["link 'foot'", "finite"]),
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
    "two parents": (
        robot(THREE + joint("fixed", name="a", child="toes") + joint("fixed", name="b")
              + joint("fixed", name="c", parent="toes")),
        ["link 'foot'", "two parents", "'b' and 'c'"],
    ),
    "circle": (
        robot(THREE + joint("fixed", name="a") + joint("fixed", name="b", parent="foot", child="toes")
              + joint("fixed", name="c", parent="toes", child="shank")),
        ["is attached to itself", "shank", "toes", "foot"],
    ),
    "on itself": (
        robot(THREE + joint("fixed", child="toes") + joint("fixed", name="b", parent="foot", child="foot")),
        ["link 'foot'", "is attached to itself"],
    ),
    "two links of a name": (
        robot(link("shank") + link("foot") + link("foot") + joint("fixed")), ["link 'foot'", "twice"],
    ),
    "two joints of a name": (
        robot(THREE + joint("fixed") + joint("fixed", child="toes")), ["joint 'ankle'", "twice"],
    ),
    "link without a name": (GOOD.replace('<link name="foot">', "<link>"), ["<link> in line 1", "no name"]),
    "a colour of words": (
        GOOD.replace("</robot>", '<material name="bone"><color rgba="white"/></material></robot>'),
        ["material 'bone' <color rgba>", "'white'"],
    ),
    "no links": (robot(""), ["no <link>"]),
    "mimic of nothing": (two("continuous", "<mimic/>"), ["joint 'ankle'", "mimic"]),
    "not a robot": ("<mujoco/>", ["<mujoco>", "not a URDF file"]),
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
    file.write_text(robot(THREE + joint("revolute", limited(2, 1) + '<axis xyz="0 0 0"/>', child="fot")))
    with pytest.raises(InputError) as caught:
        read_urdf(file)
    lines = str(caught.value).splitlines()
    assert len(lines) == 3  # axis, range, and a name
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


def test_an_entity_is_not_followed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "secret").write_text("7")
    file = tmp_path / "leg.urdf"
    entity = f'<!DOCTYPE robot [<!ENTITY mass SYSTEM "{tmp_path}/secret">]>'
    file.write_text(entity + two("fixed", foot=with_mass('<mass value="2">&mass;</mass>')))
    assert read_urdf(file).parts["foot"].mass == 2
