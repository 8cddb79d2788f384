"""S1's orthosis, seated, on five legs: the shipped one and four that come out of other files.

All legs have the same tissue, damping and friction, so that they differ by their masses and stops alone.
"""

import importlib.util
import pathlib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
import urdf_texts as urdf

import afo_sim as afo
from afo_sim.common import assets, without_digests
from afo_sim.legs import Imported, LegNumbers, export_leg, import_leg
from afo_sim.model.build import build
from afo_sim.model.path_facts import path_facts

# The same of all legs; the ankle's own spring, friction and armature in a file are taken out.
SAME = {
    "leg.damping": "0.5 N*m*s/rad",
    "leg.passive.scale": 1.0,
    "leg.passive.offset": "0 deg",
}
OWN = ("stiffness", "springref", "frictionloss", "armature", "damping")  # of an ankle in a file
INERTIAL = ("pos", "mass", "quat", "diaginertia", "fullinertia", "euler")


@dataclass(frozen=True, eq=False)
class Row:
    """One leg, and what S1's orthosis does on it, seated.

    numbers : masses and inertia of the leg
    arms : moment arms of the five muscles at an ankle angle of zero [m] (5,)
    run : recording of the scenario `seated`
    apart : largest difference of the ankle's angle to a run on the shipped leg with this leg's foot and
        stops [rad]
    """

    name: str
    numbers: LegNumbers
    arms: np.ndarray
    run: afo.Recording
    apart: float


# --- where the legs come from


def shipped() -> LegNumbers:
    """Numbers of the shipped leg, from its file."""
    return import_leg(assets.find("leg", "adult_75kg").parent / "leg.xml").numbers


def out_and_in(folder: pathlib.Path) -> Imported:
    """The shipped leg, written as URDF and read again."""
    export_leg("adult_75kg", folder / "written.urdf")
    return import_leg(folder / "written.urdf", folder / "urdf", side="right")


def humanoid(folder: pathlib.Path) -> Imported | None:
    """The right leg of dm_control's humanoid; None where dm_control is not there."""
    if importlib.util.find_spec("dm_control") is None:
        return None
    found = importlib.util.find_spec("dm_control.suite")
    assert found is not None and found.origin is not None
    return import_leg(pathlib.Path(found.origin).parent / "humanoid.xml", folder / "humanoid", side="right")


def musculoskeletal(folder: pathlib.Path) -> Imported | None:
    """The right leg of MuscleMimic's whole body (PyPI: musclemimic-models); None where it is not there."""
    found = importlib.util.find_spec("musclemimic_models")
    if found is None or found.origin is None:
        return None
    body = pathlib.Path(found.origin).parent / "model" / "body" / "myofullbody.xml"
    return import_leg(body, folder / "musculoskeletal", side="right")


def robot(folder: pathlib.Path) -> Imported:
    """The left leg of a robot as public ones are described; see `robot_files`."""
    return import_leg(robot_files(folder), folder / "robot", side="left", foot="l_ankle_roll_link")


def robot_files(folder: pathlib.Path) -> pathlib.Path:
    """A robot's description, written here: pitch and roll in the ankle, meshes in millimetres.

    Its pitch is positive where the toes go down, its meshes are named by `package://`, and frames without
    mass hang on its foot.
    """
    import trimesh

    package = folder / "small_robot_description"
    for name, size in (("shank", (70.0, 60.0, 320.0)), ("foot", (220.0, 90.0, 20.0))):
        (package / "meshes").mkdir(parents=True, exist_ok=True)
        trimesh.creation.box(extents=size).export(package / "meshes" / f"{name}.stl")
    (package / "package.xml").write_text("<package><name>small_robot_description</name></package>")
    (package / "urdf").mkdir(exist_ok=True)
    file = package / "urdf" / "small_robot.urdf"
    file.write_text(ROBOT, encoding="utf-8")
    return file


def _link(name: str, mass: float, centre: str, inertia: str, mesh: str = "", place: str = "0 0 0") -> str:
    shape = (
        f'<visual><origin xyz="{place}"/><geometry><mesh filename="package://small_robot_description/meshes/'
        f'{mesh}.stl" scale="0.001 0.001 0.001"/></geometry></visual>'
    )
    return urdf.link(name, urdf.inertial(mass, centre, inertia) + (shape if mesh else ""))


def _joint(name: str, parent: str, child: str, xyz: str, axis: str = "", limits: str = "-1 1") -> str:
    low, high = limits.split()
    stops = f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="60" velocity="9"/>'
    more = f'<origin xyz="{xyz}"/>{stops if axis else ""}'
    return urdf.joint("revolute" if axis else "fixed", more, name=name, parent=parent, child=child)


ROBOT = "\n".join(
    [
        '<?xml version="1.0"?><robot name="small_robot">',
        _link("base_link", 8.0, "0 0 0.1", "0.1 0.1 0.05"),
        _link("l_thigh_link", 2.2, "0 0 -0.15", "0.02 0.02 0.004"),
        _link("l_shank_link", 1.6, "0.005 0 -0.14", "0.015 0.015 0.003", "shank", "0 0 -0.16"),
        _link("l_ankle_pitch_link", 0.12, "0 0 0", "0.0001 0.0001 0.0001"),
        _link("l_ankle_roll_link", 0.85, "0.035 0 -0.045", "0.001 0.0035 0.004", "foot", "0.04 0 -0.06"),
        '<link name="l_sole_link"/><link name="l_force_sensor_link"/>',
        _joint("l_hip_pitch_joint", "base_link", "l_thigh_link", "0 0.09 0", "0 1 0", "-1.5 0.8"),
        _joint("l_knee_joint", "l_thigh_link", "l_shank_link", "0 0 -0.32", "0 1 0", "0 2.2"),
        _joint("l_ankle_pitch_joint", "l_shank_link", "l_ankle_pitch_link", "0 0 -0.33", "0 1 0", "-0.6 0.9"),
        _joint("l_ankle_roll_joint", "l_ankle_pitch_link", "l_ankle_roll_link", "0 0 0", "1 0 0", "-0.3 0.3"),
        _joint("l_sole_joint", "l_ankle_roll_link", "l_sole_link", "0.04 0 -0.07"),
        _joint("l_force_sensor_joint", "l_ankle_roll_link", "l_force_sensor_link", "0 0 -0.05"),
        "</robot>",
    ]
)


# --- what the orthosis does on them


def worn(name: str, leg: str | pathlib.Path, numbers: LegNumbers, folder: pathlib.Path) -> Row:
    """A leg with S1's orthosis, seated, and the same run on the shipped leg with this leg's foot."""
    run = seated(leg)
    swapped = swapped_leg(numbers, folder / f"swapped_{pathlib.Path(leg).name}")
    facts = path_facts(build(afo.load("scenario", "seated", {"leg": str(leg), **SAME})))
    arms = np.concatenate([np.full(len(f.muscles), f.arm[f.at(0.0)]) for f in facts])
    apart = float(np.abs(run["ankle/angle"] - seated(swapped)["ankle/angle"]).max())
    return Row(name, numbers, arms, run, apart)


def seated(leg: str | pathlib.Path) -> afo.Recording:
    """S1's orthosis on a leg."""
    return afo.run("seated", {"leg": str(leg), **SAME})


def with_same_tissue(file: pathlib.Path) -> None:
    """Take the ankle's own spring, friction, damping and armature out of an imported leg's file."""
    document = ElementTree.parse(file)
    for joint in document.getroot().iter("joint"):
        for key in OWN if joint.get("name") == "ankle" else ():
            joint.attrib.pop(key, None)
    document.write(file)
    about = file.with_suffix(".toml")
    about.write_text(without_digests(about.read_text(encoding="utf-8")), encoding="utf-8")


def swapped_leg(numbers: LegNumbers, folder: pathlib.Path) -> pathlib.Path:
    """The shipped leg with another leg's foot, of one rigid piece, and its ankle's stops."""
    folder.mkdir()
    document = ElementTree.parse(assets.find("leg", "adult_75kg").parent / "leg.xml")
    foot = next(body for body in document.getroot().iter("body") if body.get("name") == "foot")
    for toes in foot.findall("body"):
        foot.remove(toes)
    inertial = foot.find("inertial")
    assert inertial is not None
    for key in INERTIAL:
        inertial.attrib.pop(key, None)
    segment = numbers.foot
    at = segment.centre
    own = segment.inertia - segment.mass * (at @ at * np.eye(3) - np.outer(at, at))
    entries = own[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    inertial.attrib |= {"mass": repr(segment.mass), "pos": _text(at), "fullinertia": _text(entries)}
    next(joint for joint in foot.iter("joint")).set("range", _text(np.degrees(numbers.range)))
    document.write(folder / "leg.xml")
    (folder / "leg.toml").write_text('file = "leg.xml"\ndamping = "0.5 N*m*s/rad"\n', encoding="utf-8")
    return folder


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


LEGS = {
    "out to URDF and in again": out_and_in,
    "dm_control's humanoid": humanoid,
    "musculoskeletal (MuscleMimic)": musculoskeletal,
    "a robot's, URDF": robot,
}
