"""A tree from MuJoCo's own files; every number is the one that MuJoCo compiled."""

import dataclasses
import pathlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import get_args

import mujoco
import numpy as np

from afo_sim.common import Foreign, InputError, Notice, read_bytes, read_text
from afo_sim.legs import tree
from afo_sim.model import examine

# The kinds of a tree have MuJoCo's names: mjJNT_HINGE, mjGEOM_BOX, …
JOINT_KINDS: dict[int, tree.JointKind] = {
    getattr(mujoco.mjtJoint, f"mjJNT_{kind.upper()}"): kind for kind in get_args(tree.JointKind)
}
SHAPE_KINDS: dict[int, tree.ShapeKind] = {
    getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"): kind for kind in get_args(tree.ShapeKind)
}
# {what stands beside the tree: (MuJoCo's count of it, its kind of object, a word for one without a name)}
BESIDE_TREE = {
    "tendons": ("ntendon", mujoco.mjtObj.mjOBJ_TENDON, "tendon"),
    "actuators": ("nactuator", mujoco.mjtObj.mjOBJ_ACTUATOR, "actuator"),
    "sensors": ("nsensor", mujoco.mjtObj.mjOBJ_SENSOR, "sensor"),
    "equality constraints": ("neq", mujoco.mjtObj.mjOBJ_EQUALITY, "equality"),
    "skins": ("nskin", mujoco.mjtObj.mjOBJ_SKIN, "skin"),
    "flexes": ("nflex", mujoco.mjtObj.mjOBJ_FLEX, "flex"),
    "keyframes": ("nkey", mujoco.mjtObj.mjOBJ_KEY, "keyframe"),
    "cameras": ("ncam", mujoco.mjtObj.mjOBJ_CAMERA, "camera"),
    "lights": ("nlight", mujoco.mjtObj.mjOBJ_LIGHT, "light"),
    "plugins": ("nplugin", mujoco.mjtObj.mjOBJ_PLUGIN, "plugin"),
}
DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)  # of a geom; where it stands, its material's colour is shown
MANY_LINES = (ValueError, RuntimeError, OSError, mujoco.FatalError)


def read_mjcf(file: str | pathlib.Path) -> tree.Tree:
    """Read a MuJoCo model file (MJCF)."""
    file = pathlib.Path(file)
    spec, notes = spec_of_file(file)
    with mujoco_says(file) as warned:
        found = tree_of(spec.compile())
    found = dataclasses.replace(found, file=file, notes=(*found.notes, *notes, *warned))
    tree.check_finite(found)
    return found


def spec_of_file(file: pathlib.Path) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """A model file as a spec with all its bodies, and notices of reading it."""
    if not file.is_file():
        raise InputError("is a folder" if file.is_dir() else "there is no such file", file=file)
    examine(file)
    with mujoco_says(file) as warned:
        if file.suffix == ".xml":  # MuJoCo itself goes by the suffix
            spec = mujoco.MjSpec.from_file(str(file.absolute()))
        else:
            pieces = {piece.name: read_bytes(piece) for piece in file.parent.glob("*.xml")}
            spec = mujoco.MjSpec.from_string(read_text(file), include=pieces)
            spec.modelfiledir = str(file.parent)
    spec.compiler.fusestatic = False  # a body that is fixed keeps its name and its mass
    place_files_whole(spec, pathlib.Path(spec.modelfiledir or ""))
    return spec, (*warned, *_without_missing(spec, file))


@contextmanager
def mujoco_says(file: pathlib.Path | None) -> Iterator[list[str]]:
    """MuJoCo's errors as one sentence, and its warnings as notices."""
    notices: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield notices
        except MANY_LINES as error:
            raise InputError(f"MuJoCo cannot read it: {one_line(error)}", file=file) from None
    words = "MuJoCo says: {subject}"
    notices += [Notice("mujoco-warning", words, subject=one_line(one.message)) for one in caught]


def _without_missing(spec: mujoco.MjSpec, file: pathlib.Path) -> Iterator[Notice]:
    """Leave out meshes that are not there, where no mass depends on them."""
    missing = {
        mesh.name or pathlib.Path(mesh.file).stem: mesh
        for mesh in spec.meshes
        if mesh.file and mesh.file not in spec.assets and not pathlib.Path(mesh.file).is_file()
    }
    geoms = [geom for geom in spec.geoms if geom.meshname in missing]
    for geom in geoms:
        if not (geom.parent.explicitinertial or geom.mass == 0.0 or geom.parent == spec.worldbody):
            problem = f"there is no such file, and the mass of the body {geom.parent.name!r} depends on it"
            raise InputError(problem, file=file, field="mesh", value=missing[geom.meshname].file)
    for element in (*geoms, *missing.values()):
        spec.delete(element)
    if missing:
        text = "missing meshes are not shown and have no contact: {names}"
        yield tree.reading_note("meshes-missing", text, sorted(missing))


def files_of(spec: mujoco.MjSpec) -> Iterator[tuple[Foreign, str, str]]:
    """Every element that refers to a file: (element, file, folder of such files in the spec)."""
    folders = {"meshdir": (*spec.meshes, *spec.hfields, *spec.skins), "texturedir": (*spec.textures,)}
    for folder, elements in folders.items():
        for element in elements:
            if element.file:
                yield element, element.file, getattr(element.compiler, folder, "") or ""


def place_files_whole(spec: mujoco.MjSpec, folder: pathlib.Path) -> None:
    """Name meshes and pictures by their whole path, so that they are found from anywhere."""
    for element, named, below in files_of(spec):
        if named not in spec.assets:
            element.file = _whole(folder, below, pathlib.Path(named).name if spec.strippath else named)
    for texture in spec.textures:
        for k, named in enumerate(texture.cubefiles):
            if named and named not in spec.assets:
                texture.cubefiles[k] = _whole(folder, texture.compiler.texturedir or "", named)
    spec.strippath = False
    if all(pathlib.Path(file).is_absolute() for _, file, _ in files_of(spec)):
        spec.meshdir = spec.texturedir = ""


def _whole(folder: pathlib.Path, below: str, file: str) -> str:
    """The whole path of a file; as it is where there is no such file, which MuJoCo reports."""
    for path in (folder / below / file, pathlib.Path(below) / file):
        if path.is_file():
            return str(path.resolve())
    return file


def one_line(error: Exception | Warning | str) -> str:
    """An error of several lines as one."""
    lines = [line.strip().rstrip(".") for line in str(error).splitlines()]
    return "; ".join(filter(None, lines)) or type(error).__name__


def tree_of(model: mujoco.MjModel) -> tree.Tree:
    """The tree of a compiled model, in the posture of its `qpos0`."""
    bodies = range(1, model.nbody)
    given = [model.body(body).name for body in bodies]
    parts = dict(zip(bodies, tree.own_names(given, [f"body_{body}" for body in bodies]), strict=True))
    joints, shapes, points = _joints(model, parts), _shapes(model, parts), _points(model, parts)
    found = {}
    for body, name in parts.items():
        turn = tree.turn_of(model.body_iquat[body])
        inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
        parent = parts.get(int(model.body_parentid[body]))
        pose = tree.pose_of(model.body_pos[body], tree.turn_of(model.body_quat[body]))
        mass, centre = float(model.body_mass[body]), model.body_ipos[body].copy()
        inertia, hinged, shown = (inertia + inertia.T) / 2, tuple(joints[body]), tuple(shapes[body])
        found[name] = tree.Part(name, parent, pose, mass, centre, inertia, hinged, shown, points[body])
    beside = {}
    for word, (count, kind, fallback) in BESIDE_TREE.items():
        numbers = range(int(getattr(model, count)))
        named = [mujoco.mj_id2name(model, kind, number) or "" for number in numbers]
        if names := tree.own_names(named, [f"{fallback}_{number}" for number in numbers]):
            beside[word] = tuple(names)
    return tree.Tree(file=None, parts=found, beside=beside, notes=tuple(_notes(model, parts)))


def _joints(model: mujoco.MjModel, parts: dict[int, str]) -> dict[int, list[tree.Joint]]:
    owners = [parts[int(body)] for body in model.jnt_bodyid]
    given = [model.joint(joint).name for joint in range(model.njnt)]
    found: dict[int, list[tree.Joint]] = {body: [] for body in parts}
    for joint, name in enumerate(tree.own_names(given, [f"{owner}_joint" for owner in owners])):
        kind = JOINT_KINDS[int(model.jnt_type[joint])]
        freedom, place = int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint])
        scalar = kind in ("hinge", "slide")  # a ball's and a free joint's coordinate is a quaternion
        lower, upper = model.jnt_range[joint].tolist()
        made = tree.Joint(
            name=name,
            kind=kind,
            axis=model.jnt_axis[joint].copy(),
            position=model.jnt_pos[joint].copy(),
            range=(lower, upper) if model.jnt_limited[joint] else None,
            damping=float(model.dof_damping[freedom]),
            friction=float(model.dof_frictionloss[freedom]),
            armature=float(model.dof_armature[freedom]),
            stiffness=float(model.jnt_stiffness[joint]),
            spring_reference=float(model.qpos_spring[place]) if scalar else 0.0,
            zero=float(model.qpos0[place]) if scalar else 0.0,
        )
        found[int(model.jnt_bodyid[joint])].append(made)
    return found


def _shapes(model: mujoco.MjModel, parts: dict[int, str]) -> dict[int, list[tree.Shape]]:
    geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in parts]
    geoms = [geom for geom in geoms if int(model.geom_type[geom]) in SHAPE_KINDS]
    fallback = [f"{parts[int(model.geom_bodyid[geom])]}_shape" for geom in geoms]
    names = tree.own_names([model.geom(geom).name for geom in geoms], fallback)
    meshes: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    found: dict[int, list[tree.Shape]] = {body: [] for body in parts}
    for geom, name in zip(geoms, names, strict=True):
        found[int(model.geom_bodyid[geom])].append(_shape(model, geom, name, meshes))
    return found


def _shape(
    model: mujoco.MjModel, geom: int, name: str, meshes: dict[int, tuple[np.ndarray, np.ndarray]]
) -> tree.Shape:
    kind = SHAPE_KINDS[int(model.geom_type[geom])]
    material, own = int(model.geom_matid[geom]), model.geom_rgba[geom]
    shown = model.mat_rgba[material] if material >= 0 and np.allclose(own, DEFAULT_RGBA) else own
    pose = tree.pose_of(model.geom_pos[geom], tree.turn_of(model.geom_quat[geom]))
    red, green, blue, opacity = (float(part) for part in shown)
    plain = tree.Shape(name, kind, pose, model.geom_size[geom].copy(), rgba=(red, green, blue, opacity))
    if kind != "mesh":
        return plain
    mesh = int(model.geom_dataid[geom])
    if mesh not in meshes:  # about the mesh's own centre, as MuJoCo moves its vertices
        vertex, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        face, many = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        vertices = model.mesh_vert[vertex : vertex + count].astype(float)
        meshes[mesh] = vertices, model.mesh_face[face : face + many].astype(int)
    vertices, faces = meshes[mesh]
    return dataclasses.replace(plain, vertices=vertices, faces=faces)


def _points(model: mujoco.MjModel, parts: dict[int, str]) -> dict[int, dict[str, np.ndarray]]:
    sites = [site for site in range(model.nsite) if int(model.site_bodyid[site]) in parts]
    fallback = [f"{parts[int(model.site_bodyid[site])]}_point" for site in sites]
    names = tree.own_names([model.site(site).name for site in sites], fallback)
    found: dict[int, dict[str, np.ndarray]] = {body: {} for body in parts}
    for site, name in zip(sites, names, strict=True):
        found[int(model.site_bodyid[site])][name] = model.site_pos[site].copy()
    return found


def _notes(model: mujoco.MjModel, parts: dict[int, str]) -> Iterator[Notice]:
    """What a user would not expect of the tree."""
    if unnamed := [name for body, name in parts.items() if not model.body(body).name]:
        yield tree.reading_note("unnamed-parts", "parts without a name are called {names}", unnamed)
    of_parts = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in parts]
    if others := sorted({int(model.geom_type[geom]) for geom in of_parts} - set(SHAPE_KINDS)):
        words = [mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower() for kind in others]
        text = "geoms that are no shape of a part are left out: {names}"
        yield tree.reading_note("geoms-left-out", text, words)
    if floating := [name for body, name in parts.items() if model.body_gravcomp[body]]:
        yield tree.reading_note("gravity-compensation", "gravity compensation is left out: {names}", floating)
    curved = [
        model.joint(joint).name or parts[int(model.jnt_bodyid[joint])]
        for joint in range(model.njnt)
        if np.any(model.jnt_stiffnesspoly[joint]) or np.any(model.dof_dampingpoly[model.jnt_dofadr[joint]])
    ]
    if curved:
        text = "of polynomial springs and dampers only the linear part is read: {names}"
        yield tree.reading_note("polynomials-cut", text, curved)
