"""The pneumatic circuit: muscles, chambers and valves as actuators of an MjSpec, their rows, their first air.

    add_circuit(spec, circuit)          # actuators, without parameters
    model = spec.compile()
    ids = fill_circuit(model, circuit)  # exact parameters: MJCF text would cut them to six digits
    fill_chambers(model, data, 0.0)     # air, once the callbacks are installed

A circuit is named parameters only; whoever has descriptions turns them into one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import mujoco
import numpy as np

from afo_sim.native.install import assert_live, assert_rows
from afo_sim.native.slots import (
    KIND_CHAMBER,
    KIND_MUSCLE,
    KIND_NETWORK,
    MUSCLE_INVERSE_MASS,
    N_USER,
    RIGID,
    chamber_row,
    friction_row,
    muscle_row,
    network_row,
    valve_row,
)
from afo_sim.native.state import (
    ANCHOR_DATA,
    ANCHOR_STATES,
    CHAMBER_DATA,
    CHAMBER_STATES,
    LAST_VOLUME,
    LEADER_DATA,
    LEADER_STATES,
    VALVE_STATES,
    air_at,
    read_flows,
    write_air,
    write_rest,
)
from afo_sim.physics.friction import FRICTIONS

SIDES = ("inlet", "outlet")
BLANK = [0.0] * N_USER
LIVE_PRESSURE = 3e5  # of the state in which muscles must pull [Pa]
FRICTION_STATES = {friction.native_id: friction.n_state for friction in FRICTIONS.values()}


class ValveParameters(Protocol):
    """A valve of any type."""

    @property
    def row(self) -> Mapping[str, Any]:
        """Its own parameters, as `valve_row` takes them."""
        ...


@dataclass(frozen=True)
class CircuitValve:
    """A solenoid valve by its numbers: conductance [m³/(s·Pa)], critical pressure ratio [-], delays [s]."""

    conductance: float
    critical_ratio: float
    opening_delay: float = 0.0
    closing_delay: float = 0.0

    @property
    def row(self) -> Mapping[str, Any]:
        """Its parameters, as `valve_row` takes them."""
        return asdict(self)


@dataclass(frozen=True)
class CircuitAnchor:
    """What a limb gives way where muscles are anchored: a cuff, a plate.

    stiffness : linear [N/m]; or 0, and then
    force, length : a [N] and x0 [m] of the stiffening F = a (e^(x/x0) − 1)
    damping : [N·s/m]
    """

    name: str
    stiffness: float = 0.0
    force: float = 0.0
    length: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class CircuitMuscle:
    """Alike parallel muscles, one on each tendon, which share one own contraction.

    name : of the muscle, and of its friction
    tendons : names of the tendons, which are of one length in every posture
    row : the muscle's own parameters, as `muscle_row` takes them
    series_length : all of the tendon that is neither muscle nor stretch [m]
    chamber : name of the chamber that fills it
    cable_stiffness : of the cable or bracket of each muscle [N/m]
    anchors : names of the anchors that its pull displaces
    """

    name: str
    tendons: tuple[str, ...]
    row: Mapping[str, Any]
    series_length: float
    chamber: str
    cable_stiffness: float = RIGID
    anchors: tuple[str, ...] = ()

    @property
    def friction_states(self) -> int:
        """Number of states of its friction."""
        return FRICTION_STATES.get(self.row.get("friction", 0), 0)


@dataclass(frozen=True)
class CircuitChamber:
    """Air that muscles share, behind an inlet and an outlet valve.

    joint : that MuJoCo asks for; nothing here puts a force on it
    tube_volume : between valves and muscles [m³]
    wall_conductance : heat to the wall [W/K]
    """

    name: str
    joint: str
    tube_volume: float
    wall_conductance: float
    inlet: ValveParameters
    outlet: ValveParameters


@dataclass(frozen=True)
class Circuit:
    """Muscles, chambers and anchors, in the order of their actuators."""

    muscles: tuple[CircuitMuscle, ...]
    chambers: tuple[CircuitChamber, ...]
    anchors: tuple[CircuitAnchor, ...] = ()

    def muscles_of(self, chamber: str) -> tuple[CircuitMuscle, ...]:
        """The muscles on a chamber."""
        return tuple(muscle for muscle in self.muscles if muscle.chamber == chamber)

    def networks(self) -> list["Network"]:
        """Chambers that are solved together, since their muscles pull on the same anchors.

        Raises
        ------
        ValueError
            Muscles of one network pull on different anchors.
        """
        found: dict[tuple[str, ...] | str, list[str]] = {}
        for chamber in self.chambers:
            pulled = {muscle.anchors for muscle in self.muscles_of(chamber.name)}
            if len(pulled) > 1:
                raise ValueError(
                    f"the muscles of chamber {chamber.name!r} pull on different anchors: {pulled}"
                )
            anchors = pulled.pop() if pulled else ()
            found.setdefault(anchors or chamber.name, []).append(chamber.name)
        separate = [anchors for anchors in found if isinstance(anchors, tuple)]
        if len(set().union(*separate)) < sum(len(anchors) for anchors in separate):
            raise ValueError(f"an anchor is shared by muscles that pull on different others: {separate}")
        return [
            Network(tuple(chambers), anchors if isinstance(anchors, tuple) else ())
            for anchors, chambers in found.items()
        ]


@dataclass(frozen=True)
class Network:
    """Names of chambers and anchors that one actuator solves."""

    chambers: tuple[str, ...]
    anchors: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the actuator, that of the first chamber."""
        return f"network_{self.chambers[0]}"


@dataclass(frozen=True)
class CircuitIds:
    """Actuator ids by name; valves are "<chamber>_inlet" and "<chamber>_outlet", frictions their muscle's.

    muscles : by tendon
    anchors : (network, number in it) by name
    """

    networks: dict[str, int]
    muscles: dict[str, int]
    chambers: dict[str, int]
    valves: dict[str, int]
    frictions: dict[str, int]
    anchors: dict[str, tuple[int, int]]


def add_circuit(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """Add the actuators of a circuit to a model whose tendons are named like the muscles."""
    add_muscles(spec, circuit)
    add_chambers(spec, circuit)


def add_muscles(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """The first half of `add_circuit`, for who has actuators to put between.

    The networks come first of all: what their dyn solves is read by the others.
    """
    affine, fixed = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtGain.mjGAIN_FIXED
    spec.nuser_actuator = N_USER
    joints = {chamber.name: chamber.joint for chamber in circuit.chambers}
    for network in circuit.networks():
        leaders = sum(len(circuit.muscles_of(name)) for name in network.chambers)
        count = LEADER_STATES * leaders + ANCHOR_STATES * len(network.anchors)
        _add_states(spec, network.name, joints[network.chambers[0]], max(count, 2))
    for muscle in circuit.muscles:
        for tendon in muscle.tendons:
            leads = tendon == muscle.tendons[0]
            spec.add_actuator(
                name=tendon,
                trntype=mujoco.mjtTrn.mjTRN_TENDON,
                target=tendon,
                gaintype=affine if leads else fixed,
                gainprm=[0.0, 0.0, -1.0 if leads else 0.0] + [0.0] * 7,
                biastype=mujoco.mjtBias.mjBIAS_USER,
                userdata=BLANK,
            )


def add_chambers(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """The second half: chambers, valves, and what holds the states of friction."""
    spec.nuser_actuator = N_USER
    spec.nuserdata = (
        CHAMBER_DATA * len(circuit.chambers)
        + LEADER_DATA * len(circuit.muscles)
        + ANCHOR_DATA * len(circuit.anchors)
    )
    joints = {chamber.name: chamber.joint for chamber in circuit.chambers}
    for name, joint in joints.items():
        _add_states(spec, f"chamber_{name}", joint, CHAMBER_STATES)
    for name, joint in joints.items():
        for side in SIDES:
            _add_states(spec, f"valve_{name}_{side}", joint, VALVE_STATES)
    for muscle in circuit.muscles:
        if muscle.friction_states:
            joint = joints[muscle.chamber]
            _add_states(spec, f"friction_{muscle.name}", joint, muscle.friction_states)


def _add_states(spec: mujoco.MjSpec, name: str, joint: str, count: int) -> None:
    """An actuator without force that holds states of the callbacks'."""
    spec.add_actuator(
        name=name,
        actdim=count,
        userdata=BLANK,
        dyntype=mujoco.mjtDyn.mjDYN_USER,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_NONE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
    )


def circuit_ids(model: mujoco.MjModel, circuit: Circuit) -> CircuitIds:
    """The circuit's actuators in a compiled model."""

    def found(prefix: str, names: list[str]) -> dict[str, int]:
        return {name: model.actuator(prefix + name).id for name in names}

    networks = circuit.networks()
    ids = found("", [network.name for network in networks])
    return CircuitIds(
        networks=ids,
        muscles=found("", [tendon for muscle in circuit.muscles for tendon in muscle.tendons]),
        chambers=found("chamber_", [chamber.name for chamber in circuit.chambers]),
        valves=found("valve_", [f"{chamber.name}_{side}" for chamber in circuit.chambers for side in SIDES]),
        frictions=found("friction_", [m.name for m in circuit.muscles if m.friction_states]),
        anchors={
            name: (ids[network.name], number)
            for network in networks
            for number, name in enumerate(network.anchors)
        },
    )


def fill_circuit(model: mujoco.MjModel, circuit: Circuit) -> CircuitIds:
    """Write the exact parameters of a circuit into a compiled model."""
    ids, user = circuit_ids(model, circuit), model.actuator_user
    chambers = {chamber.name: chamber for chamber in circuit.chambers}
    anchors = {anchor.name: anchor for anchor in circuit.anchors}
    data = 0
    for network in circuit.networks():
        actuator = ids.networks[network.name]
        state = int(model.actuator_actadr[actuator])
        following = [*(ids.chambers[name] for name in network.chambers[1:]), -1]
        for name, next_chamber in zip(network.chambers, following, strict=True):
            leaders = [ids.muscles[muscle.tendons[0]] for muscle in circuit.muscles_of(name)]
            _fill_chamber(model, ids, chambers[name], [*leaders, -1][0], next_chamber, data)
            data += CHAMBER_DATA
            chain = zip(circuit.muscles_of(name), [*leaders[1:], -1], strict=False)
            for muscle, next_muscle in chain:
                _fill_muscle(model, ids, muscle, next_muscle, state, data)
                state, data = state + LEADER_STATES, data + LEADER_DATA
        numbers = [
            (a.stiffness, a.force, a.length, a.damping) for a in (anchors[name] for name in network.anchors)
        ]
        user[actuator] = network_row(
            first_chamber=ids.chambers[network.chambers[0]], state=state, userdata=data, anchors=numbers
        )
        data += ANCHOR_DATA * len(numbers)
    for muscle in circuit.muscles:
        if muscle.name in ids.frictions:
            user[ids.frictions[muscle.name]] = friction_row(muscle=ids.muscles[muscle.tendons[0]])
    fill_inverse_masses(model)
    return ids


def fill_inverse_masses(model: mujoco.MjModel) -> None:
    """Write J M⁻¹ Jᵀ [1/kg] of every muscle's path, at the model's own posture, into its row.

    To be called again where masses change: it tells how stiff a taut muscle is beside what it moves.
    """
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    jacobian, moved = np.zeros((model.nu, model.nv)), np.zeros((1, model.nv))
    mujoco.mju_sparse2dense(
        jacobian, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    for muscle in _of_kind(model, KIND_MUSCLE):
        mujoco.mj_solveM(model, data, moved, jacobian[muscle : muscle + 1])
        model.actuator_user[muscle, MUSCLE_INVERSE_MASS] = float(moved[0] @ jacobian[muscle])


def _fill_chamber(
    model: mujoco.MjModel,
    ids: CircuitIds,
    chamber: CircuitChamber,
    first_muscle: int,
    next_chamber: int,
    data: int,
) -> None:
    """The rows of a chamber and its valves."""
    user = model.actuator_user
    user[ids.chambers[chamber.name]] = chamber_row(
        first_muscle=first_muscle,
        next_chamber=next_chamber,
        inlet=ids.valves[f"{chamber.name}_inlet"],
        outlet=ids.valves[f"{chamber.name}_outlet"],
        tube_volume=chamber.tube_volume,
        wall_conductance=chamber.wall_conductance,
        userdata=data,
    )
    for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
        user[ids.valves[f"{chamber.name}_{side}"]] = valve_row(**valve.row)


def _fill_muscle(
    model: mujoco.MjModel, ids: CircuitIds, muscle: CircuitMuscle, next_muscle: int, state: int, data: int
) -> None:
    """The rows of alike muscles; the first of them leads."""
    for tendon in muscle.tendons:
        model.actuator_user[ids.muscles[tendon]] = muscle_row(
            **muscle.row,
            series_length=muscle.series_length,
            cable_stiffness=muscle.cable_stiffness,
            leader=ids.muscles[muscle.tendons[0]],
            count=len(muscle.tendons),
            chamber=ids.chambers[muscle.chamber],
            next_muscle=next_muscle,
            state=state,
            userdata=data,
            friction_states=ids.frictions.get(muscle.name, -1),
        )


def fill_chambers(model: mujoco.MjModel, data: mujoco.MjData, pressure: float | Mapping[int, float]) -> None:
    """Set chambers to gauge pressures at ambient temperature, and muscles and anchors at rest with them.

    The callbacks must be installed: they solve the muscles' own lengths at the present posture.

    Parameters
    ----------
    model, data : with this project's actuators
    pressure : of all chambers, or by actuator id, the others at ambient pressure [Pa]
    """
    chambers, networks = list(_of_kind(model, KIND_CHAMBER)), list(_of_kind(model, KIND_NETWORK))
    gauge = {c: pressure.get(c, 0.0) if isinstance(pressure, Mapping) else pressure for c in chambers}
    inputs = data.ctrl.copy()
    for chamber in chambers:
        write_air(model, data.act, chamber, air_at(gauge[chamber], 1e-3))  # of any volume
    data.ctrl[networks] = 1.0
    mujoco.mj_forward(model, data)
    data.ctrl[:] = inputs
    for chamber in chambers:
        volume = float(read_flows(model, data.userdata, chamber).volume)
        write_air(model, data.act, chamber, air_at(gauge[chamber], volume))
    for network in networks:
        write_rest(model, data, network)


def step_back(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Give muscles, anchors and volumes the past that the present velocity implies, for a start in motion.

    Without it they would be taken to have stood still, and the first steps would be of first order.
    """
    here = data.qpos.copy()
    inputs = data.ctrl.copy()
    networks = list(_of_kind(model, KIND_NETWORK))
    mujoco.mj_integratePos(model, data.qpos, data.qvel, -model.opt.timestep)
    data.ctrl[networks] = 1.0
    mujoco.mj_forward(model, data)
    data.qpos[:], data.ctrl[:] = here, inputs
    for chamber in _of_kind(model, KIND_CHAMBER):
        last = float(read_flows(model, data.userdata, chamber).volume)
        data.act[model.actuator_actadr[chamber] + LAST_VOLUME] = last
    for network in networks:
        write_rest(model, data, network)


def assert_muscles_pull(model: mujoco.MjModel, state: np.ndarray) -> None:
    """Refuse limp muscles: with 3 bar in every chamber each must carry its law's force.

    Parameters
    ----------
    model : with this project's actuators
    state : mjSTATE_INTEGRATION row of the posture

    Raises
    ------
    CallbackError
        An actuator has lost its parameters, or a muscle carries another force than its law's.
    """
    assert_rows(model)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    fill_chambers(model, data, LIVE_PRESSURE)
    mujoco.mj_forward(model, data)
    assert_live(model, data, list(_of_kind(model, KIND_MUSCLE)))


def _of_kind(model: mujoco.MjModel, kind: float) -> Iterator[int]:
    """Ids of the actuators of one kind."""
    return (i for i in range(model.nu) if model.actuator_user[i, 1] == kind)
