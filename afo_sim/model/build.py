"""spec → MjSpec → MjModel, and the addresses by name that everything downstream uses."""

import dataclasses
import functools
import math
import pathlib
import re
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import GRAVITY
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.description.scenario import Scenario
from afo_sim.model import mounting
from afo_sim.model.contact import Contact, check_sole, register
from afo_sim.model.foot import Foot, foot_of
from afo_sim.model.mounting import ANKLE, Index, chamber_of, friction_states, muscle_names, valve_names
from afo_sim.model.patient import Active, active
from afo_sim.model.walk import Walk, lay_out
from afo_sim.model.walk_bodies import add_walking, fill_walking, scale, walking_actuators

PASSIVE = "passive_ankle"
REFERS = re.compile(
    rb"<(include|model)\s"
)  # other files in a model file: a change of theirs is not seen in it
STIFF = 0.9999  # the most that MuJoCo's constraint impedance can be


@dataclass(frozen=True)
class Built:
    """A compiled scenario: the model that runs, the spec it is from, and what was found while building.

    `walk`, `foot` (with the orthosis) and `active` are there when recorded walking drives the shank,
    `contact` when the foot meets a floor.
    """

    scenario: Scenario
    model: mujoco.MjModel
    spec: mujoco.MjSpec
    index: Index
    stability: dict[str, float]
    warnings: tuple[str, ...]
    walk: Walk | None = None
    foot: Foot | None = None
    active: Active | None = None
    contact: Contact | None = None

    @property
    def xml(self) -> str:
        """The model as self-contained MJCF."""
        return self.spec.to_xml()

    @property
    def body_mass(self) -> float:
        """Of the patient, or of the leg's adult [kg]."""
        patient = self.scenario.patient
        told = None if patient is None else patient.body_mass
        return self.scenario.leg.body_mass if told is None else told


def build(scenario: Scenario) -> Built:
    """Put the orthosis on the leg, compile, and check what only the compiled model can tell.

    Parameters
    ----------
    scenario : frozen description

    Returns
    -------
    Built

    Raises
    ------
    InputError
        The leg lacks a body or joint, or is put together otherwise than assumed; a muscle's braid
        locks within the range of motion; air or braid would be unstable at this time step (with
        the step that would do).
    """
    spec = _assemble(scenario)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile it: {error}", file=scenario.leg.file) from None
    index = _index(model, scenario.orthosis)
    _fill_parameters(model, index, scenario)
    mounting.check_leg(model, scenario)
    stretch = mounting.check_stretch(model, index, scenario)
    stability, coarse = mounting.check_stability(model, index, scenario)
    warnings = (*mounting.check_description(scenario), *stretch, *coarse)
    built = Built(scenario, model, spec, index, stability, warnings)
    return _with_walking(built) if scenario.walking else built


def _with_walking(built: Built) -> Built:
    """Lay the recorded walking out, and find what the patient's own ankle does in it."""
    scenario = built.scenario
    foot = foot_of(built.model, scenario.leg.foot, ANKLE)
    walk = lay_out(scenario, foot.ankle_height)
    bare = foot_of(_leg_spec(scenario).compile(), scenario.leg.foot, ANKLE)
    own = active(walk, bare, scenario, built.body_mass)
    contact = None
    if scenario.contact:
        check_sole(foot, scenario)
        contact = register(walk, foot, built.model, scenario, built.body_mass)
        built = dataclasses.replace(built, warnings=(*built.warnings, *contact.warnings()))
    return dataclasses.replace(built, walk=walk, foot=foot, active=own, contact=contact)


def _assemble(scenario: Scenario) -> mujoco.MjSpec:
    spec = _leg_spec(scenario)
    orthosis = scenario.orthosis
    anchors = _attach(spec, scenario)
    for name, group in muscle_names(orthosis).items():
        add = _add_tendon if group.pulley is None else _add_pulley
        add(spec, anchors, name, group)
    _add_actuators(spec, orthosis)
    if scenario.walking:
        add_walking(spec, scenario)
    option = spec.option
    option.timestep = scenario.timestep
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # an unstable simulation must stop, not start again from zero
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def _read_spec(file: pathlib.Path) -> mujoco.MjSpec:
    """A model file as a spec of its caller's own; ValueError where MuJoCo cannot read it."""
    if not file.is_file() or REFERS.search(file.read_bytes()):
        return mujoco.MjSpec.from_file(str(file))
    return _parsed(str(file), file.stat().st_mtime_ns).copy()


@functools.lru_cache(maxsize=16)  # a changed file has another time of change
def _parsed(file: str, when: int) -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(file)


def _leg_spec(scenario: Scenario) -> mujoco.MjSpec:
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
            raise InputError(
                "the leg has no such body or joint",
                file=leg.file,
                field=f"leg.{kind}",
                value=name,
                allowed=", ".join(names),
                nearest=nearest_name(name, names),
            )
    ankle = spec.joint(leg.ankle)
    if ankle.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise InputError("the ankle is not a hinge", file=leg.file, field="leg.ankle", value=leg.ankle)
    ankle.name = ANKLE
    ankle.damping = leg.damping if np.isscalar(ankle.damping) else [leg.damping, 0.0, 0.0]
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


def _attach(spec: mujoco.MjSpec, scenario: Scenario) -> dict[str, mujoco.MjsBody]:
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
        offset = _side(name, group) * anchor.spacing
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


def _side(name: str, group: MuscleGroup) -> float:
    """Where a single muscle stands beside its parallel ones, in spacings from their middle."""
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
    offset = _side(name, group) * group.pulley.spacing
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


def _add_actuators(spec: mujoco.MjSpec, orthosis: Orthosis) -> None:
    user_dynamics = {
        "dyntype": mujoco.mjtDyn.mjDYN_USER,
        "gaintype": mujoco.mjtGain.mjGAIN_FIXED,
        "gainprm": [0.0] * 10,
        "biastype": mujoco.mjtBias.mjBIAS_NONE,
        "trntype": mujoco.mjtTrn.mjTRN_JOINT,
        "target": ANKLE,
    }
    blank = [0.0] * native.N_USER
    spec.nuser_actuator = native.N_USER
    spec.nuserdata = native.FLOWS_PER_CHAMBER * len(orthosis.chamber)
    affine, fixed = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtGain.mjGAIN_FIXED
    for name in muscle_names(orthosis):
        first = name.endswith("_1")  # of its group; it carries the damping's derivative for all
        spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target=name,
            gaintype=affine if first else fixed,
            gainprm=[0.0, 0.0, -1.0 if first else 0.0] + [0.0] * 7,
            biastype=mujoco.mjtBias.mjBIAS_USER,
            userdata=blank,
        )
    spec.add_actuator(
        name=PASSIVE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=ANKLE,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_USER,
        userdata=blank,
    )
    for name in orthosis.chamber:
        spec.add_actuator(name=f"chamber_{name}", actdim=3, userdata=blank, **user_dynamics)
    for name in valve_names(orthosis):
        spec.add_actuator(name=f"valve_{name}", actdim=2, userdata=blank, **user_dynamics)
    for name, states in friction_states(orthosis).items():
        spec.add_actuator(name=f"friction_{name}", actdim=states, userdata=blank, **user_dynamics)


def _index(model: mujoco.MjModel, orthosis: Orthosis) -> Index:
    joint = model.joint(ANKLE)
    return Index(
        muscles={name: model.actuator(name).id for name in muscle_names(orthosis)},
        chambers={name: model.actuator(f"chamber_{name}").id for name in orthosis.chamber},
        valves={name: model.actuator(f"valve_{name}").id for name in valve_names(orthosis)},
        frictions={name: model.actuator(f"friction_{name}").id for name in friction_states(orthosis)},
        passive=model.actuator(PASSIVE).id,
        walking=walking_actuators(model),
        ankle_qpos=int(joint.qposadr[0]),
        ankle_dof=int(joint.dofadr[0]),
    )


def _fill_parameters(model: mujoco.MjModel, index: Index, scenario: Scenario) -> None:
    """Exact parameters into the compiled model: MJCF text would cut them to six digits."""
    orthosis, user = scenario.orthosis, model.actuator_user
    groups = muscle_names(orthosis)
    for number, (chamber, actuator) in enumerate(index.chambers.items()):
        description = orthosis.chamber[chamber]
        members = [i for n, i in index.muscles.items() if chamber_of(n, groups[n]) == chamber]
        user[actuator] = native.chamber_row(
            first_muscle=members[0],
            inlet=index.valves[f"{chamber}_inlet"],
            outlet=index.valves[f"{chamber}_outlet"],
            tube_volume=description.tube_volume,
            wall_conductance=description.wall_conductance,
            userdata=native.FLOWS_PER_CHAMBER * number,
        )
        for side in ("inlet", "outlet"):
            valve = getattr(description, side)
            user[index.valves[f"{chamber}_{side}"]] = native.valve_row(
                conductance=valve.conductance,
                critical_ratio=valve.critical_ratio,
                opening_delay=valve.opening_delay,
                closing_delay=valve.closing_delay,
            )
        following = dict(zip(members, [*members[1:], -1], strict=True))
        for name, i in index.muscles.items():
            if i in following:
                group = groups[name]
                muscle = group.type
                holder = index.frictions.get(name, -1)
                if holder >= 0:
                    user[holder] = native.friction_row(muscle=i)
                user[i] = native.muscle_row(
                    **muscle.row,
                    series_length=group.series_length,
                    chamber=actuator,
                    next_muscle=following[i],
                    implicit_count=group.count if name.endswith("_1") else 0,
                    friction_states=holder,
                )
    fill_walking(model, index.walking, scenario)
    passive = scenario.leg.passive
    user[index.passive] = native.passive_row(
        scale=passive.scale, offset=passive.offset, load=scenario.load_moment
    )
