"""Where the numbers of a search for a settled stride stand, for compiled code: a row of them for each search.

AT      how far a search is, what it is of, and where its tables begin, which stand behind
JOINT   of what moves by itself: places in a state, how much counts as 1 rad
NODE    of a chamber or rigid volume: places in `act` and `userdata`, in the inputs its supply's
WAY     of a valve or restriction: nodes at its ends, by number as of `FIRST_NODE`; of its supply, or 0
STORE   of a finite source, whose node follows those that are solved for
"""

from collections import namedtuple
from typing import Any

import mujoco
import numpy as np

from afo_sim.native.air_reading import TO_AMBIENT, TO_SUPPLY, ways_of
from afo_sim.native.slots import AIR_ROW, STORE_ROW, places
from afo_sim.native.state import read_opening
from afo_sim.physics import INERTIAL, PILOTED, TWO_WAY, register_jitable

# strides, jumps … found: how far it is, changes [-] and [rad]; ended: 0, DONE or GONE
# own_of: the stride whose slopes are known; asked: whether `told` has slopes that Newton's method has asked
# within: times the distances of a settled stride; trusted: strides for which given slopes are taken
# every, interval: rows of a stride from one that slopes are taken from to the next [-], [s]
# qpos … control: widths of recorded rows; angles, velocities, activations: places in a state
# nothing: share of a node's air that flows in, below which it tells nothing of what brings it back [-]
# gas, gamma: R [J/(kg·K)], γ [-]
_NUMBERS = (
    "strides jumps since_jump air angle found ended own_of asked within trusted paired sticks frictions "
    "steps every interval qpos act userdata control angles velocities activations ankle lowest highest "
    "joints nodes chambers ways stores nothing gas gamma"
)
# joint … store: tables; pressures, warm: of all nodes of a network; giving, past, angles_before: of rows
# first, begun, became: air of nodes at first, at the start and end of the stride before; change: ln m, ln σ
# own, slopes, told [2 nodes, 2 nodes]; flowing: air that flows in, by what is there; rest: to compute with
_TABLES = (
    "joint node way store pressures warm giving past angles_before first begun became change own slopes "
    "told flowing step side matrix other"
)
TABLES = tuple(_TABLES.split())
At: Any = namedtuple("At", (*_NUMBERS.split(), *TABLES))  # type: ignore[misc]  # its names are data
Joint = namedtuple("Joint", "angle velocity scale")
Node = namedtuple("Node", "act userdata control room wall")
Way = namedtuple("Way", "origin end opening law conductance critical parameters upstream")
Store = namedtuple("Store", "act userdata content")
AT, JOINT, NODE, STORE = places(At), places(Joint), places(Node), places(Store)
WAY = places(Way, parameters=4)
WAY_NUMBERS = WAY.upstream + 1
AMBIENT, SUPPLY, FIRST_NODE = 0, 1, 2
DONE, GONE = 1.0, 2.0


@register_jitable
def table(s: Any, o: int, which: int) -> int:
    """Where a table of the search begins whose row begins at o."""
    return o + int(s[o + which])


def node_rows(model: mujoco.MjModel, nodes: list[int]) -> np.ndarray:
    """Chambers and rigid volumes, as `NODE` has them."""
    rows, found = model.actuator_user[nodes], np.zeros((len(nodes), len(NODE)))
    found[:, NODE.act], found[:, NODE.control] = model.actuator_actadr[nodes], nodes
    found[:, NODE.userdata], found[:, NODE.room] = rows[:, AIR_ROW.userdata], rows[:, AIR_ROW.volume]
    found[:, NODE.wall] = rows[:, AIR_ROW.wall_conductance]
    return found


def store_rows(model: mujoco.MjModel, stores: list[int]) -> np.ndarray:
    """Finite sources, as `STORE` has them."""
    rows = model.actuator_user[stores]
    columns = model.actuator_actadr[stores], rows[:, AIR_ROW.userdata], rows[:, STORE_ROW.content]
    return np.stack(columns, axis=1)


def way_rows(model: mujoco.MjModel, nodes: list[int]) -> list[tuple[float, ...]]:
    """Valves and restrictions between nodes, as `WAY` has them; a line's flow is its steady one."""
    numbers = {TO_AMBIENT: AMBIENT, TO_SUPPLY: SUPPLY} | {node: k for k, node in enumerate(nodes, FIRST_NODE)}
    places, found = np.arange(model.nuserdata), []
    for way in ways_of(model):
        parameters = (numbers[way.pilot], *way.parameters[1:]) if way.law in PILOTED else way.parameters
        opening = float(read_opening(model, places, way.actuator)) if way.valve else -1.0
        law = TWO_WAY if way.law == INERTIAL else way.law
        ends = numbers[way.origin], numbers[way.end]
        upstream = numbers.get(way.upstream, 0)
        found.append((*ends, opening, law, way.conductance, way.critical_ratio, *parameters, upstream))
    return found
