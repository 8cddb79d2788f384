"""OpenSim models (.osim, versions 1 to 4): bodies, joints and attachment points of markers from their XML."""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from afo_sim.common import InputError, Notice, read_bytes
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.opensim_joint import (
    Coordinate,
    Joint,
    MotionAxis,
    Pose,
    inner_function,
    numbers,
    offset_pose,
)

_METRES = ("", "m", "meter", "meters", "metre", "metres")
_LARGEST = 2**25  # bytes; a whole body with its muscles is 5 MB, and read it is thirty times as large
_NEWEST = 49999  # document versions 1xxxx to 4xxxx: OpenSim 1 to 4

X, Y, Z = np.eye(3)
# {kind: (axes of its rotations, axes of its translations)}, coordinates in this order; OpenSim's API
# documentation of each joint: frames turn about their own axes, x first
_PLAIN: dict[str, tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]] = {
    "WeldJoint": ((), ()),
    "PinJoint": ((Z,), ()),
    "SliderJoint": ((), (X,)),
    "UniversalJoint": ((X, Y), ()),
    "BallJoint": ((X, Y, Z), ()),
    "GimbalJoint": ((X, Y, Z), ()),
    "PlanarJoint": ((Z,), (X, Y)),
    "FreeJoint": ((X, Y, Z), (X, Y, Z)),
}
_FIXED = Pose(np.eye(3)[None], np.zeros((1, 3)))


@dataclass(frozen=True, eq=False)
class Sphere:
    """A contact sphere of a body."""

    body: str
    centre: np.ndarray  # in the body's axes [m] (3,)
    radius: float  # [m]


class _Frames:
    """The offset frames of a model, and what they are fixed to."""

    def __init__(self, model: Element, bodies: set[str]):
        self._bodies = bodies | {"ground"}
        self._offsets: dict[str, Element] = {}
        for frame in model.iter("PhysicalOffsetFrame"):
            self._offsets.setdefault(frame.get("name", ""), frame)

    def base(
        self, element: Element, socket: str, old: str, own: dict[str, Element] | None = None
    ) -> tuple[str, Pose]:
        """The body that an element belongs to, and the pose of its frame on the body."""
        name = (_socket(element, socket) or element.findtext(old) or "").strip().split("/")[-1]
        found = _FIXED
        for _ in range(20):  # frames on frames; more than 20 would be a ring
            frame = (own or {}).get(name)
            if frame is None and name in self._bodies:
                return name, found
            frame = self._offsets.get(name) if frame is None else frame
            if frame is None:
                break
            found = offset_pose(vector(frame, "translation"), vector(frame, "orientation")) @ found
            name, own = (_socket(frame, "parent") or "").strip().split("/")[-1], None
        return name, found


def vector(element: Element, name: str, left_out: str = "0 0 0") -> np.ndarray:
    """Three numbers of a child element (3,); `left_out` is what OpenSim takes where there is none."""
    return numbers(element, name, 3, left_out)


@dataclass(frozen=True, eq=False)
class OpenSimModel(Noted):
    """The skeleton of a model, without muscles, forces and geometry."""

    file: pathlib.Path
    name: str
    bodies: Mapping[str, float]  # body: its mass [kg]
    joints: tuple[Joint, ...]
    markers: Mapping[str, tuple[str, np.ndarray]]  # marker: its body, its place there [m] (3,)
    spheres: tuple[Sphere, ...] = ()  # contact geometry
    notices: tuple[Notice, ...] = ()

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
        found = _FIXED
        for joint, outward in self.path(start, end):
            try:
                step = joint.pose(values)
            except InputError as error:
                raise error.replaced(file=self.file) from None
            found = found @ (step if outward else step.inverse())
        return found


def read_opensim_model(path: pathlib.Path) -> OpenSimModel:
    """Read a model."""
    raw = read_bytes(path, _LARGEST)
    try:
        root = ElementTree.fromstring(raw, ElementTree.XMLParser(target=_NoDoctype()))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"is not XML: {error}", file=path, allowed="an OpenSim model, .osim") from None
    except InputError as error:
        raise error.replaced(file=path) from None
    model = root.find("Model")
    if root.tag != "OpenSimDocument" or model is None:
        raise InputError("is not an OpenSim model", file=path, allowed="<OpenSimDocument> with a <Model>")
    version = root.get("Version", "")
    if not version.isdigit() or not 10901 <= int(version) <= _NEWEST:
        allowed = "10901 to 4xxxx: a model that OpenSim 2, 3 or 4 has saved"
        raise InputError("is not a known document version", file=path, value=version, allowed=allowed)
    unit = (model.findtext("length_units") or "").strip().lower()
    if unit not in _METRES:
        raise InputError("is another unit", file=path, field="length_units", value=unit, allowed="meters")
    try:
        return _model(path, model)
    except InputError as error:
        raise error.replaced(file=path) from None
    except RecursionError:
        raise InputError("is nested too deeply", file=path) from None


def _model(path: pathlib.Path, model: ElementTree.Element) -> OpenSimModel:
    bodies: dict[str, float] = {}
    joints: list[Joint] = []
    for body in model.iterfind("BodySet/objects/Body"):
        name = body.get("name", "")
        bodies[name] = _number(body, "mass")
        for element in body.iterfind("Joint/*"):  # in versions 1 to 3 a body brings its joint along
            vectors = (vector(element, f"{what}_in_parent") for what in ("location", "orientation"))
            in_parent = offset_pose(*vectors)
            in_child = offset_pose(vector(element, "location"), vector(element, "orientation"))
            parent = (element.findtext("parent_body") or "").strip()
            joints.append(_joint(element, parent, name, in_parent, in_child))
    frames = _Frames(model, set(bodies))
    for element in model.iterfind("JointSet/objects/*"):  # of version 4
        own = {frame.get("name", ""): frame for frame in element.iterfind("frames/PhysicalOffsetFrame")}
        parent, in_parent = frames.base(element, "parent_frame", "parent_body", own)
        child, in_child = frames.base(element, "child_frame", "child_body", own)
        joints.append(_joint(element, parent, child, in_parent, in_child))
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
    text = "markers of the model without a known body: {markers}"
    notices = (note("model-markers-lost", text, markers=", ".join(lost)),) if lost else ()
    spheres = []
    for sphere in model.iterfind("ContactGeometrySet/objects/ContactSphere"):
        holder, place = frames.base(sphere, "frame", "body_name")
        radius = _number(sphere, "radius")
        spheres.append(Sphere(holder, place.point(vector(sphere, "location"))[0], radius))
    return OpenSimModel(path, model.get("name", ""), bodies, tuple(joints), markers, tuple(spheres), notices)


def _number(element: ElementTree.Element, name: str) -> float:
    value = float(numbers(element, name, 1, "0")[0])
    if value < 0.0:
        raise InputError("is negative", field=f"{name} of {element.get('name')}", value=value)
    return value


def _socket(element: Element, name: str) -> str | None:
    """What a socket connects to; the documents on the way to version 4 called it a connectee."""
    found = element.findtext(f"socket_{name}") or element.findtext(f"socket_{name}_connectee_name")
    return found or element.findtext(f"connectors/*[@name='{name}']/connectee_name")


def _joint(element: Element, parent: str, child: str, in_parent: Pose, in_child: Pose) -> Joint:
    kind, name, refused = element.tag, element.get("name", ""), ""
    layouts = ("coordinates/Coordinate", "CoordinateSet/objects/Coordinate")
    listed = [coordinate for layout in layouts for coordinate in element.iterfind(layout)]
    names = [c.get("name", "") for c in listed]
    rotations: tuple[MotionAxis, ...] = ()
    translations: tuple[MotionAxis, ...] = ()
    if (element.findtext("reverse") or "").strip().lower() == "true":
        refused = "is written from child to parent, which is not read here"
    elif kind == "CustomJoint":
        rotations, translations = (_spatial(element, of, names) for of in ("rotation", "translation"))
    elif kind in _PLAIN:
        turns, ways = _PLAIN[kind]
        if len(names) != len(turns) + len(ways):
            refused = f"has {len(names)} coordinates, but its kind needs {len(turns) + len(ways)}"
        rotations, translations = _plain(turns, names), _plain(ways, names[len(turns) :])
    else:
        refused = "is a kind of joint that is not read here"
    turning = {coordinate for part in rotations for coordinate in part.coordinates}
    coordinates = tuple(_coordinate(c, c.get("name", "") in turning) for c in listed)
    moves = coordinates, rotations, translations, refused
    return Joint(name, kind, parent, child, in_parent, in_child, *moves)


def _plain(axes: tuple[np.ndarray, ...], names: list[str]) -> tuple[MotionAxis, ...]:
    return tuple(MotionAxis(axis, (name,), lambda q: q[0]) for axis, name in zip(axes, names, strict=False))


def _spatial(joint: Element, kind: str, names: list[str]) -> tuple[MotionAxis, ...]:
    """Rotations or translations of a CustomJoint."""
    axes = {axis.get("name", ""): axis for axis in joint.iterfind("SpatialTransform/TransformAxis")}
    found = []
    for number in "123":
        axis = axes.get(kind + number)
        if axis is None:
            continue
        used = tuple((axis.findtext("coordinates") or axis.findtext("coordinate") or "").split())
        direction, field = vector(axis, "axis", "1 0 0"), f"joint {joint.get('name')}: {kind}{number}"
        if not np.any(direction):
            raise InputError("has an axis without direction", field=field)
        unknown = [name for name in used if name not in names]
        if unknown:
            raise InputError("is not a coordinate of its joint", field=field, value=unknown[0])
        found.append(MotionAxis(direction / np.linalg.norm(direction), used, inner_function(axis)))
    return tuple(found)


def _coordinate(element: Element, rotational: bool) -> Coordinate:
    default, low, high = float(numbers(element, "default_value", 1, "0")[0]), -np.inf, np.inf
    stated = (element.findtext("range") or "").strip().lower()
    if stated and "inf" not in stated:
        low, high = map(float, numbers(element, "range", 2))
    locked = (element.findtext("locked") or "").strip().lower() == "true"
    return Coordinate(element.get("name", ""), default, (low, high), rotational, locked)


class _NoDoctype(ElementTree.TreeBuilder):
    """A document type can declare entities that grow without bound; no model needs one."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise InputError("declares a DOCTYPE, which no OpenSim model does")
