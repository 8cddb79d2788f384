"""Rows of what holds and restricts air beside the chambers, and the air that it begins with."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim.common.units import AMBIENT_TEMPERATURE
from afo_sim.native.air_block import AMBIENT, SUPPLY
from afo_sim.native.air_circuit import AMBIENT_NAME, SUPPLY_NAME, AirNetwork, air_networks
from afo_sim.native.circuit import Circuit, CircuitIds
from afo_sim.native.slots import (
    CHAMBER_TUBE_VOLUME,
    KIND_STORE,
    KIND_VOLUME,
    MARK,
    N_USER,
    STORE_CONTENT,
    VOLUME_START,
    VOLUME_START_AS,
    AirSlots,
    EdgeSlots,
    restriction_row,
    store_row,
    valve_row,
    volume_row,
)
from afo_sim.native.state import (
    AIR_MASS,
    EDGE_DATA,
    SIGMA,
    STORE_MASS,
    STORE_TEMPERATURE,
    VOLUME_DATA,
    air_at,
    gas_of,
)
from afo_sim.physics.pneumatics import laminar_slope


@dataclass(frozen=True)
class AirPlaces:
    """Slots of all nodes and restrictions of a circuit by name: how they hang together."""

    nodes: Mapping[str, AirSlots]
    edges: Mapping[str, EdgeSlots]

    @classmethod
    def of(cls, circuit: Circuit, ids: CircuitIds) -> "AirPlaces":
        """The slots of a circuit, whose actuators are known."""
        nodes: dict[str, AirSlots] = {}
        edges: dict[str, EdgeSlots] = {}
        for network in air_networks(circuit):
            nodes |= _nodes(circuit, ids, network)
            edges |= _edges(ids, network)
        return cls(nodes, edges)


def _nodes(circuit: Circuit, ids: CircuitIds, network: AirNetwork) -> dict[str, AirSlots]:
    known = ids.chambers | ids.volumes | ids.stores
    names = (*network.chambers, *network.others)
    following = [*(known[name] for name in names[1:]), -1]
    steep = _steepness(circuit, network)
    first = (ids.valves | ids.restrictions)[network.edges[0].key]
    return {
        name: AirSlots(
            after,
            network.numbers[name],
            first if name == names[-1] else -1,
            network.upstream,
            1.0 if name == names[-1] else 0.0,
            circuit.gas_constant,
            circuit.heat_capacity_ratio,
            known[names[0]],
            steep[network.numbers[name]],
        )
        for k, (name, after) in enumerate(zip(names, following, strict=True))
    }


def _steepness(circuit: Circuit, network: AirNetwork) -> dict[int, float]:
    """Largest slope of all flows at each numbered node, all open; as `air_step.fastest` has it."""
    slopes = {each.name: each.steepest for each in circuit.restrictions}
    for chamber in circuit.chambers:
        for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
            row = valve.row
            slopes[f"{chamber.name}_{side}"] = laminar_slope(row["conductance"], row["critical_ratio"])
    found = dict.fromkeys((AMBIENT, *network.numbers.values()), 0.0)
    stores = {network.numbers.get(store.name) for store in circuit.stores}
    for edge in network.edges:
        fixed = {AMBIENT, SUPPLY, *stores} & {edge.origin, edge.end}
        for node in (edge.origin, edge.end):
            found[node] += (1.0 if fixed else 2.0) * slopes[edge.key]
    if network.upstream:
        found[network.upstream] += 2.0 * found[SUPPLY]
    return found


def _edges(ids: CircuitIds, network: AirNetwork) -> dict[str, EdgeSlots]:
    known = ids.valves | ids.restrictions
    following = [*(known[edge.key] for edge in network.edges[1:]), -1]
    return {
        edge.key: EdgeSlots(edge.origin, edge.end, after)
        for edge, after in zip(network.edges, following, strict=True)
    }


def fill_air_path(
    model: mujoco.MjModel, circuit: Circuit, ids: CircuitIds, slots: AirPlaces, data: int
) -> None:
    """Write the rows of volumes, stores and restrictions."""
    user = model.actuator_user[:, :N_USER]
    for volume in circuit.volumes:
        user[ids.volumes[volume.name]] = volume_row(
            volume=volume.volume,
            wall_conductance=volume.wall_conductance,
            userdata=data,
            start=volume.start,
            start_as=ids.chambers[volume.start_as] if volume.start_as else -1,
            air=slots.nodes[volume.name],
        )
        data += VOLUME_DATA
    for store in circuit.stores:
        user[ids.stores[store.name]] = store_row(
            **store.row, content=store.content, userdata=data, air=slots.nodes[store.name]
        )
        data += VOLUME_DATA
    numbers = {AMBIENT_NAME: AMBIENT, SUPPLY_NAME: SUPPLY}
    numbers |= {name: node.number for name, node in slots.nodes.items()}
    for each in circuit.restrictions:
        parameters = list(each.parameters)
        if each.pilot:
            parameters[0] = float(numbers[each.pilot])
        first, second, third, fourth = (parameters + [0.0] * 4)[:4]
        edge = slots.edges[each.name]._replace(
            place=data,
            law=each.law,
            steepness=each.steepest,
            first=first,
            second=second,
            third=third,
            fourth=fourth,
            tank=ids.volumes.get(each.end, -1),
        )
        if each.valve is not None:
            user[ids.valves[each.name]] = valve_row(**each.valve, edge=edge)
        else:
            user[ids.restrictions[each.name]] = restriction_row(
                conductance=each.conductance, critical_ratio=each.critical_ratio, edge=edge
            )
        data += EDGE_DATA


def start_air_path(model: mujoco.MjModel, data: mujoco.MjData, gauge: Mapping[int, float]) -> None:
    """Put the first air into volumes; fill stores at ambient temperature, before `model/start.py` takes.

    Units: gauge [Pa].
    """
    rows = model.actuator_user
    if rows.shape[1] < N_USER:  # none of this project's
        return
    for i in np.flatnonzero((rows[:, 0] == MARK) & np.isin(rows[:, 1], (KIND_VOLUME, KIND_STORE))):
        at = model.actuator_actadr[i]
        if rows[i, 1] == KIND_STORE:
            data.act[at + STORE_MASS], data.act[at + STORE_TEMPERATURE] = (
                rows[i, STORE_CONTENT],
                AMBIENT_TEMPERATURE,
            )
            continue
        as_chamber, gas = int(rows[i, VOLUME_START_AS]), gas_of(model, int(i))
        pressure = gauge[as_chamber] if as_chamber >= 0 else float(rows[i, VOLUME_START])
        air = air_at(pressure, float(rows[i, CHAMBER_TUBE_VOLUME]), gas)
        data.act[at + AIR_MASS] = air.mass
        data.act[at + SIGMA] = air.absolute_pressure * air.volume**gas.heat_capacity_ratio
