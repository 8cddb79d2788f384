"""The air of a network: its nodes and restrictions out of the model, the flows between them, their rates.

    node      a chamber, a volume, a store; the ambient air and the supply, whose pressures are given
    edge      a valve or a restriction between two nodes

The last node of a network leads: its dyn takes the step for all of it (`air_step`). MuJoCo sets the rates of
an actuator to zero before it calls its dyn, so none of the others may come after it.
"""

import math
from typing import Any

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.native.air_block import (
    AMBIENT,
    EDGE_1,
    EDGE_2,
    EDGE_3,
    EDGE_4,
    EDGE_CONDUCTANCE,
    EDGE_CRITICAL,
    EDGE_END,
    EDGE_FLOW,
    EDGE_LAW,
    EDGE_NUMBERS,
    EDGE_OPENING,
    EDGE_ORIGIN,
    EDGE_PLACE,
    EDGE_STEEPNESS,
    FIRST_EDGE,
    FIRST_NODE,
    NODE_ACTUATOR,
    NODE_ENTHALPY,
    NODE_KIND,
    NODE_MASS,
    NODE_MASS_RATE,
    NODE_NUMBERS,
    NODE_POWER,
    NODE_POWER_RATE,
    NODE_PRESSURE,
    NODE_SIGMA,
    NODE_SIGMA_RATE,
    NODE_STEEPNESS,
    NODE_TEMPERATURE,
    NODE_VOLUME,
    NODE_VOLUME_CHANGE,
    NODE_WALL,
    OF_FIXED,
    OF_STORE,
    OF_VOLUME,
    SUPPLY,
)
from afo_sim.native.complaints import FINE, NO_AIR, NO_PRESSURE, NO_SUPPLY, NO_VOLUME
from afo_sim.native.slots import (
    AIR_FIRST_EDGE,
    AIR_FIRST_NODE,
    AIR_NEXT,
    AIR_STEEPNESS,
    AIR_UPSTREAM,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_USERDATA,
    CHAMBER_WALL_CONDUCTANCE,
    EDGE_ROW_1,
    EDGE_ROW_END,
    EDGE_ROW_FOLLOWS,
    EDGE_ROW_LAW,
    EDGE_ROW_NEXT,
    EDGE_ROW_ORIGIN,
    EDGE_ROW_PLACE,
    EDGE_ROW_STEEPNESS,
    KIND_CHAMBER,
    KIND_STORE,
    KIND_VALVE,
    STORE_GAS,
    VALVE_CONDUCTANCE,
    VALVE_CRITICAL_RATIO,
    VOLUME_POWER,
    VOLUME_POWER_RATE,
)
from afo_sim.native.state import (
    AIR_MASS,
    LAST_PRESSURE,
    LAST_VOLUME,
    OPENING,
    PRESSURE,
    RUNNING,
    SIGMA,
    STORE_MASS,
    STORE_TEMPERATURE,
    VOLUME,
)
from afo_sim.physics.air_path import (
    COMPRESSOR,
    ONE_WAY,
    QUICK_EXHAUST,
    REGULATED,
    RELIEF,
    TWO_WAY,
    one_way_flow,
    ramp,
)
from afo_sim.physics.feeding import compressor_flow, regulator_flow, relief_flow
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import chamber_pressure, valve_flow
from afo_sim.physics.store import store_pressure

NEAR = 0.01  # relative change of a volume over a step up to which its powers follow by a series [-]


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
def take_nodes(m: Any, d: Any, j: int, s: Any) -> int:
    """Put the nodes of the network led by the node in row j into the block s; their number.

    The pressure of a chamber is what the network of muscles has solved at the start of the step.
    """
    u, act, data = m.actuator_user, d.act, d.userdata
    _fix(s, AMBIENT, AMBIENT_PRESSURE)
    _fix(s, SUPPLY, d.ctrl[int(u[j + AIR_FIRST_NODE])] + AMBIENT_PRESSURE)
    s[SUPPLY * NODE_NUMBERS + NODE_ACTUATOR] = u[j + AIR_UPSTREAM]  # the node that it draws from, or 0
    number, actuator = FIRST_NODE, int(u[j + AIR_FIRST_NODE])
    while actuator >= 0:
        q, n, adr = m.nuser_actuator * actuator, NODE_NUMBERS * number, m.actuator_actadr[actuator]
        kind, place = u[q + 1], int(u[q + CHAMBER_USERDATA])
        s[n + NODE_ACTUATOR] = float(actuator)
        s[n + NODE_WALL], s[n + NODE_STEEPNESS] = u[q + CHAMBER_WALL_CONDUCTANCE], u[q + AIR_STEEPNESS]
        s[n + NODE_MASS], s[n + NODE_SIGMA] = act[adr + AIR_MASS], act[adr + SIGMA]
        s[n + NODE_KIND] = OF_STORE if kind == KIND_STORE else OF_VOLUME
        s[n + NODE_VOLUME_CHANGE] = s[n + NODE_POWER] = 0.0
        if kind == KIND_STORE:  # slow: its pressure stays over the step, and the line warms what it gives
            s[n + NODE_PRESSURE] = pressure_of_store(
                u, q, act[adr + STORE_MASS], act[adr + STORE_TEMPERATURE]
            )
            s[n + NODE_TEMPERATURE], s[n + NODE_SIGMA_RATE] = AMBIENT_TEMPERATURE, 0.0
        elif kind == KIND_CHAMBER:
            s[n + NODE_VOLUME], s[n + NODE_PRESSURE] = data[place + VOLUME], data[place + PRESSURE]
            change = data[place + VOLUME] - act[adr + LAST_VOLUME]
            if data[place + VOLUME] + change > 0.0:  # else it has no past, as at rest, and stays
                s[n + NODE_VOLUME_CHANGE] = change
        else:
            s[n + NODE_VOLUME] = u[q + CHAMBER_TUBE_VOLUME]
            s[n + NODE_POWER], s[n + NODE_POWER_RATE] = u[q + VOLUME_POWER], u[q + VOLUME_POWER_RATE]
        actuator, number = int(u[q + AIR_NEXT]), number + 1
    return number


@register_jitable
def pressure_of_store(u: Any, q: int, mass: float, temperature: float) -> float:
    """Absolute pressure of the store whose row starts at q [Pa]."""
    g = q + STORE_GAS
    return store_pressure(
        mass, temperature, u[q + CHAMBER_TUBE_VOLUME], u[g], u[g + 2], u[g + 3], u[g + 4], u[g + 5], u[g + 6]
    )


@register_jitable
def _fix(s: Any, number: int, pressure: float) -> None:
    """A node of given pressure, at ambient temperature."""
    n = NODE_NUMBERS * number
    s[n + NODE_KIND], s[n + NODE_TEMPERATURE] = OF_FIXED, AMBIENT_TEMPERATURE
    s[n + NODE_PRESSURE] = s[n + NODE_SIGMA] = pressure


@register_jitable
def take_edges(m: Any, d: Any, j: int, s: Any) -> int:
    """Put what is open of the network led by the node in row j into the block; the end."""
    u, act = m.actuator_user, d.act
    e, actuator = FIRST_EDGE, int(u[j + AIR_FIRST_EDGE])
    while actuator >= 0:
        q = m.nuser_actuator * actuator
        law, opening = u[q + EDGE_ROW_LAW], 1.0
        if u[q + EDGE_ROW_FOLLOWS] > 0.0:  # the other way of a three-way valve; the slot holds one more
            opening = 1.0 - act[m.actuator_actadr[int(u[q + EDGE_ROW_FOLLOWS]) - 1] + OPENING]
        elif u[q + 1] == KIND_VALVE:
            opening = act[m.actuator_actadr[actuator] + OPENING]
        elif law == COMPRESSOR:
            opening = act[m.actuator_actadr[actuator] + RUNNING]
        if opening == 0.0:  # shut: not there in this step
            d.userdata[int(u[q + EDGE_ROW_PLACE])] = 0.0
        else:
            s[e + EDGE_ORIGIN], s[e + EDGE_END] = u[q + EDGE_ROW_ORIGIN], u[q + EDGE_ROW_END]
            s[e + EDGE_LAW], s[e + EDGE_PLACE], s[e + EDGE_OPENING] = law, u[q + EDGE_ROW_PLACE], opening
            s[e + EDGE_CONDUCTANCE] = u[q + VALVE_CONDUCTANCE]
            s[e + EDGE_CRITICAL] = u[q + VALVE_CRITICAL_RATIO]
            if law != TWO_WAY:
                for k in range(4):
                    s[e + EDGE_1 + k] = u[q + EDGE_ROW_1 + k]
            e += EDGE_NUMBERS
        actuator = int(u[q + EDGE_ROW_NEXT])
    return e


@register_jitable
def take_slopes(m: Any, j: int, s: Any, edges: int) -> None:
    """Put the steepness of all that `take_edges` has put into the block there too."""
    u = m.actuator_user
    e, actuator = FIRST_EDGE, int(u[j + AIR_FIRST_EDGE])
    while actuator >= 0 and e < edges:
        q = m.nuser_actuator * actuator
        if s[e + EDGE_PLACE] == u[q + EDGE_ROW_PLACE]:
            s[e + EDGE_STEEPNESS] = s[e + EDGE_OPENING] * u[q + EDGE_ROW_STEEPNESS]
            e += EDGE_NUMBERS
        actuator = int(u[q + EDGE_ROW_NEXT])


@register_jitable
def evaluate(s: Any, nodes: int, edges: int, share: float, given: bool, gas: float, gamma: float) -> None:
    """Pressures, flows and rates of a network in the state that the block holds, at a share of the step.

    Units: share [-], gas, gamma [J/(kg·K)].
    """
    for number in range(FIRST_NODE, nodes):
        n = NODE_NUMBERS * number
        state_of(s, n, share, given, gas, gamma)
        s[n + NODE_MASS_RATE] = s[n + NODE_ENTHALPY] = 0.0
    upstream = NODE_NUMBERS * int(s[SUPPLY * NODE_NUMBERS + NODE_ACTUATOR])
    supply = NODE_NUMBERS * SUPPLY
    for n in (0, supply):
        s[n + NODE_MASS_RATE] = s[n + NODE_ENTHALPY] = 0.0
    if upstream > 0:  # it holds its pressure as long as what is behind it has more
        if s[upstream + NODE_PRESSURE] < s[supply + NODE_SIGMA]:
            s[supply + NODE_PRESSURE] = s[upstream + NODE_PRESSURE]
        else:
            s[supply + NODE_PRESSURE] = s[supply + NODE_SIGMA]
        if s[upstream + NODE_KIND] == OF_VOLUME:
            s[supply + NODE_TEMPERATURE] = s[upstream + NODE_TEMPERATURE]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        a, b = NODE_NUMBERS * int(s[e + EDGE_ORIGIN]), NODE_NUMBERS * int(s[e + EDGE_END])
        flow = flow_through(s, e, a, b)
        if upstream > 0 and ((a == supply and flow < 0.0) or (b == supply and flow > 0.0)):
            flow = 0.0  # nothing runs back into a regulator
        s[e + EDGE_FLOW] = flow
        carried = flow * (s[a + NODE_TEMPERATURE] if flow >= 0.0 else s[b + NODE_TEMPERATURE])
        s[a + NODE_MASS_RATE] -= flow
        s[a + NODE_ENTHALPY] -= carried
        s[b + NODE_MASS_RATE] += flow
        s[b + NODE_ENTHALPY] += carried
    if upstream > 0:
        s[upstream + NODE_MASS_RATE] += s[supply + NODE_MASS_RATE]
        s[upstream + NODE_ENTHALPY] += s[supply + NODE_ENTHALPY]
    for number in range(FIRST_NODE, nodes):
        rate_of(s, NODE_NUMBERS * number, share, gas, gamma)


@register_jitable
def keep_powers(s: Any, nodes: int, gamma: float) -> None:
    """Keep V^−γ and V^(γ − 1) of chambers for the stages of a step, over which V hardly changes."""
    for number in range(FIRST_NODE, nodes):
        n = NODE_NUMBERS * number
        volume = s[n + NODE_VOLUME]
        if s[n + NODE_KIND] != OF_VOLUME or s[n + NODE_POWER] > 0.0:
            continue
        if abs(s[n + NODE_VOLUME_CHANGE]) < NEAR * volume:
            s[n + NODE_POWER] = volume**-gamma
            s[n + NODE_POWER_RATE] = 1.0 / (volume * s[n + NODE_POWER])


@register_jitable
def power_near(x: float, exponent: float) -> float:
    """(1 + x)^a by its series up to x³: exact at 0, and within 2e-8 up to `NEAR` for −1.4 ≤ a ≤ 0.4."""
    a = exponent
    return 1.0 + a * x * (1.0 + 0.5 * (a - 1.0) * x * (1.0 + (a - 2.0) / 3.0 * x))


@register_jitable
def state_of(s: Any, n: int, share: float, given: bool, gas: float, gamma: float) -> None:
    """Pressure and temperature of the node whose block starts at n, from its mass and σ = p V^γ."""
    if s[n + NODE_KIND] == OF_STORE:
        return
    volume = s[n + NODE_VOLUME] + share * s[n + NODE_VOLUME_CHANGE]
    if s[n + NODE_POWER] > 0.0:
        widened = share * s[n + NODE_VOLUME_CHANGE] / s[n + NODE_VOLUME]
        s[n + NODE_PRESSURE] = s[n + NODE_SIGMA] * s[n + NODE_POWER] * power_near(widened, -gamma)
    elif not given:
        s[n + NODE_PRESSURE] = chamber_pressure(s[n + NODE_SIGMA], volume, gamma)
    s[n + NODE_TEMPERATURE] = s[n + NODE_PRESSURE] * volume / (s[n + NODE_MASS] * gas)


@register_jitable
def rate_of(s: Any, n: int, share: float, gas: float, gamma: float) -> None:
    """σ̇ of the node whose block starts at n, from the energy that its flows carry and the wall's heat."""
    if s[n + NODE_KIND] == OF_STORE:
        return
    if s[n + NODE_POWER] > 0.0:
        widened = share * s[n + NODE_VOLUME_CHANGE] / s[n + NODE_VOLUME]
        power = s[n + NODE_POWER_RATE] * power_near(widened, gamma - 1.0)
    else:
        volume = s[n + NODE_VOLUME] + share * s[n + NODE_VOLUME_CHANGE]
        power = volume ** (gamma - 1.0) if volume > 0.0 else math.nan
    heat = (gamma - 1.0) * s[n + NODE_WALL] * (AMBIENT_TEMPERATURE - s[n + NODE_TEMPERATURE])
    s[n + NODE_SIGMA_RATE] = power * (gamma * gas * s[n + NODE_ENTHALPY] + heat)


@register_jitable
def flow_through(s: Any, e: int, a: int, b: int) -> float:
    """Mass flow of the restriction whose block starts at e, from the node at a to the node at b [kg/s]."""
    law, opening = s[e + EDGE_LAW], s[e + EDGE_OPENING]
    p1, t1, p2, t2 = (
        s[a + NODE_PRESSURE],
        s[a + NODE_TEMPERATURE],
        s[b + NODE_PRESSURE],
        s[b + NODE_TEMPERATURE],
    )
    conductance, critical = s[e + EDGE_CONDUCTANCE], s[e + EDGE_CRITICAL]
    if law == TWO_WAY:
        return valve_flow(p1, t1, p2, t2, opening, conductance, critical)
    if law == ONE_WAY:
        return one_way_flow(
            p1, t1, p2, t2, conductance, critical, s[e + EDGE_1], s[e + EDGE_2], s[e + EDGE_3], s[e + EDGE_4]
        )
    if law == QUICK_EXHAUST:
        pilot = s[NODE_NUMBERS * int(s[e + EDGE_1]) + NODE_PRESSURE]
        return valve_flow(
            p1, t1, p2, t2, ramp(p1 - pilot - s[e + EDGE_2], s[e + EDGE_3]), conductance, critical
        )
    if law == REGULATED:
        return regulator_flow(p1, p2, t1, s[e + EDGE_1], s[e + EDGE_2], conductance, critical)
    if law == RELIEF:
        return relief_flow(p1, p2, t1, s[e + EDGE_1], s[e + EDGE_2], conductance, critical)
    if law == COMPRESSOR and opening > 0.5:
        return compressor_flow(p2 - AMBIENT_PRESSURE, s[e + EDGE_1], 0.0, s[e + EDGE_2])
    return 0.0 * (p1 - p2)  # a NaN stays one
