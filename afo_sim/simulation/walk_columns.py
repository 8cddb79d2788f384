"""What a recording of walking holds beside the ankle: phase, pose, sole, and all moments about the ankle."""

from typing import TYPE_CHECKING

import numpy as np

from afo_sim.common.units import GRAVITY
from afo_sim.model.contact import LOADED
from afo_sim.model.foot import POINTS, turned_all
from afo_sim.model.walk import JOINTS
from afo_sim.model.walk_bodies import ACTIVE, GROUND, PADS, SINK, SPASTIC, STIFFNESS

if TYPE_CHECKING:
    from afo_sim.model.build import Built

# (unit, sign) of the columns.
WALKING = {
    "gait/phase": ("", "0 = heel strike, up to 1"),
    "gait/stride": ("", "number of the stride, from 0"),
    "gait/ankle_angle": ("rad", "as recorded, dorsiflexion positive"),
    "gait/ankle_moment": ("N*m", "internal, dorsiflexion positive; what the recorded walking takes in all"),
    "gait/needed_moment": (
        "N*m",
        "internal, dorsiflexion positive; active moment of the recorded walking less what the patient gives",
    ),
    "gait/ball_height": ("m", "of this foot's sole above the floor, were the ankle as recorded"),
    "gait/toe_height": ("m", "of this foot's sole above the floor, were the ankle as recorded"),
    "gait/ground_force_z": (
        "N",
        "upward positive, as recorded; in contact ground/force/z is this foot's own",
    ),
    "ankle/moment/biological": ("N*m", "internal, dorsiflexion positive; the patient's own muscles"),
    "ankle/moment/ground": ("N*m", "dorsiflexion positive; ground force about the ankle"),
    "ankle/moment/frame": ("N*m", "dorsiflexion positive; inertia of the foot on the driven shank"),
    "shank/sink": ("m", "of the leg from where it was recorded, upward positive"),
    "shank/angle": ("rad", "from the vertical, knee ahead of ankle positive"),
    "ankle/position/x": ("m", "forward"),
    "ankle/position/z": ("m", "up, the floor at 0"),
    "ground/force/x": ("N", "on the foot, forward positive"),
    "ground/force/z": ("N", "on the foot, upward positive"),
    "ground/position/x": ("m", "centre of pressure, forward"),
    **{f"{point}/height": ("m", "of the sole above the floor") for point in POINTS},
}


def walking_columns(
    built: "Built", rows: dict[str, np.ndarray], control: np.ndarray, first_step: int
) -> dict[str, np.ndarray]:
    """Columns of a stretch of walking; they replace the ankle's moments of a fixed shank.

    Parameters
    ----------
    built : compiled, with walking
    rows : aligned rows of the stretch
    control : inputs of the stretch (n, nu)
    first_step : number of its first step
    """
    walk, foot, active, index = built.walk, built.foot, built.active, built.index
    assert walk is not None and foot is not None and active is not None
    n = len(rows["time"])
    here = slice(first_step + 1, first_step + 1 + n)
    steps = slice(first_step, first_step + n)
    model, dof = built.model, index.ankle_dof
    x, z, shank = (rows["qpos"][:, model.joint(name).qposadr[0]] for name in JOINTS)
    angle = rows["qpos"][:, index.ankle_qpos]
    pitch = angle - shank
    places = [foot.points[name] for name in POINTS]
    sole, recorded = (
        dict(zip(POINTS, turned_all(places, way), strict=True)) for way in (pitch, walk.ankle[here] - shank)
    )
    force = {name: rows["actuator_force"][:, i] for name, i in index.walking.items()}
    biological = force[ACTIVE] + force[STIFFNESS] + force[SPASTIC]
    own = rows["actuator_force"][:, index.passive]
    forward, upward, place = walk.cycle.ground(walk.phase[here])
    weight = built.body_mass * GRAVITY
    pressing, moment = weight * upward, force[GROUND]
    contact: dict[str, np.ndarray] = {}
    if built.contact is not None:
        sink = model.joint(SINK)
        contact = {"gait/ground_force_z": pressing, "shank/sink": rows["qpos"][:, sink.qposadr[0]]}
        z = z + contact["shank/sink"]
        pads = np.stack([force[name] for name in PADS], axis=1)
        ahead = np.stack([sole[name][0] for name in POINTS], axis=1)
        moment = moment + np.sum(pads * ahead, axis=1)
        pressing = pads.sum(axis=1)
        centre = np.sum(pads * ahead, axis=1) / np.maximum(pressing, LOADED)
        place = np.where(pressing > LOADED, centre + built.contact.shift[steps], place)
    return {
        "gait/phase": walk.phase[here] % 1.0,
        "gait/stride": np.floor(walk.phase[here]),
        "gait/ankle_angle": walk.ankle[here],
        "gait/ankle_moment": active.recorded[steps],
        "gait/needed_moment": active.needed[steps],
        **{f"gait/{name}_height": z + recorded[name][1] for name in ("ball", "toe")},
        "ankle/moment/orthosis": rows["qfrc_actuator"][:, dof] - own - biological - moment,
        "ankle/moment/biological": biological,
        "ankle/moment/ground": moment,
        "shank/angle": shank,
        "ankle/position/x": x,
        "ankle/position/z": z,
        "ground/force/x": weight * forward,
        "ground/force/z": pressing,
        "ground/position/x": x + place,
        **{f"{name}/height": z + sole[name][1] for name in POINTS},
        **contact,
        **(_inertial(built, rows, pitch) if "qacc" in rows else {}),
    }


def _inertial(built: "Built", rows: dict[str, np.ndarray], pitch: np.ndarray) -> dict[str, np.ndarray]:
    """What weight and the driven shank do to the foot."""
    model, foot = built.model, built.foot
    assert foot is not None
    driven = np.stack([rows["qacc"][:, model.joint(name).dofadr[0]] for name in JOINTS], axis=1)
    if built.contact is not None:
        driven[:, 1] += rows["qacc"][:, model.joint(SINK).dofadr[0]]
    return {
        "ankle/moment/gravity": foot.gravity_moment(pitch),
        "ankle/moment/frame": foot.frame_moment(pitch, driven[:, :2], driven[:, 2]),
    }
