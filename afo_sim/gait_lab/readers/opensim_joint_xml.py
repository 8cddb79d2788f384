"""Joints and frames in an OpenSim model's XML: inside <Body> up to version 3, in <JointSet> since 4."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_function import inner_function
from afo_sim.gait_lab.readers.opensim_joint import Coordinate, Joint, MotionAxis, Pose, offset_pose

X, Y, Z = np.eye(3)
# {kind: (axes of its rotations, axes of its translations)}, coordinates in this order; OpenSim's API
# documentation of each joint: frames turn about their own axes, x first
PLAIN: dict[str, tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]] = {
    "WeldJoint": ((), ()),
    "PinJoint": ((Z,), ()),
    "SliderJoint": ((), (X,)),
    "UniversalJoint": ((X, Y), ()),
    "BallJoint": ((X, Y, Z), ()),
    "GimbalJoint": ((X, Y, Z), ()),
    "PlanarJoint": ((Z,), (X, Y)),
    "FreeJoint": ((X, Y, Z), (X, Y, Z)),
}
FIXED = Pose(np.eye(3)[None], np.zeros((1, 3)))


class Frames:
    """The offset frames of a model, and what they are fixed to."""

    def __init__(self, model: Element, bodies: set[str]):
        self._bodies = bodies | {"ground"}
        self._offsets: dict[str, Element] = {}
        for frame in model.iter("PhysicalOffsetFrame"):
            self._offsets.setdefault(frame.get("name", ""), frame)

    def base(
        self, element: Element, socket: str, old: str, own: dict[str, Element] | None = None
    ) -> tuple[str, Pose]:
        """The body that an element hangs on, and where the frame that it names stands on the body."""
        name = (_socket(element, socket) or element.findtext(old) or "").strip().split("/")[-1]
        found = FIXED
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
    text = element.findtext(name, left_out)
    try:
        found = np.array([float(word) for word in text.replace(",", " ").split()])
    except ValueError:
        found = np.array([])
    if found.shape != (3,) or not np.isfinite(found).all():
        field = f"{element.tag} {element.get('name', '')}: {name}"
        raise InputError("is not three numbers", field=field, value=text.strip())
    return found


def body_joints(body: Element) -> Iterator[Joint]:
    """The joint that a body of version 1 to 3 brings along."""
    for element in body.iterfind("Joint/*"):
        in_parent = offset_pose(
            vector(element, "location_in_parent"), vector(element, "orientation_in_parent")
        )
        in_child = offset_pose(vector(element, "location"), vector(element, "orientation"))
        parent = (element.findtext("parent_body") or "").strip()
        yield _joint(element, parent, body.get("name", ""), in_parent, in_child)


def set_joints(model: Element, frames: Frames) -> Iterator[Joint]:
    """The joints of version 4."""
    for element in model.iterfind("JointSet/objects/*"):
        own = {frame.get("name", ""): frame for frame in element.iterfind("frames/PhysicalOffsetFrame")}
        parent, in_parent = frames.base(element, "parent_frame", "parent_body", own)
        child, in_child = frames.base(element, "child_frame", "child_body", own)
        yield _joint(element, parent, child, in_parent, in_child)


def _socket(element: Element, name: str) -> str | None:
    """What a socket connects to; the documents on the way to version 4 called it a connectee."""
    found = element.findtext(f"socket_{name}") or element.findtext(f"socket_{name}_connectee_name")
    return found or element.findtext(f"connectors/*[@name='{name}']/connectee_name")


def _joint(element: Element, parent: str, child: str, in_parent: Pose, in_child: Pose) -> Joint:
    kind, name, refused = element.tag, element.get("name", ""), ""
    listed = [
        *element.iterfind("coordinates/Coordinate"),
        *element.iterfind("CoordinateSet/objects/Coordinate"),
    ]
    names = [c.get("name", "") for c in listed]
    rotations: tuple[MotionAxis, ...] = ()
    translations: tuple[MotionAxis, ...] = ()
    if (element.findtext("reverse") or "").strip().lower() == "true":
        refused = "is written from child to parent, which is not read here"
    elif kind == "CustomJoint":
        rotations, translations = _spatial(element, names)
    elif kind in PLAIN:
        turns, ways = PLAIN[kind]
        if len(names) != len(turns) + len(ways):
            refused = f"has {len(names)} coordinates, but its kind needs {len(turns) + len(ways)}"
        rotations, translations = _plain(turns, names), _plain(ways, names[len(turns) :])
    else:
        refused = "is a kind of joint that is not read here"
    turning = {coordinate for part in rotations for coordinate in part.coordinates}
    coordinates = tuple(_coordinate(c, c.get("name", "") in turning) for c in listed)
    return Joint(
        name, kind, parent, child, in_parent, in_child, coordinates, rotations, translations, refused
    )


def _plain(axes: tuple[np.ndarray, ...], names: list[str]) -> tuple[MotionAxis, ...]:
    return tuple(MotionAxis(axis, (name,), lambda q: q[0]) for axis, name in zip(axes, names, strict=False))


def _spatial(joint: Element, names: list[str]) -> tuple[tuple[MotionAxis, ...], tuple[MotionAxis, ...]]:
    """Rotations and translations of a CustomJoint."""
    axes = {axis.get("name", ""): axis for axis in joint.iterfind("SpatialTransform/TransformAxis")}
    found = []
    for kind in ("rotation", "translation"):
        parts = []
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
                raise InputError("is no coordinate of its joint", field=field, value=unknown[0])
            parts.append(MotionAxis(direction / np.linalg.norm(direction), used, inner_function(axis)))
        found.append(tuple(parts))
    return found[0], found[1]


def _coordinate(element: Element, rotational: bool) -> Coordinate:
    texts = [element.findtext("default_value") or "0", *(element.findtext("range") or "-inf inf").split()]
    try:
        default, low, high = (float(text) for text in texts)
    except ValueError:
        raise InputError(
            "its default value or its range cannot be read", field=f"coordinate {element.get('name')}"
        ) from None
    locked = (element.findtext("locked") or "").strip().lower() == "true"
    return Coordinate(element.get("name", ""), default, (low, high), rotational, locked)
