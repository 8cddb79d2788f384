"""An orthosis as a Composer entity that attaches to any leg: a walker's, an arena's, this package's."""

import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, unknown
from afo_sim.control import Command, checked_pressure, coils
from afo_sim.description import Orthosis, Side, a_joint, load
from afo_sim.legs import Found, find, tree_of
from afo_sim.model import PASSIVE, Built, check_air, check_friction, check_longest, circuit_of, endless
from afo_sim.model.build import build
from afo_sim.native import circuit_data
from afo_sim.rl.dm import composer, observable
from afo_sim.rl.leg_entity import INTEGRATOR, Driven, LegEntity, wrong_integrator
from afo_sim.rl.pymjcf import Copied, new_model

from dm_control.composer.define import observable as named  # isort: skip

ROUNDING = 1e-12  # [m] and of unit vectors: what is nearer to a straight number is that number


STUB = "adult_75kg"  # the leg on which cuff, plate and paths are laid out; only what is added is taken
STUB_STEP = 1e-4  # at which any device is laid out; the arena's own step is looked at when compiled [s]


class OrthosisObservables(composer.Observables):
    """Sensors of an orthosis; `enable_all()`, or `set_options({"pressure": {"delay": 3, "enabled":
    True}})`."""

    @named
    def pressure(self) -> observable.Generic:
        """Gauge pressure of each chamber [Pa] (n_chamber,), in the order of `entity.chambers`."""
        return observable.Generic(lambda physics: self._entity.pressure(physics))

    @named
    def air_mass(self) -> observable.Generic:
        """Mass of the air in each chamber [kg] (n_chamber,)."""
        return observable.Generic(lambda physics: self._entity.air_mass(physics))

    @named
    def force(self) -> observable.Generic:
        """Tension of each muscle [N] (n_muscle,), in the order of `entity.muscles`."""
        return observable.Generic(lambda physics: self._entity.force(physics))

    @named
    def contraction(self) -> observable.Generic:
        """Contraction ratio of each muscle's own length, shorter positive [-] (n_muscle,)."""
        return observable.Generic(lambda physics: self._entity.contraction(physics))

    @named
    def cuff_force(self) -> observable.Generic:
        """Pull of all muscles on each anchor that gives [N] (n_anchor,), in the order of `entity.anchors`."""
        return observable.Generic(lambda physics: self._entity.cuff_force(physics))

    @named
    def ankle_angle(self) -> observable.Generic:
        """Angle of the ankle, dorsiflexion positive [rad] (1,)."""
        return observable.Generic(lambda physics: self._entity.ankle_angle(physics))


class OrthosisEntity(Driven):
    """Cuff, plate, muscles, chambers and valves, to be attached to a leg by `attach_to`."""

    def _build(
        self,
        orthosis: str | os.PathLike[str] | Orthosis = "s1",
        *,
        side: Side | None = None,
        supply_pressure: float = 4e5,
        name: str = "orthosis",
    ) -> None:
        self.orthosis: Orthosis = orthosis if isinstance(orthosis, Orthosis) else load("orthosis", orthosis)
        _check_valves(self.orthosis)
        self._side, self._name = side, name
        self.supply_pressure = supply_pressure
        self.circuit = circuit_of(self.orthosis, supply=endless(supply_pressure))
        self.userdata = circuit_data(self.circuit)
        self._root = new_model(name)
        self._parts: list[Any] = []
        self._ids: native.CircuitIds | None = None
        self.found: Found | None = None
        if self.orthosis.anchored and self.orthosis.joint != "ankle":
            problem = f"is for {a_joint(self.orthosis.joint)}, and an entity's is an ankle"
            raise InputError(problem, field="orthosis", allowed="afo.attach, or an orthosis for an ankle")
        self._laid_out(side or self.orthosis.side)  # refused now, not at attaching
        self._coils = dict.fromkeys(self.orthosis.chamber, (0.0, 0.0))

    def _build_observables(self) -> OrthosisObservables:
        return OrthosisObservables(self)

    @property
    def mjcf_model(self) -> Any:
        """Its PyMJCF model: cuff, tendons and actuators; the plate is a model of its own on the foot."""
        return self._root

    # attaching

    def _laid_out(self, side: Side, tilting: bool = False) -> Built:
        """The orthosis of a side on a leg of this package, compiled and checked."""
        given = {
            "duration": "1 s",
            "timestep": f"{STUB_STEP!r} s",
            "leg": STUB,
            "orthosis": self.orthosis,
            "side": side,
            "supply": {"pressure": f"{max(self.supply_pressure, 1e5)!r} Pa"},
            "shank": {"pose": "fixed", "knee_angle": "0 deg"},
            "timer": {"period": "1 s"},
        }
        hinge = {"stiffness": "10 N*m/rad", "damping": "0.2 N*m*s/rad"}
        return build(load("scenario", given, {"leg.subtalar": hinge} if tilting else {}))

    def attach_to(
        self,
        leg_entity: Any,
        shank: Any = None,
        foot: Any = None,
        ankle: Any = None,
        *,
        side: Side | None = None,
        zero: float | None = None,
    ) -> None:
        """Put the orthosis on a leg of another entity; to be called before the environment is made."""
        if self.found is not None:
            allowed = "another OrthosisEntity"
            raise InputError("is attached already, or was", field="orthosis", allowed=allowed)
        leg = leg_entity.mjcf_model
        side = side or self._side or (leg_entity.side if isinstance(leg_entity, LegEntity) else None)
        names = {"shank": _name(leg, shank), "foot": _name(leg, foot), "ankle": _name(leg, ankle)}
        model = _compiled(leg)
        found = find(tree_of(model), **names, side=side, zero=zero)
        plate = _carrier(model, found, names["foot"])
        hinge, place = _element(leg, "joint", found.ankle), _places(leg, model, found, plate)
        pulleys = any(group.pulley is not None for group in self.orthosis.muscle.values())
        if pulleys and found.zero != 0.0:
            problem = "muscles over pulleys are measured from the joint's own zero"
            raise InputError(problem, field="zero", value=found.zero, allowed="0")
        _choose_integrator(leg.root_model)
        _ = getattr(leg_entity, "actuators", None)  # dm_control's walkers keep what they find first
        built = self._laid_out_on(found, _tilts(model, found, plate) and not pulleys)
        notes = [*built.warnings, *found.notes, *_above_the_knee(self.orthosis, found)]
        if plate != found.foot:
            notes.append(f"the plate is on {plate!r}; the ankle {found.ankle!r} moves it by {found.foot!r}")
        for note in notes:
            warnings.warn(note, stacklevel=2)
        self._attach_parts(leg_entity, place, Copied(built.full_model), hinge, found.sign)
        self.found, self._ankle = found, hinge

    def _laid_out_on(self, found: Found, tilting: bool) -> Built:
        """The orthosis for a leg that was found, with the circuit and friction that it then has."""
        self.circuit = circuit_of(self.orthosis, inverts=tilting, supply=endless(self.supply_pressure))
        self.userdata = circuit_data(self.circuit)
        built = self._laid_out(found.side, tilting)
        self._friction = built.stability["friction"] / STUB_STEP
        return built

    def _attach_parts(
        self, leg_entity: Any, place: dict[str, "_Place"], copied: Copied, hinge: Any, sign: float
    ) -> None:
        """Put cuff and plate at their places, and the muscles between them."""
        sites = {segment: at.site(f"{self._name}_{segment}") for segment, at in place.items()}
        for segment, site in sites.items():
            for body in _added(copied.model, segment):
                self._attach_part(leg_entity, site, copied, body)
        self._add_muscles(copied, hinge, sign)
        size = leg_entity.mjcf_model.root_model.size
        size.nuserdata = (size.nuserdata or 0) + self.userdata

    def _attach_part(self, leg_entity: Any, site: Any, copied: Copied, body: int) -> None:
        """A body in an attachment frame of its own: masses are then added up as in a run, in its order."""
        if self._parent is None:
            copied.body(self._root.worldbody, body)
            leg_entity.attach(self, site)
            return
        part = new_model(f"{self._name}_{copied.model.body(body).name}")
        copied.body(part.worldbody, body)
        site.attach(part)
        self._parts.append(part)

    def _add_muscles(self, copied: Copied, hinge: Any, sign: float) -> None:
        model = copied.model
        joints = dict.fromkeys(range(model.njnt), (hinge, sign))
        for tendon in range(model.ntendon):
            copied.tendon(self._root, tendon, joints)
        for actuator in range(model.nu):
            if model.actuator(actuator).name != PASSIVE:
                copied.actuator(self._root, actuator, hinge)

    def detach(self) -> None:
        """Take the orthosis off; for another leg make another."""
        super().detach()
        for part in self._parts:
            part.detach()
        self._parts.clear()

    # an environment's calls

    def _write_rows(self, model: mujoco.MjModel, userdata: int) -> None:
        if self.found is None:
            raise InputError("is attached to no leg: attach_to(leg_entity) puts it on one", field="orthosis")
        step = float(model.opt.timestep)
        check_longest(step)
        check_friction(self._friction * step, step)
        for note in check_air(self.orthosis, step)[1]:
            warnings.warn(note, stacklevel=2)
        self._ids = native.circuit_ids(model, self.circuit, self._root.full_identifier)
        native.fill_circuit(model, self.circuit, self._ids, userdata=userdata)

    def initialize_episode(self, physics: Any, random_state: Any) -> None:
        """Shut the valves, and fill all chambers with ambient air in the posture that the task has set."""
        self._check()
        self._coils = dict.fromkeys(self._coils, (0.0, 0.0))
        self._write_inputs(physics)
        native.fill_chambers(physics.model.ptr, physics.data.ptr, 0.0)

    def set_valves(self, **commands: Command) -> None:
        """Command the valves of chambers from the next physics step on, by the chamber's name."""
        three_way = [name for name, chamber in self.orthosis.chamber.items() if chamber.three_way]
        self._coils |= coils(commands, self._coils, three_way=three_way)

    @property
    def supply_pressure(self) -> float:
        """Gauge pressure of the supply [Pa], 0 to 2e6; assign it to change it from the next step on."""
        return self._supply

    @supply_pressure.setter
    def supply_pressure(self, pressure: float) -> None:
        self._supply = checked_pressure(pressure)

    def _write_inputs(self, physics: Any) -> None:
        ids, inputs = self._compiled(), physics.data.ctrl
        for name, (inlet, outlet) in self._coils.items():
            inputs[ids.chambers[name]] = self._supply
            inputs[ids.valves[f"{name}_inlet"]], inputs[ids.valves[f"{name}_outlet"]] = inlet, outlet

    def _compiled(self) -> native.CircuitIds:
        self._check()
        assert self._ids is not None
        return self._ids

    # readers

    @property
    def chambers(self) -> tuple[str, ...]:
        """Names of the chambers."""
        return tuple(self.orthosis.chamber)

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of all single muscles, such as "dorsiflexor_1"."""
        return tuple(tendon for muscle in self.circuit.muscles for tendon in muscle.tendons)

    @property
    def anchors(self) -> tuple[str, ...]:
        """Segments whose anchor gives."""
        return tuple(self.orthosis.anchor)

    def _air(self, physics: Any) -> list[native.Air]:
        ids, data = self._compiled(), self._solved(physics)
        model = physics.model.ptr
        return [native.read_air(model, data.act, data.userdata, ids.chambers[name]) for name in self.chambers]

    def pressure(self, physics: Any) -> np.ndarray:
        """Gauge pressure of each chamber [Pa] (n_chamber,)."""
        return np.array([air.absolute_pressure - AMBIENT_PRESSURE for air in self._air(physics)])

    def air_mass(self, physics: Any) -> np.ndarray:
        """Mass of the air in each chamber [kg] (n_chamber,)."""
        return np.array([air.mass for air in self._air(physics)])

    def force(self, physics: Any) -> np.ndarray:
        """Tension of each muscle itself, before any guide of its path [N] (n_muscle,)."""
        model, data = physics.model.ptr, self._solved(physics)
        return np.array([native.read_own(model, data.userdata, i).tension for i in self._muscle_ids()])

    def contraction(self, physics: Any) -> np.ndarray:
        """Contraction ratio of each muscle's own length, shorter positive [-] (n_muscle,)."""
        model, data = physics.model.ptr, self._solved(physics)
        return np.array([native.read_own(model, data.userdata, i).contraction for i in self._muscle_ids()])

    def cuff_force(self, physics: Any) -> np.ndarray:
        """Pull of all muscles on each anchor that gives [N] (n_anchor,)."""
        ids, model, data = self._compiled(), physics.model.ptr, self._solved(physics)
        found = [native.read_anchor(model, data.userdata, *ids.anchors[name]).force for name in self.anchors]
        return np.array(found)

    def ankle_angle(self, physics: Any) -> np.ndarray:
        """Angle of the ankle, dorsiflexion positive [rad] (1,)."""
        assert self.found is not None
        return np.array([self.found.sign * (float(physics.bind(self._ankle).qpos.item()) - self.found.zero)])

    def _muscle_ids(self) -> list[int]:
        return [self._compiled().muscles[name] for name in self.muscles]


def _added(model: mujoco.MjModel, segment: str) -> list[int]:
    """Bodies that the orthosis has added to a segment, in their order in the model."""
    prefix = {"shank": "cuff_", "foot": "plate_"}[segment]
    names = [(body, model.body(body).name) for body in range(1, model.nbody)]
    parent = model.body(f"{segment}_anchors").parentid[0]
    return [
        body
        for body, name in names
        if model.body_parentid[body] == parent and (name.startswith(prefix) or name == f"{segment}_anchors")
    ]


def _above_the_knee(orthosis: Orthosis, found: Found) -> Iterator[str]:
    """A remark where muscles are anchored higher on the shank than this leg's knee."""
    ends = [end for group in orthosis.muscle.values() for end in (group.origin, group.insertion)]
    highest = max((end.from_joint[2] for end in ends if end and end.segment == "shank"), default=0.0)
    if found.shank_length is not None and highest > found.shank_length:
        yield (
            f"muscles are anchored {highest * 100:.0f} cm above the ankle, and the shank {found.shank!r} is "
            f"{found.shank_length * 100:.0f} cm long: the orthosis is too long for this leg"
        )


def _choose_integrator(root: Any) -> None:
    """The integrator of a PyMJCF model, where nobody has chosen one."""
    chosen = root.option.integrator
    if chosen is None:
        root.option.integrator = INTEGRATOR
    elif chosen != INTEGRATOR:
        raise wrong_integrator(chosen)


def _check_valves(orthosis: Orthosis) -> None:
    """Refuse valves that no command of an entity opens."""
    for name, each in orthosis.restriction.items():
        if each.kind == "valve":
            problem = "is a valve between two nodes, and an entity commands those of chambers alone"
            raise InputError(problem, field=f"restriction.{name}", allowed="afo.attach, or another kind")


@dataclass(frozen=True, eq=False)
class _Place:
    """A place on a body of PyMJCF's."""

    body: Any
    position: np.ndarray
    quaternion: np.ndarray

    def site(self, name: str) -> Any:
        """A site there, to attach to."""
        return self.body.add("site", name=name, pos=self.position, quat=self.quaternion, size=[0.005] * 3)


def _compiled(leg: Any) -> mujoco.MjModel:
    """The PyMJCF model of a leg's entity by itself, in the posture that it is described in."""
    try:
        return mujoco.MjModel.from_xml_string(leg.to_xml_string(), leg.get_assets())
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the leg's entity: {error}", field="leg_entity") from None


def _name(leg: Any, element: Any) -> str | None:
    if element is None or isinstance(element, str):
        return element
    return str(element.prefixed_identifier(leg.namescope))


def _element(leg: Any, kind: str, name: str) -> Any:
    """The element of a name; InputError where PyMJCF has none."""
    made = leg.find(kind, name)
    if made is None:
        names = [e.full_identifier for e in leg.find_all(kind) if e.name]
        raise unknown(name, names, field=kind, problem=f"the leg's entity has no {kind} of this name")
    return made


def _carrier(model: mujoco.MjModel, found: Found, named: str | None) -> str:
    """Name of the body that carries the plate: the named foot, else the heaviest that the ankle moves."""
    if named is not None:
        return named
    return max(tree_of(model).below(found.foot), key=lambda part: part.mass).name


def _places(leg: Any, model: mujoco.MjModel, found: Found, foot: str) -> dict[str, _Place]:
    """{segment: place at the ankle's centre, x forward, y left, z up at an ankle angle of zero}."""
    data = mujoco.MjData(model)
    joint = model.joint(found.ankle)
    data.qpos[joint.qposadr[0]] = found.zero
    mujoco.mj_kinematics(model, data)
    made = {}
    for segment, name in (("shank", found.shank), ("foot", foot)):
        body = model.body(name).id
        turn = data.xmat[body].reshape(3, 3)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, _straight(turn.T @ found.axes).ravel())
        position = _straight(turn.T @ (found.centre - data.xpos[body]))
        made[segment] = _Place(_element(leg, "body", name), position, quaternion)
    return made


def _tilts(model: mujoco.MjModel, found: Found, foot: str) -> bool:
    """Whether other joints than the ankle turn the body that carries the plate against the shank."""
    body, shank, count = model.body(foot).id, model.body(found.shank).id, 0
    while body not in (shank, 0):
        count += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return count > 1


def _straight(values: np.ndarray) -> np.ndarray:
    """Values without the rounding of axes meant to be parallel; it would change a run's last bits."""
    whole = np.round(values) + 0.0
    return np.where(np.abs(values - whole) < ROUNDING, whole, values)
