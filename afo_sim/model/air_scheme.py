"""The air path as a graph for people: nodes, what air flows through, and the narrowest part on each way.

It is the description's own, with the products' names; what is solved is `air_path`.
"""

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from afo_sim.common import InputError, Shown
from afo_sim.description import (
    AMBIENT,
    SUPPLY,
    Chamber,
    Orthosis,
    Supply,
    Valve,
    bar,
    opening_lines,
    quick_exhaust_edges,
    regulator_edges,
    regulator_lines,
    tube_edge,
    tube_lines,
)
from afo_sim.model.air_path import OUTLET, SOURCE, TUBE_END, VALVE_END, beside, half_of_tubes, outlet_room
from afo_sim.physics import QUICK_EXHAUST, FlowEdge

LITRE = 1e8  # C in dm³/(s·bar) of one in m³/(s·Pa)
INLET, OUTLETS = "inlet", "outlet"  # ways of a chamber's valves
FREE = "ideal regulator"  # between a source and the supply: no flow lowers its pressure
REGULATOR = "regulator of the supply"


@dataclass(frozen=True)
class AirNode:
    """A place with a pressure of its own."""

    kind: str  # "supply" (endless), a source's, "point" (of regulator, tube), "volume", "chamber", "ambient"
    name: str  # as people read it
    lines: tuple[str, ...] = ()  # what is told of it, a line each
    volume: float = 0.0  # of its air [m³]; of a chamber with its muscles at their nominal length; 0: endless


@dataclass(frozen=True)
class AirEdge:
    """What air flows through between two nodes."""

    kind: str  # "regulator", "leak", "valve", "valve_3_2", or a restriction's
    name: str  # unique; of chambers' valves "<chamber> inlet" and so on
    label: str  # its name as people read it, without its chamber's
    upstream: str  # node
    downstream: str  # node
    forward: float  # sonic conductance [m³/(s·Pa)]; 0 where nothing flows, infinite of an ideal regulator
    back: float  # the other way
    ratio: float  # critical pressure ratio b [-]
    lines: tuple[str, ...] = ()  # what is told of it beside C and b
    exhaust: str = ""  # node behind the third port of a 3/2 valve or a quick exhaust
    venting: float = 0.0  # sonic conductance from `downstream` to there [m³/(s·Pa)]
    venting_ratio: float = 0.0  # critical pressure ratio of that way [-]
    way: str = ""  # INLET or OUTLETS of a chamber's valve

    @property
    def ends(self) -> tuple[str, ...]:
        """Nodes that it joins."""
        return tuple(dict.fromkeys(end for end in (self.upstream, self.downstream, self.exhaust) if end))

    def leads_to(self, node: str) -> bool:
        """Whether air comes to a node through it, and never from it."""
        return node in (self.downstream, self.exhaust) and (bool(self.way) or self.back == 0.0)


@dataclass(frozen=True)
class AirWay:
    """The way of air between a node and a chamber."""

    edges: tuple[tuple[str, float], ...]  # those that hinder: (name, C [m³/(s·Pa)]) as air flows

    @property
    def conductance(self) -> float:
        """Sonic conductance of all together, C = 1/√(Σ 1/C_i²) [m³/(s·Pa)]; infinite without any."""
        total: float = sum(each**-2 for _, each in self.edges)
        return math.inf if total == 0.0 else total**-0.5

    @property
    def narrowest(self) -> str:
        """Name of the edge with the least conductance; "" where nothing hinders."""
        return min(self.edges, key=lambda edge: edge[1])[0] if self.edges else ""

    @property
    def share(self) -> float:
        """Part of Σ 1/C² that the narrowest makes [-]; 0 where nothing hinders."""
        return (self.conductance / min(each for _, each in self.edges)) ** 2 if self.edges else 0.0


@dataclass(frozen=True, repr=False)
class AirScheme(Shown):
    """The air path of an orthosis on its supply; nodes, edges in the order of the description."""

    name: str  # of the orthosis or scenario
    description: str  # its own words
    nodes: dict[str, AirNode]  # volumes, by name
    edges: dict[str, AirEdge]  # what air flows through, by name
    origin: str  # node that all air comes from
    filling: dict[str, AirWay] = field(default_factory=dict)  # each chamber's widest way from there
    venting: dict[str, AirWay] = field(default_factory=dict)  # and to the ambient air

    @property
    def narrowest(self) -> set[str]:
        """Names of the edges that are the narrowest on the way to some chamber."""
        return {way.narrowest for way in self.filling.values() if way.narrowest}


def air_scheme(orthosis: Orthosis, supply: Supply) -> AirScheme:
    """The graph of an orthosis on a supply."""
    if not orthosis.chamber:
        raise InputError("has no muscle, and no air", field="orthosis", value=orthosis.name)
    nodes, parts = _supply(orthosis, supply)
    origin = next(iter(nodes))
    feed = next(reversed(nodes))
    for name, each in orthosis.volume.items():
        more = beside(orthosis, name)
        told = _millilitres(each.volume) + (f" + {1e6 * more:.3g} ml" if more else "")
        lines: tuple[str, ...] = (told, "with its lines") if more else (told,)
        nodes[name] = AirNode("volume", name, lines, each.volume + more)
    for name, chamber in orthosis.chamber.items():
        end = VALVE_END.format(name)
        if chamber.tube is not None and chamber.tube_length is not None:
            half = 0.5 * chamber.tube.volume(chamber.tube_length)
            room = half + chamber.port_volume
            nodes[end] = AirNode("point", "valve end", (_millilitres(room),), room)
            if chamber.quick_exhaust is not None:
                nodes[TUBE_END.format(name)] = AirNode("point", "tube end", (_millilitres(half),), half)
        groups = orthosis.muscles_of(name).values()
        muscles = tuple(f"{group.count} × {group.type.name or 'muscle'}" for group in groups)
        dead = chamber.tube_volume + half_of_tubes(orthosis, name)
        room = sum(group.count * float(group.type.volume(contraction=0.0)) for group in groups)
        lines = (*muscles, f"{_millilitres(room)} at rest", f"tubes {_millilitres(dead)}")
        nodes[name] = AirNode("chamber", name, lines, room + dead)
        parts += _of_chamber(name, chamber)
    for name, restriction in orthosis.restriction.items():
        lines = () if restriction.part.lines is None else restriction.part.lines(restriction)
        lines += () if restriction.valve is None else _proportional(restriction.valve)
        parts.append(_drawn(restriction.kind, name, name, restriction.edges(name), lines))
    nodes[AMBIENT] = AirNode("ambient", "ambient air")
    found = {}
    for part in parts:  # "supply" is the node that stands for it
        a, b, c = (feed if end == SUPPLY else end for end in (part.upstream, part.downstream, part.exhaust))
        own = part.name in (FREE, REGULATOR)
        found[part.name] = part if own else replace(part, upstream=a, downstream=b, exhaust=c)
    scheme = AirScheme(orthosis.name or "orthosis", orthosis.description, nodes, found, origin)
    for name in orthosis.chamber:
        # through another chamber's outlet only where it must
        ways = (_widest(scheme, origin, name, outwards=outwards) for outwards in (False, True))
        if (filling := next(filter(None, ways), None)) is not None:
            scheme.filling[name] = filling
        if (way := _widest(scheme, name, AMBIENT, outwards=True)) is not None:
            scheme.venting[name] = way
    return scheme


def _supply(orthosis: Orthosis, supply: Supply) -> tuple[dict[str, AirNode], list[AirEdge]]:
    """Nodes and edges of a supply; the first node is where air comes from, the last feeds the orthosis."""
    source, regulator = supply.source, supply.regulator
    set_to = bar(supply.pressure)
    if source is None and regulator is None:
        return {SUPPLY: AirNode("supply", "supply", (set_to, "endless"))}, []
    if source is None:
        first, before = AirNode("supply", "line", (bar(supply.fixed), "endless")), SUPPLY
    else:
        name, before = source.name or source.kind, SOURCE
        size = f"{1e3 * source.volume:.3g} l" if source.volume >= 1e-3 else _millilitres(source.volume)
        flow = f"{6e4 * (source.free_air_delivery or 0.0):.3g} l/min ANR"
        switched = f"{1e-5 * (source.switch_on or 0.0):.3g}–{bar(source.switch_off or 0.0)}"
        told: dict[str, tuple[str, ...]] = {
            "bottle": (size, f"{bar(source.filling_pressure or 0.0)} full"),
            "cartridge": (size, f"{1e3 * (source.content or 0.0):.3g} g CO₂"),
            "compressor": (flow, f"tank {size}", switched),
        }
        first = AirNode(source.kind, name, (source.kind, *told[source.kind]), source.volume)
    lines: tuple[str, ...] = (f"set {set_to}",)
    if regulator is None:
        edge = AirEdge("regulator", FREE, FREE, before, SUPPLY, math.inf, 0.0, 0.0, lines)
        return {before: first, SUPPLY: AirNode("point", "supply", (set_to,))}, [edge]
    edges = tuple(regulator_edges("", regulator, supply.pressure, before, OUTLET))
    lines = regulator_lines(regulator, supply.pressure)
    edge = _drawn("regulator", REGULATOR, regulator.name or "regulator", edges, lines)
    room = outlet_room(orthosis, regulator)
    return {before: first, OUTLET: AirNode("point", "regulator outlet", (_millilitres(room),), room)}, [edge]


def _of_chamber(name: str, chamber: Chamber) -> Iterator[AirEdge]:
    """A chamber's valves and tube."""
    end = name if chamber.tube is None else VALVE_END.format(name)
    if chamber.three_way:
        valve, vent = chamber.inlet, chamber.vent
        c, b, lines = valve.conductance, valve.critical_ratio, _proportional(valve)
        yield AirEdge(
            "valve_3_2", f"{name} inlet", f"3/2 {valve.name}".strip(), chamber.feed, end, c, c, b, lines,
            chamber.exhaust, vent.conductance, vent.critical_ratio, INLET,
        )  # fmt: skip
    else:
        assert chamber.outlet is not None
        inlet, outlet = (chamber.feed, end, chamber.inlet), (end, chamber.exhaust, chamber.outlet)
        for way, (origin, to, valve) in ((INLET, inlet), (OUTLETS, outlet)):
            c, b, lines = valve.conductance, valve.critical_ratio, _proportional(valve)
            label = f"{way} {valve.name}".strip()
            yield AirEdge("valve", f"{name} {way}", label, origin, to, c, c, b, lines, way=way)
    if chamber.tube is not None and chamber.tube_length is not None:
        tube, length = chamber.tube, chamber.tube_length
        quick = chamber.quick_exhaust
        far = name if quick is None else TUBE_END.format(name)
        edge, label = tube_edge("", end, far, tube, length), f"tube {tube.name}".strip()
        yield _drawn("tube", f"{name} tube", label, (edge,), tube_lines(tube, length))
        if quick is not None:
            edges = tuple(quick_exhaust_edges("", far, name, quick))
            own = f"{name} quick exhaust"
            yield _drawn("quick_exhaust", own, "quick exhaust", edges, opening_lines(quick))


def _proportional(valve: Valve) -> tuple[str, ...]:
    return ("proportional",) if valve.proportional else ()


def _drawn(kind: str, name: str, label: str, edges: Sequence[FlowEdge], lines: tuple[str, ...]) -> AirEdge:
    """What is drawn of the edges of one part; of a quick exhaust with its way out."""
    own, *branches = edges
    drawn = AirEdge(kind, name, label, own.origin, own.end, own.forth, own.back, own.ratio_forth, lines)
    for vent in (branch for branch in branches if branch.law == QUICK_EXHAUST):
        drawn = replace(drawn, exhaust=vent.end, venting=vent.conductance, venting_ratio=vent.critical_ratio)
    return drawn


def _millilitres(volume: float) -> str:
    return f"{1e6 * volume:.3g} ml"


def conductance(value: float) -> str:
    """A sonic conductance as people read it [dm³/(s·bar)]."""
    return f"{LITRE * value:.3g}"


def _widest(scheme: AirScheme, start: str, end: str, *, outwards: bool) -> AirWay | None:
    """The way with the least Σ 1/C² (Dijkstra 1959); None where there is none."""
    queue: list[tuple[float, int, str, tuple[tuple[str, float], ...]]] = [(0.0, 0, start, ())]
    done, count = set(), 0
    steps = list(_steps(scheme, outwards))
    while queue:
        cost, _, node, way = heapq.heappop(queue)
        if node == end:
            return AirWay(way)
        if node in done or (node == AMBIENT and node != start):
            continue
        done.add(node)
        for edge, a, b, c in steps:
            if a == node and b not in done:
                count += 1
                hindered = c != math.inf
                further = (*way, (edge, c)) if hindered else way
                heapq.heappush(queue, (cost + (c**-2 if hindered else 0.0), count, b, further))
    return None


def _steps(scheme: AirScheme, outwards: bool) -> Iterator[tuple[str, str, str, float]]:
    """(edge, from, to, C) of every way that air can go; valves of chambers lead one way."""
    for name, each in scheme.edges.items():
        if each.way == OUTLETS and not outwards:
            continue
        if each.forward > 0.0:
            yield name, each.upstream, each.downstream, each.forward
        if each.back > 0.0 and not each.way:
            yield name, each.downstream, each.upstream, each.back
        if each.venting > 0.0 and outwards:
            yield name, each.downstream, each.exhaust, each.venting
