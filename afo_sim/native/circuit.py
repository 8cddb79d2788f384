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
    N_USER,
    chamber_row,
    friction_row,
    muscle_row,
    valve_row,
)
from afo_sim.native.state import (
    CHAMBER_STATES,
    FLOWS_PER_CHAMBER,
    VALVE_STATES,
    Air,
    air_at,
    read_flows,
    write_air,
)
from afo_sim.physics.friction import FRICTIONS

SIDES = ("inlet", "outlet")
BLANK = [0.0] * N_USER
LIVE_PRESSURE, LIVE_VELOCITY = 3e5, 0.1  # of the state in which muscles must pull [Pa], [rad/s or m/s]
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
class CircuitMuscle:
    """A muscle on the tendon of its name.

    row : the muscle's own parameters, as `muscle_row` takes them
    series_length : all of the tendon that does not contract [m]
    chamber : name of the chamber that fills it
    implicit_count : parallel muscles whose damping's derivative this one's gain carries; 0 for none
    """

    name: str
    row: Mapping[str, Any]
    series_length: float
    chamber: str
    implicit_count: int = 1

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
    """Muscles and chambers, in the order of their actuators."""

    muscles: tuple[CircuitMuscle, ...]
    chambers: tuple[CircuitChamber, ...]


@dataclass(frozen=True)
class CircuitIds:
    """Actuator ids by name; valves are "<chamber>_inlet" and "<chamber>_outlet", frictions their muscle's."""

    muscles: dict[str, int]
    chambers: dict[str, int]
    valves: dict[str, int]
    frictions: dict[str, int]


def add_circuit(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """Add the actuators of a circuit to a model whose tendons are named like the muscles."""
    add_muscles(spec, circuit)
    add_chambers(spec, circuit)


def add_muscles(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """The first half of `add_circuit`, for who has actuators to put between."""
    affine, fixed = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtGain.mjGAIN_FIXED
    spec.nuser_actuator = N_USER
    for muscle in circuit.muscles:
        carries = muscle.implicit_count > 0
        spec.add_actuator(
            name=muscle.name,
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target=muscle.name,
            gaintype=affine if carries else fixed,
            gainprm=[0.0, 0.0, -1.0 if carries else 0.0] + [0.0] * 7,
            biastype=mujoco.mjtBias.mjBIAS_USER,
            userdata=BLANK,
        )


def add_chambers(spec: mujoco.MjSpec, circuit: Circuit) -> None:
    """The second half: chambers, valves, and what holds the states of friction."""
    spec.nuser_actuator = N_USER
    spec.nuserdata = FLOWS_PER_CHAMBER * len(circuit.chambers)
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

    return CircuitIds(
        muscles=found("", [muscle.name for muscle in circuit.muscles]),
        chambers=found("chamber_", [chamber.name for chamber in circuit.chambers]),
        valves=found("valve_", [f"{chamber.name}_{side}" for chamber in circuit.chambers for side in SIDES]),
        frictions=found("friction_", [m.name for m in circuit.muscles if m.friction_states]),
    )


def fill_circuit(model: mujoco.MjModel, circuit: Circuit) -> CircuitIds:
    """Write the exact parameters of a circuit into a compiled model."""
    ids, user = circuit_ids(model, circuit), model.actuator_user
    for number, chamber in enumerate(circuit.chambers):
        members = [muscle for muscle in circuit.muscles if muscle.chamber == chamber.name]
        chain = [*(ids.muscles[muscle.name] for muscle in members), -1]
        user[ids.chambers[chamber.name]] = chamber_row(
            first_muscle=chain[0],
            inlet=ids.valves[f"{chamber.name}_inlet"],
            outlet=ids.valves[f"{chamber.name}_outlet"],
            tube_volume=chamber.tube_volume,
            wall_conductance=chamber.wall_conductance,
            userdata=FLOWS_PER_CHAMBER * number,
        )
        for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
            user[ids.valves[f"{chamber.name}_{side}"]] = valve_row(**valve.row)
        for muscle, following in zip(members, chain[1:], strict=True):
            user[ids.muscles[muscle.name]] = muscle_row(
                **muscle.row,
                series_length=muscle.series_length,
                chamber=ids.chambers[chamber.name],
                next_muscle=following,
                implicit_count=muscle.implicit_count,
                friction_states=ids.frictions.get(muscle.name, -1),
            )
    for name, holder in ids.frictions.items():
        user[holder] = friction_row(muscle=ids.muscles[name])
    return ids


def fill_chambers(model: mujoco.MjModel, data: mujoco.MjData, pressure: float | Mapping[int, float]) -> None:
    """Set the chambers to gauge pressures at ambient temperature, at the present posture.

    The callbacks must be installed: they tell the volumes.

    Parameters
    ----------
    model, data : with this project's actuators
    pressure : of all chambers, or by actuator id, the others at ambient pressure [Pa]
    """
    chambers = list(_of_kind(model, KIND_CHAMBER))
    for chamber in chambers:  # any positive air will do
        write_air(model, data.act, chamber, Air(1.0, 1.0, 1.0))
    mujoco.mj_forward(model, data)
    for chamber in chambers:
        volume = float(read_flows(model, data.userdata, chamber).volume)
        gauge = pressure.get(chamber, 0.0) if isinstance(pressure, Mapping) else pressure
        write_air(model, data.act, chamber, air_at(gauge, volume))


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
    data.qvel[:] = LIVE_VELOCITY
    mujoco.mj_forward(model, data)
    assert_live(model, data, list(_of_kind(model, KIND_MUSCLE)))


def _of_kind(model: mujoco.MjModel, kind: float) -> Iterator[int]:
    """Ids of the actuators of one kind."""
    return (i for i in range(model.nu) if model.actuator_user[i, 1] == kind)
