"""The known walker as a scaled OpenSim model, in the text of version 3 or of version 4."""

import math
import pathlib
import re

import numpy as np
from gait_lab.known_walker import HIP, HIP_Z, MTP, SIGN, Walker, about_y, ankle_in_tibia, knee_in_femur
from gait_lab.marker_sets import placed
from osim_text import ZERO, Part, linear, version_3, version_4

CALCANEUS = np.array([-0.05, -0.04, 0.0])  # origin of calcn from the ankle, in the foot's frame [m]
# Winter 2009, table 4.1: shares of the body's mass; the foot's is split as it comes.
SHARE = {"femur": 0.1, "tibia": 0.0465, "talus": 0.001, "calcn": 0.0115, "toes": 0.002}
X, Y, Z = np.eye(3)


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
    mass = walker.mass * (1.0 - 2.0 * sum(SHARE.values()))
    turns = {"pelvis_tilt": Z, "pelvis_list": X, "pelvis_rotation": Y}
    ways = {f"pelvis_t{axis}": direction for axis, direction in zip("xyz", (X, Y, Z), strict=True)}
    parts = [_part("pelvis", "ground", np.zeros(3), mass, turns, ways)]
    for side, sign in SIGN.items():
        s, turn = side[0], -sign * walker.toe_out
        hip = {f"hip_flexion_{s}": Z, f"hip_adduction_{s}": sign * X, f"hip_rotation_{s}": sign * Y}
        for body, parent, at, axes in (
            ("femur", "pelvis", np.array([*HIP, sign * HIP_Z]), hip),
            ("tibia", f"femur_{s}", knee_in_femur(side), {f"knee_angle_{s}": -knee * Z}),
            ("talus", f"tibia_{s}", ankle_in_tibia(side), {f"ankle_angle_{s}": Z}),
            ("calcn", f"talus_{s}", about_y(turn) @ CALCANEUS, {f"subtalar_angle_{s}": Z}),
            ("toes", f"calcn_{s}", MTP - CALCANEUS, {f"mtp_angle_{s}": Z}),
        ):
            turned = (0.0, turn, 0.0) if body == "calcn" else ZERO
            mass = SHARE[body] * walker.mass
            parts.append(_part(f"{body}_{s}", parent, scale * at, mass, axes, turned=turned))
    seen = {}
    for label, (segment, place) in placed(markers, standing=True).items():
        if segment == "trunk":  # this model has none
            continue
        foot = segment.startswith("foot")
        at = place - CALCANEUS if foot else place
        seen[label] = segment.replace("foot", "calcn"), tuple(scale * at)
    text = (version_4 if version == 4 else version_3)(parts, seen)
    path.write_text(re.sub(r"(?=<(?:Body|Marker) )", "\n", text))  # a line each, as damage wants
    return path


def _part(
    name: str,
    parent: str,
    at: np.ndarray,
    mass: float,
    turns: dict[str, np.ndarray],
    ways: dict[str, np.ndarray] | None = None,
    turned: tuple = ZERO,
) -> Part:
    """A body on a joint that turns about axes one after the other; on a pin where that is z alone."""
    named = [(f"rotation{k}", *each) for k, each in enumerate(turns.items(), 1)]
    named += [(f"translation{k}", *each) for k, each in enumerate((ways or {}).items(), 1)]
    pin = len(named) == 1 and np.array_equal(named[0][2], Z)
    return Part(
        name,
        parent,
        "PinJoint" if pin else "CustomJoint",
        at=tuple(at),
        turned=turned,
        coordinates={coordinate: (0.0, -math.inf, math.inf) for _, coordinate, _ in named},
        axes={} if pin else {kind: (coordinate, tuple(axis), linear()) for kind, coordinate, axis in named},
        mass=mass,
    )
