"""A tree from any file that can be read, and what MuJoCo's own importer makes of a URDF file beside it."""

import pathlib
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from afo_sim.common import InputError
from afo_sim.legs.mjcf import MANY_LINES, one_line, read_mjcf, tree_of
from afo_sim.legs.tree import Part, Tree, listed
from afo_sim.legs.urdf import WORLD, read_urdf
from afo_sim.legs.urdf_files import XACRO, Packages, content_of, robot_element, root_tag

READ = "MJCF (root element <mujoco>) and URDF (root element <robot>)"
XML_SUFFIXES = (".xml", ".mjcf", ".urdf")
MYOCONVERTER = "an MJCF file, which MyoConverter makes of an OpenSim model"
# {suffix or root element: (what the file is, what is taken instead)}
OTHER_FORMATS = {
    ".xacro": ("is xacro, from which a URDF file is made", XACRO),
    ".sdf": ("is SDF, the format of Gazebo", "the URDF file that it was made from, or MJCF"),
    ".osim": ("is an OpenSim model", MYOCONVERTER),
    ".zip": ("is an archive", "a file of it, unpacked together with its meshes"),
    ".usd": ("is a USD scene", READ),
    ".mjb": ("is a compiled model, which only its own version of MuJoCo opens", "the MJCF file"),
    "sdf": ("is SDF, the format of Gazebo", "the URDF file that it was made from, or MJCF"),
    "OpenSimDocument": ("is an OpenSim model", MYOCONVERTER),
    "mujocoinclude": ("is a piece that a MuJoCo model includes", "the model file that includes it"),
}
RELATIVE_TOLERANCE = 1e-6  # relative
LENGTH_TOLERANCE = 1e-6  # [m] centres, axes and places of joints


def read_tree(file: str | pathlib.Path, *, packages: Packages = ()) -> Tree:
    """Read a body from MJCF or URDF; the root element tells which.

    Parameters
    ----------
    file : `.xml`, `.mjcf` or `.urdf`
    packages : where the meshes of a URDF file lie, as in `read_urdf`

    Returns
    -------
    Tree
        SI, in the posture that the file's coordinates stand in

    Raises
    ------
    InputError
        There is no such file, it is of another kind, or what it describes is impossible.
    """
    file = pathlib.Path(file)
    suffix = file.suffix.lower()
    if suffix in OTHER_FORMATS and file.is_file():
        raise _other(suffix, file)
    content_of(file)
    if suffix not in XML_SUFFIXES:
        raise InputError(
            "is of no kind that can be read", file=file, allowed=f"{READ}; {', '.join(XML_SUFFIXES)}"
        )
    root = root_tag(file)
    if root == "mujoco":
        return read_mjcf(file)
    if root == "robot":
        return read_urdf(file, packages=packages)
    if root in OTHER_FORMATS:
        raise _other(root, file)
    raise InputError(f"describes no body: its root element is <{root}>", file=file, allowed=READ)


def _other(kind: str, file: pathlib.Path) -> InputError:
    problem, instead = OTHER_FORMATS[kind]
    return InputError(problem, file=file, allowed=instead)


def second_opinion(tree: Tree) -> tuple[str, ...]:
    """Compare a tree from a URDF file with MuJoCo's own reading of the same file.

    Masses, centres, inertias, and joints' axes and ranges are compared link by link. MuJoCo reads the file
    without its shapes, which have no part in them; fixed links are kept, and masses are not raised.

    Parameters
    ----------
    tree : as `read_urdf` gave it, with its file

    Returns
    -------
    tuple of str
        one finding for each difference, with both numbers, or that MuJoCo cannot read the file; empty where
        both agree to 1e-6
    """
    if tree.file is None:
        return ("there is no file for MuJoCo to read",)
    root = robot_element(tree.file)
    guessed = tuple(_guesses(root))
    try:
        model = _imported(root, tree.file.stem)
    except MANY_LINES as error:
        return (*guessed, f"MuJoCo cannot read it: {one_line(error)}{_reason(tree)}")
    return (*guessed, *_differences(tree, tree_of(model)))


def _guesses(root: Any) -> Iterator[str]:
    """Links that MuJoCo by itself would give a mass."""
    several = [link for link in root.findall("link") if link.find("inertial") is None]
    names = [link.get("name", "") for link in several if link.find("collision") is not None]
    if names:
        yield (
            f"no <inertial>: {listed(names)}; without mass here, while MuJoCo by itself takes the volume of "
            "the collision shapes at 1000 kg/m³"
        )


def _imported(root: Any, name: str) -> mujoco.MjModel:
    """A robot by MuJoCo's importer, without shapes."""
    from lxml import etree

    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for extra in root.findall("mujoco"):  # settings of its own would change the numbers
        root.remove(extra)
    for joint in root.findall("joint"):
        for rule in joint.findall("mimic"):  # of which MuJoCo would write a log into the working folder
            joint.remove(rule)
    root.set("name", root.get("name") or name)
    spec: Any = mujoco.MjSpec.from_string(etree.tostring(root, encoding="unicode"))
    spec.compiler.fusestatic = False  # the root is fixed, and would lose its mass
    spec.compiler.boundmass = spec.compiler.boundinertia = 0.0
    spec.compiler.balanceinertia = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    return spec.compile()


def _reason(tree: Tree) -> str:
    """Which links MuJoCo refuses, where it is for their mass."""
    light = [part.name for part in tree.parts.values() if part.joints and not part.mass]
    return f"; MuJoCo moves no link without mass, as {listed(light)}" if light else ""


def _differences(tree: Tree, other: Tree) -> Iterator[str]:
    missing = [name for name in tree.parts if name not in other.parts]
    if missing:
        yield f"MuJoCo has no {listed(missing)}"
    more = [name for name in other.parts if name not in tree.parts and name != WORLD]
    if more:
        yield f"only MuJoCo has {listed(more)}"
    for name, part in tree.parts.items():
        if name in other.parts:
            yield from _part_differences(part, other.parts[name])
    joints = other.joints()
    for name, (_, joint) in tree.joints().items():
        if name not in joints:
            yield f"joint {name}: MuJoCo has none of that name"
            continue
        _, theirs = joints[name]
        if joint.kind != theirs.kind:
            yield f"joint {name}: {joint.kind} here, {theirs.kind} in MuJoCo"
        elif not np.allclose(joint.axis, theirs.axis, rtol=0, atol=LENGTH_TOLERANCE):
            yield f"joint {name}: axis {_list(joint.axis)} here, {_list(theirs.axis)} in MuJoCo"
        if joint.range != theirs.range and not _same_range(joint.range, theirs.range):
            yield f"joint {name}: range {_span(joint.range)} here, {_span(theirs.range)} in MuJoCo"


def _part_differences(part: Part, other: Part) -> Iterator[str]:
    if abs(part.mass - other.mass) > RELATIVE_TOLERANCE * max(part.mass, other.mass):
        yield f"link {part.name}: mass {part.mass:.9g} kg here, {other.mass:.9g} kg in MuJoCo"
    if not np.allclose(part.pose, other.pose, rtol=0, atol=LENGTH_TOLERANCE):
        ours, theirs = _list(part.pose[:3, 3]), _list(other.pose[:3, 3])
        yield f"link {part.name}: placed otherwise on its parent: {ours} m here, {theirs} m in MuJoCo"
    if not (part.mass and other.mass):
        return  # a centre of nothing is nowhere
    if not np.allclose(part.centre, other.centre, rtol=0, atol=LENGTH_TOLERANCE):
        yield f"link {part.name}: centre {_list(part.centre)} m here, {_list(other.centre)} m in MuJoCo"
    scale = max(np.abs(part.inertia).max(), np.abs(other.inertia).max())
    apart = np.abs(part.inertia - other.inertia)
    if scale and apart.max() > RELATIVE_TOLERANCE * scale:
        row, column = np.unravel_index(np.argmax(apart), apart.shape)
        name = "xyz"[row] + "xyz"[column]
        ours, theirs = part.inertia[row, column], other.inertia[row, column]
        yield f"link {part.name}: inertia {name} {ours:.9g} kg·m² here, {theirs:.9g} kg·m² in MuJoCo"


def _same_range(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    return (
        one is not None and other is not None and np.allclose(one, other, rtol=RELATIVE_TOLERANCE, atol=1e-9)
    )


def _list(numbers: np.ndarray) -> str:
    return "(" + ", ".join(f"{number:.6g}" for number in numbers) + ")"


def _span(found: tuple[float, float] | None) -> str:
    return "without stops" if found is None else f"{found[0]:.6g} to {found[1]:.6g}"
