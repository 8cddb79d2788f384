"""OpenSim models (.osim, versions 1 to 4): bodies, joints and marker places from their XML."""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_joint import Joint, Pose
from afo_sim.gait_lab.readers.opensim_joint_xml import Frames, body_joints, set_joints, vector

METRES = ("", "m", "meter", "meters", "metre", "metres")
NEWEST = 49999  # document versions 1xxxx to 4xxxx: OpenSim 1 to 4


@dataclass(frozen=True, eq=False)
class Sphere:
    """A contact sphere of a body."""

    body: str
    centre: np.ndarray  # in the body's axes [m] (3,)
    radius: float  # [m]


@dataclass(frozen=True, eq=False)
class OpenSimModel:
    """What a model says of the skeleton; muscles, forces and geometry are left aside."""

    file: pathlib.Path
    name: str
    bodies: Mapping[str, float]  # body: its mass [kg]
    joints: tuple[Joint, ...]
    markers: Mapping[str, tuple[str, np.ndarray]]  # marker: its body, its place there [m] (3,)
    spheres: tuple[Sphere, ...] = ()  # contact geometry
    remarks: tuple[str, ...] = ()

    @property
    def mass(self) -> float:
        """Mass of all bodies [kg]."""
        return float(sum(self.bodies.values()))

    def path(self, start: str, end: str) -> list[tuple[Joint, bool]]:
        """The joints from one body to another, each with whether it is passed from parent to child."""
        ways: dict[str, list[tuple[Joint, bool]]] = {start: []}
        open_ends = [start]
        while open_ends and end not in ways:
            body = open_ends.pop(0)
            for joint in self.joints:
                for near, far, outward in (
                    (joint.parent, joint.child, True),
                    (joint.child, joint.parent, False),
                ):
                    if near == body and far not in ways:
                        ways[far] = [*ways[body], (joint, outward)]
                        open_ends.append(far)
        if end not in ways:
            raise InputError(f"no joints lead from {start} to {end}", file=self.file)
        return ways[end]

    def pose(self, start: str, end: str, values: Mapping[str, np.ndarray]) -> Pose:
        """The body `end` in the body `start` over time; values as `Joint.pose` takes them."""
        found = Pose(np.eye(3)[None], np.zeros((1, 3)))
        for joint, outward in self.path(start, end):
            try:
                step = joint.pose(values)
            except InputError as error:
                raise error.of_file(self.file) from None
            found = found @ (step if outward else step.inverse())
        return found


def read_opensim_model(path: pathlib.Path) -> OpenSimModel:
    """Read a model."""
    root = _root(path)
    model = root.find("Model")
    if root.tag != "OpenSimDocument" or model is None:
        raise InputError("is not an OpenSim model", file=path, allowed="<OpenSimDocument> with a <Model>")
    version = root.get("Version", "")
    if not version.isdigit() or not 10901 <= int(version) <= NEWEST:
        allowed = "10901 to 4xxxx: a model that OpenSim 2, 3 or 4 has saved"
        raise InputError("is no document version known here", file=path, value=version, allowed=allowed)
    unit = (model.findtext("length_units") or "").strip().lower()
    if unit not in METRES:
        raise InputError("is another unit", file=path, field="length_units", value=unit, allowed="meters")
    try:
        return _model(path, model)
    except InputError as error:
        raise error.of_file(path) from None


def _model(path: pathlib.Path, model: ElementTree.Element) -> OpenSimModel:
    bodies: dict[str, float] = {}
    joints: list[Joint] = []
    for body in model.iterfind("BodySet/objects/Body"):
        name = body.get("name", "")
        bodies[name] = _number(body, "mass", f"mass of {name}")
        joints += body_joints(body)
    frames = Frames(model, set(bodies))
    joints += set_joints(model, frames)
    if not bodies or not joints:
        raise InputError("has no bodies, or no joints between them")
    markers, lost = {}, []
    for marker in model.iterfind("MarkerSet/objects/Marker"):
        name = marker.get("name", "")
        holder, place = frames.base(marker, "parent_frame", "body")
        if holder not in bodies:
            lost.append(name)
            continue
        markers[name] = (holder, place.point(vector(marker, "location"))[0])
    remarks = (f"markers of the model without a known body: {', '.join(lost)}",) if lost else ()
    spheres = tuple(_spheres(model, frames))
    return OpenSimModel(path, model.get("name", ""), bodies, tuple(joints), markers, spheres, remarks)


def _spheres(model: ElementTree.Element, frames: Frames) -> list[Sphere]:
    found = []
    for sphere in model.iterfind("ContactGeometrySet/objects/ContactSphere"):
        body, place = frames.base(sphere, "frame", "body_name")
        radius = _number(sphere, "radius", f"radius of {sphere.get('name')}")
        found.append(Sphere(body, place.point(vector(sphere, "location"))[0], radius))
    return found


def _number(element: ElementTree.Element, name: str, field: str) -> float:
    text = (element.findtext(name) or "0").strip()
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < np.inf:
        raise InputError("is no number of 0 or more", field=field, value=text)
    return value


class _NoDoctype(ElementTree.TreeBuilder):
    """A document type can declare entities that grow without bound; no model needs one."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise InputError("declares a DOCTYPE, which no OpenSim model does")


def _root(path: pathlib.Path) -> ElementTree.Element:
    try:
        return ElementTree.parse(path, ElementTree.XMLParser(target=_NoDoctype())).getroot()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"is no XML: {error}", file=path, allowed="an OpenSim model, .osim") from None
    except InputError as error:
        raise error.of_file(path) from None
