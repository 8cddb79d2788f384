"""A tree from any file that can be read, by what stands in it."""

import pathlib

from afo_sim.common.errors import InputError
from afo_sim.legs.mjcf import read_mjcf
from afo_sim.legs.tree import Tree
from afo_sim.legs.urdf import read_urdf
from afo_sim.legs.urdf_meshes import Packages
from afo_sim.legs.urdf_xml import XACRO, content_of, root_tag

READ = "MJCF (root element <mujoco>) and URDF (root element <robot>)"
XML_SUFFIXES = (".xml", ".mjcf", ".urdf")
MYOCONVERTER = "an MJCF file, which MyoConverter makes of an OpenSim model"
# {suffix or root element: (what the file is, what is taken instead)}
OTHERS = {
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
    if suffix in OTHERS and file.is_file():
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
    if root in OTHERS:
        raise _other(root, file)
    raise InputError(f"describes no body: its root element is <{root}>", file=file, allowed=READ)


def _other(kind: str, file: pathlib.Path) -> InputError:
    problem, instead = OTHERS[kind]
    return InputError(problem, file=file, allowed=instead)
