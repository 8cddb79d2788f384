"""A tree as a self-contained MJCF text with all its digits (MuJoCo keeps six), and meshes beside it."""

import dataclasses
import pathlib
import re
from collections.abc import Iterable
from xml.etree import ElementTree

import mujoco
import numpy as np

from afo_sim.common import write_bytes, write_text
from afo_sim.legs.tree import (
    LEAST_INERTIA,
    LEAST_MASS,
    Joint,
    Part,
    Shape,
    Tree,
    free_name,
    moved,
    quaternion_of,
    reading_note,
)

MESHES = "meshes"  # folder beside the file
MOST_FACES = 200_000  # of an STL file that MuJoCo reads
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3, "mesh": 0}
IDLE = 1e-10  # [kg] or [kg·m²] of all that a joint moves
NO_CONTROL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd]")  # what XML can hold


def write_leg_file(tree: Tree, path: pathlib.Path, model: str, comment: str = "") -> list[pathlib.Path]:
    """Write a tree as MJCF, with its meshes in a folder beside it."""
    names = _mesh_files(tree)
    files = [path]
    for file, shape in dict(names.values()).items():
        target = path.parent / MESHES / file
        write_bytes(target, _mesh_content(shape, file))
        files.append(target)
    write_text(path, leg_text(tree, model, comment))
    return files


def _mesh_files(tree: Tree) -> dict[int, tuple[str, Shape]]:
    """{id of a mesh's vertices: name of its file, a shape that has it}; shapes may share one."""
    found: dict[int, tuple[str, Shape]] = {}
    taken: set[str] = set()
    for part in tree.parts.values():
        for shape in part.shapes:
            if shape.kind == "mesh" and _solid(shape) and id(shape.vertices) not in found:
                stem = free_name(re.sub(r"[^\w.-]+", "_", shape.name).strip("._") or "mesh", taken)
                taken.add(stem)
                suffix = "stl" if len(shape.faces) <= MOST_FACES else "obj"
                found[id(shape.vertices)] = f"{stem}.{suffix}", shape
    return found


def _solid(shape: Shape) -> bool:
    """Whether MuJoCo can hold a shape: a mesh of a single triangle it refuses."""
    return shape.kind != "mesh" or len(np.unique(shape.vertices, axis=0)) >= 4


def _mesh_content(shape: Shape, file: str) -> bytes:
    import trimesh  # large, and needed for meshes only

    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    content = mesh.export(file_type=file.rpartition(".")[2])
    return content.encode() if isinstance(content, str) else content


def movable(tree: Tree) -> Tree:
    """The same tree, where parts on joints have at least a trifle of mass and inertia."""
    poses = {name: tree.world_pose(name) for name in tree.parts}
    still = [
        joint.name
        for part in tree.parts.values()
        for joint in part.joints
        if joint.kind in ("hinge", "slide") and _inertia_about(tree, poses, part, joint) < IDLE
    ]
    parts = {name: _with_inertia(part, still) for name, part in tree.parts.items()}
    raised = [name for name, part in tree.parts.items() if parts[name].inertia is not part.inertia]
    idle = "joints that move no mass are taken as stiff: {names}"
    odd = "parts that have no inertia of a body are given the nearest: {names}"
    kinds = (("joints-idle", idle, still), ("inertias-raised", odd, raised))
    notes = [reading_note(code, text, names) for code, text, names in kinds if names]
    moving = {joint.name for part in parts.values() for joint in part.joints}
    couplings = tuple(each for each in tree.couplings if moving.issuperset(each[:2]))
    return dataclasses.replace(tree, parts=parts, notes=(*tree.notes, *notes), couplings=couplings)


def _with_inertia(part: Part, still: list[str]) -> Part:
    joints = tuple(joint for joint in part.joints if joint.name not in still)
    moments, axes = np.linalg.eigh(part.inertia)
    if not joints or (part.mass >= LEAST_MASS and moments[0] >= LEAST_INERTIA):
        return dataclasses.replace(part, joints=joints)
    inertia = axes * np.maximum(moments, LEAST_INERTIA) @ axes.T
    return dataclasses.replace(part, joints=joints, mass=max(part.mass, LEAST_MASS), inertia=inertia)


def _inertia_about(tree: Tree, poses: dict[str, np.ndarray], carried: Part, joint: Joint) -> float:
    """Inertia of a joint's part, and of all that hangs on it, about a hinge [kg·m²]; of a slide its mass."""
    (axis, place), total = tree.line(joint.name), 0.0
    for part in tree.below(carried.name):
        pose = poses[part.name]
        across = np.cross(axis, moved(pose, part.centre) - place)
        own = pose[:3, :3].T @ axis
        turning = own @ part.inertia @ own + part.mass * across @ across
        total += part.mass if joint.kind == "slide" else turning
    return float(total)


def spec_of(tree: Tree) -> mujoco.MjSpec:
    """A tree as a spec, with its couplings and the shapes that touch."""
    assets = {file: _mesh_content(shape, file) for file, shape in _mesh_files(tree).values()}
    text = leg_text(tree, tree.file.stem if tree.file else "body", meshdir="")
    spec: mujoco.MjSpec = mujoco.MjSpec.from_string(text, assets=assets)
    for joint, other, offset, multiplier in tree.couplings:
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            name1=joint,
            name2=other,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            data=[offset, multiplier, *[0.0] * (mujoco.mjNEQDATA - 2)],
        )
    return spec


def leg_text(tree: Tree, model: str, comment: str = "", meshdir: str = MESHES) -> str:
    """A tree as MJCF text; its meshes stand in files of `_mesh_files`."""
    root = ElementTree.Element("mujoco", model=_clean(model))
    if comment:
        root.append(ElementTree.Comment(f" {_clean(comment).replace('--', '- -')} "))
    compiler = {"angle": "radian", "autolimits": "true"}
    meshes = _mesh_files(tree)
    ElementTree.SubElement(root, "compiler", compiler | ({"meshdir": meshdir} if meshes else {}))
    if meshes:
        asset = ElementTree.SubElement(root, "asset")
        for file, _ in meshes.values():  # a shell may be open or flat, and no mass is taken from it
            name = pathlib.PurePath(file).stem
            ElementTree.SubElement(asset, "mesh", name=name, file=file, inertia="shell")
    elements: dict[str | None, ElementTree.Element] = {None: ElementTree.SubElement(root, "worldbody")}
    taken: set[str] = set()
    for part in tree.parts.values():
        elements[part.name] = _body(elements[part.parent], part, meshes, taken)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _clean(text: str) -> str:
    return NO_CONTROL.sub("", text)


def _body(
    above: ElementTree.Element, part: Part, meshes: dict[int, tuple[str, Shape]], taken: set[str]
) -> ElementTree.Element:
    body = ElementTree.SubElement(above, "body", {"name": _clean(part.name), **_place(part.pose)})
    if part.mass > 0.0:
        ElementTree.SubElement(body, "inertial", _inertial(part))
    for joint in part.joints:
        ElementTree.SubElement(body, "joint", _joint(joint))
    for shape in filter(_solid, part.shapes):
        name = free_name(_clean(shape.name), taken)
        taken.add(name)
        weightless = {} if part.mass > 0.0 else {"mass": "0"}
        ElementTree.SubElement(body, "geom", _geom(shape, name, meshes) | weightless)
    for name, at in part.points.items():
        ElementTree.SubElement(body, "site", name=_clean(name), pos=_numbers(at), size="0.006")
    return body


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)  # + 0.0 makes −0 a plain 0


def _place(pose: np.ndarray) -> dict[str, str]:
    found = {"pos": _numbers(pose[:3, 3])}
    if not np.array_equal(pose[:3, :3], np.eye(3)):
        found["quat"] = _numbers(quaternion_of(pose[:3, :3]))
    return found


def _inertial(part: Part) -> dict[str, str]:
    found = {"pos": _numbers(part.centre), "mass": repr(float(part.mass))}
    beside = part.inertia - np.diag(np.diag(part.inertia))
    if np.abs(beside).max() <= 1e-15 * np.abs(part.inertia).max():
        return found | {"diaginertia": _numbers(_possible(np.diag(part.inertia)))}
    moments, axes = np.linalg.eigh(part.inertia)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # right-handed
    return found | {"quat": _numbers(quaternion_of(axes)), "diaginertia": _numbers(_possible(moments))}


def _possible(moments: np.ndarray) -> np.ndarray:
    """Principal moments with the largest no greater than the others' sum, which rounding breaks (3,)."""
    found = np.maximum(moments, 0.0)
    k = int(np.argmax(found))
    others = np.delete(found, k)
    found[k] = min(found[k], others[0] + others[1])
    return found


def _joint(joint: Joint) -> dict[str, str]:
    found = {"name": _clean(joint.name), "type": joint.kind}
    found |= {"axis": _numbers(joint.axis), "pos": _numbers(joint.position)}
    if joint.range is not None:
        found["range"] = _numbers(joint.range)
    if joint.zero:
        found["ref"] = repr(joint.zero)
    numbers = {"damping": joint.damping, "frictionloss": joint.friction, "armature": joint.armature}
    if joint.stiffness:
        numbers |= {"stiffness": joint.stiffness, "springref": joint.spring_reference}
    return found | {key: repr(float(value)) for key, value in numbers.items() if value}


def _geom(shape: Shape, name: str, meshes: dict[int, tuple[str, Shape]]) -> dict[str, str]:
    found = {"name": name, "type": shape.kind, **_place(shape.pose), "rgba": _numbers(shape.rgba)}
    if shape.kind == "mesh":
        found["mesh"] = pathlib.PurePath(meshes[id(shape.vertices)][0]).stem
    else:
        found["size"] = _numbers(shape.size[: SIZES[shape.kind]])
    return found | ({"group": "3"} if shape.touches else {"contype": "0", "conaffinity": "0"})
