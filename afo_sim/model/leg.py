"""The leg's own spec, as big as the patient, with the orthosis's rigid parts on it."""

import functools
import pathlib
import re

import mujoco
import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.description.scenario import Scenario
from afo_sim.model.mounting import ANKLE
from afo_sim.model.walk_bodies import scale

REFERS = re.compile(
    rb"<(include|model)\s"
)  # other files in a model file: a change of theirs is not seen in it
STIFF = 0.9999  # the most that MuJoCo's constraint impedance can be


def leg_spec(scenario: Scenario) -> mujoco.MjSpec:
    """The leg's own spec, with its ankle named, and as big as the patient."""
    leg = scenario.leg
    try:
        spec = _read_spec(leg.file)
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {error}", file=leg.file) from None
    spec.compiler.fusestatic = False  # a URDF's fixed root would lose its mass
    for kind, name, existing in (
        ("shank", leg.shank, spec.bodies),
        ("foot", leg.foot, spec.bodies),
        ("ankle", leg.ankle, spec.joints),
    ):
        names = [element.name for element in existing if element.name]
        if name not in names:
            raise unknown(
                name, names, file=leg.file, field=f"leg.{kind}", problem="the leg has no such body or joint"
            )
    ankle = spec.joint(leg.ankle)
    if ankle.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise InputError("the ankle is not a hinge", file=leg.file, field="leg.ankle", value=leg.ankle)
    ankle.name = ANKLE
    half = 0.5 * leg.damping  # MuJoCo takes it at the end of a step; the passive ankle adds the other half
    ankle.damping = half if np.isscalar(ankle.damping) else [half, 0.0, 0.0]
    patient = scenario.patient
    if patient is not None:
        heavier = (patient.body_mass or leg.body_mass) / leg.body_mass
        taller = (patient.body_height or leg.body_height) / leg.body_height
        if (heavier, taller) != (1.0, 1.0):
            scale(spec, heavier, taller)
    ankle.armature += leg.inertia
    if leg.friction:
        _rub(ankle, leg.friction, scenario.timestep)
    return spec


def _rub(ankle: mujoco.MjsJoint, friction: float, timestep: float) -> None:
    """Coulomb friction [N·m] that holds: MuJoCo's own, by default, creeps at degrees a second."""
    ankle.frictionloss += friction
    ankle.solimp_friction = [STIFF, STIFF, 0.001, 0.5, 2.0]
    ankle.solref_friction = [2.0 * timestep, 1.0]  # stopped within a step


def attach_parts(spec: mujoco.MjSpec, scenario: Scenario) -> dict[str, mujoco.MjsBody]:
    """Cuff and plate, if there are any, each a spec of its own with its own prefix, on shank and foot.

    Returns
    -------
    {segment: the body, at the ankle, that carries its ends of the muscles}
    """
    leg, orthosis = scenario.leg, scenario.orthosis
    shank, foot, ankle = spec.body(leg.shank), spec.body(leg.foot), spec.joint(ANKLE)
    joint_in_foot = np.array(ankle.pos)
    joint_in_shank = np.array(foot.pos) + joint_in_foot  # parallel axes at zero ankle angle
    anchors = {}
    for segment, body, position, prefix, file in (
        ("shank", shank, joint_in_shank, "cuff", orthosis.cuff),
        ("foot", foot, joint_in_foot, "plate", orthosis.plate),
    ):
        if file is not None:
            body.add_frame(pos=position).attach_body(_part(file, prefix), f"{prefix}_", "")
        # a body of their own: the segment's stated inertia would swallow their mass
        anchors[segment] = body.add_body(name=f"{segment}_anchors", pos=position)
    return anchors


def _part(file: pathlib.Path, name: str) -> mujoco.MjsBody:
    """The one rigid body of a cuff or plate."""
    try:
        part = _read_spec(file)
    except ValueError as error:
        problem = "there is no such file" if not file.is_file() else f"MuJoCo cannot read it: {error}"
        raise InputError(problem, file=file, field=f"orthosis.{name}") from None
    world = part.worldbody
    if len(world.bodies) != 1 or world.geoms or part.joints:
        raise InputError(
            "is not one rigid part",
            file=file,
            allowed="exactly one body below the world, with all geoms inside it, and no joints",
        )
    body = world.first_body()
    body.name = body.name or name
    return body


def _read_spec(file: pathlib.Path) -> mujoco.MjSpec:
    """A model file as a spec of its caller's own; ValueError where MuJoCo cannot read it."""
    if not file.is_file() or REFERS.search(file.read_bytes()):
        return mujoco.MjSpec.from_file(str(file))
    return _parsed(str(file), file.stat().st_mtime_ns).copy()


@functools.lru_cache(maxsize=16)  # a changed file has another time of change
def _parsed(file: str, when: int) -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(file)
