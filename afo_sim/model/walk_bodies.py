"""Additions to the model for walking: a driven shank, the ground's moment, the patient's own ankle."""

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description import Scenario
from afo_sim.model.contact import ground_of, pad_stiffness
from afo_sim.model.foot import REST, Foot
from afo_sim.model.mounting import ANKLE, GAIN_STATE, add_motor
from afo_sim.model.outsole import POINTS, SOLE, padded
from afo_sim.model.person import Size, in_contact, reflex_gain
from afo_sim.model.walk import ARMATURE, JOINTS

DRIVES = tuple(f"drive_{joint}" for joint in JOINTS)
GROUND, ACTIVE, STIFFNESS, SPASTIC = "ground", "active_moment", "active_stiffness", "spasticity"
SINK, SUPPORT = "sink", "support"  # the joint of the leg's compliance, and its actuator
PADS = tuple(f"pad_{point}" for point in POINTS)


def add_walking(spec: mujoco.MjSpec, scenario: Scenario, size: Size) -> None:
    """Put the shank on three driven joints at the ankle, and the walking's moments about the ankle."""
    # MuJoCo measures its solver's progress by the mean inertia: the carriage's would let it stop before the
    # ankle's stop or friction holds
    spec.option.tolerance = 0.0
    leg = scenario.leg
    shank, foot = spec.body(leg.shank), spec.body(leg.foot)
    at = np.array(foot.pos) + np.array(spec.joint(ANKLE).pos)
    shank.pos = -at
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in zip(JOINTS, (slide, slide, hinge), np.eye(3)[[0, 2, 1]], strict=True):
        if name == JOINTS[-1] and in_contact(scenario):
            # The leg's compliance against the ground, upward positive; before the shank turns, along the
            # world's z
            ground, rest = ground_of(scenario, Size(taller=size.taller)), [0.0, 0.0]
            shank.add_joint(
                name=SINK,
                type=slide,
                axis=[0.0, 0.0, 1.0],
                pos=at,
                stiffness=[ground.body_stiffness * size.heavier, *rest],  # a polynomial
                damping=[0.5 * ground.body_damping * size.heavier, *rest],  # the other half is the support's
            )
        shank.add_joint(name=name, type=kind, axis=axis, pos=at, armature=ARMATURE)
    for drive, driven in zip(DRIVES, JOINTS, strict=True):
        add_motor(spec, drive, driven, (ARMATURE,))
    add_motor(spec, GROUND, ANKLE, (1.0,))
    add_motor(spec, ACTIVE, ANKLE, (1.0,))
    add_motor(spec, STIFFNESS, ANKLE, (0.0, -1.0))  # −ctrl × angle
    add_motor(spec, SPASTIC, ANKLE, (0.0, 0.0, -1.0), callback=True)
    if leg.toes is not None:  # it moves their rest angle
        add_motor(spec, REST, leg.toes.joint, (1.0,))
    if in_contact(scenario):
        _add_contact(spec, padded(leg.toes))


def _add_contact(spec: mujoco.MjSpec, points: tuple[str, ...]) -> None:
    """A pad under each point of the sole, whose input is the floor's height there; the body's support."""
    spec.worldbody.add_site(name=GROUND)
    there = {site.name for site in spec.sites}
    for point in points:
        if f"{SOLE}{point}" not in there:
            continue  # the foot is refused as soon as it is looked at
        spec.add_actuator(
            name=f"pad_{point}",
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            target=f"{SOLE}{point}",
            refsite=GROUND,
            gear=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            gaintype=mujoco.mjtGain.mjGAIN_AFFINE,
            gainprm=[0.0, 0.0, -1.0] + [0.0] * 7,
            biastype=mujoco.mjtBias.mjBIAS_USER,
            userdata=[0.0] * native.N_USER,
            **GAIN_STATE,
        )
    add_motor(spec, SUPPORT, SINK, (1.0,), callback=True)


def walking_actuators(model: mujoco.MjModel) -> dict[str, int]:
    """Ids of the actuators that walking adds, by name; none where the shank is fixed."""
    ids = {
        name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        for name in (*DRIVES, GROUND, ACTIVE, STIFFNESS, SPASTIC, REST, *PADS, SUPPORT)
    }
    return {name: i for name, i in ids.items() if i >= 0}


def fill_walking(model: mujoco.MjModel, actuators: dict[str, int], scenario: Scenario, foot: Foot) -> None:
    """Their rows."""
    model.actuator_user[list(actuators.values())] = native.row(native.Kind.MOTOR, gain=0.0)
    model.actuator_user[actuators[SPASTIC]] = native.row(native.Kind.SPASTIC, gain=reflex_gain(scenario))
    if in_contact(scenario):
        ground = ground_of(scenario, Size.of(scenario))
        brakes = float(model.dof_damping[int(model.joint(SINK).dofadr[0])])
        model.actuator_user[actuators[SUPPORT]] = native.row(native.Kind.MOTOR, gain=brakes)
        for point, stiff in pad_stiffness(ground, foot).items():
            model.actuator_user[actuators[f"pad_{point}"]] = native.row(
                native.Kind.PAD, stiffness=stiff, damping=ground.damping
            )
