"""Chamber and valve: rates of their states."""

from typing import Any

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.native.complaints import FINE, NO_AIR, NO_PRESSURE, NO_SUPPLY, NO_VOLUME
from afo_sim.native.slots import (
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_USERDATA,
    CHAMBER_WALL_CONDUCTANCE,
    VALVE_BANDWIDTH,
    VALVE_CLOSING_DELAY,
    VALVE_COIL,
    VALVE_CONDUCTANCE,
    VALVE_CRITICAL_RATIO,
    VALVE_OPENING_DELAY,
)
from afo_sim.native.state import (
    AIR_MASS,
    ARMATURE,
    INLET_FLOW,
    LAST_PRESSURE,
    LAST_VOLUME,
    OPENING,
    OUTLET_FLOW,
    PRESSURE,
    SIGMA,
    VOLUME,
)
from afo_sim.physics.driving import proportional_rate
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import chamber_pressure, sigma_rate, valve_flow, valve_rates


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
def flows(m: Any, d: Any, i: int, j: int, pressure: float, temperature: float) -> tuple[float, float]:
    """Flows through inlet and outlet of the chamber actuator i at a pressure and temperature [kg/s]."""
    u = m.actuator_user
    supply = d.ctrl[i] + AMBIENT_PRESSURE
    inlet, outlet = int(u[j + CHAMBER_INLET]), int(u[j + CHAMBER_OUTLET])
    return (
        through(m, d, inlet, supply, AMBIENT_TEMPERATURE, pressure, temperature),
        through(m, d, outlet, pressure, temperature, AMBIENT_PRESSURE, AMBIENT_TEMPERATURE),
    )


@register_jitable
def chamber_complaint(m: Any, d: Any, i: int) -> int:
    """The reason for which the chamber actuator i cannot be stepped; FINE for none."""
    adr = m.actuator_actadr[i]
    if not (d.act[adr + SIGMA] > 0.0 and d.act[adr + LAST_PRESSURE] > 0.0):
        return NO_PRESSURE
    if not d.act[adr + LAST_VOLUME] > 0.0:
        return NO_VOLUME
    if not d.act[adr + AIR_MASS] > 0.0:
        return NO_AIR
    if not d.ctrl[i] + AMBIENT_PRESSURE > 0.0:
        return NO_SUPPLY
    return FINE


@register_jitable
def chamber_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the chamber actuator i, whose row starts at j, from what its network has solved.

    The midpoint rule: σ and m half a step on, and the volume there by what it moved in the last step.
    """
    u, act, act_dot, data = m.actuator_user, d.act, d.act_dot, d.userdata
    adr, place = m.actuator_actadr[i], int(u[j + CHAMBER_USERDATA])
    step, wall = m.opt.timestep, u[j + CHAMBER_WALL_CONDUCTANCE]
    volume, pressure = data[place + VOLUME], data[place + PRESSURE]
    mass, sigma = act[adr + AIR_MASS], act[adr + SIGMA]
    temperature = pressure * volume / (mass * GAS_CONSTANT)
    inlet_flow, outlet_flow = flows(m, d, i, j, pressure, temperature)
    flow_in, flow_out = inward_and_outward(inlet_flow, outlet_flow)
    half_sigma = sigma + 0.5 * step * sigma_rate(temperature, volume, flow_in, flow_out, wall)
    half_mass = mass + 0.5 * step * (flow_in - flow_out)
    half_volume = volume + 0.5 * (volume - act[adr + LAST_VOLUME])
    if not (half_sigma > 0.0 and half_mass > 0.0 and half_volume > 0.0):  # the next step will complain
        half_sigma, half_mass, half_volume = sigma, mass, volume
    half_pressure = chamber_pressure(half_sigma, half_volume)
    temperature = half_pressure * half_volume / (half_mass * GAS_CONSTANT)
    inlet_flow, outlet_flow = flows(m, d, i, j, half_pressure, temperature)
    flow_in, flow_out = inward_and_outward(inlet_flow, outlet_flow)
    act_dot[adr + AIR_MASS] = flow_in - flow_out
    act_dot[adr + SIGMA] = sigma_rate(temperature, half_volume, flow_in, flow_out, wall)
    act_dot[adr + LAST_VOLUME] = (volume - act[adr + LAST_VOLUME]) / step
    act_dot[adr + LAST_PRESSURE] = (pressure - act[adr + LAST_PRESSURE]) / step
    data[place + INLET_FLOW], data[place + OUTLET_FLOW] = inlet_flow, outlet_flow


@register_jitable
def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the valve actuator i, whose row starts at j; its coil is its input or a drive's."""
    u = m.actuator_user
    adr, driven = m.actuator_actadr[i], int(u[j + VALVE_COIL])
    coil = d.userdata[driven - 1] if driven > 0 else d.ctrl[i]
    if u[j + VALVE_BANDWIDTH] > 0.0:
        rate = proportional_rate(coil, d.act[adr + OPENING], u[j + VALVE_BANDWIDTH], m.opt.timestep)
        d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = rate, rate
        return
    d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = valve_rates(
        coil,
        d.act[adr + ARMATURE],
        d.act[adr + OPENING],
        u[j + VALVE_OPENING_DELAY],
        u[j + VALVE_CLOSING_DELAY],
        m.opt.timestep,
    )
