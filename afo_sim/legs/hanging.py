"""Cuff, plate and the ends of the muscles on the bodies of a model, whatever axes these have."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description.attachment import Segment
from afo_sim.description.orthosis import Orthosis
from afo_sim.legs.attached_spec import place_files_whole
from afo_sim.legs.finding import Found
from afo_sim.model.leg import rigid_part

KINDS: tuple[tuple[Segment, str], ...] = (("shank", "cuff"), ("foot", "plate"))


@dataclass(frozen=True, eq=False)
class Place:
    """The ankle on a body, by name: position [m] (3,) and turn of the leg's axes (4,), in the body's axes."""

    body: str
    position: np.ndarray
    quaternion: np.ndarray


def hang(
    spec: mujoco.MjSpec, orthosis: Orthosis, places: Mapping[Segment, Place], prefix: str, mirrored: bool
) -> tuple[dict[str, mujoco.MjsBody], mujoco.MjsDefault]:
    """Hang an orthosis' rigid parts on two bodies, in frames at the ankle: x forward, y left, z up."""
    anchors: dict[str, mujoco.MjsBody] = {}
    for segment, kind in KINDS:
        place = places[segment]
        frame = spec.body(place.body).add_frame(pos=place.position, quat=place.quaternion)
        file = getattr(orthosis, kind)
        if file is not None:
            part = rigid_part(file, kind, mirrored)
            frame.attach_body(part, f"{prefix}{kind}_", "")
            place_files_whole(spec, file.parent)
        # a spec of its own: elements added to it take MuJoCo's defaults, not the model's
        blank = mujoco.MjSpec()
        body = blank.worldbody.add_body(name="anchors")
        anchors[segment] = frame.attach_body(body, f"{prefix}{segment}_", "")
        anchors[segment].childclass = f"{prefix}{segment}_main"
    return anchors, spec.find_default(f"{prefix}shank_main")


def places_of(model: mujoco.MjModel, found: Found, bodies: Mapping[Segment, str]) -> dict[Segment, Place]:
    """The ankle, in the leg's axes, on the bodies that carry the device, by segment.

    The model stands in its own posture, with the ankle at its zero. With R of the body and A of the leg's
    axes in the world, x of the body and c of the ankle's centre, position and turn are Rᵀ (c − x) and Rᵀ A.
    """
    data = native.scratch(model)
    data.qpos[model.joint(found.ankle).qposadr[0]] = found.zero
    mujoco.mj_kinematics(model, data)
    places: dict[Segment, Place] = {}
    for segment, name in bodies.items():
        body = model.body(name).id
        turn = data.xmat[body].reshape(3, 3)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(turn.T @ found.axes).reshape(9))
        places[segment] = Place(name, turn.T @ (found.centre - data.xpos[body]), quaternion)
    return places
