"""The known walker as a scaled OpenSim model, in the text of version 3 or of version 4."""

import pathlib

import numpy as np
from gait_lab.known_walker import HIP, HIP_Z, MTP, SIGN, Walker, ankle_in_tibia, knee_in_femur
from gait_lab.marker_sets import placed

CALCANEUS = np.array([-0.05, -0.04, 0.0])  # origin of calcn from the ankle, in the foot's frame [m]
# Winter 2009, table 4.1: shares of the body's mass; the foot's is split as it comes.
SHARE = {"femur": 0.1, "tibia": 0.0465, "talus": 0.001, "calcn": 0.0115, "toes": 0.002}

Joint = tuple[str, str, str, np.ndarray, np.ndarray, list[tuple[str, str]]]


def write_osim(
    path: pathlib.Path,
    walker: Walker,
    markers: str,
    *,
    version: int = 4,
    scale: float = 1.0,
    knee: float = 1.0,
) -> pathlib.Path:
    """Pelvis, femur, tibia, talus, calcn and toes of both sides, with a set's markers.

    `scale` makes the model of a smaller person; `knee` −1 has flexion negative, as version 3's models.
    """
    path.write_text((_version_4 if version == 4 else _version_3)(walker, markers, scale, knee))
    return path


def _joints(walker: Walker, scale: float, knee: float) -> list[Joint]:
    """name, parent, child, place in parent, orientation (body-fixed x, y, z), (coordinate, axis) pairs."""
    none = np.zeros(3)
    found: list[Joint] = [
        (
            "ground_pelvis",
            "ground",
            "pelvis",
            none,
            none,
            [("pelvis_tilt", "0 0 1"), ("pelvis_list", "1 0 0"), ("pelvis_rotation", "0 1 0")],
        )
    ]
    for side, sign in SIGN.items():
        s = side[0]
        turn = -sign * walker.toe_out
        c, q = np.cos(turn), np.sin(turn)
        calcaneus = np.array([[c, 0.0, q], [0.0, 1.0, 0.0], [-q, 0.0, c]]) @ CALCANEUS
        third = "0 0 1" if knee < 0.0 else "0 0 -1"
        found += [
            (
                f"hip_{s}",
                "pelvis",
                f"femur_{s}",
                np.array([*HIP, sign * HIP_Z]),
                none,
                [
                    (f"hip_flexion_{s}", "0 0 1"),
                    (f"hip_adduction_{s}", f"{sign:g} 0 0"),
                    (f"hip_rotation_{s}", f"0 {sign:g} 0"),
                ],
            ),
            (
                f"knee_{s}",
                f"femur_{s}",
                f"tibia_{s}",
                knee_in_femur(side),
                none,
                [(f"knee_angle_{s}", third)],
            ),
            (
                f"ankle_{s}",
                f"tibia_{s}",
                f"talus_{s}",
                ankle_in_tibia(side),
                none,
                [(f"ankle_angle_{s}", "0 0 1")],
            ),
            (
                f"subtalar_{s}",
                f"talus_{s}",
                f"calcn_{s}",
                calcaneus,
                np.array([0.0, turn, 0.0]),
                [(f"subtalar_angle_{s}", "0 0 1")],
            ),
            (f"mtp_{s}", f"calcn_{s}", f"toes_{s}", MTP - CALCANEUS, none, [(f"mtp_angle_{s}", "0 0 1")]),
        ]
    return [(n, p, c, scale * at, turn, axes) for n, p, c, at, turn, axes in found]


def _masses(walker: Walker) -> dict[str, float]:
    found = {f"{body}_{s}": share * walker.mass for body, share in SHARE.items() for s in "rl"}
    return {"pelvis": walker.mass - sum(found.values())} | found


def _markers(name: str, scale: float) -> dict[str, tuple[str, np.ndarray]]:
    found = {}
    for label, (segment, place) in placed(name, standing=True).items():
        body, at = segment, place
        if segment.startswith("foot"):
            body, at = segment.replace("foot", "calcn"), place - CALCANEUS
        found[label] = body, scale * at
    return found


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _spatial(axes: list[tuple[str, str]], free: bool, wrap: str) -> str:
    rows = []
    directions = ["1 0 0", "0 1 0", "0 0 1"]
    names = [(f"rotation{k}", *axis) for k, axis in enumerate(axes, 1)]
    left = [d for d in directions if all(d != a.replace("-", "") for _, a in axes)]
    names += [(f"rotation{k}", "", left.pop()) for k in range(len(axes) + 1, 4)]
    slides = ["pelvis_tx", "pelvis_ty", "pelvis_tz"] if free else ["", "", ""]
    names += [(f"translation{k}", slides[k - 1], directions[k - 1]) for k in (1, 2, 3)]
    for name, coordinate, axis in names:
        inner = (
            "<LinearFunction{0}><coefficients> 1 0</coefficients></LinearFunction>"
            if coordinate
            else "<Constant{0}><value>0</value></Constant>"
        )
        function = inner.format(' name="function"' if not wrap else "")
        rows.append(
            f'<TransformAxis name="{name}"><coordinates>{coordinate}</coordinates><axis>{axis}</axis>'
            + (f"<{wrap}>{function}</{wrap}>" if wrap else function)
            + "</TransformAxis>"
        )
    return "<SpatialTransform>" + "\n".join(rows) + "</SpatialTransform>"


def _coordinates(axes: list[tuple[str, str]], free: bool) -> str:
    names = [name for name, _ in axes] + (["pelvis_tx", "pelvis_ty", "pelvis_tz"] if free else [])
    return "\n".join(
        f'<Coordinate name="{name}"><default_value>0</default_value><locked>false</locked></Coordinate>'
        for name in names
    )


def _version_4(walker: Walker, markers: str, scale: float, knee: float) -> str:
    bodies = "\n".join(
        f'<Body name="{name}"><mass>{mass:.9g}</mass><mass_center>0 0 0</mass_center>'
        "<inertia>0.01 0.01 0.01 0 0 0</inertia></Body>"
        for name, mass in _masses(walker).items()
    )
    joints = []
    for name, parent, child, at, turn, axes in _joints(walker, scale, knee):
        free, pin = parent == "ground", len(axes) == 1 and axes[0][1] == "0 0 1"
        kind = "PinJoint" if pin else "CustomJoint"
        way = "/ground" if free else f"/bodyset/{parent}"
        joints.append(
            f'<{kind} name="{name}"><socket_parent_frame>{parent}_offset</socket_parent_frame>'
            f"<socket_child_frame>{child}_offset</socket_child_frame>"
            f"<coordinates>{_coordinates(axes, free)}</coordinates><frames>"
            f'<PhysicalOffsetFrame name="{parent}_offset"><socket_parent>{way}</socket_parent>'
            f"<translation>{_text(at)}</translation><orientation>{_text(turn)}</orientation></PhysicalOffsetFrame>"
            f'<PhysicalOffsetFrame name="{child}_offset"><socket_parent>/bodyset/{child}</socket_parent>'
            "<translation>0 0 0</translation><orientation>0 0 0</orientation></PhysicalOffsetFrame></frames>"
            f"{'' if pin else _spatial(axes, free, '')}</{kind}>"
        )
    seen = "\n".join(
        f'<Marker name="{name}"><socket_parent_frame>/bodyset/{body}</socket_parent_frame>'
        f"<location>{_text(at)}</location><fixed>true</fixed></Marker>"
        for name, (body, at) in _markers(markers, scale).items()
    )
    return f"""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40500"><Model name="known_walker"><Ground name="ground"></Ground>
<gravity>0 -9.80665 0</gravity><length_units>meters</length_units><force_units>N</force_units>
<BodySet name="bodyset"><objects>{bodies}</objects><groups /></BodySet>
<JointSet name="jointset"><objects>{"".join(joints)}</objects><groups /></JointSet>
<MarkerSet name="markerset"><objects>{seen}</objects><groups /></MarkerSet>
</Model></OpenSimDocument>
"""


def _version_3(walker: Walker, markers: str, scale: float, knee: float) -> str:
    masses = _masses(walker)
    bodies = ['<Body name="ground"><mass>0</mass><mass_center> 0 0 0</mass_center><Joint /></Body>']
    for name, parent, child, at, turn, axes in _joints(walker, scale, knee):
        free = parent == "ground"
        bodies.append(
            f'<Body name="{child}"><mass>{masses[child]:.9g}</mass><mass_center> 0 0 0</mass_center>'
            f'<Joint><CustomJoint name="{name}"><parent_body>{parent}</parent_body>'
            f"<location_in_parent>{_text(at)}</location_in_parent>"
            f"<orientation_in_parent>{_text(turn)}</orientation_in_parent>"
            "<location>0 0 0</location><orientation>0 0 0</orientation>"
            f"<CoordinateSet><objects>{_coordinates(axes, free)}</objects><groups /></CoordinateSet>"
            f"{_spatial(axes, free, 'function')}</CustomJoint></Joint></Body>"
        )
    seen = "\n".join(
        f'<Marker name="{name}"><body>{body}</body><location> {_text(at)}</location>'
        "<fixed>false</fixed></Marker>"
        for name, (body, at) in _markers(markers, scale).items()
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="30000"><Model name="known_walker"><length_units>meters</length_units>
<force_units>N</force_units><gravity> 0 -9.80665 0</gravity>
<BodySet><objects>{"".join(bodies)}</objects><groups /></BodySet>
<MarkerSet><objects>{seen}</objects><groups /></MarkerSet>
</Model></OpenSimDocument>
"""
