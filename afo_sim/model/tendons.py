"""The path of every muscle: between two anchors, through points and around surfaces, or over a pulley."""

import math

import mujoco
import numpy as np

from afo_sim.description.attachment import PathPoint
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.model.mounting import ANKLE, muscle_names

LATERAL = np.array([0.0, 1.0, 0.0])
GUIDE = [0.35, 0.5, 0.7, 1.0]  # colour of points and surfaces
DRAWN_HALF = 0.02  # half of the drawn length of a cylinder that stands for an endless one [m]


def add_tendons(
    spec: mujoco.MjSpec,
    anchors: dict[str, mujoco.MjsBody],
    orthosis: Orthosis,
    *,
    prefix: str = "",
    default: mujoco.MjsDefault | None = None,
) -> None:
    """A tendon for every single muscle, of its name; `anchors` are the bodies that carry the ends.

    `prefix` begins the names in the spec; `default` is the class of the tendons, by default the spec's own.
    """
    for name, group in muscle_names(orthosis).items():
        tendon = spec.add_tendon(default, name=prefix + name, width=group.type.bore / 2.0)
        add = _add_path if group.pulley is None else _add_pulley
        add(tendon, anchors, prefix + name, group)


def _add_path(
    tendon: mujoco.MjsTendon,
    anchors: dict[str, mujoco.MjsBody],
    name: str,
    group: MuscleGroup,
) -> None:
    """The path of one muscle from origin to insertion; half its mass stands at each end.

    Points and surfaces between them weigh nothing. A surface is a geom that nothing collides with. The
    path bends around it, outside, on the side where it is shorter, wherever the straight line between its
    neighbouring points would pass through it.
    """
    assert group.origin is not None and group.insertion is not None
    tendon.rgba = [0.75, 0.25, 0.2, 1.0]
    for end, anchor in (("origin", group.origin), ("insertion", group.insertion)):
        if end == "insertion":
            for number, place in enumerate(group.path):
                _add_place(anchors[place.segment], tendon, f"{name}_path{number}", name, group, place)
        offset = side(name, group) * anchor.spacing
        body = anchors[anchor.segment]
        position = np.array(anchor.from_ankle) + np.array([0.0, offset, 0.0])
        site = body.add_site(name=f"{name}_{end}", pos=position, size=[0.005] * 3)
        body.add_geom(
            name=f"{name}_{end}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=position,
            size=[0.006, 0.0, 0.0],
            mass=group.type.whole_mass / 2.0,
            contype=0,
            conaffinity=0,
            rgba=[0.8, 0.8, 0.82, 1.0],
        )
        tendon.wrap_site(site.name)


def _add_place(
    body: mujoco.MjsBody,
    tendon: mujoco.MjsTendon,
    label: str,
    name: str,
    group: MuscleGroup,
    place: PathPoint,
) -> None:
    """A point or a surface of one muscle's path, on the body that carries the anchors of its segment."""
    position = np.array(place.from_ankle) + side(name, group) * place.spacing * LATERAL
    surface = place.surface
    if surface is None:
        body.add_site(name=label, pos=position, size=[0.004] * 3, rgba=GUIDE)
        tendon.wrap_site(label)
        return
    turn, size = np.array([1.0, 0.0, 0.0, 0.0]), [surface.radius, 0.0, 0.0]
    kind = mujoco.mjtGeom.mjGEOM_SPHERE
    if surface.shape == "cylinder":
        kind, size[1] = mujoco.mjtGeom.mjGEOM_CYLINDER, max(0.5 * place.spacing, DRAWN_HALF)
        mujoco.mju_quatZ2Vec(turn, np.array(surface.axis) / np.linalg.norm(surface.axis))
    body.add_geom(
        name=label,
        type=kind,
        pos=position,
        quat=turn,
        size=size,
        mass=0.0,
        contype=0,
        conaffinity=0,
        rgba=GUIDE,
    )
    tendon.wrap_geom(label, "")


def side(name: str, group: MuscleGroup) -> float:
    """Place of a single muscle beside its parallel ones, in spacings from their middle."""
    return int(name.rsplit("_", 1)[1]) - 0.5 * (group.count + 1)


def _add_pulley(
    tendon: mujoco.MjsTendon,
    anchors: dict[str, mujoco.MjsBody],
    name: str,
    group: MuscleGroup,
) -> None:
    """One muscle over a pulley: a fixed tendon of length −(moment arm) × angle.

    The arm's stated inertia is taken to hold pulley and muscles, so that they add no mass. For
    pictures only, the pulley is a disc, and the muscle hangs straight between two sites of the shank:
    the point where its cable touches the pulley, and one a quarter turn of cable above the muscle.
    """
    assert group.pulley is not None
    arm, muscle = group.pulley.moment_arm, group.type
    tendon.wrap_joint(ANKLE, -arm)
    offset = side(name, group) * group.pulley.spacing
    length = muscle.end_length - group.series_length
    height = length + 0.5 * math.pi * group.pulley.radius
    for end, z in (("origin", height), ("insertion", 0.0)):
        anchors["shank"].add_site(name=f"{name}_{end}", pos=[arm, offset, z], size=[0.005] * 3)
    half_width = 0.004 + (0.5 * group.pulley.spacing if group.count > 1 else 0.0)
    anchors["foot"].add_geom(
        name=f"{name}_pulley",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        fromto=[0.0, offset - half_width, 0.0, 0.0, offset + half_width, 0.0],
        size=[group.pulley.radius, 0.0, 0.0],
        mass=0.0,
        contype=0,
        conaffinity=0,
        rgba=[0.55, 0.57, 0.6, 1.0],
    )
