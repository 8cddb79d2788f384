"""The air of a network: its nodes and restrictions out of the model, the flows between them, their rates.

    node      a chamber, a volume, a store; the ambient air and the supply, whose pressures are given
    edge      a valve or a restriction between two nodes

The last node of a network leads: its dyn takes the step for all of it (`air_step`). MuJoCo sets the rates of
an actuator to zero before it calls its dyn, so none of the others may come after it.
"""

from typing import Any

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.native.air_block import (
    AMBIENT,
    EDGE,
    EDGE_NUMBERS,
    FIRST_BLOCK,
    FIRST_EDGE,
    NODE,
    NODE_NUMBERS,
    OF_FIXED,
    OF_STORE,
    OF_VOLUME,
    SUPPLY,
)
from afo_sim.native.driving import seat_of
from afo_sim.native.error_codes import FINE, NO_AIR, NO_PRESSURE, NO_SUPPLY, NO_VOLUME
from afo_sim.native.slots import (
    AIR_ROW,
    CHAMBER_ACT,
    CHAMBER_DATA,
    EDGE_ROW,
    RESTRICTION_ACT,
    STORE_ACT,
    VALVE_ROW,
    VOLUME_ROW,
    Kind,
    kind_of,
)
from afo_sim.physics import (
    COMPRESSOR,
    INERTIAL,
    NEVER,
    RESTING,
    TWO_WAY,
    chamber_pressure,
    edge_flow,
    register_jitable,
    store_pressure,
)

NEAR = 0.01  # relative change of a volume over a step up to which its powers follow by a series [-]


@register_jitable
def chamber_complaint(m: Any, d: Any, i: int) -> int:
    """The reason for which the chamber actuator i cannot be stepped; FINE for none."""
    adr = m.actuator_actadr[i]
    if not (d.act[adr + CHAMBER_ACT.sigma] > 0.0 and d.act[adr + CHAMBER_ACT.last_pressure] > 0.0):
        return NO_PRESSURE
    if not d.act[adr + CHAMBER_ACT.last_volume] > 0.0:
        return NO_VOLUME
    if not d.act[adr + CHAMBER_ACT.mass] > 0.0:
        return NO_AIR
    if not d.ctrl[i] + AMBIENT_PRESSURE > 0.0:
        return NO_SUPPLY
    return FINE


@register_jitable
def take_nodes(m: Any, d: Any, j: int, s: Any) -> int:
    """Put the nodes of the network led by the node in row j into the block s; where they end."""
    u, act, data = m.actuator_user, d.act, d.userdata
    _fix(s, AMBIENT, AMBIENT_PRESSURE)
    _fix(s, SUPPLY, d.ctrl[int(u[j + AIR_ROW.first_node])] + AMBIENT_PRESSURE)
    s[SUPPLY * NODE_NUMBERS + NODE.actuator] = u[j + AIR_ROW.upstream]  # the node that it draws from, or 0
    n, actuator = FIRST_BLOCK, int(u[j + AIR_ROW.first_node])
    while actuator >= 0:
        q, adr = m.nuser_actuator * actuator, m.actuator_actadr[actuator]
        kind, place = kind_of(u, q), int(u[q + AIR_ROW.userdata])
        s[n + NODE.actuator] = float(actuator)
        s[n + NODE.wall], s[n + NODE.steepness] = u[q + AIR_ROW.wall_conductance], u[q + AIR_ROW.steepness]
        s[n + NODE.wall_by_flow] = u[q + AIR_ROW.wall_conductance_by_flow]
        s[n + NODE.mass], s[n + NODE.sigma] = act[adr + CHAMBER_ACT.mass], act[adr + CHAMBER_ACT.sigma]
        s[n + NODE.kind] = OF_STORE if kind == Kind.STORE else OF_VOLUME
        s[n + NODE.volume_change] = s[n + NODE.power] = 0.0
        if kind == Kind.STORE:  # slow: its pressure stays over the step, and the line warms what it gives
            mass, temperature = act[adr + STORE_ACT.mass], act[adr + STORE_ACT.temperature]
            s[n + NODE.pressure] = store_pressure(mass, temperature, u[q + AIR_ROW.volume], gas_in(u, q))
            s[n + NODE.temperature], s[n + NODE.sigma_rate] = AMBIENT_TEMPERATURE, 0.0
        elif kind == Kind.CHAMBER:
            s[n + NODE.volume] = data[place + CHAMBER_DATA.volume]
            s[n + NODE.pressure] = data[place + CHAMBER_DATA.pressure]
            change = data[place + CHAMBER_DATA.volume] - act[adr + CHAMBER_ACT.last_volume]
            if data[place + CHAMBER_DATA.volume] + change > 0.0:  # else it has no past, as at rest, and stays
                s[n + NODE.volume_change] = change
        else:
            s[n + NODE.volume] = u[q + AIR_ROW.volume]
            s[n + NODE.power] = u[q + VOLUME_ROW.power]
        actuator, n = int(u[q + AIR_ROW.following]), n + NODE_NUMBERS
    return n


@register_jitable
def gas_in(u: Any, q: int) -> Any:
    """The gas of the store whose row starts at q, as the kernels of stores take it."""
    g = q + AIR_ROW.real_gas
    return u[g], u[g + 1], u[g + 2], u[g + 3], u[g + 4], u[g + 5], u[g + 6]


@register_jitable
def _fix(s: Any, number: int, pressure: float) -> None:
    """A node of given pressure, at ambient temperature."""
    n = NODE_NUMBERS * number
    s[n + NODE.kind], s[n + NODE.temperature] = OF_FIXED, AMBIENT_TEMPERATURE
    s[n + NODE.pressure] = s[n + NODE.sigma] = pressure


@register_jitable
def take_edges(m: Any, d: Any, j: int, s: Any) -> tuple[int, float]:
    """Put what opens in this step of the network led by the node in row j into the block."""
    u, act, data = m.actuator_user, d.act, d.userdata
    e, until, actuator = FIRST_EDGE, 1.0, int(u[j + AIR_ROW.first_edge])
    while actuator >= 0:
        q = m.nuser_actuator * actuator
        law, place, follows = u[q + EDGE_ROW.law], int(u[q + EDGE_ROW.place]), int(u[q + EDGE_ROW.follows])
        opening, first, second = 1.0, NEVER, NEVER
        if follows > 0:  # the other way of a three-way valve; the slot holds one more
            opening, first, second = seat_of(m, d, follows - 1)[:3]
            opening = 1.0 - opening
        elif kind_of(u, q) == Kind.VALVE:
            opening, first, second = seat_of(m, d, actuator)[:3]
        elif law == COMPRESSOR:
            opening = act[m.actuator_actadr[actuator] + RESTRICTION_ACT.state]
        if opening == 0.0 and first >= 1.0:  # shut: not there in this step
            data[place] = data[place + 1] = 0.0
        else:
            between = min(second, 1.0) - min(first, 1.0)
            data[place + 1] = abs(opening - between)
            s[e + EDGE.origin], s[e + EDGE.end] = u[q + EDGE_ROW.origin], u[q + EDGE_ROW.end]
            s[e + EDGE.law], s[e + EDGE.place], s[e + EDGE.opening] = law, u[q + EDGE_ROW.place], opening
            s[e + EDGE.first], s[e + EDGE.second] = first, second
            c, b = u[q + VALVE_ROW.conductance], u[q + VALVE_ROW.critical_ratio]
            s[e + EDGE.conductance], s[e + EDGE.critical] = c, b
            s[e + EDGE.steepness] = u[q + EDGE_ROW.steepness]
            if law != TWO_WAY:
                for k in range(4):
                    s[e + EDGE.parameters + k] = u[q + EDGE_ROW.parameters + k]
            if law == INERTIAL:
                s[e + EDGE.parameters + 1] = act[m.actuator_actadr[actuator] + RESTRICTION_ACT.state]
            until = min(until, first)
            e += EDGE_NUMBERS
        actuator = int(u[q + EDGE_ROW.following])
    return e, until


@register_jitable
def switch(s: Any, edges: int, share: float) -> float:
    """Switch the seats of the valves whose instant is a share of the step; the share of the next one [-]."""
    until = 1.0
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        while s[e + EDGE.first] <= share + RESTING:
            s[e + EDGE.opening] = 1.0 - s[e + EDGE.opening]
            s[e + EDGE.first], s[e + EDGE.second] = s[e + EDGE.second], NEVER
        until = min(until, s[e + EDGE.first])
    return until


@register_jitable
def evaluate(s: Any, nodes: int, edges: int, share: float, given: bool, gas: float, gamma: float) -> None:
    """Pressures, flows and rates of a network in the state that the block holds, at a share of the step."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        state_of(s, n, share, given, gas, gamma)
        s[n + NODE.mass_rate] = s[n + NODE.enthalpy] = s[n + NODE.inflow] = 0.0
    upstream = NODE_NUMBERS * int(s[SUPPLY * NODE_NUMBERS + NODE.actuator])
    supply = NODE_NUMBERS * SUPPLY
    for n in (0, supply):
        s[n + NODE.mass_rate] = s[n + NODE.enthalpy] = 0.0
    if upstream > 0:  # it holds its pressure as long as what is behind it has more
        if s[upstream + NODE.pressure] < s[supply + NODE.sigma]:
            s[supply + NODE.pressure] = s[upstream + NODE.pressure]
        else:
            s[supply + NODE.pressure] = s[supply + NODE.sigma]
        if s[upstream + NODE.kind] == OF_VOLUME:
            s[supply + NODE.temperature] = s[upstream + NODE.temperature]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        a, b = NODE_NUMBERS * int(s[e + EDGE.origin]), NODE_NUMBERS * int(s[e + EDGE.end])
        flow = flow_through(s, e, a, b)
        if upstream > 0 and ((a == supply and flow < 0.0) or (b == supply and flow > 0.0)):
            flow = 0.0  # nothing runs back into a regulator
        s[e + EDGE.flow] = flow
        carried = flow * (s[a + NODE.temperature] if flow >= 0.0 else s[b + NODE.temperature])
        s[a + NODE.mass_rate] -= flow
        s[a + NODE.enthalpy] -= carried
        s[b + NODE.mass_rate] += flow
        s[b + NODE.enthalpy] += carried
        s[(b if flow >= 0.0 else a) + NODE.inflow] += abs(flow)
    if upstream > 0:
        s[upstream + NODE.mass_rate] += s[supply + NODE.mass_rate]
        s[upstream + NODE.enthalpy] += s[supply + NODE.enthalpy]
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        rate_of(s, n, gas, gamma)


@register_jitable
def keep_powers(s: Any, nodes: int, gamma: float) -> None:
    """Keep V^−γ of chambers for the stages of a step, over which V hardly changes."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        volume = s[n + NODE.volume]
        if s[n + NODE.kind] != OF_VOLUME or s[n + NODE.power] > 0.0:
            continue
        if abs(s[n + NODE.volume_change]) < NEAR * volume:
            s[n + NODE.power] = volume**-gamma


@register_jitable
def power_near(x: float, exponent: float) -> float:
    """(1 + x)^a by its series up to x³: exact at 0, and within 2e-8 up to `NEAR` for a ≥ −1.4."""
    a = exponent
    return 1.0 + a * x * (1.0 + 0.5 * (a - 1.0) * x * (1.0 + (a - 2.0) / 3.0 * x))


@register_jitable
def state_of(s: Any, n: int, share: float, given: bool, gas: float, gamma: float) -> None:
    """Pressure and temperature of the node whose block starts at n, from its mass and σ = p V^γ."""
    if s[n + NODE.kind] == OF_STORE:
        return
    volume = s[n + NODE.volume] + share * s[n + NODE.volume_change]
    if s[n + NODE.power] > 0.0:
        widened = share * s[n + NODE.volume_change] / s[n + NODE.volume]
        s[n + NODE.pressure] = s[n + NODE.sigma] * s[n + NODE.power] * power_near(widened, -gamma)
    elif not given:
        s[n + NODE.pressure] = chamber_pressure(s[n + NODE.sigma], volume, gamma)
    s[n + NODE.temperature] = s[n + NODE.pressure] * volume / (s[n + NODE.mass] * gas)


@register_jitable
def rate_of(s: Any, n: int, gas: float, gamma: float) -> None:
    """σ̇ of the node whose block starts at n, from the energy that its flows carry and the wall's heat."""
    # The energy grows p by (γ − 1)/V, and σ by V^(γ − 1) = σ/(p V) = σ/(m R T) more.
    if s[n + NODE.kind] == OF_STORE:
        return
    power = s[n + NODE.sigma] / (s[n + NODE.mass] * gas * s[n + NODE.temperature])
    wall = s[n + NODE.wall] + s[n + NODE.wall_by_flow] * s[n + NODE.inflow]
    heat = (gamma - 1.0) * wall * (AMBIENT_TEMPERATURE - s[n + NODE.temperature])
    s[n + NODE.sigma_rate] = power * (gamma * gas * s[n + NODE.enthalpy] + heat)


@register_jitable
def flow_through(s: Any, e: int, a: int, b: int) -> float:
    """Mass flow of the restriction whose block starts at e, from the node at a to the node at b [kg/s]."""
    p1, t1 = s[a + NODE.pressure], s[a + NODE.temperature]
    p2, t2 = s[b + NODE.pressure], s[b + NODE.temperature]
    law, opening, k = s[e + EDGE.law], s[e + EDGE.opening], e + EDGE.parameters
    c, critical = s[e + EDGE.conductance], s[e + EDGE.critical]
    return edge_flow(law, p1, t1, p2, t2, opening, c, critical, s, k, NODE.pressure, NODE_NUMBERS)
