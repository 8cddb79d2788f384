"""A tree's MJCF holds every number as it was, and its meshes."""

import dataclasses
import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from turned_leg import shipped, told_otherwise

from afo_sim.legs import Shape, Tree, cut, find
from afo_sim.legs.mjcf import read_mjcf
from afo_sim.legs.mjcf_out import write_leg_file


def with_mesh(tree: Tree, mesh: Any) -> Tree:
    vertices = np.asarray(mesh.vertices, dtype=np.float32).astype(float)
    shape = Shape("bone: tibia/1", "mesh", np.eye(4), np.zeros(3), vertices, np.asarray(mesh.faces))
    twin = dataclasses.replace(shape, name="again")
    shank = tree.parts["shank"]
    parts = tree.parts | {"shank": dataclasses.replace(shank, shapes=(*shank.shapes, shape, twin))}
    return dataclasses.replace(tree, parts=parts)


@pytest.mark.parametrize("seed", range(3))
def test_all_digits_are_kept(tmp_path: pathlib.Path, seed: int) -> None:
    tree = told_otherwise(shipped(), np.random.default_rng(seed))
    write_leg_file(tree, tmp_path / "leg.xml", "leg")
    back = read_mjcf(tmp_path / "leg.xml")
    assert list(back.parts) == list(tree.parts)
    for name, part in tree.parts.items():
        again = back.parts[name]
        assert again.mass == part.mass
        assert np.array_equal(again.centre, part.centre)
        np.testing.assert_allclose(again.inertia, part.inertia, rtol=0, atol=1e-16)
        np.testing.assert_allclose(again.pose, part.pose, rtol=0, atol=1e-14)
        for one, other in zip(part.joints, again.joints, strict=True):
            assert one.range == other.range and one.name == other.name
            np.testing.assert_allclose(one.axis, other.axis, rtol=0, atol=1e-15)
        for point, at in part.points.items():
            assert np.array_equal(again.points[point], at)


def test_meshes_lie_where_they_did(tmp_path: pathlib.Path) -> None:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.04)
    mesh.apply_translation([0.01, 0.02, 0.3])
    tree = with_mesh(shipped(), mesh)
    files = write_leg_file(tree, tmp_path / "leg.xml", "leg")
    assert [file.name for file in files] == ["leg.xml", "bone_tibia_1.stl"]  # one file for both shapes
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for name in ("bone: tibia/1", "again"):
        geom = model.geom(name)
        own = model.mesh(geom.dataid[0])
        vertices = model.mesh_vert[own.vertadr[0] : own.vertadr[0] + own.vertnum[0]]
        there = vertices @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
        wanted = mesh.vertices + model.body("shank").pos
        gaps = np.linalg.norm(there[:, None] - wanted[None], axis=2).min(axis=1)
        assert len(there) == len(wanted) and gaps.max() < 1e-7


def test_flat_and_open_meshes_compile(tmp_path: pathlib.Path) -> None:
    import trimesh

    corners = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]]
    for vertices, faces, number in ((corners, [[0, 1, 2], [1, 3, 2]], 2), (corners[:3], [[0, 1, 2]], 0)):
        plate = trimesh.Trimesh(vertices, faces)
        write_leg_file(with_mesh(shipped(), plate), tmp_path / "leg.xml", "leg")
        model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
        # of a single triangle MuJoCo makes no mesh: it is left out
        assert np.sum(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH) == number


def test_strange_names_and_thin_bodies_are_written(tmp_path: pathlib.Path) -> None:
    """A thin plate's greatest moment is the sum of the others, which rounding breaks."""
    tree = shipped()
    thin = np.diag([0.1 + 1e-9, 0.2, 0.3 + 2e-9])
    names = tree.parts["shank"].shapes
    shapes = tuple(dataclasses.replace(shape, name='a "b" <c> & \x01') for shape in names)
    shank = dataclasses.replace(tree.parts["shank"], inertia=thin, shapes=shapes)
    tree = dataclasses.replace(tree, parts=tree.parts | {"shank": shank})
    write_leg_file(tree, tmp_path / "leg.xml", "leg", comment="of -- somebody")
    back = read_mjcf(tmp_path / "leg.xml")
    np.testing.assert_allclose(back.parts["shank"].inertia, thin, atol=2e-9)


def test_shapes_do_not_touch(tmp_path: pathlib.Path) -> None:
    tree = shipped()
    write_leg_file(cut(tree, find(tree)), tmp_path / "leg.xml", "leg")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()


def test_shapes_weigh_nothing(tmp_path: pathlib.Path) -> None:
    """A part of no mass keeps none, whatever its shapes; what is put on the leg later has its own."""
    tree = shipped()
    toes = dataclasses.replace(tree.parts["toes"], mass=0.0, inertia=np.zeros((3, 3)), joints=())
    write_leg_file(dataclasses.replace(tree, parts=tree.parts | {"toes": toes}), tmp_path / "leg.xml", "leg")
    spec = mujoco.MjSpec.from_file(str(tmp_path / "leg.xml"))
    part = spec.body("shank").add_body(name="fitting")
    part.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], mass=0.2)
    model = spec.compile()
    assert model.body("toes").mass[0] == 0.0
    assert model.body("fitting").mass[0] == pytest.approx(0.2)
