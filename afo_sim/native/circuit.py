"""The pneumatic circuit: muscles, chambers and valves as actuators of an MjSpec, their rows, their first air.

    add_circuit(spec, circuit)          # actuators, without parameters
    model = spec.compile()
    ids = fill_circuit(model, circuit)  # exact parameters: MJCF text would cut them to six digits
    fill_chambers(model, data, 0.0)     # air, once the callbacks are installed

A circuit is named parameters only; whoever has descriptions turns them into one.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import mujoco

from afo_sim.common import GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.native import slots
from afo_sim.physics import COMPRESSOR, FRICTIONS, INERTIAL, FlowEdge, flow_edge

AMBIENT_NAME, SUPPLY_NAME = flow_edge.AMBIENT, flow_edge.SUPPLY
SIDES = ("inlet", "outlet")
BLANK = [0.0] * slots.N_USER


class ValveParameters(Protocol):
    """A valve of any type."""

    @property
    def row(self) -> Mapping[str, Any]:
        """Its own parameters, by the names of `VALVE_ROW`."""
        ...


@dataclass(frozen=True)
class CircuitValve:
    """A valve by its numbers."""

    conductance: float  # [m³/(s·Pa)]
    critical_ratio: float  # of pressures [-]
    opening_delay: float = 0.0  # [s]
    closing_delay: float = 0.0  # [s]
    bandwidth: float = 0.0  # of a proportional valve [Hz]
    dead_band: float = 0.0  # of a proportional valve [-]
    opening_ramp: float = 0.0  # after its delay, from shut to open [s]
    closing_ramp: float = 0.0  # and back [s]
    threshold: float = 0.0  # these three as of `description.air.Valve` [-]
    hold_decay: float = 0.0  # [s]
    hold_pressure: float = 0.0  # [Pa]

    @property
    def row(self) -> Mapping[str, Any]:
        """Its parameters, by the names of `VALVE_ROW`."""
        return asdict(self)


@dataclass(frozen=True)
class CircuitAnchor:
    """What a limb gives way where muscles are anchored: a cuff, a plate."""

    name: str
    stiffness: float = 0.0  # linear [N/m]; or 0, and then
    force: float = 0.0  # a of the stiffening F = a (e^(x/x0) − 1) [N]
    length: float = 0.0  # x0 of it [m]
    damping: float = 0.0  # [N·s/m]


@dataclass(frozen=True)
class CircuitMuscle:
    """Alike parallel muscles, one on each tendon, which share one own contraction."""

    name: str  # of the muscle, and of its friction
    tendons: tuple[str, ...]  # names; of one length in every posture
    row: Mapping[str, Any]  # its own parameters, as `muscle_row` takes them
    series_length: float  # all of the tendon that is neither muscle nor stretch [m]
    chamber: str  # name of the one that fills it
    cable_stiffness: float = slots.RIGID  # of the cable or bracket of each muscle [N/m]
    anchors: tuple[str, ...] = ()  # names of those that its pull displaces
    wrap_friction: float = 0.0  # coefficient of friction at the tendons' guides [-]

    @property
    def friction_states(self) -> int:
        """Number of states of its friction."""
        own = self.row.get("friction", 0)
        return next((each.n_state for each in FRICTIONS.values() if each.native_id == own), 0)


@dataclass(frozen=True)
class CircuitDrive:
    """A pressure drive of a chamber's two valves."""

    row: Mapping[str, Any]  # its own parameters
    bandwidth: float = 0.0  # of the two valves, where they are proportional [Hz]; 0 for solenoid valves


@dataclass(frozen=True)
class CircuitChamber:
    """Air that muscles share, behind an inlet and an outlet valve."""

    name: str
    joint: str  # that MuJoCo asks for; nothing here puts a force on it
    tube_volume: float  # between valves and muscles [m³]
    wall_conductance: float  # heat to the wall [W/K]
    inlet: ValveParameters
    outlet: ValveParameters
    drive: CircuitDrive | None = None  # makes coils of a pressure; none where coils are the inputs
    feed: str = SUPPLY_NAME  # node before the inlet
    exhaust: str = AMBIENT_NAME  # node behind the outlet
    port: str = ""  # node that the valves open into, where a tube leads on to the muscles; else the chamber
    three_way: bool = False  # whether the outlet is the inlet valve's other way, open while that is shut
    wall_conductance_by_flow: float = 0.0  # by which the wall's grows with what flows in [J/(kg·K)]


@dataclass(frozen=True)
class CircuitVolume:
    """A rigid volume: reservoir, manifold, end of a tube; its wall's conductances as of a chamber."""

    name: str
    volume: float  # [m³]
    wall_conductance: float = 0.0
    start: float = 0.0  # gauge pressure that it begins with [Pa]
    start_as: str = ""  # chamber whose pressure it begins with instead; none by default
    wall_conductance_by_flow: float = 0.0


@dataclass(frozen=True)
class CircuitStore:
    """A finite source: gas bottle or cartridge."""

    name: str
    row: Mapping[str, Any]  # its own parameters
    content: float  # [kg]


@dataclass(frozen=True, eq=False)
class Circuit:
    """Muscles, chambers and anchors, in the order of their actuators, and the rest of the air path."""

    muscles: tuple[CircuitMuscle, ...]
    chambers: tuple[CircuitChamber, ...]
    anchors: tuple[CircuitAnchor, ...] = ()
    volumes: tuple[CircuitVolume, ...] = ()
    stores: tuple[CircuitStore, ...] = ()
    restrictions: tuple[FlowEdge, ...] = ()
    upstream: str = ""  # store or volume that the supply draws from; none where it never sags
    gas_constant: float = GAS_CONSTANT  # [J/(kg·K)]
    heat_capacity_ratio: float = HEAT_CAPACITY_RATIO  # [-]

    def muscles_of(self, chamber: str) -> tuple[CircuitMuscle, ...]:
        """The muscles on a chamber."""
        return tuple(muscle for muscle in self.muscles if muscle.chamber == chamber)

    @property
    def driven(self) -> tuple[CircuitChamber, ...]:
        """The chambers that have a drive."""
        return tuple(chamber for chamber in self.chambers if chamber.drive is not None)

    @property
    def userdata(self) -> int:
        """How many numbers of MjData.userdata are its own."""
        return (
            len(slots.CHAMBER_DATA) * len(self.chambers)
            + len(slots.LEADER_DATA) * len(self.muscles)
            + len(slots.ANCHOR_DATA) * len(self.anchors)
            + len(slots.DRIVE_DATA) * len(self.driven)
            + len(slots.VOLUME_DATA) * (len(self.volumes) + len(self.stores))
            + slots.EDGE_DATA * len(self.restrictions)
        )

    def networks(self) -> list["Network"]:
        """Chambers that are solved together, since their muscles pull on the same anchors."""
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


@dataclass(frozen=True, eq=False)  # shared by the cases of a layout, which it tells apart
class CircuitIds:
    """Actuator ids by name; valves are "<chamber>_inlet" and "<chamber>_outlet", frictions their muscle's."""

    networks: dict[str, int]
    muscles: dict[str, int]
    chambers: dict[str, int]
    valves: dict[str, int]
    frictions: dict[str, int]
    anchors: dict[str, tuple[int, int]]
    drives: dict[str, int] = field(default_factory=dict)
    volumes: dict[str, int] = field(default_factory=dict)
    stores: dict[str, int] = field(default_factory=dict)
    restrictions: dict[str, int] = field(default_factory=dict)


def add_circuit(
    spec: mujoco.MjSpec, circuit: Circuit, *, prefix: str = "", userdata: int = 0,
    default: mujoco.MjsDefault | None = None,
) -> None:  # fmt: skip
    """Add the actuators of a circuit to a model whose tendons are named like the muscles."""
    add_muscles(spec, circuit, prefix=prefix, default=default)
    add_chambers(spec, circuit, prefix=prefix, userdata=userdata, default=default)


def add_muscles(
    spec: mujoco.MjSpec, circuit: Circuit, *, prefix: str = "", default: mujoco.MjsDefault | None = None
) -> None:
    """The first half of `add_circuit`, for who has actuators to put between."""
    affine, fixed = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtGain.mjGAIN_FIXED
    spec.nuser_actuator = max(slots.N_USER, spec.nuser_actuator)
    joints = {chamber.name: chamber.joint for chamber in circuit.chambers}
    for network in circuit.networks():
        leaders = sum(len(circuit.muscles_of(name)) for name in network.chambers)
        count = len(slots.LEADER_ACT) * leaders + len(slots.ANCHOR_ACT) * len(network.anchors)
        joint = joints[network.chambers[0]]
        add_states(spec, prefix + network.name, joint, max(count, 2), default)
    for muscle in circuit.muscles:
        for tendon in muscle.tendons:
            leads = tendon == muscle.tendons[0]
            spec.add_actuator(
                default, name=prefix + tendon, trntype=mujoco.mjtTrn.mjTRN_TENDON, target=prefix + tendon,
                gaintype=affine if leads else fixed, gainprm=[0.0, 0.0, -1.0 if leads else 0.0] + [0.0] * 7,
                biastype=mujoco.mjtBias.mjBIAS_USER, userdata=BLANK,
            )  # fmt: skip


def add_chambers(
    spec: mujoco.MjSpec, circuit: Circuit, *, prefix: str = "", userdata: int = 0,
    default: mujoco.MjsDefault | None = None,
) -> None:  # fmt: skip
    """The second half: chambers, drives, valves, and what holds the states of friction."""
    spec.nuser_actuator = max(slots.N_USER, spec.nuser_actuator)
    spec.nuserdata = userdata + circuit.userdata
    joints = {chamber.name: chamber.joint for chamber in circuit.chambers}
    for chamber in circuit.driven:
        add_states(spec, f"{prefix}drive_{chamber.name}", chamber.joint, len(slots.DRIVE_ACT), default)
    for name, joint in joints.items():
        add_states(spec, f"{prefix}chamber_{name}", joint, len(slots.CHAMBER_ACT), default)
    for name, joint in joints.items():
        for side in SIDES:
            add_states(spec, f"{prefix}valve_{name}_{side}", joint, len(slots.VALVE_ACT), default)
    for muscle in circuit.muscles:
        if muscle.friction_states:
            joint = joints[muscle.chamber]
            add_states(spec, f"{prefix}friction_{muscle.name}", joint, muscle.friction_states, default)
    _add_air_path(spec, circuit, prefix, default)


def _add_air_path(
    spec: mujoco.MjSpec, circuit: Circuit, prefix: str, default: mujoco.MjsDefault | None
) -> None:
    """Volumes, stores and restrictions; those without states ask for no callback and hold numbers only."""
    if not circuit.chambers:
        return
    joint = circuit.chambers[0].joint
    for volume in circuit.volumes:
        add_states(spec, f"{prefix}volume_{volume.name}", joint, len(slots.STORE_ACT), default)
    for store in circuit.stores:
        add_states(spec, f"{prefix}store_{store.name}", joint, len(slots.STORE_ACT), default)
    for each in circuit.restrictions:
        if each.valve is not None:
            add_states(spec, f"{prefix}valve_{each.name}", joint, len(slots.VALVE_ACT), default)
            continue
        states = len(slots.RESTRICTION_ACT) if each.law in (COMPRESSOR, INERTIAL) else 0
        add_states(spec, f"{prefix}restriction_{each.name}", joint, states, default)


def add_states(
    spec: mujoco.MjSpec, name: str, joint: str, count: int, default: mujoco.MjsDefault | None = None
) -> None:
    """Add an actuator without force that holds states of the callbacks', or numbers alone."""
    user, none = mujoco.mjtDyn.mjDYN_USER, mujoco.mjtDyn.mjDYN_NONE
    spec.add_actuator(
        default, name=name, actdim=count if count else -1, userdata=BLANK, dyntype=user if count else none,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED, gainprm=[0.0] * 10, biastype=mujoco.mjtBias.mjBIAS_NONE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint,
    )  # fmt: skip


def circuit_ids(model: mujoco.MjModel, circuit: Circuit, prefix: str = "") -> CircuitIds:
    """The circuit's actuators in a compiled model, where their names begin with a prefix."""

    def found(kind: str, names: list[str]) -> dict[str, int]:
        return {name: model.actuator(prefix + kind + name).id for name in names}

    networks = circuit.networks()
    ids = found("", [network.name for network in networks])
    valves = [f"{chamber.name}_{side}" for chamber in circuit.chambers for side in SIDES]
    valves += [each.name for each in circuit.restrictions if each.valve is not None]
    return CircuitIds(
        networks=ids,
        muscles=found("", [tendon for muscle in circuit.muscles for tendon in muscle.tendons]),
        chambers=found("chamber_", [chamber.name for chamber in circuit.chambers]),
        valves=found("valve_", valves),
        frictions=found("friction_", [m.name for m in circuit.muscles if m.friction_states]),
        anchors={
            name: (ids[network.name], number)
            for network in networks
            for number, name in enumerate(network.anchors)
        },
        drives=found("drive_", [chamber.name for chamber in circuit.driven]),
        volumes=found("volume_", [each.name for each in circuit.volumes]),
        stores=found("store_", [each.name for each in circuit.stores]),
        restrictions=found("restriction_", [r.name for r in circuit.restrictions if r.valve is None]),
    )
