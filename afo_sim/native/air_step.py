"""One step of the air of a network: the midpoint rule, or Chebyshev stages where the air is stiff.

A step is taken in pieces from one switching of a valve to the next, so that openings stay over each. Where a
node would change by more than a share of itself, a piece is taken in parts. What a restriction has moved is
integrated by the same scheme as the nodes, so that no air is lost between them. In one part and without
stiffness this is the midpoint rule with the volume half a step on, by what it moved in the last step.

The flow of a line with inertia stays over a part; before and after it the pressures push it on for half a
part (Strang's splitting). Of a line that rings this is Verlet's method.
"""

import math
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.native.air import evaluate, gas_in, keep_powers, state_of, switch, take_edges, take_nodes
from afo_sim.native.air_block import (
    EDGE,
    EDGE_NUMBERS,
    FIRST_BLOCK,
    FIRST_EDGE,
    NODE,
    NODE_NUMBERS,
    OF_STORE,
    OF_VOLUME,
    SUPPLY,
    block,
)
from afo_sim.native.slots import (
    AIR_ROW,
    CHAMBER_ACT,
    CHAMBER_DATA,
    EDGE_ROW,
    RESTRICTION_ACT,
    STORE_ACT,
    STORE_ROW,
    VOLUME_DATA,
    Kind,
    kind_of,
)
from afo_sim.physics import (
    INERTIAL,
    RESTING,
    compressor_runs,
    following,
    line_flow,
    register_jitable,
    stages,
    store_temperature_rate,
)
from afo_sim.physics.chebyshev import origin

CHANGE = 0.1  # of a node's air or σ in a part of a step, at most [-]
MOST_PARTS = 512
ERROR = 2e-5  # of a node's air or σ in a part of a step of Chebyshev stages, as estimated, at most [-]
MARGIN = 1.2  # by which the slope of the air may exceed its estimate [-]
RINGING = 0.2  # angular frequency of lines with inertia × part, at most; their period is then 0.2 % short [-]
SLOW = 0.3  # rate × part up to which the midpoint rule is taken, without an estimate of its error


@register_jitable
def air_dyn(m: Any, d: Any, j: int) -> None:
    """Write the rates of all nodes of the network that the node whose row starts at j leads; else nothing."""
    u = m.actuator_user
    if not u[j + AIR_ROW.leads] > 0.0:
        return
    gas, gamma = u[j + AIR_ROW.gas_constant], u[j + AIR_ROW.heat_capacity_ratio]
    s = block()
    nodes = take_nodes(m, d, j, s)
    edges, until = take_edges(m, d, j, s)
    evaluate(s, nodes, edges, 0.0, True, gas, gamma)
    step = m.opt.timestep
    if kind_of(u, j) != Kind.CHAMBER:  # the last node leads, and chambers come first
        for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
            q = m.nuser_actuator * int(s[n + NODE.actuator])
            if kind_of(u, q) != Kind.CHAMBER:
                d.userdata[int(u[q + AIR_ROW.userdata]) + VOLUME_DATA.pressure] = s[n + NODE.pressure]
    if until > 1.0 - RESTING and calm(s, nodes, step, gas, gamma):
        if one_midpoint(s, nodes, edges, step, gas, gamma):
            write_rates(m, d, nodes, s, True)
            write_flows(m, d, edges, s, True)
            return
        take_nodes(m, d, j, s)  # which it has moved
        evaluate(s, nodes, edges, 0.0, True, gas, gamma)
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        s[e + EDGE.total] = 0.0
    share = 0.0
    while share < 1.0:  # from one switching of a valve to the next, and to the step's end
        if until > 1.0 - RESTING:
            until = 1.0
        if not advance(s, nodes, edges, step, share, until - share, gas, gamma):
            for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
                s[n + NODE.mass] = s[n + NODE.sigma] = math.nan  # the next step will complain
            break
        share = until
        if share < 1.0:
            until = switch(s, edges, share)
            evaluate(s, nodes, edges, share, False, gas, gamma)
    write_rates(m, d, nodes, s, False)
    write_flows(m, d, edges, s, False)


@register_jitable
def calm(s: Any, nodes: int, step: float, gas: float, gamma: float) -> bool:
    """Whether one midpoint takes the step, even were all valves open: most steps of most circuits."""
    # As `fastest` has it, with R T/V = p/m: γ p Σ k + (γ − 1) hA/R by the mass.
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        mass = s[n + NODE.mass]
        if s[n + NODE.kind] == OF_STORE:
            return False
        rate = gamma * gas * s[n + NODE.pressure] * s[n + NODE.steepness] + (gamma - 1.0) * s[n + NODE.wall]
        if not step * rate <= SLOW * mass * gas:
            return False
        if not step * abs(s[n + NODE.mass_rate]) <= CHANGE * mass:
            return False
        if not step * abs(s[n + NODE.sigma_rate]) <= CHANGE * s[n + NODE.sigma]:
            return False
    return True


@register_jitable
def one_midpoint(s: Any, nodes: int, edges: int, step: float, gas: float, gamma: float) -> bool:
    """The rates of a step of the midpoint rule in one part into the block; False where it fails."""
    half = 0.5 * step
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        s[n + NODE.first_mass], s[n + NODE.first_sigma] = s[n + NODE.mass], s[n + NODE.sigma]
        s[n + NODE.mass] += half * s[n + NODE.mass_rate]
        s[n + NODE.sigma] += half * s[n + NODE.sigma_rate]
    evaluate(s, nodes, edges, 0.5, False, gas, gamma)
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        if not (
            s[n + NODE.first_mass] + step * s[n + NODE.mass_rate] > 0.0
            and s[n + NODE.first_sigma] + step * s[n + NODE.sigma_rate] > 0.0
        ):
            return False
    return True


@register_jitable
def fastest(s: Any, nodes: int, edges: int, gas: float, gamma: float) -> tuple[float, float, float]:
    """The fastest rate of decay of a network [1/s], at most, and the largest share that changes [1/s]."""
    # And the angular frequency of lines with inertia, at most: ω² = Σ (A/L) γ R T/V of all their ends.
    # dp/dt = γ R T/V Σ k (p' − p) with the steepest slope k of each restriction. A circle that holds all
    # rates (Gershgorin) counts k twice between two volumes.
    rate, change, ringing = 0.0, 0.0, 0.0
    for n in range(0, nodes, NODE_NUMBERS):
        s[n + NODE.steepness] = 0.0
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        a, b = NODE_NUMBERS * int(s[e + EDGE.origin]), NODE_NUMBERS * int(s[e + EDGE.end])
        twice = 2.0 if s[a + NODE.kind] == OF_VOLUME and s[b + NODE.kind] == OF_VOLUME else 1.0
        slope = twice * s[e + EDGE.opening] * s[e + EDGE.steepness]
        s[a + NODE.steepness] += slope
        s[b + NODE.steepness] += slope
        if s[e + EDGE.law] == INERTIAL:
            for n in (a, b):
                if s[n + NODE.kind] == OF_VOLUME:
                    stiff = gamma * gas * s[n + NODE.temperature] / s[n + NODE.volume]
                    ringing += s[e + EDGE.parameters] * stiff
    upstream = int(s[NODE_NUMBERS * SUPPLY + NODE.actuator])
    if upstream > 0:  # what draws from the supply may draw from behind it
        s[NODE_NUMBERS * upstream + NODE.steepness] += 2.0 * s[NODE_NUMBERS * SUPPLY + NODE.steepness]
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        mass, share = s[n + NODE.mass], abs(s[n + NODE.sigma_rate] / s[n + NODE.sigma])
        change = max(change, share, abs(s[n + NODE.mass_rate] / mass))
        if s[n + NODE.kind] != OF_STORE:
            air = gamma * gas * s[n + NODE.temperature] * s[n + NODE.steepness] / s[n + NODE.volume]
            rate = max(rate, air + (gamma - 1.0) * s[n + NODE.wall] / (mass * gas))
    return rate, change, math.sqrt(ringing)


@register_jitable
def push_lines(s: Any, nodes: int, edges: int, time: float, share: float, gas: float, gamma: float) -> None:
    """Flows of lines with inertia after a time under the pressures at a share of the step."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        state_of(s, n, share, False, gas, gamma)
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        if s[e + EDGE.law] == INERTIAL:
            a, b = NODE_NUMBERS * int(s[e + EDGE.origin]), NODE_NUMBERS * int(s[e + EDGE.end])
            p1, t1 = s[a + NODE.pressure], s[a + NODE.temperature]
            p2, t2 = s[b + NODE.pressure], s[b + NODE.temperature]
            c, critical, k = s[e + EDGE.conductance], s[e + EDGE.critical], e + EDGE.parameters
            s[k + 2] = s[k + 1]
            s[k + 1] = line_flow(s[k + 1], p1, t1, p2, t2, c, critical, time * s[k])


@register_jitable
def advance(
    s: Any, nodes: int, edges: int, step: float, begins: float, width: float, gas: float, gamma: float
) -> bool:
    """Take a share of a step, over which no valve switches, in parts; False where the shortest one fails."""
    rate, change, ringing = fastest(s, nodes, edges, gas, gamma)
    parts, k = 1, 0
    while parts < MOST_PARTS and (
        change * step * width > CHANGE * parts or ringing * step * width > RINGING * parts
    ):
        parts *= 2
    if parts > 1 or step * width * rate > SLOW:
        keep_powers(s, nodes, gamma)
    known = True  # whether the rates at the part's beginning stand in the block
    while k < parts:
        of_step = width / parts
        part, share = step * of_step, begins + k * of_step
        if ringing > 0.0:
            push_lines(s, nodes, edges, 0.5 * part, share, gas, gamma)
            known = False
        if not known:
            evaluate(s, nodes, edges, share, False, gas, gamma)
        begin(s, nodes, edges)
        known = False
        if part * rate <= SLOW:
            fine = midpoint(s, nodes, edges, part, share, of_step, gas, gamma)
        else:
            fine = chebyshev(s, nodes, edges, part, rate, share, of_step, gas, gamma)
            if fine and parts < MOST_PARTS:
                evaluate(s, nodes, edges, share + of_step, False, gas, gamma)
                fine = error(s, nodes, part) <= ERROR
                known = True
        if fine:
            for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
                s[e + EDGE.total] += s[e + EDGE.moved]
            if ringing > 0.0:
                push_lines(s, nodes, edges, 0.5 * part, share + of_step, gas, gamma)
            k += 1
        elif parts < MOST_PARTS:
            restore(s, nodes, edges)
            k, parts, known = 2 * k, 2 * parts, True
        else:
            return False
    return True


@register_jitable
def restore(s: Any, nodes: int, edges: int) -> None:
    """Go back to the state and the rates that a part of a step began with."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        for k in range(2):
            s[n + NODE.mass + k] = s[n + NODE.first_mass + k]
            s[n + NODE.mass_rate + k] = s[n + NODE.first_mass_rate + k]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        s[e + EDGE.flow] = s[e + EDGE.first_flow]
        if s[e + EDGE.law] == INERTIAL:
            s[e + EDGE.parameters + 1] = s[e + EDGE.parameters + 2]


@register_jitable
def begin(s: Any, nodes: int, edges: int) -> None:
    """Keep the state and the rates that a part of a step begins with."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        for k in range(2):
            s[n + NODE.first_mass + k] = s[n + NODE.last_mass + k] = s[n + NODE.mass + k]
            s[n + NODE.first_mass_rate + k] = s[n + NODE.mass_rate + k]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        s[e + EDGE.first_flow] = s[e + EDGE.flow]
        s[e + EDGE.moved] = s[e + EDGE.last_moved] = 0.0


@register_jitable
def positive(s: Any, nodes: int) -> bool:
    """Whether mass and σ of every node are above zero; of a NaN they are not."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        if not (s[n + NODE.mass] > 0.0 and s[n + NODE.sigma] > 0.0):
            return False
    return True


@register_jitable
def midpoint(
    s: Any, nodes: int, edges: int, part: float, share: float, width: float, gas: float, gamma: float
) -> bool:
    """The midpoint rule over a part of a step that begins at a share of it; False where it fails."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        for k in range(2):
            s[n + NODE.mass + k] = s[n + NODE.first_mass + k] + 0.5 * part * s[n + NODE.first_mass_rate + k]
    if not positive(s, nodes):
        return False
    evaluate(s, nodes, edges, share + 0.5 * width, False, gas, gamma)
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        for k in range(2):
            s[n + NODE.mass + k] = s[n + NODE.first_mass + k] + part * s[n + NODE.mass_rate + k]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        s[e + EDGE.moved] = part * s[e + EDGE.flow]
    return positive(s, nodes)


@register_jitable
def chebyshev(
    s: Any, nodes: int, edges: int, part: float, rate: float, share: float, width: float, gas: float,
    gamma: float,
) -> bool:  # fmt: skip
    """As many Chebyshev stages as the fastest rate needs, over a part of a step; False where it fails."""
    count = stages(MARGIN * part * rate)
    x, w1 = origin(count)
    t0, t1, d0, d1, s0, s1 = 1.0, x, 0.0, 1.0, 0.0, 0.0
    b = 4.0 / (16.0 * x * x)  # of stage 2: T'' = 4, T' = 4 x; stages 0 and 1 take it
    before_b, before_before_b, before_a = b, b, 1.0 - b * x
    combine(s, nodes, edges, 0.0, 0.0, 0.0, b * w1 * part)
    place = w1 / (4.0 * x * x)  # of stage 1: c2/T'2, and c2 = w1/x
    for _ in range(2, count + 1):
        if not positive(s, nodes):
            return False
        evaluate(s, nodes, edges, share + place * width, False, gas, gamma)
        t2, d2, s2 = following(x, t0, t1, d0, d1, s0, s1)
        t0, t1, d0, d1, s0, s1 = t1, t2, d1, d2, s1, s2
        b = s1 / (d1 * d1)
        mu, nu, by_rate = 2.0 * b * x / before_b, -b / before_before_b, 2.0 * b * w1 / before_b
        combine(s, nodes, edges, mu, nu, by_rate * part, -before_a * by_rate * part)
        before_before_b, before_b, before_a = before_b, b, 1.0 - b * t1
        place = w1 * s1 / d1
    settle(s, nodes, edges)
    return positive(s, nodes)


@register_jitable
def settle(s: Any, nodes: int, edges: int) -> None:
    """Masses at the end of a part from what restrictions have moved: many stages gather rounding."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        s[n + NODE.mass] = s[n + NODE.first_mass]
    upstream = s[SUPPLY * NODE_NUMBERS + NODE.actuator]
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        origin, end, moved = s[e + EDGE.origin], s[e + EDGE.end], s[e + EDGE.moved]
        if origin == SUPPLY and upstream > 0.0:
            origin = upstream
        if end == SUPPLY and upstream > 0.0:
            end = upstream
        s[NODE_NUMBERS * int(origin) + NODE.mass] -= moved
        s[NODE_NUMBERS * int(end) + NODE.mass] += moved


@register_jitable
def error(s: Any, nodes: int, part: float) -> float:
    """Largest share of mass or σ by which a part of a step is off, by the rates at its end [-]."""
    # 0.8 (Y0 − Y1) + 0.4 h (F0 + F1), the estimate of the source of `chebyshev`. The stages damp some fast
    # decays by almost nothing; a node that should have come to rest is far from it by this measure.
    largest = 0.0
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        if s[n + NODE.kind] != OF_STORE:
            for k in range(2):
                first, last = s[n + NODE.first_mass + k], s[n + NODE.mass + k]
                rates = s[n + NODE.first_mass_rate + k] + s[n + NODE.mass_rate + k]
                largest = max(largest, abs(0.8 * (first - last) + 0.4 * part * rates) / last)
    return largest


@register_jitable
def combine(s: Any, nodes: int, edges: int, mu: float, nu: float, by_rate: float, by_first: float) -> None:
    """Next stage of states and moved air: (1 − μ − ν) Y0 + μ Y(j−1) + ν Y(j−2) + h μ' F(j−1) + h γ' F0."""
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        for k in range(2):
            now = s[n + NODE.mass + k]
            s[n + NODE.mass + k] = (
                (1.0 - mu - nu) * s[n + NODE.first_mass + k]
                + mu * now
                + nu * s[n + NODE.last_mass + k]
                + by_rate * s[n + NODE.mass_rate + k]
                + by_first * s[n + NODE.first_mass_rate + k]
            )
            s[n + NODE.last_mass + k] = now
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        now = s[e + EDGE.moved]
        s[e + EDGE.moved] = (
            mu * now
            + nu * s[e + EDGE.last_moved]
            + by_rate * s[e + EDGE.flow]
            + by_first * s[e + EDGE.first_flow]
        )
        s[e + EDGE.last_moved] = now


@register_jitable
def write_rates(m: Any, d: Any, nodes: int, s: Any, plain: bool) -> None:
    """Rates that lead the states to the end of the step, which stands in the block."""
    u, act, act_dot, data, step = m.actuator_user, d.act, d.act_dot, d.userdata, m.opt.timestep
    for n in range(FIRST_BLOCK, nodes, NODE_NUMBERS):
        actuator = int(s[n + NODE.actuator])
        adr, q = m.actuator_actadr[actuator], m.nuser_actuator * actuator
        kind = kind_of(u, q)
        if kind == Kind.STORE:
            outflow = (act[adr + STORE_ACT.mass] - s[n + NODE.mass]) / step
            act_dot[adr + STORE_ACT.mass] = -outflow
            act_dot[adr + STORE_ACT.temperature] = store_temperature_rate(
                act[adr], act[adr + STORE_ACT.temperature], u[q + AIR_ROW.volume], max(-outflow, 0.0),
                max(outflow, 0.0), u[q + STORE_ROW.shell], u[q + AIR_ROW.wall_conductance],
                AMBIENT_TEMPERATURE, gas_in(u, q),
            )  # fmt: skip
        elif plain:
            act_dot[adr + CHAMBER_ACT.mass] = s[n + NODE.mass_rate]
            act_dot[adr + CHAMBER_ACT.sigma] = s[n + NODE.sigma_rate]
        else:
            act_dot[adr + CHAMBER_ACT.mass] = (s[n + NODE.mass] - act[adr + CHAMBER_ACT.mass]) / step
            act_dot[adr + CHAMBER_ACT.sigma] = (s[n + NODE.sigma] - act[adr + CHAMBER_ACT.sigma]) / step
        if kind == Kind.CHAMBER:
            place = int(u[q + AIR_ROW.userdata])
            grown = data[place + CHAMBER_DATA.volume] - act[adr + CHAMBER_ACT.last_volume]
            risen = data[place + CHAMBER_DATA.pressure] - act[adr + CHAMBER_ACT.last_pressure]
            act_dot[adr + CHAMBER_ACT.last_volume] = grown / step
            act_dot[adr + CHAMBER_ACT.last_pressure] = risen / step


@register_jitable
def write_flows(m: Any, d: Any, edges: int, s: Any, plain: bool) -> None:
    """Mean flow of every restriction over the step to `userdata` [kg/s], and a line's at its end."""
    for e in range(FIRST_EDGE, edges, EDGE_NUMBERS):
        mean = s[e + EDGE.flow] if plain else s[e + EDGE.total] / m.opt.timestep
        d.userdata[int(s[e + EDGE.place])] = mean
        if s[e + EDGE.law] == INERTIAL:
            d.userdata[int(s[e + EDGE.place]) + 1] = s[e + EDGE.parameters + 1]


@register_jitable
def restriction_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Take a line's flow to the step's end; start a compressor when its tank is below one pressure, and stop
    it above another."""
    u, state = m.actuator_user, m.actuator_actadr[i] + RESTRICTION_ACT.state
    if u[j + EDGE_ROW.law] == INERTIAL:  # after the node that leads, which has put it there
        wanted = d.userdata[int(u[j + EDGE_ROW.place]) + 1]
    else:
        tank, k = m.nuser_actuator * int(u[j + EDGE_ROW.tank]), j + EDGE_ROW.parameters
        gauge = d.userdata[int(u[tank + AIR_ROW.userdata]) + VOLUME_DATA.pressure] - AMBIENT_PRESSURE
        wanted = compressor_runs(d.act[state], gauge, u[k + 2], u[k + 3])
    d.act_dot[state] = (wanted - d.act[state]) / m.opt.timestep
