"""Files of a URDF model: the text with its numbers, checked, and the meshes that it names."""

import contextlib
import logging
import os
import pathlib
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from urllib.parse import unquote

import numpy as np

from afo_sim.common import Foreign, InputError, check_regular, plausible, read_bytes, unknown

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
# {element: {attribute: how many numbers stand there}}, http://wiki.ros.org/urdf/XML
NUMBERS: dict[str, dict[str, tuple[int, ...]]] = {
    "origin": {"xyz": (3,), "rpy": (3,)},
    "mass": {"value": (1,)},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), (1,)),
    "axis": {"xyz": (3,)},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), (1,)),
    "dynamics": dict.fromkeys(("damping", "friction"), (1,)),
    "mimic": dict.fromkeys(("multiplier", "offset"), (1,)),
    "box": {"size": (3,)},
    "cylinder": {"radius": (1,), "length": (1,)},
    "sphere": {"radius": (1,)},
    "capsule": {"radius": (1,), "length": (1,)},
    "mesh": {"scale": (1, 3)},
    "color": {"rgba": (3, 4)},
}
NEEDED = {"mass": ("value",), "inertia": ("ixx", "iyy", "izz")}  # yourdfpy would take 0 kg and 1 kg·m²
UNUSED = ("safety_controller", "calibration")  # of a robot's own electronics
ENDLESS = {"effort", "velocity"}  # a joint may be without such a limit
SHAPE_SIZES = {kind: tuple(NUMBERS[kind]) for kind in ("box", "cylinder", "sphere", "capsule")}
SHAPE_SIZES["mesh"] = ("filename",)
HARMLESS = ("ERR_HYPHEN_IN_COMMENT", "ERR_UNKNOWN_VERSION")  # PyBullet writes version 0.0
XACRO = (
    "the expanded file: `xacro FILE.xacro > FILE.urdf` of ROS, or, without ROS, `pip install xacrodoc` and "
    "`xacrodoc FILE.xacro -o FILE.urdf`"
)
SCHEMES = ("package://", "model://")
LOUD = ("yourdfpy", "trimesh", "collada")
Packages = Mapping[str, str | os.PathLike[str]] | Sequence[str | os.PathLike[str]] | str | os.PathLike[str]


def robot_element(file: pathlib.Path) -> Foreign:
    """The <robot> of a file, as lxml's element without comments."""
    root = _root_element(file)
    if root.tag != "robot":
        problem = f"is not a URDF file: its root element is <{root.tag}>"
        raise InputError(problem, file=file, allowed="<robot> as the root element")
    unexpanded = any("${" in value for element in root.iter() for value in element.attrib.values())
    if unexpanded or any("xacro" in str(element.tag) for element in root.iter()):
        raise InputError("holds xacro macros", file=file, allowed=XACRO)
    for element in list(root.iter()):
        if ":" in str(element.tag) or element.tag in UNUSED:  # a prefix is a simulator's
            element.getparent().remove(element)
    return root


def _root_element(file: pathlib.Path) -> Foreign:
    root, faults = _parsed(file)
    if root is not None and not faults:
        return root
    content = content_of(file)
    if b"\0" in content or not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        raise InputError("is not XML", file=file)
    reason = f": {faults[0]}" if faults else ""
    raise InputError(f"is not whole XML, perhaps it is cut off{reason}", file=file)


def root_tag(file: pathlib.Path) -> str:
    """Name of the root element, also of a file that is faulty further on."""
    root, _ = _parsed(file)
    return str(root.tag) if root is not None else str(_root_element(file).tag)


def _parsed(file: pathlib.Path) -> tuple[Foreign, list[str]]:
    """The root of a file, None without any, and what is wrong with its XML."""
    from lxml import etree

    plain = {"remove_blank_text": True, "remove_comments": True, "remove_pis": True}
    parser = etree.XMLParser(**plain, resolve_entities=False, no_network=True, recover=True)
    try:
        root = etree.fromstring(content_of(file).strip(b"\0 \t\r\n"), parser)
    except etree.XMLSyntaxError:
        root = None
    faults = [fault for fault in parser.error_log if fault.domain_name != "NAMESPACE"]
    faults = [fault for fault in faults if fault.type_name not in HARMLESS]
    return root, [f"{fault.message.strip()}, line {fault.line}" for fault in faults]


def content_of(file: pathlib.Path) -> bytes:
    """The bytes of a file."""
    content = read_bytes(file)
    if not content.strip():
        raise InputError("is empty", file=file)
    return content


def text_problems(root: Foreign, file: pathlib.Path) -> Iterator[InputError]:
    """What yourdfpy would stumble over or silently fill in: names, references, and numbers."""
    for kind in ("link", "joint"):
        names: set[str] = set()
        for element in root.findall(kind):
            name = element.get("name", "").strip()
            if not name:
                yield InputError("has no name", file=file, field=f"<{kind}> in line {element.sourceline}")
            elif name in names:
                problem = f"occurs twice: give one of the {kind}s another name"
                yield InputError(problem, file=file, field=f"{kind} {name!r}")
            names.add(name)
            place = f"{kind} {name!r}"
            if kind == "joint":
                yield from _joint_problems(element, file, place)
            yield from _number_problems(element, file, place)
    for material in root.findall("material"):
        yield from _number_problems(material, file, f"material {material.get('name', '')!r}")


def _joint_problems(joint: Foreign, file: pathlib.Path, place: str) -> Iterator[InputError]:
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is None or not element.get("link"):
            yield InputError(f'has no <{end} link="…"/>', file=file, field=place)
    kind = joint.get("type")
    if kind not in JOINT_TYPES:
        problem = "is not a valid type of joint" if kind else "has no type"
        yield unknown(kind, JOINT_TYPES, file=file, field=place, problem=problem)
    mimic = joint.find("mimic")
    if mimic is not None and not mimic.get("joint"):
        yield InputError('has a <mimic> without joint="…"', file=file, field=place)


def _number_problems(owner: Foreign, file: pathlib.Path, place: str) -> Iterator[InputError]:
    for element in owner.iter():
        for attribute in NEEDED.get(element.tag, ()):
            if element.get(attribute) is None:
                field = f"{place} <{element.tag} {attribute}>"
                yield InputError("is missing", file=file, field=field, allowed="a number")
        for attribute, counts in NUMBERS.get(element.tag, {}).items():
            text = element.get(attribute)
            problem = _number_problem(text, counts, attribute in ENDLESS) if text is not None else ""
            if problem:
                field = f"{place} <{element.tag} {attribute}>"
                yield InputError(problem, file=file, field=field, value=text)


def _number_problem(text: str, counts: tuple[int, ...], endless: bool) -> str:
    """Why a text is not so many finite numbers; empty where it is."""
    words = text.replace(",", " ").split() if len(counts) > 1 or counts == (3,) else [text.strip()]
    try:
        numbers = np.array([float(word) for word in words])
        plausible(numbers[~np.isinf(numbers)] if endless else numbers)
    except ValueError:
        return "is not a number" if counts == (1,) else "is not a list of numbers"
    except InputError as error:
        return error.problem
    if len(numbers) not in counts:
        return f"has {len(numbers)} numbers, not {' or '.join(map(str, counts))}"
    return ""


def without_odd_shapes(root: Foreign) -> dict[str, list[str]]:
    """Take out the shapes that are unknown, or that have no size; {why: links}, for a note."""
    found: dict[str, list[str]] = {}
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            if problem := _shape_problem(shape.find("geometry")):
                found.setdefault(problem, []).append(link.get("name", ""))
                link.remove(shape)
    return found


def _shape_problem(geometry: Foreign) -> str:
    if geometry is None or not len(geometry):
        return "a shape without a geometry"
    kind = geometry[0].tag
    if kind not in SHAPE_SIZES:
        return f"a shape <{kind}>, which is unknown"
    if any(not geometry[0].get(attribute) for attribute in SHAPE_SIZES[kind]):
        return f"a <{kind}> without {' or '.join(SHAPE_SIZES[kind])}"
    if kind != "mesh" and not all(_positive(geometry[0].get(attribute)) for attribute in SHAPE_SIZES[kind]):
        return f"a <{kind}> without extent"
    return ""


def _positive(text: str) -> bool:
    try:
        return all(float(word) > 0 for word in text.replace(",", " ").split())
    except ValueError:
        return True


def take_capsules(root: Foreign) -> set[tuple[str, str, int]]:
    """Make cylinders of capsules, which yourdfpy does not read: {(link, visual or collision, which)}."""
    found = set()
    for link in root.findall("link"):
        for kind in ("visual", "collision"):
            for number, shape in enumerate(link.findall(kind)):
                if shape.find("geometry")[0].tag == "capsule":
                    shape.find("geometry")[0].tag = "cylinder"
                    found.add((link.get("name"), kind, number))
    return found


def split_commas(root: Foreign) -> None:
    """Write spaces for the commas in lists of numbers, which yourdfpy reads in some places only."""
    for element in root.iter():
        for attribute, counts in NUMBERS.get(element.tag, {}).items():
            if max(counts) > 1 and "," in (text := element.get(attribute, "")):
                element.set(attribute, re.sub(r"\s*,\s*", " ", text))


@contextmanager
def quiet() -> Iterator[None]:
    """Without what yourdfpy, trimesh and pycollada log, and what they warn of in their own code."""
    loggers = [logging.getLogger(name) for name in LOUD]
    levels = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def find_mesh(name: str, file: pathlib.Path, packages: Packages) -> pathlib.Path | None:
    """Where a mesh lies that a file names; None where it is nowhere."""
    for candidate in _candidates(name.strip(), file, packages):
        with contextlib.suppress(OSError):  # a name too long for the system
            if candidate.is_file():
                return candidate
    return None


def _candidates(name: str, file: pathlib.Path, packages: Packages) -> Iterator[pathlib.Path]:
    if isinstance(packages, str | os.PathLike):
        packages = (packages,)
    named = dict(packages) if isinstance(packages, Mapping) else {}
    given = [pathlib.Path(folder) for folder in (named.values() if named else packages)]
    ros = filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep))
    folders = [*given, *file.absolute().parents, *map(pathlib.Path, ros)]
    scheme = next((scheme for scheme in SCHEMES if name.startswith(scheme)), "")
    if not scheme:
        path = unquote(name.removeprefix("file://")) if name.startswith("file://") else name
        for text in dict.fromkeys((path, path.replace("\\", "/"))):
            yield from (folder / text for folder in [file.absolute().parent, *folders])
            yield from (folder / pathlib.PurePath(text).name for folder in given)
        return
    package, _, rest = name.removeprefix(scheme).partition("/")
    if package in named:
        yield pathlib.Path(named[package]) / rest
    for folder in folders:
        yield folder / package / rest
        if folder.name == package:
            yield folder / rest
    yield from (folder / rest for folder in folders)


def load_mesh(path: pathlib.Path, scale: float | np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and faces (m, 3) of a mesh file, through trimesh."""
    import trimesh

    with quiet():
        try:
            check_regular(path)
            mesh = trimesh.load(str(path), force="mesh", skip_materials=True)
            unit = trimesh.units.unit_conversion(mesh.units, "meters") if mesh.units else 1.0
        except Exception as error:  # each of trimesh's readers has errors of its own
            raise ValueError(str(error) or type(error).__name__) from None
    faces = np.asarray(getattr(mesh, "faces", ()), dtype=int).reshape(-1, 3)
    factor = np.ones(3) * unit * (1.0 if scale is None else scale)
    vertices = np.asarray(mesh.vertices, dtype=float).reshape(-1, 3) * factor
    if not len(faces) or not np.isfinite(vertices).all():
        raise ValueError("it holds no surface")
    if np.prod(factor) < 0:  # a mirrored mesh would show its inside
        faces = faces[:, ::-1]
    return vertices, faces
