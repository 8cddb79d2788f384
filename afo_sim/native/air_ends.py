"""Valves and restrictions at the two nodes whose pressures are given: the supply and the ambient air."""

from typing import NamedTuple

import mujoco
import numpy as np

from afo_sim.native.air_block import AMBIENT, FIRST_NODE, SUPPLY
from afo_sim.native.members import edges_of, leaders, nodes_of
from afo_sim.native.slots import COMPRESSOR_ACT, EDGE_ROW, KIND_CHAMBER
from afo_sim.native.state import Air, read_air, read_volume, room_of
from afo_sim.physics.flow_edge import COMPRESSOR


class AirEnd(NamedTuple):
    """A valve or restriction at the supply or the ambient air.

    edge : its actuator
    sign : of its flow out of the supply, or into the ambient air
    node : actuator of the node on its other side; −1 where that is one of the two as well
    """

    edge: int
    sign: float
    node: int


def ends_at_supply(model: mujoco.MjModel) -> list[AirEnd]:
    """What draws on a supply's set pressure, in all networks of a model."""
    return _ends(model, SUPPLY, 1.0)


def ends_at_ambient(model: mujoco.MjModel) -> list[AirEnd]:
    """What vents into the ambient air; a compressor, which takes from it, is not among it."""
    return [end for end in _ends(model, AMBIENT, -1.0) if not is_compressor(model, end.edge)]


def is_compressor(model: mujoco.MjModel, edge: int) -> bool:
    """Whether the actuator of a restriction is a compressor."""
    return bool(model.actuator_user[edge, EDGE_ROW.law] == COMPRESSOR)


def read_running(model: mujoco.MjModel, act: np.ndarray, compressor: int) -> np.ndarray:
    """Whether the compressor of an actuator runs, 1 or 0, from `act` (…, na)."""
    running: np.ndarray = act[..., model.actuator_actadr[compressor] + COMPRESSOR_ACT.running]
    return running


def read_node(model: mujoco.MjModel, act: np.ndarray, userdata: np.ndarray, node: int) -> Air:
    """What is in the actuator of a chamber, a volume or a store, from `act` (…, na) and `userdata`."""
    if model.actuator_user[node, 1] == KIND_CHAMBER:
        return read_air(model, act, userdata, node)
    mass = act[..., model.actuator_actadr[node]]  # the first state of each
    volume = np.full_like(mass, room_of(model, node))
    return Air(mass, volume, read_volume(model, userdata, node))


def _ends(model: mujoco.MjModel, number: int, outward: float) -> list[AirEnd]:
    rows = model.actuator_user
    found = []
    for leader in leaders(model):
        members = dict(enumerate(nodes_of(model, leader), FIRST_NODE))
        for edge in edges_of(model, leader):
            a, b = int(rows[edge, EDGE_ROW.origin]), int(rows[edge, EDGE_ROW.end])
            if a == number:
                found.append(AirEnd(edge, outward, members.get(b, -1)))
            elif b == number:
                found.append(AirEnd(edge, -outward, members.get(a, -1)))
    return found
