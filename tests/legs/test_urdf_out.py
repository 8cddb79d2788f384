"""Written as URDF and read again: by this package, by MuJoCo, and by Rerun."""

import dataclasses
import pathlib

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from leg_models import OPTIONS, assert_moves_alike, built, random_mjcf

from afo_sim.common import InputError
from afo_sim.legs import Part, Tree, tree_of, write_urdf
from afo_sim.legs.mjcf_out import movable
from afo_sim.legs.urdf import read_urdf


def random_tree(seed: int, most_joints: int = 1) -> Tree:
    return tree_of(mujoco.MjModel.from_xml_string(random_mjcf(seed, most_joints=most_joints)))


def in_world(tree: Tree, part: Part) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and inertia of a part in the world's axes, whatever its own axes are."""
    pose = tree.world_pose(part.name)
    return part.mass, pose[:3, :3] @ part.centre + pose[:3, 3], pose[:3, :3] @ part.inertia @ pose[:3, :3].T


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), most_joints=st.integers(1, 3))
def test_read_again_it_is_the_same(seed: int, most_joints: int, tmp_path: pathlib.Path) -> None:
    tree = random_tree(seed, most_joints)
    write_urdf(tree, tmp_path / "leg.urdf")
    again = read_urdf(tmp_path / "leg.urdf")
    for part in tree.parts.values():
        for ours, theirs in zip(in_world(again, again.parts[part.name]), in_world(tree, part), strict=True):
            assert ours == pytest.approx(theirs, rel=1e-12, abs=1e-12)
        for name, place in part.points.items():
            seen = tree.world_pose(part.name) @ [*place, 1]
            assert again.world_pose(f"{name}_point")[:3, 3] == pytest.approx(seen[:3], abs=1e-12)
    joints = again.joints()
    assert set(joints) == set(tree.joints())
    for name, (part, joint) in tree.joints().items():
        other, found = joints[name]
        pose, place = tree.world_pose(part.name), again.world_pose(other.name)
        assert place[:3, :3] @ found.axis == pytest.approx(pose[:3, :3] @ joint.axis, abs=1e-12)
        if joint.kind == "hinge":  # a slide may stand anywhere
            assert place[:3, 3] == pytest.approx((pose @ [*joint.position, 1])[:3], abs=1e-12)
        assert found.kind == joint.kind and joint.range is not None
        assert found.range == pytest.approx(np.array(joint.range) - joint.zero, rel=1e-12)
        assert (found.damping, found.friction) == pytest.approx((joint.damping, joint.friction), rel=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_mujoco_reads_the_same_dynamics(seed: int, tmp_path: pathlib.Path) -> None:
    """Inertia matrix, bias and passive forces of MuJoCo's own import, in any posture and at any speed."""
    model = mujoco.MjModel.from_xml_string(random_mjcf(seed))
    tree = tree_of(model)
    write_urdf(tree, tmp_path / "leg.urdf")
    imported = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.urdf"))
    assert_moves_alike(imported, model, list(tree.joints()), seed)


@pytest.mark.parametrize("seed", range(4))
def test_rerun_reads_the_same_joints(seed: int, tmp_path: pathlib.Path) -> None:
    from rerun.urdf import UrdfTree
    from scipy.spatial.transform import Rotation

    tree = random_tree(seed, 3)
    write_urdf(tree, tmp_path / "leg.urdf", name="my leg")
    seen = UrdfTree.from_file_path(tmp_path / "leg.urdf")
    assert seen.name == "my leg" and seen.root_link().name == "world"
    poses = {"world": np.eye(4)}
    waiting = list(seen.joints())
    while waiting:
        joint = waiting.pop(0)
        if joint.parent_link not in poses:
            waiting.append(joint)
            continue
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = Rotation.from_euler("xyz", joint.origin_rpy).as_matrix(), joint.origin_xyz
        poses[joint.child_link] = poses[joint.parent_link] @ own
    for name, (part, joint) in tree.joints().items():
        found, pose = seen.get_joint_by_name(name), tree.world_pose(part.name)
        place = poses[found.child_link]
        assert place[:3, :3] @ found.axis == pytest.approx(pose[:3, :3] @ joint.axis, abs=1e-6)
        if joint.kind == "hinge":
            assert place[:3, 3] == pytest.approx((pose @ [*joint.position, 1])[:3], abs=1e-6)
        limits = np.array([found.limit_lower, found.limit_upper])
        assert limits == pytest.approx(np.array(joint.range) - joint.zero, rel=1e-6)


PENDULUM = f"""<mujoco>{OPTIONS}<worldbody><body name="rod" pos="0.3 0 2" quat="0.9 0.1 0.2 0.3">
  <joint name="hinge" axis="0.1 -1 0.2" pos="0.02 0.01 0.5" damping="0.02"/>
  <inertial pos="0 0.03 -0.1" mass="1.7" fullinertia="0.2 0.21 0.05 0.01 -0.02 0.003"/>
</body></worldbody></mujoco>"""


SHAPES = """<mujoco><asset><mesh name="bone" vertex="0 0 0 0.2 0 0 0 0.3 0 0 0 0.4"/></asset><worldbody>
  <body name="leg"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <geom name="box" type="box" size="0.1 0.2 0.3" pos="0 0 1" rgba="1 0 0 1"/>
    <geom name="ball" type="sphere" size="0.1"/>
    <geom name="tube" type="cylinder" size="0.1 0.2" euler="90 0 0"/>
    <geom name="shin" type="capsule" size="0.05 0.2" pos="0.1 0 0" euler="0 90 0"/>
    <geom name="calf" type="ellipsoid" size="0.1 0.2 0.3"/>
    <geom name="tibia" type="mesh" mesh="bone" pos="1 2 3"/><geom name="fibula" type="mesh" mesh="bone"/>
  </body></worldbody></mujoco>"""


@pytest.fixture
def shapes(tmp_path: pathlib.Path):
    tree = tree_of(mujoco.MjModel.from_xml_string(SHAPES))
    notes = write_urdf(tree, tmp_path / "leg.urdf")
    return tree, read_urdf(tmp_path / "leg.urdf"), notes


def test_shapes_are_read_again(shapes) -> None:
    tree, again, notes = shapes
    old = {shape.name: shape for shape in tree.parts["leg"].shapes}
    new = {shape.name: shape for shape in again.parts["leg"].shapes}
    for name in ("box", "ball", "tube"):
        assert (new[name].kind, new[name].rgba) == (old[name].kind, pytest.approx(old[name].rgba))
        assert new[name].size == pytest.approx(old[name].size)
        assert new[name].pose == pytest.approx(old[name].pose, abs=1e-12)
    assert [(note.code, note.data["all"]) for note in notes] == [
        ("shapes-replaced", ["shin"]),
        ("shapes-replaced", ["calf"]),
    ]


def test_a_capsule_is_a_cylinder_with_two_spheres(shapes) -> None:
    new = {shape.name: shape for shape in shapes[1].parts["leg"].shapes}
    assert list(new["shin"].size) == [0.05, 0.2, 0]
    ends = np.array([new[f"shin_{end}"].pose[:3, 3] for end in ("top", "bottom")])
    assert ends == pytest.approx(np.array([[0.3, 0, 0], [-0.1, 0, 0]]), abs=1e-12)  # along x by the 90°


def test_meshes_have_their_corners_and_share_a_file(shapes, tmp_path: pathlib.Path) -> None:
    tree, again, _ = shapes
    for name in ("tibia", "fibula"):
        (old,) = [shape for shape in tree.parts["leg"].shapes if shape.name == name]
        (new,) = [shape for shape in again.parts["leg"].shapes if shape.name == name]
        corners = [s.vertices @ s.pose[:3, :3].T + s.pose[:3, 3] for s in (old, new)]
        assert np.abs(corners[0][:, None] - corners[1][None]).max(-1).min(0) == pytest.approx(0, abs=1e-6)
    assert sorted(path.name for path in (tmp_path / "leg_meshes").iterdir()) == ["calf.stl", "tibia.stl"]


def test_an_ellipsoid_is_a_mesh_of_its_extent(shapes) -> None:
    import trimesh

    (calf,) = [shape for shape in shapes[1].parts["leg"].shapes if shape.name == "calf"]
    assert np.abs(calf.vertices).max(axis=0) == pytest.approx([0.1, 0.2, 0.3], rel=2e-3)
    solid = trimesh.Trimesh(calf.vertices, calf.faces)
    assert solid.volume == pytest.approx(4 / 3 * np.pi * 0.1 * 0.2 * 0.3, rel=0.02)


def test_mujoco_and_rerun_find_the_meshes(shapes, tmp_path: pathlib.Path) -> None:
    import rerun as rr
    from rerun.urdf import UrdfTree

    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.urdf"))
    assert model.nmesh == 2 and model.body("leg").mass == 1
    recording = rr.RecordingStream("test")
    UrdfTree.from_file_path(tmp_path / "leg.urdf").log_urdf_to_recording(recording)


def test_a_name_with_spaces_beside_the_working_folder(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_urdf(tree_of(mujoco.MjModel.from_xml_string(SHAPES)), "my leg ä.urdf")
    assert len(read_urdf("my leg ä.urdf").parts["leg"].shapes) == 9
    assert mujoco.MjModel.from_xml_path("my leg ä.urdf").nmesh == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my leg ä.urdf", "my leg ä_meshes"]


def test_limits_have_effort_and_velocity(tmp_path: pathlib.Path) -> None:
    from lxml import etree

    write_urdf(random_tree(3), tmp_path / "leg.urdf")
    limits = etree.parse(str(tmp_path / "leg.urdf")).findall(".//limit")
    assert limits and all(float(one.get(key)) > 0 for one in limits for key in ("effort", "velocity"))


def with_joint(**changes: object) -> Tree:
    tree = tree_of(mujoco.MjModel.from_xml_string(PENDULUM))
    part = tree.parts["rod"]
    joint = dataclasses.replace(part.joints[0], **changes)  # type: ignore[arg-type]
    return dataclasses.replace(tree, parts={"rod": dataclasses.replace(part, joints=(joint,))})


@pytest.mark.parametrize(
    ("changes", "code", "name"),
    [
        ({"stiffness": 3.0}, "springs-left-out", "hinge"),
        ({"armature": 0.1}, "rotors-left-out", "hinge"),
        ({"zero": 0.2}, "coordinates-shifted", "hinge"),
        ({"kind": "slide"}, "slides-end", "hinge"),
        ({"kind": "free"}, "root-moves", "rod"),
    ],
)
def test_what_urdf_does_not_hold_is_told(
    changes: dict[str, object], code: str, name: str, tmp_path: pathlib.Path
) -> None:
    notes = write_urdf(with_joint(**changes), tmp_path / "rod.urdf")
    assert [(note.code, note.data["all"]) for note in notes] == [(code, [name])]


def test_nothing_is_told_of_what_is_held(tmp_path: pathlib.Path) -> None:
    assert write_urdf(with_joint(), tmp_path / "rod.urdf") == ()


def test_a_ball_joint_is_refused_before_anything_is_written(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="ball joint: hinge"):
        write_urdf(with_joint(kind="ball"), tmp_path / "rod.urdf")
    with pytest.raises(InputError, match=r"\.urdf"):
        write_urdf(with_joint(), tmp_path / "rod.xml")
    with pytest.raises(InputError, match="no part"):
        write_urdf(Tree(None, {}), tmp_path / "rod.urdf")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("field", ["mass", "centre", "damping", "range"])
def test_a_number_that_is_none_is_refused(field: str, tmp_path: pathlib.Path) -> None:
    part = with_joint().parts["rod"]
    if field in ("mass", "centre"):
        part = dataclasses.replace(part, **{field: np.nan})  # type: ignore[arg-type]
    else:
        joint = dataclasses.replace(part.joints[0], **{field: (0.0, np.inf)})  # type: ignore[arg-type]
        part = dataclasses.replace(part, joints=(joint,))
    with pytest.raises(InputError, match=f"{field}: is not finite"):
        write_urdf(Tree(None, {"rod": part}), tmp_path / "rod.urdf")
    assert not list(tmp_path.iterdir())


def test_what_stands_beside_is_told(tmp_path: pathlib.Path) -> None:
    tree = dataclasses.replace(with_joint(), beside={"tendons": ("a",), "equality constraints": ("b",)})
    assert write_urdf(tree, tmp_path / "rod.urdf") == ("left out: tendons, equality constraints",)


def test_names_that_meet_are_made_different(tmp_path: pathlib.Path) -> None:
    """A point whose link would be called like a part, and parts called world and with spaces."""
    tree = with_joint()
    rod = dataclasses.replace(tree.parts["rod"], name="world", points={"heel": np.ones(3)})
    point = dataclasses.replace(rod, name="heel_point", parent="world", joints=(), points={})
    odd = dataclasses.replace(point, name='my "left" <foot> ü')
    write_urdf(Tree(None, {part.name: part for part in (rod, point, odd)}), tmp_path / "rod.urdf")
    again = read_urdf(tmp_path / "rod.urdf")
    assert {"world", "heel_point", "heel_point_2", odd.name} < set(again.parts)


def test_a_place_that_cannot_be_written_is_left_alone(tmp_path: pathlib.Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError):
        write_urdf(with_joint(), tmp_path / "file/rod.urdf")
    (tmp_path / "leg.urdf").mkdir()
    tree = tree_of(mujoco.MjModel.from_xml_string(SHAPES))
    with pytest.raises(InputError):
        write_urdf(tree, tmp_path / "leg.urdf")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "leg.urdf"]


@pytest.mark.parametrize("seed", range(6))
def test_several_joints_survive_urdf(seed: int, tmp_path) -> None:
    """Split into massless links for URDF and read again, a body moves like the model."""
    model = mujoco.MjModel.from_xml_string(random_mjcf(seed, most_joints=3))
    tree = tree_of(model)
    notes = write_urdf(tree, tmp_path / "leg.urdf")
    assert "massless-links-between" in [note.code for note in notes]
    again = movable(read_urdf(tmp_path / "leg.urdf"))
    assert set(again.parts) > set(tree.parts)
    assert_moves_alike(built(again), model, list(tree.joints()), seed)
