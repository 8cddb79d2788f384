"""Chamber and valve: rates of their states."""

from typing import Any

from numba.extending import register_jitable

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.native.complaints import FINE, NO_AIR, NO_PRESSURE, NO_SUPPLY, NO_VOLUME
from afo_sim.native.slots import (
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_USERDATA,
    CHAMBER_WALL_CONDUCTANCE,
    MUSCLE_B,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_NEXT,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_SERIES_LENGTH,
    VALVE_CLOSING_DELAY,
    VALVE_CONDUCTANCE,
    VALVE_CRITICAL_RATIO,
    VALVE_OPENING_DELAY,
)
from afo_sim.native.state import (
    ABSOLUTE_PRESSURE,
    AIR_MASS,
    ARMATURE,
    INLET_FLOW,
    INTEGRATED_VOLUME,
    OPENING,
    OUTLET_FLOW,
    VOLUME,
)
from afo_sim.physics.pneumatics import muscle_volume, pressure_rate, valve_flow, valve_rates


@register_jitable
def chamber_volume(m: Any, d: Any, j: int) -> tuple[float, float]:
    """Volume of tube and muscles of the chamber whose row starts at j [m³], and its rate [m³/s]."""
    u, lengths, velocities = m.actuator_user, d.actuator_length, d.actuator_velocity
    volume, volume_rate = u[j + CHAMBER_TUBE_VOLUME], 0.0
    k = int(u[j + CHAMBER_FIRST_MUSCLE])
    while k >= 0:
        q = m.nuser_actuator * k
        length = u[q + MUSCLE_NOMINAL_LENGTH]
        per_length = 1.0 / length
        contraction = 1.0 - (lengths[k] - u[q + MUSCLE_SERIES_LENGTH]) * per_length
        part, slope = muscle_volume(
            contraction, length, u[q + MUSCLE_NOMINAL_RADIUS], u[q + MUSCLE_B], u[q + MUSCLE_DEAD_VOLUME]
        )
        volume += part
        volume_rate -= slope * velocities[k] * per_length
        k = int(u[q + MUSCLE_NEXT])
    return volume, volume_rate


@register_jitable
def through(
    m: Any,
    d: Any,
    valve: int,
    pressure_1: float,
    temperature_1: float,
    pressure_2: float,
    temperature_2: float,
) -> float:
    """Mass flow through a valve's actuator from side 1 to side 2 [kg/s]."""
    u, q = m.actuator_user, m.nuser_actuator * valve
    return valve_flow(
        pressure_1,
        temperature_1,
        pressure_2,
        temperature_2,
        d.act[m.actuator_actadr[valve] + OPENING],
        u[q + VALVE_CONDUCTANCE],
        u[q + VALVE_CRITICAL_RATIO],
    )


@register_jitable
def inward_and_outward(inlet_flow: float, outlet_flow: float) -> tuple[float, float]:
    """Air that enters and air that leaves a chamber, both ≥ 0, from the signed flows of its valves [kg/s]."""
    flow_in, flow_out = 0.0, 0.0
    if inlet_flow < 0.0:
        flow_out -= inlet_flow
    else:
        flow_in += inlet_flow
    if outlet_flow < 0.0:
        flow_in -= outlet_flow
    else:
        flow_out += outlet_flow
    return flow_in, flow_out


@register_jitable
def chamber_dyn(m: Any, d: Any, i: int, j: int) -> int:
    """Write the rates of the chamber actuator i, whose row starts at j, and its flows; return a complaint."""
    u, act = m.actuator_user, d.act
    adr = m.actuator_actadr[i]
    mass, integrated_volume = act[adr + AIR_MASS], act[adr + INTEGRATED_VOLUME]
    pressure = act[adr + ABSOLUTE_PRESSURE]
    if not pressure > 0.0:
        return NO_PRESSURE
    if not mass > 0.0:
        return NO_AIR
    volume, volume_rate = chamber_volume(m, d, j)
    if not volume > 0.0:
        return NO_VOLUME
    # from the volume that the pressure belongs to, to the one at the end of this step
    volume_rate += (volume - integrated_volume) / m.opt.timestep
    temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
    supply = d.ctrl[i] + AMBIENT_PRESSURE
    if not supply > 0.0:
        return NO_SUPPLY
    inlet, outlet = int(u[j + CHAMBER_INLET]), int(u[j + CHAMBER_OUTLET])
    inlet_flow = through(m, d, inlet, supply, AMBIENT_TEMPERATURE, pressure, temperature)
    outlet_flow = through(m, d, outlet, pressure, temperature, AMBIENT_PRESSURE, AMBIENT_TEMPERATURE)
    flow_in, flow_out = inward_and_outward(inlet_flow, outlet_flow)
    # midpoint rule: the explicit one loses pressure whichever way the volume moves
    wall, half = u[j + CHAMBER_WALL_CONDUCTANCE], 0.5 * m.opt.timestep
    rate = pressure_rate(pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall)
    pressure += half * rate
    integrated_volume += half * volume_rate
    mass += half * (flow_in - flow_out)
    temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
    rate = pressure_rate(pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall)
    act_dot, userdata, row = d.act_dot, d.userdata, int(u[j + CHAMBER_USERDATA])
    act_dot[adr + AIR_MASS] = flow_in - flow_out
    act_dot[adr + INTEGRATED_VOLUME] = volume_rate
    act_dot[adr + ABSOLUTE_PRESSURE] = rate
    userdata[row + INLET_FLOW], userdata[row + OUTLET_FLOW] = inlet_flow, outlet_flow
    userdata[row + VOLUME] = volume
    return FINE


@register_jitable
def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the valve actuator i, whose row starts at j."""
    u = m.actuator_user
    adr = m.actuator_actadr[i]
    d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = valve_rates(
        d.ctrl[i],
        d.act[adr + ARMATURE],
        d.act[adr + OPENING],
        u[j + VALVE_OPENING_DELAY],
        u[j + VALVE_CLOSING_DELAY],
        m.opt.timestep,
    )
