"""Nodes of the air of a compiled model and the ways between them, read from its rows."""

from typing import NamedTuple

import mujoco
import numpy as np

from afo_sim.common.units import AMBIENT_TEMPERATURE
from afo_sim.native.air_block import AMBIENT, FIRST_NODE, SUPPLY
from afo_sim.native.members import edges_of, leaders, nodes_of
from afo_sim.native.slots import AIR_ROW, EDGE_ROW, KIND_VALVE, STORE_ACT, STORE_ROW, VALVE_ROW
from afo_sim.physics.flow_edge import PILOTED

TO_AMBIENT, TO_SUPPLY, NOWHERE = -1, -2, -3  # instead of an actuator


class Way(NamedTuple):
    """A valve or restriction.

    actuator : its own
    origin, end : actuators of the nodes, or TO_AMBIENT, TO_SUPPLY
    valve : whether a coil opens it
    law, conductance, critical_ratio, parameters : as of `FlowEdge`
    pilot : actuator of the node that keeps a quick exhaust shut, or NOWHERE
    upstream : actuator of what the supply draws from, or NOWHERE
    """

    actuator: int
    origin: int
    end: int
    valve: bool
    law: int
    conductance: float
    critical_ratio: float
    parameters: tuple[float, float, float, float]
    pilot: int = NOWHERE
    upstream: int = NOWHERE


def ways_of(model: mujoco.MjModel) -> list[Way]:
    """All valves and restrictions of a model."""
    rows = model.actuator_user
    found = []
    for leader in leaders(model):
        nodes = {AMBIENT: TO_AMBIENT, SUPPLY: TO_SUPPLY}
        nodes |= dict(enumerate(nodes_of(model, leader), FIRST_NODE))
        number = int(rows[leader, AIR_ROW.upstream])
        upstream = nodes[number] if number else NOWHERE
        for edge in edges_of(model, leader):
            row = rows[edge]
            law, first = int(row[EDGE_ROW.law]), float(row[EDGE_ROW.parameters])
            found.append(
                Way(
                    edge,
                    nodes[int(row[EDGE_ROW.origin])],
                    nodes[int(row[EDGE_ROW.end])],
                    bool(row[1] == KIND_VALVE),
                    law,
                    float(row[VALVE_ROW.conductance]),
                    float(row[VALVE_ROW.critical_ratio]),
                    (first, *map(float, row[EDGE_ROW.parameters + 1 : EDGE_ROW.parameters + 4])),  # type: ignore[arg-type]
                    nodes[int(first)] if law in PILOTED else NOWHERE,
                    upstream,
                )
            )
    return found


def wall_of(model: mujoco.MjModel, node: int) -> float:
    """Heat conductance to the wall of the actuator of a chamber or volume [W/K]."""
    return float(model.actuator_user[node, AIR_ROW.wall_conductance])


def store_left(model: mujoco.MjModel, act: np.ndarray, store: int) -> float:
    """Share of its first content that is left in a store's actuator [-], from `act` (na,)."""
    left = act[model.actuator_actadr[store] + STORE_ACT.mass] / model.actuator_user[store, STORE_ROW.content]
    return float(left)


def fill_store(model: mujoco.MjModel, act: np.ndarray, store: int) -> None:
    """Fill the actuator of a store, at ambient temperature, in `act` (na,)."""
    at = model.actuator_actadr[store]
    act[at + STORE_ACT.mass] = model.actuator_user[store, STORE_ROW.content]
    act[at + STORE_ACT.temperature] = AMBIENT_TEMPERATURE


def read_content(model: mujoco.MjModel, act: np.ndarray, store: int) -> np.ndarray:
    """Mass of gas and liquid in the actuator of a store [kg], from `act` (…, na)."""
    content: np.ndarray = act[..., model.actuator_actadr[store] + STORE_ACT.mass]
    return content


def write_content(model: mujoco.MjModel, act: np.ndarray, store: int, content: float) -> None:
    """Set what is in the actuator of a store [kg] in `act` (na,), gas and liquid at ambient temperature."""
    at = model.actuator_actadr[store]
    act[at + STORE_ACT.mass], act[at + STORE_ACT.temperature] = content, AMBIENT_TEMPERATURE
