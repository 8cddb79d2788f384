"""Leg, orthosis, circuit and walking put together and compiled, without parameters.

Cases share a compiled model that differ in no more than parameters. A case whose person is heavier or lighter
shares it too: the masses are written into a copy, and MuJoCo computes what follows from them as it does when
it compiles.
"""

import copy
import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import GRAVITY, InputError, Mixed
from afo_sim.description import Described, MuscleGroup, Scenario
from afo_sim.model.foot import Foot, foot_of
from afo_sim.model.inversion import SideArms
from afo_sim.model.leg import attach_parts, check_leg, leg_spec, times_of_change, weighed_later
from afo_sim.model.mirror import mirror_shapes, orthosis_mirrored
from afo_sim.model.mounting import ANKLE, Index, add_motor, sweep_lengths
from afo_sim.model.paths import add_tendons
from afo_sim.model.person import USUAL_GROUND, Size, in_contact
from afo_sim.model.walk_bodies import SINK, add_walking, walking_actuators

PASSIVE = "passive_ankle"
SWEPT_ANGLES = 41  # of the range of motion at which a muscle's stretch is looked at
# Not compiled: words, and what is written into the compiled model.
NOT_COMPILED = ("name", "description", "provenance")
# its size stands for the last two
LEG_NOT_COMPILED = (*NOT_COMPILED, "directions", "passive", "body_mass", "body_height")
GROUP_NOT_COMPILED = (*NOT_COMPILED, "type", "link_length", "slack", "cable", "wrap_friction", "path")
OF_A_BODY = ("body_mass", "body_inertia")
OF_A_JOINT = ("jnt_stiffness",)
OF_A_DOF = ("dof_damping", "dof_armature", "dof_frictionloss")


def assemble(spec: mujoco.MjSpec, scenario: Scenario, circuit: native.Circuit, size: Size) -> mujoco.MjSpec:
    """Put the orthosis on the leg, its circuit, and walking: everything that is compiled."""
    anchors = attach_parts(spec, scenario)
    add_tendons(spec, anchors, scenario.orthosis)
    if orthosis_mirrored(scenario):
        for body in anchors.values():
            mirror_shapes(body)
    native.add_muscles(spec, circuit)
    add_motor(spec, PASSIVE, ANKLE, (0.0,), callback=True)
    native.add_chambers(spec, circuit)
    if scenario.walking:
        add_walking(spec, scenario, size)
    option = spec.option
    option.timestep = scenario.timestep
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # an unstable simulation must stop, not start again from zero
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def compiled(spec: mujoco.MjSpec, scenario: Scenario) -> mujoco.MjModel:
    """A spec's model, without parameters, which looks for contacts only where geoms may touch."""
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile it: {error}", file=scenario.leg.file) from None
    if not collides(model):
        # on the spec too, so that the saved model is the one that ran
        for option in (model.opt, spec.option):
            option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= unused(model)
    return model


def collides(model: mujoco.MjModel) -> bool:
    """Whether any two geoms may touch; where none may, no step needs to look for contacts."""
    able = model.geom_contype[:, None] & model.geom_conaffinity[None, :]
    return bool(able.any()) or model.npair > 0


def unused(model: mujoco.MjModel) -> int:
    """Bits of `disableflags` that change no number of a compiled model, which has nothing of their kind."""
    bits = mujoco.mjtDisableBit
    friction = (model.dof_frictionloss, model.tendon_frictionloss)
    springs = (
        model.jnt_stiffness,
        model.jnt_stiffnesspoly,
        model.tendon_stiffness,
        model.tendon_stiffnesspoly,
        model.flex_stiffness,
        model.flex_edgestiffness,
    )
    parts = {
        bits.mjDSBL_FRICTIONLOSS: friction,
        bits.mjDSBL_SPRING: springs,
        bits.mjDSBL_CLAMPCTRL: (model.actuator_ctrllimited,),
    }
    return sum(int(bit) for bit, arrays in parts.items() if not any(array.any() for array in arrays))


@dataclass(frozen=True, eq=False)
class Load:
    """What goes with the person's mass in a compiled model: rows of its arrays, and their numbers there."""

    rows: tuple[tuple[str, np.ndarray, np.ndarray], ...]

    @classmethod
    def of(cls, model: mujoco.MjModel | None, bodies: Sequence[str], joints: Sequence[str]) -> Self:
        """Of the bodies and joints of these names, in a model for a person as heavy as the leg's."""
        if model is None or not bodies:
            return cls(())
        body = np.array([model.body(name).id for name in bodies])
        joint = np.array([model.joint(name).id for name in joints])
        at = [(OF_A_BODY, body), (OF_A_JOINT, joint), (OF_A_DOF, model.jnt_dofadr[joint])]
        return cls(
            tuple((name, rows, getattr(model, name)[rows].copy()) for names, rows in at for name in names)
        )

    def put(self, model: mujoco.MjModel, heavier: float) -> None:
        """Write a person's into a model, and what MuJoCo's compiler makes of them."""
        if not self.rows or all(
            np.array_equal(getattr(model, name)[rows], numbers * heavier) for name, rows, numbers in self.rows
        ):
            return
        for name, rows, numbers in self.rows:
            getattr(model, name)[rows] = numbers * heavier
        mujoco.mj_setConst(model, native.scratch(model))
        # both means, one number after the other; MuJoCo computes them only where it compiles
        model.stat.meanmass = np.cumsum(model.body_mass[1:])[-1] / (model.nbody - 1)
        model.stat.meaninertia = np.cumsum(model.dof_M0)[-1] / model.nv


@dataclass(frozen=True, eq=False)
class Geometry:
    """A leg with its orthosis, compiled without pictures and parameters. It is shared."""

    model: mujoco.MjModel  # what is stepped
    foot: Foot | None  # of recorded walking, with the orthosis
    bare: Foot | None  # that of the leg alone in its shoe
    index: Index  # actuators by name
    circuit: native.CircuitIds  # actuators by name
    angles: np.ndarray  # over the range of motion [rad] (n,)
    lengths: np.ndarray  # of the muscles' paths at these angles [m] (n, n_muscle)
    load: Load  # what goes with the person's mass
    side_arms: SideArms | None  # lever arms of the muscles to the foot's sides; None where they have none
    spare: list[mujoco.MjModel] = field(default_factory=list)  # filled before, needed no more: a copy is dear

    def of(self, heavier: float) -> mujoco.MjModel:
        """The model for a person whose mass is by a factor another, to be filled with parameters."""
        try:
            own = self.spare.pop()  # another thread may have taken the last one
        except IndexError:
            own = copy.copy(self.model)
        self.load.put(own, heavier)
        return own

    def feet(self, heavier: float) -> tuple[Foot, Foot]:
        """Foot and bare foot of that person; an orthosis is as heavy for all."""
        assert self.foot is not None and self.bare is not None
        more = heavier - 1.0 if self.load.rows else 0.0
        return self.foot.with_more(self.bare, more), self.bare.with_more(self.bare, more)


@dataclass(frozen=True)
class _Seen:
    """All that is compiled of a scenario, and the scenario."""

    compiled: tuple[Mixed, ...]
    scenario: Scenario = field(compare=False)
    circuit: native.Circuit = field(compare=False)
    size: Size = field(compare=False)
    own: bool = field(compare=False)


def geometry_of(scenario: Scenario, circuit: native.Circuit, size: Size) -> Geometry:
    """The compiled model of a scenario, shared where it was compiled before."""
    leg, orthosis = scenario.leg, scenario.orthosis
    times = [times_of_change(file) for file in (leg.file, orthosis.cuff, orthosis.plate) if file is not None]
    own = times[0] is not None and weighed_later(leg.file, times[0])
    if own:
        size = Size(taller=size.taller)
    ground = (scenario.ground or USUAL_GROUND) if in_contact(scenario) else None
    told = *times, size, scenario.timestep, scenario.simulated_side, scenario.walking
    whole = (*told, ground, leg, scenario.shoe, orthosis, circuit)
    asked = _Seen(whole, scenario, circuit, size, own)
    return _made(asked) if None in times else _asked(asked)


@functools.lru_cache(maxsize=8)  # by whole descriptions first: to take them apart takes longer
def _asked(asked: _Seen) -> Geometry:
    """By what is compiled of them."""
    scenario, circuit = asked.scenario, asked.circuit
    leg, orthosis, ground = scenario.leg, scenario.orthosis, asked.compiled[-5]
    seen = (
        asked.compiled[:-5],
        (orthosis.side, orthosis.joint),
        None if ground is None else _values(ground),
        _values(leg, LEG_NOT_COMPILED),
        tuple(None if each is None else _values(each) for each in (scenario.shoe, orthosis.outsole)),
        (orthosis.cuff, orthosis.plate, orthosis.range_of_motion, tuple(orthosis.anchor)),
        tuple((name, *_path(group)) for name, group in orthosis.muscle.items()),
        tuple((m.name, m.tendons, m.chamber, m.anchors, m.friction_states) for m in circuit.muscles),
        tuple((c.name, c.joint, c.drive is not None) for c in circuit.chambers),
        tuple(each.name for each in circuit.volumes),
        tuple(each.name for each in circuit.stores),
        tuple((r.name, r.law, r.valve is not None) for r in circuit.restrictions),
    )
    return _kept(dataclasses.replace(asked, compiled=seen))


def _values(described: Described, without: tuple[str, ...] = NOT_COMPILED) -> tuple[object, ...]:
    """The values of a description and of its parts."""
    values = (value for name, value in vars(described).items() if name not in without)
    return tuple(_values(value) if isinstance(value, Described) else value for value in values)


def _path(group: MuscleGroup) -> tuple[object, ...]:
    """What is compiled of a muscle group; its length over a pulley only for pictures."""
    muscle = group.type
    drawn = muscle.end_length - group.series_length if group.pulley is not None else 0.0
    places = tuple(map(_values, group.path))
    return (muscle.whole_mass, muscle.bore, drawn, places, *_values(group, GROUP_NOT_COMPILED))


@functools.lru_cache(maxsize=8)
def _kept(seen: _Seen) -> Geometry:
    return _made(seen)


def _made(seen: _Seen) -> Geometry:
    scenario, circuit = seen.scenario, seen.circuit
    leg = leg_spec(scenario, seen.size)
    bodies = [body.name for body in leg.bodies[1:]] if seen.own else []
    joints = [joint.name for joint in leg.joints] if seen.own else []
    bare = foot_of(leg.copy().compile(), scenario.leg, ANKLE) if scenario.walking else None
    spec = assemble(leg, scenario, circuit, seen.size)
    # MuJoCo would move each shape with its body in every step, and follow each of several alike paths
    stepped = spec.copy()
    stepped.compiler.discardvisual = True
    for name, leader in ((name, muscle.name) for muscle in circuit.muscles for name in muscle.tendons[1:]):
        stepped.actuator(name).target = leader
        stepped.delete(stepped.tendon(name))
    model = compiled(stepped, scenario)
    check_leg(model, scenario)
    ids = native.circuit_ids(model, circuit)
    qpos, dof = int(model.joint(ANKLE).qposadr[0]), int(model.joint(ANKLE).dofadr[0])
    angles = np.linspace(*scenario.orthosis.range_of_motion, SWEPT_ANGLES)
    return Geometry(
        model=model,
        foot=foot_of(model, scenario.leg, ANKLE) if scenario.walking else None,
        bare=bare,
        circuit=ids,
        index=Index(
            **vars(ids),
            passive=model.actuator(PASSIVE).id,
            walking=walking_actuators(model),
            ankle_qpos=qpos,
            ankle_dof=dof,
            joints={
                model.joint(k).name: (int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k]))
                for k in range(model.njnt)
            },
        ),
        angles=angles,
        lengths=sweep_lengths(model, list(ids.muscles.values()), qpos, angles),
        load=Load.of(model, bodies, [*joints, *([SINK] if seen.own and in_contact(scenario) else [])]),
        side_arms=SideArms.of(spec, scenario, ids.muscles),
    )
