"""Networks of the air in a compiled model: which node leads each, and what hangs on its chains of slots."""

from collections.abc import Iterator

import mujoco
import numpy as np

from afo_sim.native.slots import AIR_ROW, EDGE_ROW, KIND_CHAMBER, KIND_STORE, KIND_VOLUME, MARK


def leaders(model: mujoco.MjModel) -> list[int]:
    """Actuators of the nodes that lead a network."""
    rows = model.actuator_user
    nodes = np.isin(rows[:, 1], (KIND_CHAMBER, KIND_VOLUME, KIND_STORE)) & (rows[:, 0] == MARK)
    return [int(i) for i in np.flatnonzero(nodes & (rows[:, AIR_ROW.leads] > 0.0))]


def nodes_of(model: mujoco.MjModel, leader: int) -> list[int]:
    """Actuators of a network's nodes, in the order of their numbers from 2 on."""
    return list(_chain(model, leader, AIR_ROW.first_node, AIR_ROW.following))


def edges_of(model: mujoco.MjModel, leader: int) -> list[int]:
    """Actuators of a network's valves and restrictions."""
    return list(_chain(model, leader, AIR_ROW.first_edge, EDGE_ROW.following))


def _chain(model: mujoco.MjModel, leader: int, first: int, following: int) -> Iterator[int]:
    """Actuators that hang together by a slot, which begins in another slot of the leader."""
    rows = model.actuator_user
    actuator = int(rows[leader, first])
    while actuator >= 0:
        yield actuator
        actuator = int(rows[actuator, following])
