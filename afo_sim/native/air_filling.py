"""Rows of what holds and restricts air beside the chambers, and the air that it begins with."""

from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim.common.units import AMBIENT_TEMPERATURE
from afo_sim.native.air_block import AMBIENT, SUPPLY
from afo_sim.native.air_circuit import AMBIENT_NAME, SUPPLY_NAME, AirNetwork, air_networks
from afo_sim.native.circuit import Circuit, CircuitIds
from afo_sim.native.slots import (
    AIR_ROW,
    CHAMBER_ACT,
    EDGE_DATA,
    KIND_RESTRICTION,
    KIND_STORE,
    KIND_VALVE,
    KIND_VOLUME,
    MARK,
    N_USER,
    STORE_ACT,
    STORE_ROW,
    VOLUME_DATA,
    VOLUME_ROW,
    row,
)
from afo_sim.native.state import air_at, gas_of
from afo_sim.physics.pneumatics import laminar_slope

Values = dict[str, float]  # of a row, by name


def air_rows(circuit: Circuit, ids: CircuitIds) -> tuple[dict[str, Values], dict[str, Values]]:
    """How all nodes and all valves and restrictions of a circuit are joined: values of their rows by name."""
    nodes: dict[str, Values] = {}
    edges: dict[str, Values] = {}
    for network in air_networks(circuit):
        nodes |= _nodes(circuit, ids, network)
        known = ids.valves | ids.restrictions
        following = [*(known[key] for key in [*network.edges][1:]), -1]
        edges |= {
            key: {"origin": origin, "end": end, "following": after, "tank": -1}
            for (key, (origin, end)), after in zip(network.edges.items(), following, strict=True)
        }
    return nodes, edges


def _nodes(circuit: Circuit, ids: CircuitIds, network: AirNetwork) -> dict[str, Values]:
    known = ids.chambers | ids.volumes | ids.stores
    names = (*network.chambers, *network.others)
    following = [*(known[name] for name in names[1:]), -1]
    steep = _steepness(circuit, network)
    first = (ids.valves | ids.restrictions)[next(iter(network.edges))]
    return {
        name: {
            "following": after,
            "number": network.numbers[name],
            "first_edge": first if name == names[-1] else -1,
            "upstream": network.upstream,
            "leads": 1.0 if name == names[-1] else 0.0,
            "gas_constant": circuit.gas_constant,
            "heat_capacity_ratio": circuit.heat_capacity_ratio,
            "first_node": known[names[0]],
            "steepness": steep[network.numbers[name]],
        }
        for name, after in zip(names, following, strict=True)
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
    for key, ends in network.edges.items():
        fixed = {AMBIENT, SUPPLY, *stores} & {*ends}
        for node in ends:
            found[node] += (1.0 if fixed else 2.0) * slopes[key]
    if network.upstream:
        found[network.upstream] += 2.0 * found[SUPPLY]
    return found


def fill_air_path(
    model: mujoco.MjModel,
    circuit: Circuit,
    ids: CircuitIds,
    nodes: Mapping[str, Values],
    edges: Mapping[str, Values],
    data: int,
) -> None:
    """Write the rows of volumes, stores and restrictions; results stand in `userdata` from `data` on."""
    user, gamma = model.actuator_user[:, :N_USER], circuit.heat_capacity_ratio
    for volume in circuit.volumes:
        user[ids.volumes[volume.name]] = row(
            KIND_VOLUME,
            start=volume.start,
            start_as=ids.chambers[volume.start_as] if volume.start_as else -1,
            power=volume.volume**-gamma,
            power_rate=volume.volume ** (gamma - 1.0),
            volume=volume.volume,
            wall_conductance=volume.wall_conductance,
            userdata=data,
            **nodes[volume.name],
        )
        data += len(VOLUME_DATA)
    for store in circuit.stores:
        values = {**store.row, **nodes[store.name]}
        user[ids.stores[store.name]] = row(KIND_STORE, content=store.content, userdata=data, **values)
        data += len(VOLUME_DATA)
    numbers = {AMBIENT_NAME: AMBIENT, SUPPLY_NAME: SUPPLY}
    numbers |= {name: int(node["number"]) for name, node in nodes.items()}
    for each in circuit.restrictions:
        parameters = [float(numbers[each.pilot]), *each.parameters[1:]] if each.pilot else each.parameters
        edge = edges[each.name] | {"place": data, "law": each.law, "steepness": each.steepest}
        edge["tank"] = ids.volumes.get(each.end, -1)
        if each.valve is not None:
            values = {**each.valve, **edge}
            user[ids.valves[each.name]] = row(KIND_VALVE, parameters=parameters, **values)
        else:
            values = {"conductance": each.conductance, "critical_ratio": each.critical_ratio, **edge}
            user[ids.restrictions[each.name]] = row(KIND_RESTRICTION, parameters=parameters, **values)
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
            data.act[at + STORE_ACT.mass], data.act[at + STORE_ACT.temperature] = (
                rows[i, STORE_ROW.content],
                AMBIENT_TEMPERATURE,
            )
            continue
        as_chamber, gas = int(rows[i, VOLUME_ROW.start_as]), gas_of(model, int(i))
        pressure = gauge[as_chamber] if as_chamber >= 0 else float(rows[i, VOLUME_ROW.start])
        air = air_at(pressure, float(rows[i, AIR_ROW.volume]), gas)
        data.act[at + CHAMBER_ACT.mass] = air.mass
        data.act[at + CHAMBER_ACT.sigma] = air.absolute_pressure * air.volume**gas.heat_capacity_ratio
