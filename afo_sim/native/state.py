"""Air, muscles, anchors and valves of the callbacks, read and written by name in `act` and `userdata`."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.native import slots


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


def chain(rows: Any, leader: int, first: int, following: int) -> Iterator[int]:
    """Actuators that hang together by a slot, which begins in another slot of the leader."""
    actuator = int(rows[leader][first])
    while actuator >= 0:
        yield actuator
        actuator = int(rows[actuator][following])


def gas_of(model: mujoco.MjModel, node: int) -> GasOf:
    """The gas in the actuator of a chamber, a volume or a store."""
    row = model.actuator_user[node]
    return GasOf(float(row[slots.AIR_ROW.gas_constant]), float(row[slots.AIR_ROW.heat_capacity_ratio]))


def read_air(model: mujoco.MjModel, act: np.ndarray, userdata: np.ndarray, chamber: int) -> Air:
    """The air of a chamber's actuator, from `act` (…, na) and `userdata` (…, nuserdata)."""
    at, found = int(model.actuator_user[chamber, slots.AIR_ROW.userdata]), slots.CHAMBER_DATA
    mass = act[..., model.actuator_actadr[chamber] + slots.CHAMBER_ACT.mass]
    return Air(mass, userdata[..., at + found.volume], userdata[..., at + found.pressure])


def write_air(model: mujoco.MjModel, act: np.ndarray, chamber: int, air: Air) -> None:
    """Set the states of a chamber's actuator in `act` (…, na): air that has stood like this."""
    at, gamma = model.actuator_actadr[chamber], gas_of(model, chamber).heat_capacity_ratio
    act[..., at + slots.CHAMBER_ACT.mass] = air.mass
    act[..., at + slots.CHAMBER_ACT.sigma] = air.absolute_pressure * air.volume**gamma
    act[..., at + slots.CHAMBER_ACT.last_volume] = air.volume
    act[..., at + slots.CHAMBER_ACT.last_pressure] = air.absolute_pressure


def read_held(model: mujoco.MjModel, act: np.ndarray, chamber: int) -> np.ndarray:
    """Mass [kg] and σ of the actuator of a chamber or volume, from `act` (…, na): (…, 2)."""
    at = model.actuator_actadr[chamber]
    return np.asarray(act[..., at + slots.CHAMBER_ACT.mass : at + slots.CHAMBER_ACT.sigma + 1])


def write_held(model: mujoco.MjModel, act: np.ndarray, chamber: int, held: np.ndarray) -> None:
    """Set mass [kg] and σ (2,) of the actuator of a chamber or volume in `act` (na,); its room stays."""
    at, gamma = model.actuator_actadr[chamber], gas_of(model, chamber).heat_capacity_ratio
    act[at + slots.CHAMBER_ACT.mass : at + slots.CHAMBER_ACT.sigma + 1] = held
    if model.actuator_user[chamber, slots.KIND] != slots.Kind.VOLUME:
        act[at + slots.CHAMBER_ACT.last_pressure] = held[1] / act[at + slots.CHAMBER_ACT.last_volume] ** gamma


def air_at(pressure: float, volume: float, gas: GasOf | None = None) -> Air:
    """A chamber at gauge `pressure` [Pa] and ambient temperature: m = p_abs V/(R T); of air by default."""
    absolute = pressure + AMBIENT_PRESSURE
    constant = (gas or GasOf()).constant
    return Air(absolute * volume / (constant * AMBIENT_TEMPERATURE), volume, absolute)


def read_own(model: mujoco.MjModel, userdata: np.ndarray, muscle: int) -> Own:
    """Own length of a muscle's actuator, from `userdata` (…, nuserdata); parallel muscles are alike."""
    leader = int(model.actuator_user[muscle, slots.MUSCLE_ROW.leader])
    at = int(model.actuator_user[leader, slots.MUSCLE_ROW.userdata])
    return Own(
        contraction=userdata[..., at + slots.LEADER_DATA.contraction],
        tension=userdata[..., at + slots.LEADER_DATA.tension],
        rate=userdata[..., at + slots.LEADER_DATA.rate],
    )


def read_carried(model: mujoco.MjModel, act: np.ndarray, muscle: int) -> np.ndarray:
    """Static force of a muscle beyond its tension, one step back [N], from `act`; 0 at a range's end."""
    leader = int(model.actuator_user[muscle, slots.MUSCLE_ROW.leader])
    state = int(model.actuator_user[leader, slots.MUSCLE_ROW.state])
    return np.asarray(act[..., state + slots.LEADER_ACT.carried])


def read_anchor(model: mujoco.MjModel, userdata: np.ndarray, network: int, number: int) -> Yielding:
    """An anchor of a network's actuator, from `userdata` (…, nuserdata)."""
    found = slots.ANCHOR_DATA
    at = int(model.actuator_user[network, slots.NETWORK_ROW.userdata]) + len(found) * number
    return Yielding(userdata[..., at + found.pull], userdata[..., at + found.displacement])


def write_rest(model: mujoco.MjModel, data: mujoco.MjData, network: int) -> None:
    """Take a network's lengths and displacements, as solved at rest, for those of its last step."""
    rows, act, found = model.actuator_user, data.act, data.userdata
    muscle, now = slots.MUSCLE_ROW, slots.LEADER_ACT
    for chamber in chain(rows, network, slots.NETWORK_ROW.first_chamber, slots.CHAMBER_ROW.next):
        for leader in chain(rows, chamber, slots.CHAMBER_ROW.first_muscle, muscle.next):
            at, state = int(rows[leader, muscle.userdata]), int(rows[leader, muscle.state])
            act[state + now.contraction] = found[at + slots.LEADER_DATA.contraction]
            act[state + now.carried] = act[state + now.last_move] = 0.0
    at, state = int(rows[network, slots.NETWORK_ROW.userdata]), int(rows[network, slots.NETWORK_ROW.state])
    for number in range(int(rows[network, slots.NETWORK_ROW.anchors])):
        place, own = state + len(slots.ANCHOR_ACT) * number, at + len(slots.ANCHOR_DATA) * number
        act[place + slots.ANCHOR_ACT.displacement] = found[own + slots.ANCHOR_DATA.displacement]
        act[place + slots.ANCHOR_ACT.last_move] = 0.0


def read_flows(model: mujoco.MjModel, userdata: np.ndarray, chamber: int) -> Flows:
    """Flows and volume of a chamber's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, slots.AIR_ROW.userdata])
    return Flows(
        inlet=userdata[..., at + slots.CHAMBER_DATA.inlet_flow],
        outlet=userdata[..., at + slots.CHAMBER_DATA.outlet_flow],
        volume=userdata[..., at + slots.CHAMBER_DATA.volume],
    )


def read_volume(model: mujoco.MjModel, userdata: np.ndarray, node: int) -> np.ndarray:
    """Absolute pressure of the actuator of a volume or store [Pa], from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[node, slots.AIR_ROW.userdata])
    return np.asarray(userdata[..., at + slots.VOLUME_DATA.pressure])


def room_of(model: mujoco.MjModel, node: int) -> float:
    """Volume of the actuator of a rigid volume or store [m³]."""
    return float(model.actuator_user[node, slots.AIR_ROW.volume])


def read_flow(model: mujoco.MjModel, userdata: np.ndarray, edge: int) -> np.ndarray:
    """Mean flow of the step through the actuator of a valve or restriction [kg/s], from `userdata`."""
    return np.asarray(userdata[..., int(model.actuator_user[edge, slots.EDGE_ROW.place])])


def read_opening(model: mujoco.MjModel, userdata: np.ndarray, valve: int) -> np.ndarray:
    """Mean opening of a valve's actuator over the step [-], from `userdata` (…, nuserdata)."""
    return np.asarray(userdata[..., int(model.actuator_user[valve, slots.EDGE_ROW.place]) + 1])


def first_way(model: mujoco.MjModel, valve: int) -> int | None:
    """The actuator of the 3/2 valve whose other way a valve's actuator is; None where it is no other way."""
    follows = int(model.actuator_user[valve, slots.EDGE_ROW.follows])
    return follows - 1 if follows > 0 else None


def is_driven(model: mujoco.MjModel, valve: int) -> bool:
    """Whether a drive gives the coil of a valve's actuator."""
    return bool(model.actuator_user[valve, slots.VALVE_ROW.coil] > 0.0)


def read_coil(model: mujoco.MjModel, userdata: np.ndarray, valve: int) -> np.ndarray:
    """Coil of a driven valve's actuator [-], from `userdata` (…, nuserdata)."""
    return np.asarray(userdata[..., int(model.actuator_user[valve, slots.VALVE_ROW.coil]) - 1])


def read_switches(model: mujoco.MjModel, act: np.ndarray, drive: int, outlet: bool) -> np.ndarray:
    """How often a drive's actuator has switched a coil on since the start [-], from `act` (…, na)."""
    place = slots.DRIVE_ACT.outlet_switches if outlet else slots.DRIVE_ACT.inlet_switches
    return np.asarray(np.round(act[..., model.actuator_actadr[drive] + place]))


def write_valve(model: mujoco.MjModel, act: np.ndarray, valve: int, armature: float, opening: float) -> None:
    """Set armature and opening of a valve's actuator in `act` (…, na) [-]; its coil is what opened it."""
    at = model.actuator_actadr[valve]
    act[..., at + slots.VALVE_ACT.armature], act[..., at + slots.VALVE_ACT.opening] = armature, opening
    act[..., at + slots.VALVE_ACT.coil] = act[..., at + slots.VALVE_ACT.seat] = opening
