"""Named places in `act` and `userdata`, and reading and writing by these names.

    actuator   act                                              userdata
    network    of each leader: contraction, carried force,      of each anchor: force, displacement
               last move; of each anchor: displacement,
               damper's force
    chamber    air mass, σ = p V^γ, last volume, last pressure  inlet flow, outlet flow, volume, pressure
    muscle     –                                                of each leader: contraction, tension, rate, …
    drive      reading, integral, pulse, switches               coils of inlet and outlet
    valve      armature, opening                                –
    friction   states of the muscle's friction                  –

A "last" state, and all states of a network, belong to the posture one step back. What belongs to the present
posture is solved anew in each step and stands in `userdata`.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.native.members import edges_of, leaders, nodes_of
from afo_sim.native.slots import (
    AIR_GAS,
    AIR_HEAT_CAPACITY_RATIO,
    AIR_NUMBER,
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_NEXT,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_USERDATA,
    EDGE_ROW_END,
    EDGE_ROW_FOLLOWS,
    EDGE_ROW_ORIGIN,
    EDGE_ROW_PLACE,
    KIND_VOLUME,
    MUSCLE_LEADER,
    MUSCLE_NEXT,
    MUSCLE_STATE,
    MUSCLE_USERDATA,
    NETWORK_ANCHORS,
    NETWORK_FIRST_CHAMBER,
    NETWORK_STATE,
    NETWORK_USERDATA,
    VALVE_COIL,
)

AIR_MASS, SIGMA, LAST_VOLUME, LAST_PRESSURE = range(4)
ARMATURE, OPENING = range(2)
RUNNING = 0  # of a compressor
VOLUME_PRESSURE = 0
STORE_MASS, STORE_TEMPERATURE = range(2)
CONTRACTION, CARRIED, LAST_MOVE = range(3)  # of a leader in the act of its network
ANCHOR_DISPLACEMENT, ANCHOR_LOSS = range(2)  # of an anchor there
INLET_FLOW, OUTLET_FLOW, VOLUME, PRESSURE = range(4)
(
    OWN_CONTRACTION,
    TENSION,
    OWN_RATE,
    CABLE_SLOPE,
    WORK_VOLUME_SLOPE,
    WORK_STEP,
    WORK_BY_PRESSURE,
    WORK_BY_PULL,
    WORK_COEFFICIENT,
    WORK_CHANGE,
) = range(10)
PULL, DISPLACEMENT = range(2)
INLET_COIL, OUTLET_COIL = range(2)
# GIVEN is the side of two-point switching, or the signed width of the present pulse [s]; CLOCK the time since
# that began. STAGE is 0 before the first step, 1 off, 2 on.
(
    READING,
    INTEGRAL,
    GIVEN,
    CLOCK,
    STAGE,
    INLET_LAST,
    OUTLET_LAST,
    INLET_SWITCHES,
    OUTLET_SWITCHES,
) = range(9)
CHAMBER_STATES, VALVE_STATES, LEADER_STATES, ANCHOR_STATES, DRIVE_STATES = 4, 2, 3, 2, 9
CHAMBER_DATA, LEADER_DATA, ANCHOR_DATA, DRIVE_DATA = 4, 10, 2, 2
VOLUME_STATES, VOLUME_DATA, EDGE_DATA, COMPRESSOR_STATES = 2, 1, 1, 2


class Air(NamedTuple):
    """The air of a chamber, numbers or arrays: mass [kg], volume [m³], absolute pressure [Pa]."""

    mass: Any
    volume: Any
    absolute_pressure: Any


class Flows(NamedTuple):
    """Air through a chamber's valves, supply to chamber to ambient positive [kg/s]; its volume [m³]."""

    inlet: np.ndarray
    outlet: np.ndarray
    volume: np.ndarray


class Own(NamedTuple):
    """A muscle at its own length: contraction [-], tension [N], contraction rate of the step [1/s]."""

    contraction: np.ndarray
    tension: np.ndarray
    rate: np.ndarray


class Yielding(NamedTuple):
    """An anchor: pull of all muscles on it [N], and how far it gives way [m]."""

    force: np.ndarray
    displacement: np.ndarray


class GasOf(NamedTuple):
    """The gas of a chamber: R [J/(kg·K)], γ [-]."""

    constant: float = GAS_CONSTANT
    heat_capacity_ratio: float = HEAT_CAPACITY_RATIO


def gas_of(model: mujoco.MjModel, node: int) -> GasOf:
    """The gas in the actuator of a chamber, a volume or a store."""
    row = model.actuator_user[node]
    gamma = float(row[AIR_HEAT_CAPACITY_RATIO])
    return GasOf(float(row[AIR_GAS]), gamma)


def read_air(model: mujoco.MjModel, act: np.ndarray, userdata: np.ndarray, chamber: int) -> Air:
    """The air of a chamber's actuator, from `act` (…, na) and `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, CHAMBER_USERDATA])
    mass = act[..., model.actuator_actadr[chamber] + AIR_MASS]
    return Air(mass, userdata[..., at + VOLUME], userdata[..., at + PRESSURE])


def write_air(model: mujoco.MjModel, act: np.ndarray, chamber: int, air: Air) -> None:
    """Set the states of a chamber's actuator in `act` (…, na): air that has stood like this."""
    at = model.actuator_actadr[chamber]
    act[..., at + AIR_MASS] = air.mass
    act[..., at + SIGMA] = air.absolute_pressure * air.volume ** gas_of(model, chamber).heat_capacity_ratio
    act[..., at + LAST_VOLUME] = air.volume
    act[..., at + LAST_PRESSURE] = air.absolute_pressure


def read_held(model: mujoco.MjModel, act: np.ndarray, chamber: int) -> np.ndarray:
    """Mass [kg] and σ of the actuator of a chamber or volume, from `act` (…, na): (…, 2)."""
    at = model.actuator_actadr[chamber]
    held: np.ndarray = act[..., at + AIR_MASS : at + SIGMA + 1]
    return held


def write_held(model: mujoco.MjModel, act: np.ndarray, chamber: int, held: np.ndarray) -> None:
    """Set mass [kg] and σ (2,) of the actuator of a chamber or volume in `act` (na,); its room stays."""
    at = model.actuator_actadr[chamber]
    act[at + AIR_MASS : at + SIGMA + 1] = held
    if model.actuator_user[chamber, 1] == KIND_VOLUME:
        return
    act[at + LAST_PRESSURE] = held[1] / act[at + LAST_VOLUME] ** gas_of(model, chamber).heat_capacity_ratio


def air_at(pressure: float, volume: float, gas: GasOf | None = None) -> Air:
    """A chamber at gauge `pressure` [Pa] and ambient temperature: m = p_abs V/(R T); of air by default."""
    absolute = pressure + AMBIENT_PRESSURE
    constant = (gas or GasOf()).constant
    return Air(absolute * volume / (constant * AMBIENT_TEMPERATURE), volume, absolute)


def read_own(model: mujoco.MjModel, userdata: np.ndarray, muscle: int) -> Own:
    """Own length of a muscle's actuator, from `userdata` (…, nuserdata); parallel muscles are alike."""
    leader = int(model.actuator_user[muscle, MUSCLE_LEADER])
    at = int(model.actuator_user[leader, MUSCLE_USERDATA])
    contraction, tension, rate = (userdata[..., at + k] for k in (OWN_CONTRACTION, TENSION, OWN_RATE))
    return Own(contraction, tension, rate)


def read_carried(model: mujoco.MjModel, act: np.ndarray, muscle: int) -> np.ndarray:
    """Static force of a muscle beyond its tension, one step back [N], from `act`; 0 at a range's end."""
    leader = int(model.actuator_user[muscle, MUSCLE_LEADER])
    carried: np.ndarray = act[..., int(model.actuator_user[leader, MUSCLE_STATE]) + CARRIED]
    return carried


def read_anchor(model: mujoco.MjModel, userdata: np.ndarray, network: int, number: int) -> Yielding:
    """An anchor of a network's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[network, NETWORK_USERDATA]) + ANCHOR_DATA * number
    return Yielding(userdata[..., at + PULL], userdata[..., at + DISPLACEMENT])


def write_rest(model: mujoco.MjModel, data: mujoco.MjData, network: int) -> None:
    """Take a network's lengths and displacements, as solved at rest, for those of its last step."""
    rows, act, found = model.actuator_user, data.act, data.userdata
    chamber = int(rows[network, NETWORK_FIRST_CHAMBER])
    while chamber >= 0:
        leader = int(rows[chamber, CHAMBER_FIRST_MUSCLE])
        while leader >= 0:
            at, state = int(rows[leader, MUSCLE_USERDATA]), int(rows[leader, MUSCLE_STATE])
            act[state + CONTRACTION] = found[at + OWN_CONTRACTION]
            act[state + CARRIED] = act[state + LAST_MOVE] = 0.0
            leader = int(rows[leader, MUSCLE_NEXT])
        chamber = int(rows[chamber, CHAMBER_NEXT])
    at, state = int(rows[network, NETWORK_USERDATA]), int(rows[network, NETWORK_STATE])
    for number in range(int(rows[network, NETWORK_ANCHORS])):
        place = state + ANCHOR_STATES * number
        act[place + ANCHOR_DISPLACEMENT] = found[at + ANCHOR_DATA * number + DISPLACEMENT]
        act[place + ANCHOR_LOSS] = 0.0


def read_flows(model: mujoco.MjModel, userdata: np.ndarray, chamber: int) -> Flows:
    """Flows and volume of a chamber's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, CHAMBER_USERDATA])
    inlet, outlet, volume = (userdata[..., at + k] for k in (INLET_FLOW, OUTLET_FLOW, VOLUME))
    return Flows(inlet, outlet, volume)


def read_volume(model: mujoco.MjModel, userdata: np.ndarray, node: int) -> np.ndarray:
    """Absolute pressure of the actuator of a volume or store [Pa], from `userdata` (…, nuserdata)."""
    found: np.ndarray = userdata[..., int(model.actuator_user[node, CHAMBER_USERDATA]) + VOLUME_PRESSURE]
    return found


def room_of(model: mujoco.MjModel, node: int) -> float:
    """Volume of the actuator of a rigid volume or store [m³]."""
    return float(model.actuator_user[node, CHAMBER_TUBE_VOLUME])


def read_flow(model: mujoco.MjModel, userdata: np.ndarray, edge: int) -> np.ndarray:
    """Mean flow of the step through the actuator of a valve or restriction [kg/s], from `userdata`."""
    found: np.ndarray = userdata[..., int(model.actuator_user[edge, EDGE_ROW_PLACE])]
    return found


def touching(model: mujoco.MjModel, node: int) -> list[tuple[int, float]]:
    """Valves and restrictions at a node's actuator, each with the sign of a flow into it."""
    rows = model.actuator_user
    number = rows[node, AIR_NUMBER]
    found = []
    leader = next((k for k in leaders(model) if node in nodes_of(model, k)), None)
    for edge in () if leader is None else edges_of(model, leader):
        ends = ((EDGE_ROW_ORIGIN, -1.0), (EDGE_ROW_END, 1.0))
        found += [(edge, sign) for slot, sign in ends if rows[edge, slot] == number]
    return found


def read_opening(model: mujoco.MjModel, act: np.ndarray, valve: int) -> np.ndarray:
    """Opening of a valve's seat [-], from `act` (…, na); of a 3/2 valve's other way what the first leaves."""
    first = first_way(model, valve)
    if first is not None:
        return 1.0 - read_opening(model, act, first)
    opening: np.ndarray = act[..., model.actuator_actadr[valve] + OPENING]
    return opening


def first_way(model: mujoco.MjModel, valve: int) -> int | None:
    """The actuator of the 3/2 valve whose other way a valve's actuator is; None where it is no other way."""
    follows = int(model.actuator_user[valve, EDGE_ROW_FOLLOWS])
    return follows - 1 if follows > 0 else None


def is_driven(model: mujoco.MjModel, valve: int) -> bool:
    """Whether a drive gives the coil of a valve's actuator."""
    return bool(model.actuator_user[valve, VALVE_COIL] > 0.0)


def read_coil(model: mujoco.MjModel, userdata: np.ndarray, valve: int) -> np.ndarray:
    """Coil of a driven valve's actuator [-], from `userdata` (…, nuserdata)."""
    coil: np.ndarray = userdata[..., int(model.actuator_user[valve, VALVE_COIL]) - 1]
    return coil


def read_switches(model: mujoco.MjModel, act: np.ndarray, drive: int, outlet: bool) -> np.ndarray:
    """How often a drive's actuator has switched a coil on since the start [-], from `act` (…, na)."""
    place = OUTLET_SWITCHES if outlet else INLET_SWITCHES
    count: np.ndarray = np.round(act[..., model.actuator_actadr[drive] + place])
    return count


def write_valve(model: mujoco.MjModel, act: np.ndarray, valve: int, armature: float, opening: float) -> None:
    """Set armature and opening of a valve's actuator in `act` (…, na) [-]."""
    at = model.actuator_actadr[valve]
    act[..., at + ARMATURE], act[..., at + OPENING] = armature, opening
