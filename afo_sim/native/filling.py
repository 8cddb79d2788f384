"""Parameters of a circuit into a compiled model, its first air, and whether its muscles pull."""

from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from afo_sim.native.air_filling import AirPlaces, fill_air_path, start_air_path
from afo_sim.native.circuit import Circuit, CircuitChamber, CircuitIds, CircuitMuscle, circuit_ids
from afo_sim.native.install import assert_live, assert_rows
from afo_sim.native.scratch import scratch
from afo_sim.native.slots import (
    KIND_CHAMBER,
    KIND_MUSCLE,
    KIND_NETWORK,
    MARK,
    MUSCLE_INVERSE_MASS,
    N_USER,
    VALVE_BANDWIDTH,
    VALVE_COIL,
    chamber_row,
    drive_row,
    friction_row,
    muscle_row,
    network_row,
    valve_row,
)
from afo_sim.native.state import (
    ANCHOR_DATA,
    CHAMBER_DATA,
    DRIVE_DATA,
    INLET_COIL,
    INLET_FLOW,
    LAST_VOLUME,
    LEADER_DATA,
    LEADER_STATES,
    OUTLET_COIL,
    OUTLET_FLOW,
    air_at,
    gas_of,
    read_flows,
    write_air,
    write_rest,
)
from afo_sim.physics.pneumatics import laminar_slope

LIVE_PRESSURE = 3e5  # of the state in which muscles must pull [Pa]


def fill_circuit(
    model: mujoco.MjModel, circuit: Circuit, ids: CircuitIds | None = None, *, userdata: int = 0
) -> CircuitIds:
    """Write the exact parameters of a circuit into a compiled model."""
    ids, user = ids or circuit_ids(model, circuit), _rows(model)
    chambers = {chamber.name: chamber for chamber in circuit.chambers}
    slots = AirPlaces.of(circuit, ids)
    anchors = {anchor.name: anchor for anchor in circuit.anchors}
    data = userdata
    for network in circuit.networks():
        actuator = ids.networks[network.name]
        state = int(model.actuator_actadr[actuator])
        following = [*(ids.chambers[name] for name in network.chambers[1:]), -1]
        for name, next_chamber in zip(network.chambers, following, strict=True):
            leaders = [ids.muscles[muscle.tendons[0]] for muscle in circuit.muscles_of(name)]
            _fill_chamber(model, ids, chambers[name], [*leaders, -1][0], next_chamber, data, slots)
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
    for chamber in circuit.driven:
        _fill_drive(model, ids, chamber, data)
        data += DRIVE_DATA
    fill_air_path(model, circuit, ids, slots, data)
    for muscle in circuit.muscles:
        if muscle.name in ids.frictions:
            user[ids.frictions[muscle.name]] = friction_row(muscle=ids.muscles[muscle.tendons[0]])
    fill_inverse_masses(model)
    return ids


def fill_inverse_masses(model: mujoco.MjModel) -> None:
    """Write J M⁻¹ Jᵀ [1/kg] of every muscle's path, at the model's own posture, into its row.

    To be called again where masses change: it tells how stiff a taut muscle is beside what it moves.
    """
    data = scratch(model)
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
    slots: AirPlaces,
) -> None:
    """The rows of a chamber and its valves."""
    user = _rows(model)
    user[ids.chambers[chamber.name]] = chamber_row(
        first_muscle=first_muscle,
        next_chamber=next_chamber,
        inlet=ids.valves[f"{chamber.name}_inlet"],
        outlet=ids.valves[f"{chamber.name}_outlet"],
        tube_volume=chamber.tube_volume,
        wall_conductance=chamber.wall_conductance,
        userdata=data,
        air=slots.nodes[chamber.name],
    )
    sides = (("inlet", chamber.inlet, INLET_FLOW), ("outlet", chamber.outlet, OUTLET_FLOW))
    for side, valve, place in sides:
        key = f"{chamber.name}_{side}"
        row = dict(valve.row)
        slope = laminar_slope(row["conductance"], row["critical_ratio"])
        follows = ids.valves[f"{chamber.name}_inlet"] + 1 if chamber.three_way and side == "outlet" else 0
        edge = slots.edges[key]._replace(place=data + place, steepness=slope, follows=follows)
        user[ids.valves[key]] = valve_row(**row, edge=edge)


def _fill_drive(model: mujoco.MjModel, ids: CircuitIds, chamber: CircuitChamber, data: int) -> None:
    """The rows of a drive, and of the valves that take their coils from it."""
    user, name, drive = _rows(model), chamber.name, chamber.drive
    assert drive is not None
    user[ids.drives[name]] = drive_row(**drive.row, chamber=ids.chambers[name], userdata=data)
    for side, place in (("inlet", INLET_COIL), ("outlet", OUTLET_COIL)):
        actuator = ids.valves[f"{name}_{side}"]
        user[actuator, VALVE_COIL] = data + place + 1.0
        if drive.bandwidth > 0.0:
            user[actuator, VALVE_BANDWIDTH] = drive.bandwidth


def _fill_muscle(
    model: mujoco.MjModel, ids: CircuitIds, muscle: CircuitMuscle, next_muscle: int, state: int, data: int
) -> None:
    """The rows of alike muscles; the first of them leads."""
    for tendon in muscle.tendons:
        _rows(model)[ids.muscles[tendon]] = muscle_row(
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
            wrap_friction=muscle.wrap_friction,
        )


def fill_chambers(model: mujoco.MjModel, data: mujoco.MjData, pressure: float | Mapping[int, float]) -> None:
    """Set chambers to gauge pressures at ambient temperature, and muscles and anchors at rest with them.

    The callbacks must be installed: they solve the muscles' own lengths at the present posture.

    Units: pressure [Pa].
    """
    chambers, networks = list(_of_kind(model, KIND_CHAMBER)), list(_of_kind(model, KIND_NETWORK))
    gauge = {c: pressure.get(c, 0.0) if isinstance(pressure, Mapping) else pressure for c in chambers}
    for chamber in chambers:
        write_air(
            model, data.act, chamber, air_at(gauge[chamber], 1e-3, gas_of(model, chamber))
        )  # of any volume
    start_air_path(model, data, gauge)
    _solve_at_rest(model, data, networks)
    for chamber in chambers:
        volume = float(read_flows(model, data.userdata, chamber).volume)
        write_air(model, data.act, chamber, air_at(gauge[chamber], volume, gas_of(model, chamber)))
    for network in networks:
        write_rest(model, data, network)


def _solve_at_rest(model: mujoco.MjModel, data: mujoco.MjData, networks: list[int]) -> None:
    """Own lengths at rest at the chambers' last pressures and the present posture, into `userdata`."""
    inputs = data.ctrl.copy()
    data.ctrl[networks] = 1.0
    mujoco.mj_forward(model, data)
    data.ctrl[:] = inputs


def step_back(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Give muscles, anchors and volumes the past that the present velocity implies, for a start in motion.

    Without it they would be taken to have stood still, and the first steps would be of first order.
    """
    here = data.qpos.copy()
    networks = list(_of_kind(model, KIND_NETWORK))
    mujoco.mj_integratePos(model, data.qpos, data.qvel, -model.opt.timestep)
    _solve_at_rest(model, data, networks)
    data.qpos[:] = here
    for chamber in _of_kind(model, KIND_CHAMBER):
        last = float(read_flows(model, data.userdata, chamber).volume)
        data.act[model.actuator_actadr[chamber] + LAST_VOLUME] = last
    for network in networks:
        write_rest(model, data, network)


def assert_muscles_pull(model: mujoco.MjModel, state: np.ndarray) -> None:
    """Refuse limp muscles: with 3 bar in every chamber each must carry its law's force."""
    assert_rows(model)
    data = scratch(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    fill_chambers(model, data, LIVE_PRESSURE)
    mujoco.mj_forward(model, data)
    assert_live(model, data, list(_of_kind(model, KIND_MUSCLE)))


def _rows(model: mujoco.MjModel) -> np.ndarray:
    """The actuators' parameters, written in place; somebody else's may be wider (nu, N_USER)."""
    return model.actuator_user[:, :N_USER]


def _of_kind(model: mujoco.MjModel, kind: float) -> Iterator[int]:
    """Ids of this project's actuators of one kind."""
    user = model.actuator_user
    return (i for i in range(model.nu) if user[i, 0] == MARK and user[i, 1] == kind)
