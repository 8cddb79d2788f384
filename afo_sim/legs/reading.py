"""A tree, or a spec, from any file that can be read."""

import dataclasses
import pathlib

import mujoco

from afo_sim.common import InputError
from afo_sim.legs.mjcf import read_mjcf, spec_of_file
from afo_sim.legs.mjcf_out import movable, spec_of
from afo_sim.legs.tree import Tree
from afo_sim.legs.urdf import read_urdf
from afo_sim.legs.urdf_files import XACRO, Packages, content_of, root_tag
from afo_sim.model import examine

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


def read_tree(file: str | pathlib.Path, *, packages: Packages = (), contact: bool = False) -> Tree:
    """Read a body from MJCF or URDF, by the root element."""
    file = pathlib.Path(file)
    if _is_mjcf(file):
        return read_mjcf(file)
    examine(file)
    return read_urdf(file, packages=packages, contact=contact)


def read_body(file: str | pathlib.Path, packages: Packages = ()) -> Tree:
    """A whole body, as legs are found in it."""
    return read_tree(file, packages=packages, contact=True)


def read_spec(file: pathlib.Path, packages: Packages = ()) -> tuple[mujoco.MjSpec, Tree]:
    """A file as a spec to be changed; and as `read_body` reads it, of MJCF the notices alone."""
    if _is_mjcf(file):
        spec, notes = spec_of_file(file)
        return spec, Tree(file, {}, notes=notes)
    tree = read_body(file, packages)
    moving = movable(tree)
    return spec_of(moving), dataclasses.replace(tree, notes=moving.notes)


def _is_mjcf(file: pathlib.Path) -> bool:
    """Whether a file is MJCF; otherwise it is URDF."""
    suffix = file.suffix.lower()
    if suffix in OTHER_FORMATS and file.is_file():
        raise _other(suffix, file)
    content_of(file)
    if suffix not in XML_SUFFIXES:
        allowed = f"{READ}; {', '.join(XML_SUFFIXES)}"
        raise InputError("is of no kind that can be read", file=file, allowed=allowed)
    root = root_tag(file)
    if root in ("mujoco", "robot"):
        return root == "mujoco"
    if root in OTHER_FORMATS:
        raise _other(root, file)
    raise InputError(f"describes no body: its root element is <{root}>", file=file, allowed=READ)


def _other(kind: str, file: pathlib.Path) -> InputError:
    problem, instead = OTHER_FORMATS[kind]
    return InputError(problem, file=file, allowed=instead)
