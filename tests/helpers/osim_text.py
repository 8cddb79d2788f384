"""Small OpenSim models as text: the same skeleton in the layouts of version 3 and of version 4."""

import pathlib
from dataclasses import dataclass, field

ZERO = (0.0, 0.0, 0.0)


def linear(scale: float = 1.0) -> str:
    return f"<LinearFunction><coefficients>{scale} 0</coefficients></LinearFunction>"


@dataclass(frozen=True)
class Part:
    """A body with the joint that carries it."""

    name: str
    parent: str
    kind: str = "PinJoint"
    at: tuple = ZERO  # the joint's frame on the parent [m]
    turned: tuple = ZERO  # and its turns about x, y, z [rad]
    on_child: tuple = ZERO  # the joint's frame on the body [m]
    child_turned: tuple = ZERO
    coordinates: dict = field(default_factory=dict)  # name: (default, low, high)
    axes: dict = field(default_factory=dict)  # "rotation1": (coordinates, axis, function)
    mass: float = 1.0

    def spatial(self, version: int) -> str:
        lines = []
        for name, (coordinates, axis, function) in self.axes.items():
            inner = f"<function>{function}</function>" if version < 4 else function
            lines.append(
                f'<TransformAxis name="{name}"><coordinates>{coordinates}</coordinates>'
                f"<axis>{words(axis)}</axis>{inner}</TransformAxis>"
            )
        return f"<SpatialTransform>{''.join(lines)}</SpatialTransform>" if lines else ""

    def coordinate_text(self) -> str:
        return "".join(
            f'<Coordinate name="{name}"><default_value>{default}</default_value>'
            f"<range>{low} {high}</range></Coordinate>"
            for name, (default, low, high) in self.coordinates.items()
        )


def words(numbers: tuple) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def version_3(parts: list[Part], markers: dict, extra: str = "") -> str:
    """Joints inside the bodies that they carry."""
    bodies = ['<Body name="ground"><mass>0</mass><Joint /></Body>']
    for p in parts:
        bodies.append(
            f'<Body name="{p.name}"><mass>{p.mass}</mass><Joint><{p.kind} name="{p.name}_joint">'
            f"<parent_body>{p.parent}</parent_body><location_in_parent>{words(p.at)}</location_in_parent>"
            f"<orientation_in_parent>{words(p.turned)}</orientation_in_parent>"
            f"<location>{words(p.on_child)}</location><orientation>{words(p.child_turned)}</orientation>"
            f"<CoordinateSet><objects>{p.coordinate_text()}</objects></CoordinateSet>"
            f"{p.spatial(3)}</{p.kind}></Joint></Body>"
        )
    points = "".join(
        f'<Marker name="{name}"><body>{body}</body><location> {words(place)}</location></Marker>'
        for name, (body, place) in markers.items()
    )
    return document(30000, f"<BodySet><objects>{''.join(bodies)}</objects></BodySet>", points, extra)


def version_4(parts: list[Part], markers: dict, extra: str = "") -> str:
    """Joints in a set of their own, between frames fixed to bodies."""
    bodies = "".join(f'<Body name="{p.name}"><mass>{p.mass}</mass></Body>' for p in parts)
    joints = []
    for p in parts:
        base = "/ground" if p.parent == "ground" else f"/bodyset/{p.parent}"
        frames = "".join(
            f'<PhysicalOffsetFrame name="{name}"><socket_parent>{on}</socket_parent>'
            f"<translation>{words(at)}</translation><orientation>{words(turned)}</orientation>"
            "</PhysicalOffsetFrame>"
            for name, on, at, turned in (
                ("parent_offset", base, p.at, p.turned),
                ("child_offset", f"/bodyset/{p.name}", p.on_child, p.child_turned),
            )
        )
        joints.append(
            f'<{p.kind} name="{p.name}_joint"><socket_parent_frame>parent_offset</socket_parent_frame>'
            "<socket_child_frame>child_offset</socket_child_frame>"
            f"<coordinates>{p.coordinate_text()}</coordinates><frames>{frames}</frames>"
            f"{p.spatial(4)}</{p.kind}>"
        )
    points = "".join(
        f'<Marker name="{name}"><socket_parent_frame>/bodyset/{body}</socket_parent_frame>'
        f"<location>{words(place)}</location></Marker>"
        for name, (body, place) in markers.items()
    )
    sets = f'<BodySet name="bodyset"><objects>{bodies}</objects></BodySet>'
    sets += f'<JointSet name="jointset"><objects>{"".join(joints)}</objects></JointSet>'
    return document(40000, sets, points, extra)


def document(version: int, sets: str, markers: str, extra: str) -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><OpenSimDocument Version="{version}"><Model name="small">'
        f"<length_units>meters</length_units>{sets}"
        f"<MarkerSet><objects>{markers}</objects></MarkerSet>{extra}</Model></OpenSimDocument>"
    )


LAYOUTS = {"version 3": version_3, "version 4": version_4}

ANGLE = (0.0, -2.0, 2.0)
HIP_AT, THIGH, SHANK, ANKLE_ON_FOOT, TOES_AT = (-0.06, -0.08, 0.08), 0.42, 0.41, (0.05, 0.045, 0.0), 0.18


def walker(*, spheres: bool = False) -> tuple[list[Part], dict, str]:
    """Pelvis and two legs, joints of plain pins and a ball: parts, markers, contact geometry."""
    free = dict.fromkeys(("pelvis_tilt", "pelvis_tx", "pelvis_ty", "pelvis_tz"), (0.0, -9.0, 9.0))
    ways = {
        f"translation{k}": (f"pelvis_t{axis}", tuple(float(axis == other) for other in "xyz"), linear())
        for k, axis in enumerate("xyz", start=1)
    }
    tilt = {"rotation1": ("pelvis_tilt", (0.0, 0.0, 1.0), linear())}
    parts = [Part("pelvis", "ground", "CustomJoint", coordinates=free, axes=tilt | ways, mass=10.0)]
    markers: dict = {
        "R.ASIS": ("pelvis", (0.02, 0.03, 0.13)),
        "L.ASIS": ("pelvis", (0.02, 0.03, -0.13)),
        "V.Sacral": ("pelvis", (-0.17, 0.04, 0.0)),
    }
    for side, out in (("r", 1.0), ("l", -1.0)):
        big, s = side.upper(), f"_{side}"
        parts += [
            Part(
                "femur" + s,
                "pelvis",
                "CustomJoint",
                at=(HIP_AT[0], HIP_AT[1], out * HIP_AT[2]),
                coordinates={"hip_flexion" + s: ANGLE},
                axes={"rotation1": ("hip_flexion" + s, (0.0, 0.0, 1.0), linear())},
            ),
            Part("tibia" + s, "femur" + s, at=(0.0, -THIGH, 0.0), coordinates={"knee_angle" + s: ANGLE}),
            Part("talus" + s, "tibia" + s, at=(0.0, -SHANK, 0.0), coordinates={"ankle_angle" + s: ANGLE}),
            Part("calcn" + s, "talus" + s, "WeldJoint", on_child=ANKLE_ON_FOOT),
            Part("toes" + s, "calcn" + s, at=(TOES_AT, 0.0, 0.0), coordinates={"mtp_angle" + s: ANGLE}),
        ]
        markers |= {
            f"{big}.Thigh.Upper": ("femur" + s, (0.04, -0.2, out * 0.09)),
            f"{big}.Thigh.Front": ("femur" + s, (0.1, -0.28, 0.0)),
            f"{big}.Knee.Lat": ("femur" + s, (0.0, -THIGH, out * 0.06)),
            f"{big}.Shank.Upper": ("tibia" + s, (0.03, -0.06, out * 0.07)),
            f"{big}.Shank.Front": ("tibia" + s, (0.05, -0.1, out * 0.02)),
            f"{big}.Ankle.Lat": ("tibia" + s, (0.0, -SHANK, out * 0.055)),
            f"{big}.Heel": ("calcn" + s, (-0.02, 0.02, 0.0)),
            f"{big}.Midfoot.Lat": ("calcn" + s, (0.12, 0.01, out * 0.06)),
            f"{big}.Toe.Tip": ("toes" + s, (0.08, 0.005, 0.0)),
        }
    shapes = "".join(
        f'<ContactSphere name="{b}"><body_name>{b}</body_name><location>{words(place)}</location>'
        f"<radius>0.03</radius></ContactSphere>"
        for b, place in (
            ("calcn_r", (0.0, 0.01, 0.0)),
            ("toes_r", (0.05, 0.013, 0.0)),
            ("calcn_l", (0.0, 0.01, 0.0)),
            ("toes_l", (0.05, 0.013, 0.0)),
        )
    )
    extra = f"<ContactGeometrySet><objects>{shapes}</objects></ContactGeometrySet>" if spheres else ""
    return parts, markers, extra


def write(path: pathlib.Path, text: str) -> pathlib.Path:
    path.write_text(text, encoding="utf-8")
    return path
