"""The path of every muscle: between two anchors, or over a pulley."""

import math

import mujoco
import numpy as np

from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.model.mounting import ANKLE, muscle_names


def add_tendons(spec: mujoco.MjSpec, anchors: dict[str, mujoco.MjsBody], orthosis: Orthosis) -> None:
    """A tendon for every single muscle, of its name; `anchors` are the bodies that carry the ends."""
    for name, group in muscle_names(orthosis).items():
        add = _add_tendon if group.pulley is None else _add_pulley
        add(spec, anchors, name, group)


def _add_tendon(
    spec: mujoco.MjSpec,
    anchors: dict[str, mujoco.MjsBody],
    name: str,
    group: MuscleGroup,
) -> None:
    """The path of one muscle between two sites; half its mass stands at each end."""
    assert group.origin is not None and group.insertion is not None
    tendon = spec.add_tendon(name=name, width=group.type.bore / 2.0)
    tendon.rgba = [0.75, 0.25, 0.2, 1.0]
    for end, anchor in (("origin", group.origin), ("insertion", group.insertion)):
        offset = side(name, group) * anchor.spacing
        body = anchors[anchor.segment]
        position = np.array(anchor.from_ankle) + np.array([0.0, offset, 0.0])
        site = body.add_site(name=f"{name}_{end}", pos=position, size=[0.005] * 3)
        body.add_geom(
            name=f"{name}_{end}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=position,
            size=[0.006, 0.0, 0.0],
            mass=group.type.mass / 2.0,
            contype=0,
            conaffinity=0,
            rgba=[0.8, 0.8, 0.82, 1.0],
        )
        tendon.wrap_site(site.name)


def side(name: str, group: MuscleGroup) -> float:
    """Place of a single muscle beside its parallel ones, in spacings from their middle."""
    return int(name.rsplit("_", 1)[1]) - 0.5 * (group.count + 1)


def _add_pulley(
    spec: mujoco.MjSpec,
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
    tendon = spec.add_tendon(name=name, width=muscle.bore / 2.0)
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
