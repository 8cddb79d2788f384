"""Air, muscles, anchors and valves of the callbacks, read and written by name in `act` and `userdata`."""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.native.slots import (
    AIR_ROW,
    ANCHOR_ACT,
    ANCHOR_DATA,
    CHAMBER_ACT,
    CHAMBER_DATA,
    CHAMBER_ROW,
    DRIVE_ACT,
    EDGE_ROW,
    KIND_VOLUME,
    LEADER_ACT,
    LEADER_DATA,
    MUSCLE_ROW,
    NETWORK_ROW,
    VALVE_ACT,
    VALVE_ROW,
    VOLUME_DATA,
)


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
    return GasOf(float(row[AIR_ROW.gas_constant]), float(row[AIR_ROW.heat_capacity_ratio]))


def read_air(model: mujoco.MjModel, act: np.ndarray, userdata: np.ndarray, chamber: int) -> Air:
    """The air of a chamber's actuator, from `act` (…, na) and `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, AIR_ROW.userdata])
    mass = act[..., model.actuator_actadr[chamber] + CHAMBER_ACT.mass]
    return Air(mass, userdata[..., at + CHAMBER_DATA.volume], userdata[..., at + CHAMBER_DATA.pressure])


def write_air(model: mujoco.MjModel, act: np.ndarray, chamber: int, air: Air) -> None:
    """Set the states of a chamber's actuator in `act` (…, na): air that has stood like this."""
    at, gamma = model.actuator_actadr[chamber], gas_of(model, chamber).heat_capacity_ratio
    act[..., at + CHAMBER_ACT.mass] = air.mass
    act[..., at + CHAMBER_ACT.sigma] = air.absolute_pressure * air.volume**gamma
    act[..., at + CHAMBER_ACT.last_volume] = air.volume
    act[..., at + CHAMBER_ACT.last_pressure] = air.absolute_pressure


def read_held(model: mujoco.MjModel, act: np.ndarray, chamber: int) -> np.ndarray:
    """Mass [kg] and σ of the actuator of a chamber or volume, from `act` (…, na): (…, 2)."""
    at = model.actuator_actadr[chamber]
    return np.asarray(act[..., at + CHAMBER_ACT.mass : at + CHAMBER_ACT.sigma + 1])


def write_held(model: mujoco.MjModel, act: np.ndarray, chamber: int, held: np.ndarray) -> None:
    """Set mass [kg] and σ (2,) of the actuator of a chamber or volume in `act` (na,); its room stays."""
    at, gamma = model.actuator_actadr[chamber], gas_of(model, chamber).heat_capacity_ratio
    act[at + CHAMBER_ACT.mass : at + CHAMBER_ACT.sigma + 1] = held
    if model.actuator_user[chamber, 1] != KIND_VOLUME:
        act[at + CHAMBER_ACT.last_pressure] = held[1] / act[at + CHAMBER_ACT.last_volume] ** gamma


def air_at(pressure: float, volume: float, gas: GasOf | None = None) -> Air:
    """A chamber at gauge `pressure` [Pa] and ambient temperature: m = p_abs V/(R T); of air by default."""
    absolute = pressure + AMBIENT_PRESSURE
    constant = (gas or GasOf()).constant
    return Air(absolute * volume / (constant * AMBIENT_TEMPERATURE), volume, absolute)


def read_own(model: mujoco.MjModel, userdata: np.ndarray, muscle: int) -> Own:
    """Own length of a muscle's actuator, from `userdata` (…, nuserdata); parallel muscles are alike."""
    leader = int(model.actuator_user[muscle, MUSCLE_ROW.leader])
    at = int(model.actuator_user[leader, MUSCLE_ROW.userdata])
    return Own(
        contraction=userdata[..., at + LEADER_DATA.contraction],
        tension=userdata[..., at + LEADER_DATA.tension],
        rate=userdata[..., at + LEADER_DATA.rate],
    )


def read_carried(model: mujoco.MjModel, act: np.ndarray, muscle: int) -> np.ndarray:
    """Static force of a muscle beyond its tension, one step back [N], from `act`; 0 at a range's end."""
    leader = int(model.actuator_user[muscle, MUSCLE_ROW.leader])
    return np.asarray(act[..., int(model.actuator_user[leader, MUSCLE_ROW.state]) + LEADER_ACT.carried])


def read_anchor(model: mujoco.MjModel, userdata: np.ndarray, network: int, number: int) -> Yielding:
    """An anchor of a network's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[network, NETWORK_ROW.userdata]) + len(ANCHOR_DATA) * number
    return Yielding(userdata[..., at + ANCHOR_DATA.pull], userdata[..., at + ANCHOR_DATA.displacement])


def write_rest(model: mujoco.MjModel, data: mujoco.MjData, network: int) -> None:
    """Take a network's lengths and displacements, as solved at rest, for those of its last step."""
    rows, act, found = model.actuator_user, data.act, data.userdata
    chamber = int(rows[network, NETWORK_ROW.first_chamber])
    while chamber >= 0:
        leader = int(rows[chamber, CHAMBER_ROW.first_muscle])
        while leader >= 0:
            at, state = int(rows[leader, MUSCLE_ROW.userdata]), int(rows[leader, MUSCLE_ROW.state])
            act[state + LEADER_ACT.contraction] = found[at + LEADER_DATA.contraction]
            act[state + LEADER_ACT.carried] = act[state + LEADER_ACT.last_move] = 0.0
            leader = int(rows[leader, MUSCLE_ROW.next])
        chamber = int(rows[chamber, CHAMBER_ROW.next])
    at, state = int(rows[network, NETWORK_ROW.userdata]), int(rows[network, NETWORK_ROW.state])
    for number in range(int(rows[network, NETWORK_ROW.anchors])):
        place, own = state + len(ANCHOR_ACT) * number, at + len(ANCHOR_DATA) * number
        act[place + ANCHOR_ACT.displacement] = found[own + ANCHOR_DATA.displacement]
        act[place + ANCHOR_ACT.last_move] = 0.0


def read_flows(model: mujoco.MjModel, userdata: np.ndarray, chamber: int) -> Flows:
    """Flows and volume of a chamber's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, AIR_ROW.userdata])
    return Flows(
        inlet=userdata[..., at + CHAMBER_DATA.inlet_flow],
        outlet=userdata[..., at + CHAMBER_DATA.outlet_flow],
        volume=userdata[..., at + CHAMBER_DATA.volume],
    )


def read_volume(model: mujoco.MjModel, userdata: np.ndarray, node: int) -> np.ndarray:
    """Absolute pressure of the actuator of a volume or store [Pa], from `userdata` (…, nuserdata)."""
    return np.asarray(userdata[..., int(model.actuator_user[node, AIR_ROW.userdata]) + VOLUME_DATA.pressure])


def room_of(model: mujoco.MjModel, node: int) -> float:
    """Volume of the actuator of a rigid volume or store [m³]."""
    return float(model.actuator_user[node, AIR_ROW.volume])


def read_flow(model: mujoco.MjModel, userdata: np.ndarray, edge: int) -> np.ndarray:
    """Mean flow of the step through the actuator of a valve or restriction [kg/s], from `userdata`."""
    return np.asarray(userdata[..., int(model.actuator_user[edge, EDGE_ROW.place])])


def read_opening(model: mujoco.MjModel, userdata: np.ndarray, valve: int) -> np.ndarray:
    """Mean opening of a valve's actuator over the step [-], from `userdata` (…, nuserdata)."""
    return np.asarray(userdata[..., int(model.actuator_user[valve, EDGE_ROW.place]) + 1])


def first_way(model: mujoco.MjModel, valve: int) -> int | None:
    """The actuator of the 3/2 valve whose other way a valve's actuator is; None where it is no other way."""
    follows = int(model.actuator_user[valve, EDGE_ROW.follows])
    return follows - 1 if follows > 0 else None


def is_driven(model: mujoco.MjModel, valve: int) -> bool:
    """Whether a drive gives the coil of a valve's actuator."""
    return bool(model.actuator_user[valve, VALVE_ROW.coil] > 0.0)


def read_coil(model: mujoco.MjModel, userdata: np.ndarray, valve: int) -> np.ndarray:
    """Coil of a driven valve's actuator [-], from `userdata` (…, nuserdata)."""
    return np.asarray(userdata[..., int(model.actuator_user[valve, VALVE_ROW.coil]) - 1])


def read_switches(model: mujoco.MjModel, act: np.ndarray, drive: int, outlet: bool) -> np.ndarray:
    """How often a drive's actuator has switched a coil on since the start [-], from `act` (…, na)."""
    place = DRIVE_ACT.outlet_switches if outlet else DRIVE_ACT.inlet_switches
    return np.asarray(np.round(act[..., model.actuator_actadr[drive] + place]))


def write_valve(model: mujoco.MjModel, act: np.ndarray, valve: int, armature: float, opening: float) -> None:
    """Set armature and opening of a valve's actuator in `act` (…, na) [-]; its coil is what opened it."""
    at = model.actuator_actadr[valve]
    act[..., at + VALVE_ACT.armature], act[..., at + VALVE_ACT.opening] = armature, opening
    act[..., at + VALVE_ACT.coil] = act[..., at + VALVE_ACT.seat] = opening
