"""Parameters of a circuit into a compiled model, its first air, and whether its muscles pull."""

import math
from collections.abc import Callable, Mapping
from dataclasses import astuple

import mujoco
import numpy as np

from afo_sim.native import slots
from afo_sim.native.air_block import AMBIENT, SUPPLY
from afo_sim.native.air_circuit import AirNetwork, air_networks
from afo_sim.native.air_reading import write_content
from afo_sim.native.circuit import (
    AMBIENT_NAME,
    SUPPLY_NAME,
    Circuit,
    CircuitChamber,
    CircuitIds,
    CircuitMuscle,
    circuit_ids,
)
from afo_sim.native.install import assert_live, assert_rows
from afo_sim.native.rows import muscle_row, of_kind, row
from afo_sim.native.scratch_data import jacobian, scratch
from afo_sim.native.state import air_at, gas_of, read_flows, write_air, write_rest
from afo_sim.physics import INERTIAL, laminar_slope

Values = dict[str, float]  # of a row, by name


def air_rows(circuit: Circuit, ids: CircuitIds) -> tuple[dict[str, Values], dict[str, Values]]:
    """How all nodes and all valves and restrictions of a circuit are joined: values of their rows by name."""
    nodes: dict[str, Values] = {}
    edges: dict[str, Values] = {}
    for network in air_networks(circuit):
        nodes |= _nodes(circuit, ids, network)
        known = ids.valves | ids.restrictions
        following = [*(known[key] for key in [*network.edges][1:]), -1]
        at = ids.chambers | ids.volumes
        before = {number: at.get(name, -1) for name, number in network.numbers.items()}
        for (key, (origin, end)), after in zip(network.edges.items(), following, strict=True):
            joined: Values = {"origin": origin, "end": end, "following": after, "tank": -1}
            edges[key] = joined | {"before": before.get(origin, -1)}
    return nodes, edges


def _nodes(circuit: Circuit, ids: CircuitIds, network: AirNetwork) -> dict[str, Values]:
    known = ids.chambers | ids.volumes | ids.stores
    names = (*network.chambers, *network.others)
    following = [*(known[name] for name in names[1:]), -1]
    steep = _steepness(circuit, network)
    first = (ids.valves | ids.restrictions)[next(iter(network.edges))]
    return {
        name: {
            "following": after, "number": network.numbers[name],
            "first_edge": first if name == names[-1] else -1, "upstream": network.upstream,
            "leads": 1.0 if name == names[-1] else 0.0, "gas_constant": circuit.gas_constant,
            "heat_capacity_ratio": circuit.heat_capacity_ratio, "first_node": known[names[0]],
            "steepness": steep[network.numbers[name]],
        }
        for name, after in zip(names, following, strict=True)
    }  # fmt: skip


def _steepness(circuit: Circuit, network: AirNetwork) -> dict[int, float]:
    """Largest slope of all flows at each numbered node, all open; as `air_step.fastest` has it."""
    slopes = {e.name: math.inf if e.law == INERTIAL else e.steepest for e in circuit.restrictions}
    for chamber in circuit.chambers:
        for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
            row = valve.row
            slopes[f"{chamber.name}_{side}"] = laminar_slope(row["conductance"], row["critical_ratio"])
    found = dict.fromkeys((AMBIENT, *network.numbers.values()), 0.0)
    stores = {network.numbers.get(store.name) for store in circuit.stores}
    for key, ends in network.edges.items():
        fixed = {AMBIENT, SUPPLY, *stores} & {*ends}
        for node in ends:
            found[node] += (1.0 if fixed else 2.0) * slopes[key]
    if network.upstream:
        found[network.upstream] += 2.0 * found[SUPPLY]
    return found


def fill_air_path(
    model: mujoco.MjModel, circuit: Circuit, ids: CircuitIds, nodes: Mapping[str, Values],
    edges: Mapping[str, Values], data: int,
) -> None:  # fmt: skip
    """Write the rows of volumes, stores and restrictions; results stand in `userdata` from `data` on."""
    user, gamma = model.actuator_user[:, : slots.N_USER], circuit.heat_capacity_ratio
    for volume in circuit.volumes:
        user[ids.volumes[volume.name]] = row(
            slots.Kind.VOLUME, start=volume.start,
            start_as=ids.chambers[volume.start_as] if volume.start_as else -1, power=volume.volume**-gamma,
            volume=volume.volume, wall_conductance=volume.wall_conductance,
            wall_conductance_by_flow=volume.wall_conductance_by_flow, userdata=data, **nodes[volume.name],
        )  # fmt: skip
        data += len(slots.VOLUME_DATA)
    for store in circuit.stores:
        values = {**store.row, **nodes[store.name]}
        user[ids.stores[store.name]] = row(slots.Kind.STORE, content=store.content, userdata=data, **values)
        data += len(slots.VOLUME_DATA)
    numbers = {AMBIENT_NAME: AMBIENT, SUPPLY_NAME: SUPPLY}
    numbers |= {name: int(node["number"]) for name, node in nodes.items()}
    for each in circuit.restrictions:
        parameters = [float(numbers[each.pilot]), *each.parameters[1:]] if each.pilot else each.parameters
        edge = edges[each.name] | {"place": data, "law": each.law, "steepness": each.steepest}
        edge["tank"] = ids.volumes.get(each.end, -1)
        if each.valve is not None:
            values = {**each.valve, **edge}
            user[ids.valves[each.name]] = row(slots.Kind.VALVE, parameters=parameters, **values)
        else:
            values = {"conductance": each.conductance, "critical_ratio": each.critical_ratio, **edge}
            user[ids.restrictions[each.name]] = row(slots.Kind.RESTRICTION, parameters=parameters, **values)
        data += slots.EDGE_DATA


def start_air_path(model: mujoco.MjModel, data: mujoco.MjData, gauge: Mapping[int, float]) -> None:
    """Put the first air into volumes; fill stores at ambient temperature, before `model/start.py` takes."""
    rows = model.actuator_user
    for store in of_kind(model, slots.Kind.STORE):
        write_content(model, data.act, store, float(rows[store, slots.STORE_ROW.content]))
    for i in of_kind(model, slots.Kind.RESTRICTION):
        if rows[i, slots.EDGE_ROW.law] == INERTIAL:  # its air is at rest
            data.act[model.actuator_actadr[i] + slots.RESTRICTION_ACT.state] = 0.0
    for i in of_kind(model, slots.Kind.VOLUME):
        at, gas = model.actuator_actadr[i], gas_of(model, i)
        as_chamber = int(rows[i, slots.VOLUME_ROW.start_as])
        pressure = gauge[as_chamber] if as_chamber >= 0 else float(rows[i, slots.VOLUME_ROW.start])
        air = air_at(pressure, float(rows[i, slots.AIR_ROW.volume]), gas)
        data.act[at + slots.CHAMBER_ACT.mass] = air.mass
        data.act[at + slots.CHAMBER_ACT.sigma] = air.absolute_pressure * air.volume**gas.heat_capacity_ratio


LIVE_PRESSURE = 3e5  # of the state in which muscles must pull [Pa]


def fill_circuit(
    model: mujoco.MjModel, circuit: Circuit, ids: CircuitIds | None = None, *, userdata: int = 0
) -> CircuitIds:
    """Write the exact parameters of a circuit into a compiled model."""
    ids, user = ids or circuit_ids(model, circuit), _rows(model)
    chambers = {chamber.name: chamber for chamber in circuit.chambers}
    nodes, edges = air_rows(circuit, ids)
    anchors = {anchor.name: anchor for anchor in circuit.anchors}
    data = userdata
    for network in circuit.networks():
        actuator = ids.networks[network.name]
        state = int(model.actuator_actadr[actuator])
        following = [*(ids.chambers[name] for name in network.chambers[1:]), -1]
        for name, next_chamber in zip(network.chambers, following, strict=True):
            leaders = [ids.muscles[muscle.tendons[0]] for muscle in circuit.muscles_of(name)]
            _fill_chamber(model, ids, chambers[name], [*leaders, -1][0], next_chamber, data, nodes, edges)
            data += len(slots.CHAMBER_DATA)
            chain = zip(circuit.muscles_of(name), [*leaders[1:], -1], strict=False)
            for muscle, next_muscle in chain:
                _fill_muscle(model, ids, muscle, next_muscle, state, data)
                state, data = state + len(slots.LEADER_ACT), data + len(slots.LEADER_DATA)
        if len(network.anchors) > slots.MAX_ANCHORS:
            problem = f"a network has {len(network.anchors)} anchors; there is room for {slots.MAX_ANCHORS}"
            raise ValueError(problem)
        user[actuator] = row(
            slots.Kind.NETWORK,
            first_chamber=ids.chambers[network.chambers[0]],
            state=state,
            userdata=data,
            anchors=len(network.anchors),
            first_anchor=[number for name in network.anchors for number in astuple(anchors[name])[1:]],
        )
        data += len(slots.ANCHOR_DATA) * len(network.anchors)
    for chamber in circuit.driven:
        _fill_drive(model, ids, chamber, data)
        data += len(slots.DRIVE_DATA)
    fill_air_path(model, circuit, ids, nodes, edges, data)
    for muscle in circuit.muscles:
        if muscle.name in ids.frictions:
            user[ids.frictions[muscle.name]] = row(slots.Kind.FRICTION, muscle=ids.muscles[muscle.tendons[0]])
    fill_inverse_masses(model)
    return ids


def fill_inverse_masses(model: mujoco.MjModel) -> None:
    """Write J M⁻¹ Jᵀ [1/kg] of every muscle's path, at the model's own posture, into its row."""
    data = scratch(model)
    mujoco.mj_fwdPosition(model, data)
    arms, moved = jacobian(model, data), np.zeros((1, model.nv))
    for muscle in of_kind(model, slots.Kind.MUSCLE):
        mujoco.mj_solveM(model, data, moved, arms[muscle : muscle + 1])
        model.actuator_user[muscle, slots.MUSCLE_ROW.inverse_mass] = float(moved[0] @ arms[muscle])


def _fill_chamber(
    model: mujoco.MjModel, ids: CircuitIds, chamber: CircuitChamber, first_muscle: int, next_chamber: int,
    data: int, nodes: Mapping[str, Values], edges: Mapping[str, Values],
) -> None:  # fmt: skip
    """The rows of a chamber and its valves."""
    user = _rows(model)
    user[ids.chambers[chamber.name]] = row(
        slots.Kind.CHAMBER, first_muscle=first_muscle, next=next_chamber,
        inlet=ids.valves[f"{chamber.name}_inlet"], outlet=ids.valves[f"{chamber.name}_outlet"],
        volume=chamber.tube_volume, wall_conductance=chamber.wall_conductance,
        wall_conductance_by_flow=chamber.wall_conductance_by_flow, userdata=data, **nodes[chamber.name],
    )  # fmt: skip
    inlet = ids.valves[f"{chamber.name}_inlet"]
    for side, valve, place, follows in (
        ("inlet", chamber.inlet, slots.CHAMBER_DATA.inlet_flow, 0),
        ("outlet", chamber.outlet, slots.CHAMBER_DATA.outlet_flow, inlet + 1 if chamber.three_way else 0),
    ):
        key, own = f"{chamber.name}_{side}", valve.row
        slope = laminar_slope(own["conductance"], own["critical_ratio"])
        values = {**own, **edges[key], "place": data + place, "steepness": slope, "follows": follows}
        user[ids.valves[key]] = row(slots.Kind.VALVE, **values)


def _fill_drive(model: mujoco.MjModel, ids: CircuitIds, chamber: CircuitChamber, data: int) -> None:
    """The rows of a drive, and of the valves that take their coils from it."""
    user, name, drive = _rows(model), chamber.name, chamber.drive
    assert drive is not None
    user[ids.drives[name]] = row(slots.Kind.DRIVE, chamber=ids.chambers[name], userdata=data, **drive.row)
    for side, place in (("inlet", slots.DRIVE_DATA.inlet_coil), ("outlet", slots.DRIVE_DATA.outlet_coil)):
        actuator = ids.valves[f"{name}_{side}"]
        user[actuator, slots.VALVE_ROW.coil] = data + place + 1.0
        if drive.bandwidth > 0.0:
            user[actuator, slots.VALVE_ROW.bandwidth] = drive.bandwidth


def _fill_muscle(
    model: mujoco.MjModel, ids: CircuitIds, muscle: CircuitMuscle, next_muscle: int, state: int, data: int
) -> None:
    """The rows of alike muscles; the first of them leads."""
    for tendon in muscle.tendons:
        _rows(model)[ids.muscles[tendon]] = muscle_row(
            **muscle.row, series_length=muscle.series_length, cable_stiffness=muscle.cable_stiffness,
            leader=ids.muscles[muscle.tendons[0]], parallel=len(muscle.tendons),
            chamber=ids.chambers[muscle.chamber], next=next_muscle, state=state, userdata=data,
            friction_states=ids.frictions.get(muscle.name, -1), wrap_friction=muscle.wrap_friction,
        )  # fmt: skip


def fill_chambers(model: mujoco.MjModel, data: mujoco.MjData, pressure: float | Mapping[int, float]) -> None:
    """Set chambers to gauge pressures at ambient temperature, and muscles and anchors at rest with them."""
    chambers, networks = of_kind(model, slots.Kind.CHAMBER), of_kind(model, slots.Kind.NETWORK)
    gauge = {c: pressure.get(c, 0.0) if isinstance(pressure, Mapping) else pressure for c in chambers}
    for chamber in chambers:
        of_any_volume = air_at(gauge[chamber], 1e-3, gas_of(model, chamber))
        write_air(model, data.act, chamber, of_any_volume)
    start_air_path(model, data, gauge)
    _solve_at_rest(model, data, networks)
    for chamber in chambers:
        volume = float(read_flows(model, data.userdata, chamber).volume)
        write_air(model, data.act, chamber, air_at(gauge[chamber], volume, gas_of(model, chamber)))
    for network in networks:
        write_rest(model, data, network)


def volume_at_rest(model: mujoco.MjModel, data: mujoco.MjData, chamber: int) -> Callable[[float], float]:
    """The volume of a chamber with its muscles at rest [m³], by its absolute pressure [Pa]; others stay."""
    networks = of_kind(model, slots.Kind.NETWORK)
    at = model.actuator_actadr[chamber] + slots.CHAMBER_ACT.last_pressure

    def volume(pressure: float) -> float:
        data.act[at] = pressure
        _solve_at_rest(model, data, networks)
        return float(read_flows(model, data.userdata, chamber).volume)

    return volume


def _solve_at_rest(model: mujoco.MjModel, data: mujoco.MjData, networks: list[int]) -> None:
    """Own lengths at rest at the chambers' last pressures and the present posture, into `userdata`."""
    inputs = data.ctrl.copy()
    data.ctrl[networks] = 1.0
    mujoco.mj_forward(model, data)
    data.ctrl[:] = inputs


def step_back(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Give muscles, anchors and volumes the past that the present velocity implies, for a start in motion."""
    here = data.qpos.copy()
    networks = of_kind(model, slots.Kind.NETWORK)
    mujoco.mj_integratePos(model, data.qpos, data.qvel, -model.opt.timestep)
    _solve_at_rest(model, data, networks)
    data.qpos[:] = here
    for chamber in of_kind(model, slots.Kind.CHAMBER):
        last = float(read_flows(model, data.userdata, chamber).volume)
        data.act[model.actuator_actadr[chamber] + slots.CHAMBER_ACT.last_volume] = last
    for network in networks:
        write_rest(model, data, network)


def assert_muscles_pull(model: mujoco.MjModel, state: np.ndarray) -> None:
    """Refuse limp muscles: with 3 bar in every chamber each must carry its law's force."""
    assert_rows(model)
    data = scratch(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    fill_chambers(model, data, LIVE_PRESSURE)
    mujoco.mj_forward(model, data)
    assert_live(model, data, of_kind(model, slots.Kind.MUSCLE))


def muscle_rows(model: mujoco.MjModel) -> bytes:
    """Sizes of a model, and what its muscles, their air and anchors are: all that those carry at rest."""
    kinds = slots.Kind.MUSCLE, slots.Kind.CHAMBER, slots.Kind.NETWORK, slots.Kind.VOLUME, slots.Kind.STORE
    muscles, *others = (of_kind(model, kind) for kind in kinds)
    rows = model.actuator_user[muscles]
    rows[:, slots.MUSCLE_ROW.inverse_mass] = 0.0  # of whom they move, which no muscle at rest asks
    rest = model.actuator_user[[i for found in others for i in found]]
    return bytes(model._sizes.tobytes() + rows.tobytes() + rest.tobytes())


def _rows(model: mujoco.MjModel) -> np.ndarray:
    """The actuators' parameters, written in place; somebody else's may be wider (nu, slots.N_USER)."""
    return model.actuator_user[:, : slots.N_USER]
