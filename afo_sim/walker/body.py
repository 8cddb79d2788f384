"""A walker's body: trunk, thighs, and on each the described leg; the left one's names begin with "left_"."""

import dataclasses
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import GRAVITY, InputError, Keywords
from afo_sim.description import Ground, Scenario
from afo_sim.model import (
    ANKLE,
    GAIN_STATE,
    POINTS,
    SOLE,
    UNDRIVEN,
    USUAL_GROUND,
    Size,
    add_motor,
    add_tendons,
    attach_parts,
    circuit_of,
    ground_of,
    healthy_tissue,
    leg_spec,
    own_supply,
    own_tissue,
    person_of,
    reflex_gain,
)
from afo_sim.physics import GAINS, LEG_MUSCLES, LONG, NERVES
from afo_sim.walker.leg_muscles import MUSCLES, PATHS, THIGH, TRUNK, Muscle, Segment

SIDES = ("", "left_")
OWN = "own_"
HIP, KNEE, TOE = "hip", "knee", "toe"
FORWARD, UP, PITCH = "forward", "up", "pitch"
ROOT = (FORWARD, UP, PITCH)
JOINTS = (HIP, KNEE, ANKLE, TOE)
RATES = 2 * (len(ROOT) + len(SIDES) * len(JOINTS))  # places of `userdata`, the first: two steps' of each
REFLEX, TISSUE, SPASM = "reflex", "tissue", "spasm"
FLOOR = "floor"
BARE = {**UNDRIVEN, "orthosis": "none"}  # what is set of a scenario in which no device is worn
# Stops as springs that lose energy: {name: joint, sign of its coordinate, where it begins [rad]}.
# The knee's is H0914v3's, the ankle's are the adult leg's.
STOPS = {
    "knee_stop": (KNEE, -1.0, math.radians(5.0)),
    "ankle_up": (ANKLE, -1.0, math.radians(-30.0)),
    "ankle_down": (ANKLE, 1.0, math.radians(-50.0)),
}
STOP_STIFFNESS, STOP_DAMPING = 500.0, 1.0  # [N·m/rad], [s/rad]: of SCONE's other joints
GRIP_STIFFNESS, GRIP_DAMPING, FRICTION = 4e4, 150.0, 0.8  # [N/m], [N·s/m], [-]
SHANK_SHARE = 0.246  # of the body's height (Winter)


@dataclass(frozen=True, eq=False)
class Body:
    """A walker, compiled, with its parameters."""

    model: mujoco.MjModel
    scenario: Scenario  # whose patient, leg, shoe and orthosis it has
    size: Size  # against the adult of 75 kg and 1.75 m
    ids: native.CircuitIds | None  # of the orthosis' air, the left leg's "left_…"; None without chambers
    weight: float  # of everything [N]
    muscles: np.ndarray  # actuator ids by side and muscle (2, 7)
    reflexes: np.ndarray  # actuator ids by side (2,)
    pads: np.ndarray  # actuator ids by side (2, 4)
    plan: np.ndarray | None = None  # of the planar steps; None where only MuJoCo's can be taken


def floor_of(scenario: Scenario) -> Ground:
    """The floor that is walked on."""
    return scenario.ground or USUAL_GROUND


def build_body(scenario: Scenario, strength: dict[str, float] | None = None, spring: float = 0.0) -> Body:
    """Compile the body of a scenario's patient, with the scenario's orthosis on one leg or both."""
    person = person_of(scenario)
    size = Size(person.body_mass / 75.0, person.body_height / 1.75)
    spec = _whole(scenario, size)
    worn, supply = scenario.orthosis, own_supply(scenario)
    legs = wearing(scenario) if worn.muscle else ()
    circuits = {side: circuit_of(worn, f"{side}{ANKLE}", supply=supply) for side in legs}
    places = [_add_own(spec, uneven=floor_of(scenario).uneven > 0.0)]
    for side, circuit in circuits.items():
        native.add_circuit(spec, circuit, prefix=side, userdata=places[-1])
        places.append(spec.nuserdata)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the walker: {error}", file=scenario.leg.file) from None
    model.jnt_stiffness[model.joint(ANKLE).id] += spring
    named = _named(model)
    muscles = np.array([[named(f"{side}{muscle}") for muscle in LEG_MUSCLES] for side in SIDES])
    reflexes = np.array([named(f"{side}{REFLEX}") for side in SIDES])
    pads = np.array([[named(f"{side}pad_{point}") for point in POINTS] for side in SIDES])
    weight = float(model.body_mass.sum()) * GRAVITY
    body = Body(model, scenario, size, None, weight, muscles, reflexes, pads)
    for k in range(len(SIDES)):
        _fill_leg(body, k, strength or {})
        _fill_floor(body, k)
        _fill_tissue(body, k)
    known: dict[str, Keywords] = {}
    for place, (side, circuit) in zip(places, circuits.items(), strict=False):
        own = native.circuit_ids(model, circuit, side)
        native.fill_circuit(model, circuit, own, userdata=place)
        for kind, found in vars(own).items():
            known.setdefault(kind, {}).update({f"{side}{name}": number for name, number in found.items()})
    ids = native.CircuitIds(**known) if circuits else None
    if ids is not None:
        native.fill_inverse_masses(model)
    feet = tuple(model.body(f"{side}{scenario.leg.foot}").id for side in SIDES)
    return dataclasses.replace(body, ids=ids, plan=native.plan_of(model, pads, model.body("trunk").id, feet))


def wearing(scenario: Scenario) -> tuple[str, ...]:
    """The sides of the legs that wear the orthosis, if there is one."""
    return SIDES if scenario.worn_on == "both" else SIDES[:1]


def _whole(scenario: Scenario, size: Size) -> mujoco.MjSpec:
    """Trunk, thighs and legs, the orthosis' parts and tendons on the first leg."""
    spec, taller = mujoco.MjSpec(), size.taller
    spec.compiler.degree = False
    spec.worldbody.add_site(name=FLOOR)
    trunk = spec.worldbody.add_body(name="trunk")
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in zip(ROOT, (slide, slide, hinge), ([1, 0, 0], [0, 0, 1], [0, -1, 0]), strict=True):
        trunk.add_joint(name=name, type=kind, axis=axis)
    _weigh(trunk, TRUNK, size)
    other = scenario if scenario.worn_on == "both" else scenario.set(BARE)
    for side, described in zip(SIDES, (scenario, other), strict=True):
        lateral = -0.0835 if side == "" else 0.0835
        thigh = trunk.add_body(name=f"{side}thigh", pos=taller * np.array([0.0, lateral, -0.0661]))
        thigh.add_joint(name=f"{side}{HIP}", type=hinge, axis=[0, -1, 0])
        _weigh(thigh, THIGH, size)
        _hang_leg(spec, thigh, side, described, size)
    _add_paths(spec, scenario, taller)
    if scenario.orthosis.muscle:
        add_tendons(spec, attach_parts(spec, scenario), scenario.orthosis)
    option = spec.option
    option.timestep = scenario.timestep
    # Coordinates are along and normal to a plane floor: on a slope gravity leans, and pads and grips stay
    # exact. On an uneven floor their directions stay, too: it leans by 4° at most, and grips hold at 39°.
    slope = floor_of(scenario).slope
    option.gravity = [-GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope)]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_CONTACT
    return spec


def _weigh(body: mujoco.MjsBody, segment: Segment, size: Size) -> None:
    body.explicitinertial = True
    body.mass, body.ipos = segment.mass * size.heavier, size.taller * np.array(segment.centre)
    body.inertia = [segment.inertia * size.heavier * size.taller**2] * 3


def _hang_leg(spec: mujoco.MjSpec, thigh: mujoco.MjsBody, side: str, scenario: Scenario, size: Size) -> None:
    """The described leg on a thigh, with a knee."""
    leg = leg_spec(scenario, Size.of(scenario))  # as much bigger than the body that it was made for
    length = scenario.leg.shank_length
    own = SHANK_SHARE * scenario.leg.body_height if length is None else length
    height = own * Size.of(scenario).taller
    shank = leg.body(scenario.leg.shank)
    at = np.array(leg.joint(ANKLE).pos) + np.array(leg.body(scenario.leg.foot).pos) + [0.0, 0.0, height]
    shank.pos = np.zeros(3)
    shank.add_joint(name=KNEE, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, -1, 0], pos=at)
    for joint in leg.joints:  # tissue and springs hold them; the solver of stops would not be of second order
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    if side and scenario.orthosis.muscle:  # it takes the prefix with the leg
        add_tendons(leg, attach_parts(leg, scenario), scenario.orthosis)
    thigh.add_frame(pos=size.taller * np.array(THIGH.end) - at).attach_body(shank, side or OWN, "")
    if side == "":  # MuJoCo complains of an attachment without a prefix
        for elements in (spec.bodies, spec.joints, spec.geoms, spec.sites, spec.meshes, spec.materials):
            for element in elements:
                element.name = element.name.removeprefix(OWN)


def _add_paths(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> None:
    """Sites and tendons of the leg's own muscles, mirrored on the other leg."""
    for side in SIDES:
        across = 1.0 if side == "" else -1.0
        bodies = {
            "trunk": (spec.body("trunk"), np.zeros(3)),
            "thigh": (spec.body(f"{side}thigh"), np.zeros(3)),
            "shank": (spec.body(f"{side}{scenario.leg.shank}"), np.zeros(3)),
            "foot": (spec.body(f"{side}{scenario.leg.foot}"), np.array(spec.joint(f"{side}{ANKLE}").pos)),
        }
        for muscle, path in PATHS.items():
            tendon = spec.add_tendon(name=f"{side}{muscle}")
            for k, (segment, x, y, z) in enumerate(path):
                body, origin = bodies[segment]
                site = body.add_site(
                    name=f"{side}{muscle}_{k}",
                    pos=origin + taller * np.array([x, across * y, z]),
                    size=[0.004, 0.0, 0.0],
                )
                tendon.wrap_site(site.name)


def _add_own(spec: mujoco.MjSpec, *, uneven: bool) -> int:
    """Actuators of reflexes, muscles, tissue, stops and floor; how many places of `userdata` they take."""
    spec.nuser_actuator = native.N_USER
    for side in SIDES:
        native.add_states(spec, f"{side}{REFLEX}", f"{side}{TOE}", len(native.REFLEX_ACT))
        spec.actuators[-1].biastype = mujoco.mjtBias.mjBIAS_USER  # of the toes' extensors
    user, none = mujoco.mjtBias.mjBIAS_USER, [0.0] * native.N_USER
    for side in SIDES:
        for muscle in LEG_MUSCLES:
            spec.add_actuator(
                name=f"{side}{muscle}",
                trntype=mujoco.mjtTrn.mjTRN_TENDON,
                target=f"{side}{muscle}",
                actdim=len(native.LEG_MUSCLE_ACT),
                dyntype=mujoco.mjtDyn.mjDYN_USER,
                gaintype=mujoco.mjtGain.mjGAIN_FIXED,
                gainprm=[0.0] * 10,
                biastype=user,
                userdata=none,
            )
    for kind, gear, states in (("pad", [0, 0, 1, 0, 0, 0], 1), ("grip", [1, 0, 0, 0, 0, 0], 2)):
        for side, point in itertools.product(SIDES, POINTS):
            spec.add_actuator(
                name=f"{side}{kind}_{point}",
                trntype=mujoco.mjtTrn.mjTRN_SITE,
                target=f"{side}{SOLE}{point}",
                refsite=FLOOR,
                gear=gear,
                gaintype=mujoco.mjtGain.mjGAIN_AFFINE,
                gainprm=[0.0, 0.0, -1.0] + [0.0] * 7,
                biastype=user,
                userdata=none,
                **GAIN_STATE | {"actdim": states},
            )
    for side in SIDES:
        add_motor(spec, f"{side}{TISSUE}", f"{side}{ANKLE}", (0.0,), callback=True)
        add_motor(spec, f"{side}{SPASM}", f"{side}{ANKLE}", (0.0, 0.0, -1.0), callback=True)
        for name, (joint, sign, _) in STOPS.items():
            add_motor(spec, f"{side}{name}", f"{side}{joint}", (0.0, 0.0, -1.0), callback=True)
            spec.actuators[-1].gear = [sign, 0.0, 0.0, 0.0, 0.0, 0.0]
    memory = NERVES * _slots(spec.option.timestep)
    own = RATES + len(SIDES) * (memory + len(native.LEG_MUSCLE_DATA) * len(LEG_MUSCLES))
    spec.nuserdata = own + (native.FLOOR_POINTS if uneven else 0)
    return spec.nuserdata


def _slots(step: float) -> int:
    return int(LONG / step + 0.5) + 1


def _fill_leg(body: Body, k: int, strength: dict[str, float]) -> None:
    """Rows of a leg's muscles and reflexes."""
    model, side, toes = body.model, SIDES[k], body.scenario.leg.toes
    leg, rows, named = body.scenario.leg, body.model.actuator_user, _named(body.model)
    floor = floor_of(body.scenario)
    if toes is None:
        raise InputError("has no toes, which a responding walker needs", file=leg.file, field="toes")
    own, slots = len(native.LEG_MUSCLE_DATA) * len(LEG_MUSCLES), _slots(body.scenario.timestep)
    for place, (i, name) in enumerate(zip(body.muscles[k], LEG_MUSCLES, strict=True)):
        at = RATES + own * k + len(native.LEG_MUSCLE_DATA) * place
        rows[i] = muscle_row(MUSCLES[name], body.size, strength.get(f"{side}{name}", 1.0), at)
    knee, pitch = model.joint(f"{side}{KNEE}"), model.joint(PITCH)
    model.joint(f"{side}{TOE}").damping *= 0.5  # the reflex takes the other half
    rows[body.reflexes[k]] = native.row(
        native.Kind.REFLEX,
        other=body.reflexes[1 - k],
        muscle=body.muscles[k, 0],
        pad=body.pads[k, 0],
        tissue=named(f"{side}{TISSUE}"),
        extension=toes.stiffness * Size.of(body.scenario).springy * toes.swing_extension,
        foot=model.body(f"{side}{leg.foot}").id,
        trunk=model.body("trunk").id,
        knee=int(knee.qposadr[0]),
        knee_rate=int(knee.dofadr[0]),
        pitch=int(pitch.qposadr[0]),
        pitch_rate=int(pitch.dofadr[0]),
        userdata=RATES + 2 * own + NERVES * slots * k,
        slots=slots,
        weight=body.weight,
        slope=floor.slope,
        floor=RATES + len(SIDES) * (own + NERVES * slots) if floor.uneven else 0,
        gains=[0.0] * len(GAINS),
    )


def _fill_floor(body: Body, k: int) -> None:
    """Rows of a leg's pads and grips."""
    rows, side, size, named = body.model.actuator_user, SIDES[k], body.size, _named(body.model)
    ground, stiffer = ground_of(body.scenario, Size.of(body.scenario)), size.heavier / size.taller
    for pad, point in zip(body.pads[k], POINTS, strict=True):
        rows[pad] = native.row(native.Kind.PAD, stiffness=ground.stiffness, damping=ground.damping)
        rows[named(f"{side}grip_{point}")] = native.row(
            native.Kind.GRIP,
            pad=pad,
            stiffness=GRIP_STIFFNESS * stiffer,
            damping=GRIP_DAMPING * stiffer * size.slower,
            friction=FRICTION,
        )


def _fill_tissue(body: Body, k: int) -> None:
    """Rows of a leg's passive ankle, its stretch reflex, its stops; the device's leg has the patient's."""
    rows, side, scenario, named = body.model.actuator_user, SIDES[k], body.scenario, _named(body.model)
    tissue = own_tissue(scenario) if side == "" else healthy_tissue(scenario)
    rows[named(f"{side}{TISSUE}")] = native.row(
        native.Kind.PASSIVE, scale=tissue.scale, offset=tissue.offset, load=0.0, damping=0.5 * tissue.damping
    )
    rows[named(f"{side}{SPASM}")] = native.row(
        native.Kind.SPASTIC, gain=reflex_gain(scenario) if side == "" else 0.0
    )
    for name in STOPS:
        rows[named(f"{side}{name}")] = native.row(
            native.Kind.PAD,
            stiffness=STOP_STIFFNESS * body.size.springy,
            damping=STOP_DAMPING * body.size.slower,
        )


def _named(model: mujoco.MjModel) -> Callable[[str], int]:
    return lambda name: int(model.actuator(name).id)


def muscle_row(muscle: Muscle, size: Size, strength: float, place: int) -> np.ndarray:
    """`actuator_user` of a leg's own muscle in a body of a size: force by mass, lengths by height."""
    force, optimal = muscle.force * size.heavier, muscle.optimal * size.taller
    return native.row(
        native.Kind.LEG_MUSCLE,
        strength=strength,
        force=force,
        optimal=optimal,
        slack=muscle.slack * size.taller,
        width=math.sin(muscle.pennation),
        strain=muscle.tendon_strain,
        fastest=muscle.fastest / size.slower,
        damping=muscle.damping,
        passive=muscle.passive,
        mass=muscle.mass * size.heavier,
        slow=muscle.slow,
        userdata=place,
    )
