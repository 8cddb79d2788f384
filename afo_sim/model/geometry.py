"""The compiled model without its parameters, which cases share that differ in no more than these.

A case whose person is heavier or lighter shares it too: the masses are written into a copy, and MuJoCo
computes what follows from them as it does when it compiles.
"""

import copy
import functools
import threading
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description.orthosis import MuscleGroup
from afo_sim.description.quantity import Described
from afo_sim.description.scenario import Scenario
from afo_sim.model.assemble import PASSIVE, assemble, compiled
from afo_sim.model.foot import Foot, foot_of
from afo_sim.model.leg import Size, leg_spec, times_of_change, weights
from afo_sim.model.mounting import ANKLE, Index, check_leg, sweep_lengths
from afo_sim.model.walk_bodies import walking_actuators

ANGLES = 41  # of the range of motion at which a muscle's stretch is looked at
# Not compiled: words, and what is written into the compiled model.
WORDS = ("name", "description", "provenance")
OF_A_LEG = (*WORDS, "directions", "passive", "body_mass", "body_height")  # its size stands for the last two
OF_A_GROUP = (*WORDS, "type", "link_length", "slack", "cable")


@dataclass(frozen=True, eq=False)
class Geometry:
    """A leg with its orthosis, compiled without pictures and parameters. It is shared.

    model : what is stepped
    bare : the leg alone, of recorded walking; whose turn it is writes masses into it
    index, circuit : actuators by name
    angles : over the range of motion [rad] (n,)
    lengths : of the muscles' paths at these angles [m] (n, n_muscle)
    taller : factor on the leg's lengths
    weights : mass and inertia of the bodies that go with the person's mass, by name
    """

    model: mujoco.MjModel
    bare: mujoco.MjModel | None
    index: Index
    circuit: native.CircuitIds
    angles: np.ndarray
    lengths: np.ndarray
    taller: float
    weights: dict[str, tuple[float, np.ndarray]]
    turn: threading.Lock = field(default_factory=threading.Lock)

    def of(self, heavier: float) -> mujoco.MjModel:
        """The model for a person whose mass is by a factor another, to be filled with parameters."""
        own = copy.copy(self.model)
        if heavier != 1.0:
            self._weigh(own, heavier)
        return own

    def bare_foot(self, heavier: float, foot: str) -> Foot:
        """The foot, the body of this name, without orthosis for that person."""
        assert self.bare is not None
        with self.turn:  # a copy of a model costs more than all else here
            self._weigh(self.bare, heavier)
            return foot_of(self.bare, foot, ANKLE)

    def _weigh(self, model: mujoco.MjModel, heavier: float) -> None:
        """Write a person's masses into a model, and what MuJoCo's compiler makes of them."""
        if not self.weights:
            return
        for name, (mass, inertia) in self.weights.items():
            body = model.body(name).id
            model.body_mass[body] = mass * heavier
            model.body_inertia[body] = inertia * heavier * self.taller**2
        mujoco.mj_setConst(model, native.scratch(model))
        # both means, one number after the other; MuJoCo computes them only where it compiles
        model.stat.meanmass = np.cumsum(model.body_mass[1:])[-1] / (model.nbody - 1)
        model.stat.meaninertia = np.cumsum(model.dof_M0)[-1] / model.nv


@dataclass(frozen=True)
class _Seen:
    """All that is compiled of a scenario, and the scenario."""

    compiled: tuple[Any, ...]
    scenario: Scenario = field(compare=False)
    circuit: native.Circuit = field(compare=False)
    size: Size = field(compare=False)
    weights: dict[str, tuple[float, np.ndarray]] = field(compare=False)


def geometry_of(scenario: Scenario, circuit: native.Circuit, size: Size) -> Geometry:
    """The compiled model of a scenario, shared where it was compiled before.

    Parameters
    ----------
    scenario : frozen description
    circuit : of its orthosis
    size : of the leg; of its mass only where that is not written later

    Raises
    ------
    InputError
        As `build`.
    """
    leg, orthosis = scenario.leg, scenario.orthosis
    times = [times_of_change(file) for file in (leg.file, orthosis.cuff, orthosis.plate) if file is not None]
    own = {} if times[0] is None else weights(leg.file, times[0])
    if own:
        size = Size(taller=size.taller)
    seen = (
        *times,
        size,
        scenario.timestep,
        scenario.walking,
        _values(scenario.ground) if scenario.contact and scenario.ground is not None else None,
        _values(leg, OF_A_LEG),
        (orthosis.cuff, orthosis.plate, orthosis.range_of_motion, tuple(orthosis.anchor)),
        tuple((name, *_path(group)) for name, group in orthosis.muscle.items()),
        tuple((m.name, m.tendons, m.chamber, m.anchors, m.friction_states) for m in circuit.muscles),
        tuple((chamber.name, chamber.joint) for chamber in circuit.chambers),
    )
    described = _Seen(seen, scenario, circuit, size, own)
    return (_made if None in times else _kept)(described)


def _values(described: Described, without: tuple[str, ...] = WORDS) -> tuple[Any, ...]:
    """The values of a description and of its parts."""
    return tuple(
        _values(value) if isinstance(value, Described) else value
        for name, value in vars(described).items()
        if name not in without
    )


def _path(group: MuscleGroup) -> tuple[Any, ...]:
    """What is compiled of a muscle group; its length over a pulley only for pictures."""
    muscle = group.type
    drawn = muscle.end_length - group.series_length if group.pulley is not None else 0.0
    return (muscle.mass, muscle.bore, drawn, *_values(group, OF_A_GROUP))


@functools.lru_cache(maxsize=8)
def _kept(seen: _Seen) -> Geometry:
    return _made(seen)


def _made(seen: _Seen) -> Geometry:
    scenario, circuit = seen.scenario, seen.circuit
    leg = leg_spec(scenario, seen.size)
    bare = leg.copy().compile() if scenario.walking else None
    spec = assemble(leg, scenario, circuit)
    # MuJoCo would move each shape with its body in every step
    spec.compiler.discardvisual = True
    model = compiled(spec, scenario)
    check_leg(model, scenario)
    ids = native.circuit_ids(model, circuit)
    joint = model.joint(ANKLE)
    angles = np.linspace(*scenario.orthosis.range_of_motion, ANGLES)
    return Geometry(
        model=model,
        bare=bare,
        circuit=ids,
        index=Index(
            muscles=ids.muscles,
            chambers=ids.chambers,
            valves=ids.valves,
            frictions=ids.frictions,
            anchors=ids.anchors,
            passive=model.actuator(PASSIVE).id,
            walking=walking_actuators(model),
            ankle_qpos=int(joint.qposadr[0]),
            ankle_dof=int(joint.dofadr[0]),
        ),
        angles=angles,
        lengths=sweep_lengths(model, list(ids.muscles.values()), int(joint.qposadr[0]), angles),
        taller=seen.size.taller,
        weights=seen.weights,
    )
