"""spec → MjSpec → MjModel, and the addresses by name that everything downstream uses."""

import dataclasses
import functools
from dataclasses import dataclass

import mujoco

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY
from afo_sim.description.orthosis import Mounting, MuscleGroup, Orthosis
from afo_sim.description.scenario import Scenario
from afo_sim.model import mounting, stability
from afo_sim.model.contact import Contact, check_sole, register
from afo_sim.model.foot import Foot, foot_of
from afo_sim.model.leg import attach_parts, leg_spec
from afo_sim.model.mounting import ANKLE, Index
from afo_sim.model.patient import Active, active
from afo_sim.model.tendons import add_tendons
from afo_sim.model.walk import Walk, lay_out
from afo_sim.model.walk_bodies import add_walking, fill_walking, walking_actuators

PASSIVE = "passive_ankle"


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

    @functools.cached_property
    def xml(self) -> str:
        """The model as self-contained MJCF."""
        return self.spec.to_xml()

    @property
    def body_mass(self) -> float:
        """Of the patient, or of the leg's adult [kg]."""
        patient = self.scenario.patient
        own = None if patient is None else patient.body_mass
        return self.scenario.leg.body_mass if own is None else own


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
    if not collides(model):
        # on the spec too, so that the saved model is the one that ran
        for option in (model.opt, spec.option):
            option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    index = _fill_parameters(model, scenario)
    mounting.check_leg(model, scenario)
    stretch = mounting.check_stretch(model, index, scenario)
    numbers, coarse = stability.check_stability(model, index, scenario)
    warnings = (*mounting.check_description(scenario), *stretch, *coarse)
    built = Built(scenario, model, spec, index, numbers, warnings)
    return _with_walking(built) if scenario.walking else built


def collides(model: mujoco.MjModel) -> bool:
    """Whether any two geoms may touch; where none may, no step needs to look for contacts."""
    able = model.geom_contype[:, None] & model.geom_conaffinity[None, :]
    return bool(able.any()) or model.npair > 0


def _with_walking(built: Built) -> Built:
    """Lay the recorded walking out, and find what the patient's own ankle does in it."""
    scenario = built.scenario
    foot = foot_of(built.model, scenario.leg.foot, ANKLE)
    walk = lay_out(scenario, foot.ankle_height)
    bare = foot_of(leg_spec(scenario).compile(), scenario.leg.foot, ANKLE)
    own = active(walk, bare, scenario, built.body_mass)
    contact = None
    if scenario.contact:
        check_sole(foot, scenario)
        contact = register(walk, foot, built.model, scenario, built.body_mass)
        built = dataclasses.replace(built, warnings=(*built.warnings, *contact.warnings()))
    return dataclasses.replace(built, walk=walk, foot=foot, active=own, contact=contact)


def _assemble(scenario: Scenario) -> mujoco.MjSpec:
    spec = leg_spec(scenario)
    orthosis = scenario.orthosis
    anchors = attach_parts(spec, scenario)
    add_tendons(spec, anchors, orthosis)
    circuit = circuit_of(orthosis)
    native.add_muscles(spec, circuit)
    _add_passive_ankle(spec)
    native.add_chambers(spec, circuit)
    if scenario.walking:
        add_walking(spec, scenario)
    option = spec.option
    option.timestep = scenario.timestep
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # an unstable simulation must stop, not start again from zero
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def circuit_of(orthosis: Orthosis) -> native.Circuit:
    """The circuit of an orthosis: alike parallel muscles share one own contraction, others have their own."""
    return native.Circuit(
        muscles=tuple(
            native.CircuitMuscle(
                name=tendons[0],
                tendons=tendons,
                row=group.type.row,
                series_length=group.series_length,
                chamber=group.chamber or name,
                cable_stiffness=group.cable.stiffness,
                anchors=tuple(orthosis.anchor) if group.pulley is None else (),
            )
            for name, group in orthosis.muscle.items()
            for tendons in _alike(name, group)
        ),
        chambers=tuple(
            native.CircuitChamber(
                name=name,
                joint=ANKLE,
                tube_volume=chamber.tube_volume,
                wall_conductance=chamber.wall_conductance,
                inlet=chamber.inlet,
                outlet=chamber.outlet,
            )
            for name, chamber in orthosis.chamber.items()
        ),
        anchors=tuple(_anchor(name, mounting) for name, mounting in orthosis.anchor.items()),
    )


def _alike(name: str, group: MuscleGroup) -> list[tuple[str, ...]]:
    """Names of a group's muscles: in one tuple where their paths are equally long, else each in its own."""
    tendons = tuple(f"{name}_{k}" for k in range(1, group.count + 1))
    return [tendons] if group.alike else [(tendon,) for tendon in tendons]


def _anchor(name: str, mounting: Mounting) -> native.CircuitAnchor:
    law = mounting.stiffening
    return native.CircuitAnchor(
        name=name,
        stiffness=mounting.stiffness or 0.0,
        force=0.0 if law is None else law.force,
        length=0.0 if law is None else law.length,
        damping=mounting.damping,
    )


def _add_passive_ankle(spec: mujoco.MjSpec) -> None:
    spec.add_actuator(
        name=PASSIVE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=ANKLE,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_USER,
        userdata=[0.0] * native.N_USER,
    )


def _fill_parameters(model: mujoco.MjModel, scenario: Scenario) -> Index:
    """Exact parameters into the compiled model, and where everything stands in it."""
    ids = native.fill_circuit(model, circuit_of(scenario.orthosis))
    joint = model.joint(ANKLE)
    index = Index(
        muscles=ids.muscles,
        chambers=ids.chambers,
        valves=ids.valves,
        frictions=ids.frictions,
        anchors=ids.anchors,
        passive=model.actuator(PASSIVE).id,
        walking=walking_actuators(model),
        ankle_qpos=int(joint.qposadr[0]),
        ankle_dof=int(joint.dofadr[0]),
    )
    fill_walking(model, index.walking, scenario)
    passive = scenario.leg.passive
    model.actuator_user[index.passive] = native.passive_row(
        scale=passive.scale,
        offset=passive.offset,
        load=scenario.load_moment,
        damping=0.5 * scenario.leg.damping,
    )
    return index
