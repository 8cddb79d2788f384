"""Named places in `act` and `userdata`, and reading and writing by these names.

    actuator   act                                          userdata
    chamber    air mass, integrated volume, abs. pressure   inlet flow, outlet flow, volume
    valve      armature, opening                            –
    friction   states of the muscle's friction              –

The integrated volume is the one that the chamber's pressure belongs to; the volume in `userdata` follows
from the muscles' lengths in the same step.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.native.slots import CHAMBER_USERDATA

AIR_MASS, INTEGRATED_VOLUME, ABSOLUTE_PRESSURE = range(3)
ARMATURE, OPENING = range(2)
INLET_FLOW, OUTLET_FLOW, VOLUME = range(3)
CHAMBER_STATES, VALVE_STATES, FLOWS_PER_CHAMBER = 3, 2, 3


class Air(NamedTuple):
    """The states of a chamber, numbers or arrays: mass [kg], volume of the pressure [m³], pressure [Pa]."""

    mass: Any
    volume: Any
    absolute_pressure: Any


class Flows(NamedTuple):
    """Air through a chamber's valves, supply to chamber to ambient positive [kg/s]; its volume [m³]."""

    inlet: np.ndarray
    outlet: np.ndarray
    volume: np.ndarray


def read_air(model: mujoco.MjModel, act: np.ndarray, chamber: int) -> Air:
    """The states of a chamber's actuator, from `act` (…, na)."""
    at = model.actuator_actadr[chamber]
    mass, volume, pressure = (act[..., at + k] for k in (AIR_MASS, INTEGRATED_VOLUME, ABSOLUTE_PRESSURE))
    return Air(mass, volume, pressure)


def write_air(model: mujoco.MjModel, act: np.ndarray, chamber: int, air: Air) -> None:
    """Set the states of a chamber's actuator in `act` (…, na)."""
    at = model.actuator_actadr[chamber]
    act[..., at + AIR_MASS] = air.mass
    act[..., at + INTEGRATED_VOLUME] = air.volume
    act[..., at + ABSOLUTE_PRESSURE] = air.absolute_pressure


def air_at(pressure: float, volume: float) -> Air:
    """A chamber at gauge `pressure` [Pa] and ambient temperature: m = p_abs V/(R T)."""
    absolute = pressure + AMBIENT_PRESSURE
    return Air(absolute * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE), volume, absolute)


def read_flows(model: mujoco.MjModel, userdata: np.ndarray, chamber: int) -> Flows:
    """Flows and volume of a chamber's actuator, from `userdata` (…, nuserdata)."""
    at = int(model.actuator_user[chamber, CHAMBER_USERDATA])
    inlet, outlet, volume = (userdata[..., at + k] for k in (INLET_FLOW, OUTLET_FLOW, VOLUME))
    return Flows(inlet, outlet, volume)


def read_opening(model: mujoco.MjModel, act: np.ndarray, valve: int) -> np.ndarray:
    """Opening of a valve's seat [-], from `act` (…, na)."""
    opening: np.ndarray = act[..., model.actuator_actadr[valve] + OPENING]
    return opening


def write_valve(model: mujoco.MjModel, act: np.ndarray, valve: int, armature: float, opening: float) -> None:
    """Set armature and opening of a valve's actuator in `act` (…, na) [-]."""
    at = model.actuator_actadr[valve]
    act[..., at + ARMATURE], act[..., at + OPENING] = armature, opening
