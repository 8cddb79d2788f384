"""Slopes of the air over one stride: how what its nodes end with follows from what they begin with.

    d(ln m)/dt = Σ w/m              d(ln σ)/dt = E/(p V),    E = γ R Σ w T_w + (γ − 1) hA (T_a − T)

w flows into a node through a valve, tube or restriction. Pressures of the ambient air, of the supply and of
stores are given. The rates are linearised along the rows of a stride that was walked. A step between two rows
is (1 − z + z²/2)⁻¹, of second order, in which the air of a tube's end, faster than the rows, comes to rest.
A chamber's volume follows its pressure by `giving`, d ln V/d ln p, which two strides tell that differ in
their air. The slopes serve a search, whose result does not depend on them.
"""

import math
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.native.slots import CHAMBER_ACT, CHAMBER_DATA, VOLUME_DATA
from afo_sim.native.stride_numbers import (
    AMBIENT,
    AT,
    FIRST_NODE,
    NODE,
    STORE,
    SUPPLY,
    WAY,
    WAY_NUMBERS,
    table,
)
from afo_sim.physics import edge_flow, register_jitable

GIVING = 0.3  # where no two strides tell it yet [-]
MOST_GIVING = 0.6  # more would be a chamber that hardly resists [-]
TOLD = 5e-4  # change of ln p from which on two strides tell it [-]
NUDGE = 1e-6  # of ln p, by which flows are differentiated [-]
UP, DOWN = math.exp(NUDGE), math.exp(-NUDGE)


@register_jitable
def giving(
    pressure: float, volume: float, pressure_before: float, volume_before: float, known: float
) -> float:
    """d ln V/d ln p in a row of two strides; what is known where they tell nothing of it."""
    pressed = math.log(pressure / pressure_before)
    if not abs(pressed) > TOLD:
        return known
    return min(max(math.log(volume / volume_before) / pressed, 0.0), MOST_GIVING)


@register_jitable
def air_in(s: Any, o: int, k: int, act: Any, userdata: Any, row: int) -> tuple[float, float, float]:
    """Mass [kg], absolute pressure [Pa] and volume [m³] of a node in a recorded row."""
    node = table(s, o, AT.node) + len(NODE) * k
    mass = act[row * int(s[o + AT.act]) + int(s[node + NODE.act]) + CHAMBER_ACT.mass]
    data = row * int(s[o + AT.userdata]) + int(s[node + NODE.userdata])
    if k < s[o + AT.chambers]:
        return mass, userdata[data + CHAMBER_DATA.pressure], userdata[data + CHAMBER_DATA.volume]
    return mass, userdata[data + VOLUME_DATA.pressure], s[node + NODE.room]


@register_jitable
def take_row(s: Any, o: int, act: Any, userdata: Any, control: Any, row: int) -> None:
    """Pressures and temperatures of all nodes in a row, into their tables."""
    pressures, warm, nodes = table(s, o, AT.pressures), table(s, o, AT.warm), int(s[o + AT.nodes])
    supply = row * int(s[o + AT.control]) + int(s[table(s, o, AT.node) + NODE.control])  # of the first node
    s[pressures + AMBIENT], s[pressures + SUPPLY] = AMBIENT_PRESSURE, control[supply] + AMBIENT_PRESSURE
    for k in range(nodes):
        mass, pressure, volume = air_in(s, o, k, act, userdata, row)
        s[pressures + FIRST_NODE + k] = pressure
        s[warm + FIRST_NODE + k] = pressure * volume / (mass * s[o + AT.gas])
    for k in range(int(s[o + AT.stores])):
        place = int(s[table(s, o, AT.store) + len(STORE) * k + STORE.userdata]) + VOLUME_DATA.pressure
        s[pressures + FIRST_NODE + nodes + k] = userdata[row * int(s[o + AT.userdata]) + place]


@register_jitable
def _open(s: Any, o: int, way: int, userdata: Any, row: int) -> float:
    """Opening of a way in a row [-]; 1 of what is no valve."""
    place = int(s[way + WAY.opening])
    return 1.0 if place < 0 else userdata[row * int(s[o + AT.userdata]) + place]


@register_jitable
def flow_of(s: Any, o: int, way: int, by_origin: float, by_end: float, userdata: Any, row: int) -> float:
    """Mass flow of a way, the pressures at its ends times two factors, in the row that was taken [kg/s]."""
    pressures, warm = table(s, o, AT.pressures), table(s, o, AT.warm)
    origin, end = int(s[way + WAY.origin]), int(s[way + WAY.end])
    supply, upstream = s[pressures + SUPPLY], int(s[way + WAY.upstream])
    if upstream > 0:
        supply = min(supply, s[pressures + upstream])
    p1 = supply if origin == SUPPLY else s[pressures + origin]
    p2 = supply if end == SUPPLY else s[pressures + end]
    return edge_flow(
        s[way + WAY.law], p1 * by_origin, s[warm + origin], p2 * by_end, s[warm + end],
        _open(s, o, way, userdata, row), s[way + WAY.conductance], s[way + WAY.critical], s,
        way + WAY.parameters, pressures, 1,
    )  # fmt: skip


@register_jitable
def entering(s: Any, o: int, act: Any, userdata: Any, control: Any, first: int) -> None:
    """Air that flows into each node over the rows, by what it has at first, into `flowing` [-]."""
    # None where it is hardly any, or where all that joins a node to what is given is shut.
    every, nodes, ways = int(s[o + AT.every]), int(s[o + AT.nodes]), int(s[o + AT.ways])
    flowing, flows, reached = table(s, o, AT.flowing), table(s, o, AT.side), table(s, o, AT.matrix)
    for k in range(nodes):
        s[flowing + k] = 0.0
    for w in range(ways):
        s[flows + w] = 0.0
    for row in range(first, first + int(s[o + AT.steps]), every):
        take_row(s, o, act, userdata, control, row)
        for w in range(ways):
            way = table(s, o, AT.way) + WAY_NUMBERS * w
            flow = flow_of(s, o, way, 1.0, 1.0, userdata, row)
            into = int(s[way + (WAY.end if flow >= 0.0 else WAY.origin)]) - FIRST_NODE
            if flow != 0.0:
                s[flows + w] = 1.0
                if 0 <= into < nodes:
                    s[flowing + into] += abs(flow)
    for number in range(FIRST_NODE + nodes + int(s[o + AT.stores])):
        s[reached + number] = 0.0 if FIRST_NODE <= number < FIRST_NODE + nodes else 1.0
    for _ in range(ways):
        for w in range(ways):
            way = table(s, o, AT.way) + WAY_NUMBERS * w
            origin, end = reached + int(s[way + WAY.origin]), reached + int(s[way + WAY.end])
            if s[flows + w] > 0.0 and s[origin] + s[end] > 0.0:
                s[origin] = s[end] = 1.0
    for k in range(nodes):
        entered = s[flowing + k] * s[o + AT.interval] / air_in(s, o, k, act, userdata, first)[0]
        s[flowing + k] = entered if s[reached + FIRST_NODE + k] > 0.0 and entered > s[o + AT.nothing] else 0.0


@register_jitable
def air_slopes(s: Any, o: int, act: Any, userdata: Any, control: Any, first: int) -> None:
    """∂(ln m, ln σ) of all nodes at the end of a stride by those at its start, into `own`."""
    n, every, interval = 2 * int(s[o + AT.nodes]), int(s[o + AT.every]), s[o + AT.interval]
    own, z, matrix = table(s, o, AT.own), table(s, o, AT.other), table(s, o, AT.matrix)
    for i in range(n):
        for j in range(n):
            s[own + n * i + j] = 1.0 if i == j else 0.0
    for number in range(-(-int(s[o + AT.steps]) // every)):
        rates(s, o, z, number, act, userdata, control, first + number * every)
        for i in range(n):
            for j in range(n):
                square = 0.0
                for k in range(n):
                    square += s[z + n * i + k] * s[z + n * k + j]
                found = 0.5 * interval * interval * square - interval * s[z + n * i + j]
                s[matrix + n * i + j] = found + 1.0 if i == j else found
        solve(s, matrix, own, n)


@register_jitable
def rates(s: Any, o: int, z: int, number: int, act: Any, userdata: Any, control: Any, row: int) -> None:
    """Slopes of the rates of (ln m, ln σ) by these in a row [1/s], into the matrix at z."""
    take_row(s, o, act, userdata, control, row)
    nodes, n = int(s[o + AT.nodes]), 2 * int(s[o + AT.nodes])
    giving, warm, table_of = table(s, o, AT.giving), table(s, o, AT.warm), table(s, o, AT.node)
    gamma = s[o + AT.gamma]
    for i in range(n * n):
        s[z + i] = 0.0
    for k in range(nodes):
        mass, pressure, volume = air_in(s, o, k, act, userdata, row)
        give, temperature = s[giving + nodes * number + k], s[warm + FIRST_NODE + k]
        heat = (gamma - 1.0) * s[table_of + len(NODE) * k + NODE.wall]
        add(s, z, n, 2 * k + 1, k, 0.0, -heat * temperature / (pressure * volume), give, gamma)
        of_t = (1.0 + give) / (1.0 + gamma * give)
        warmed = heat * (AMBIENT_TEMPERATURE - temperature) / (pressure * volume)
        s[z + (n + 1) * (2 * k + 1)] -= warmed * of_t  # ln (p V) follows as ln T does
    for w in range(int(s[o + AT.ways])):
        way = table(s, o, AT.way) + WAY_NUMBERS * w
        if _open(s, o, way, userdata, row) == 0.0:  # as valves are most of the time
            continue
        flow = flow_of(s, o, way, 1.0, 1.0, userdata, row)
        origin, end = int(s[way + WAY.origin]), int(s[way + WAY.end])
        up = origin if flow >= 0.0 else end  # whose temperature the flow has
        carried = gamma * s[o + AT.gas] * s[warm + up]
        for at_origin, other in ((True, origin - FIRST_NODE), (False, end - FIRST_NODE)):
            if not 0 <= other < nodes:
                continue
            high, low = (UP, DOWN) if at_origin else (1.0, 1.0)
            more = flow_of(s, o, way, high, 1.0 if at_origin else UP, userdata, row)
            less = flow_of(s, o, way, low, 1.0 if at_origin else DOWN, userdata, row)
            by_p = (more - less) / (2.0 * NUDGE)
            half = 0.5 * flow if up == other + FIRST_NODE else 0.0
            give = s[giving + nodes * number + other]
            for sign, node in ((-1.0, origin - FIRST_NODE), (1.0, end - FIRST_NODE)):
                if not 0 <= node < nodes:
                    continue
                mass, pressure, volume = air_in(s, o, node, act, userdata, row)
                share, work = sign / mass, sign * carried / (pressure * volume)
                add(s, z, n, 2 * node, other, share * by_p, -share * half, give, gamma)
                add(s, z, n, 2 * node + 1, other, work * by_p, work * half, give, gamma)
        for sign, node in ((-1.0, origin - FIRST_NODE), (1.0, end - FIRST_NODE)):
            if 0 <= node < nodes:
                mass, pressure, volume = air_in(s, o, node, act, userdata, row)
                give = s[giving + nodes * number + node]
                of_t = (1.0 + give) / (1.0 + gamma * give)
                s[z + (n + 1) * 2 * node] -= sign * flow / mass
                s[z + (n + 1) * (2 * node + 1)] -= sign * carried * flow / (pressure * volume) * of_t


@register_jitable
def add(
    s: Any, z: int, n: int, row: int, node: int, by_p: float, by_t: float, give: float, gamma: float
) -> None:
    """Add slopes by ln p and ln T of a node, as slopes by its ln m and ln σ."""
    of_p = 1.0 / (1.0 + gamma * give)  # of ln p by ln σ; of ln m only ln T follows, by −1
    s[z + n * row + 2 * node] -= by_t
    s[z + n * row + 2 * node + 1] += by_p * of_p + by_t * (1.0 + give) * of_p


@register_jitable
def solve(s: Any, a: int, x: int, n: int) -> None:
    """A⁻¹ X into X, of matrices [n, n] at a and x, by Gauss' elimination with pivots; A is lost."""
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(s[a + n * i + k]) > abs(s[a + n * pivot + k]):
                pivot = i
        for j in range(n):
            s[a + n * k + j], s[a + n * pivot + j] = s[a + n * pivot + j], s[a + n * k + j]
            s[x + n * k + j], s[x + n * pivot + j] = s[x + n * pivot + j], s[x + n * k + j]
        for i in range(k + 1, n):
            share = s[a + n * i + k] / s[a + n * k + k]
            for j in range(n):
                s[a + n * i + j] -= share * s[a + n * k + j]
                s[x + n * i + j] -= share * s[x + n * k + j]
    for k in range(n - 1, -1, -1):
        for j in range(n):
            found = s[x + n * k + j]
            for i in range(k + 1, n):
                found -= s[a + n * k + i] * s[x + n * i + j]
            s[x + n * k + j] = found / s[a + n * k + k]
