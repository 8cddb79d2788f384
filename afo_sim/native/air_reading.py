"""Nodes and edges of the air of a compiled model, read from its rows: networks, ways, ends, contents."""

from typing import NamedTuple

import mujoco
import numpy as np

from afo_sim.common import AMBIENT_TEMPERATURE
from afo_sim.native import slots
from afo_sim.native.air_block import AMBIENT, FIRST_NODE, SUPPLY
from afo_sim.native.state import Air, chain, read_air, read_volume, room_of
from afo_sim.physics import COMPRESSOR, PILOTED

_AIR = (slots.Kind.CHAMBER, slots.Kind.VOLUME, slots.Kind.STORE)
TO_AMBIENT, TO_SUPPLY, NOWHERE = -1, -2, -3  # instead of an actuator


class Way(NamedTuple):
    """A valve or restriction, its law and numbers as of `FlowEdge`; nodes by their actuators."""

    actuator: int
    origin: int  # or TO_AMBIENT, TO_SUPPLY
    end: int  # the same
    valve: bool  # whether a coil opens it
    law: int
    conductance: float
    critical_ratio: float
    parameters: tuple[float, float, float, float]
    pilot: int = NOWHERE  # node that keeps a quick exhaust shut
    upstream: int = NOWHERE  # what the supply draws from


def ways_of(model: mujoco.MjModel) -> list[Way]:
    """All valves and restrictions of a model."""
    # without what only muscles have, and as Python's numbers, which are read faster
    rows = model.actuator_user[:, : slots.EDGE_ROW.tank + 1].tolist()
    found, flow = [], slots.EDGE_ROW
    for leader, own in enumerate(rows):
        if own[slots.KIND] not in _AIR or not own[slots.AIR_ROW.leads] > 0.0:
            continue
        nodes = {AMBIENT: TO_AMBIENT, SUPPLY: TO_SUPPLY}
        joined = chain(rows, leader, slots.AIR_ROW.first_node, slots.AIR_ROW.following)
        nodes |= dict(enumerate(joined, FIRST_NODE))
        number = int(own[slots.AIR_ROW.upstream])
        upstream = nodes[number] if number else NOWHERE
        for edge in chain(rows, leader, slots.AIR_ROW.first_edge, flow.following):
            row = rows[edge]
            ends = nodes[int(row[flow.origin])], nodes[int(row[flow.end])]
            law, numbers = int(row[flow.law]), tuple(row[flow.parameters : flow.tank])
            opens = row[slots.VALVE_ROW.conductance], row[slots.VALVE_ROW.critical_ratio]
            pilot = nodes[int(numbers[0])] if law in PILOTED else NOWHERE
            valve = row[slots.KIND] == slots.Kind.VALVE
            found.append(Way(edge, *ends, valve, law, *opens, numbers, pilot, upstream))
    return found


def read_content(model: mujoco.MjModel, act: np.ndarray, store: int) -> np.ndarray:
    """Mass of gas and liquid in the actuator of a store [kg], from `act` (…, na)."""
    return np.asarray(act[..., model.actuator_actadr[store] + slots.STORE_ACT.mass])


def write_content(model: mujoco.MjModel, act: np.ndarray, store: int, content: float) -> None:
    """Set what is in the actuator of a store [kg] in `act` (na,), gas and liquid at ambient temperature."""
    at = model.actuator_actadr[store]
    act[at + slots.STORE_ACT.mass], act[at + slots.STORE_ACT.temperature] = content, AMBIENT_TEMPERATURE


def touching(model: mujoco.MjModel, node: int) -> list[tuple[int, float]]:
    """Valves and restrictions at a node's actuator, each with the sign of a flow into it."""
    return [(end.edge, end.sign) for end in _ends(model, node, -1.0)]


class AirEnd(NamedTuple):
    """A valve or restriction at the supply or the ambient air."""

    edge: int  # its actuator
    sign: float  # of its flow out of the supply, or into the ambient air
    node: int  # actuator of the node on its other side; −1 where that is one of the two as well


def ends_at_supply(model: mujoco.MjModel) -> list[AirEnd]:
    """What draws on a supply's set pressure, in all networks of a model."""
    return _ends(model, TO_SUPPLY, 1.0)


def ends_at_ambient(model: mujoco.MjModel) -> list[AirEnd]:
    """What vents into the ambient air; a compressor, which takes from it, is not among it."""
    return [end for end in _ends(model, TO_AMBIENT, -1.0) if not is_compressor(model, end.edge)]


def is_compressor(model: mujoco.MjModel, edge: int) -> bool:
    """Whether the actuator of a restriction is a compressor."""
    return bool(model.actuator_user[edge, slots.EDGE_ROW.law] == COMPRESSOR)


def read_running(model: mujoco.MjModel, act: np.ndarray, compressor: int) -> np.ndarray:
    """Whether the compressor of an actuator runs, 1 or 0, from `act` (…, na)."""
    return np.asarray(act[..., model.actuator_actadr[compressor] + slots.RESTRICTION_ACT.state])


def read_node(model: mujoco.MjModel, act: np.ndarray, userdata: np.ndarray, node: int) -> Air:
    """What is in the actuator of a chamber, a volume or a store, from `act` (…, na) and `userdata`."""
    if model.actuator_user[node, slots.KIND] == slots.Kind.CHAMBER:
        return read_air(model, act, userdata, node)
    mass = act[..., model.actuator_actadr[node]]  # the first state of each
    volume = np.full_like(mass, room_of(model, node))
    return Air(mass, volume, read_volume(model, userdata, node))


def _ends(model: mujoco.MjModel, given: int, outward: float) -> list[AirEnd]:
    return [
        AirEnd(way.actuator, sign, max(other, -1))
        for way in ways_of(model)
        for end, other, sign in ((way.origin, way.end, outward), (way.end, way.origin, -outward))
        if end == given
    ]
