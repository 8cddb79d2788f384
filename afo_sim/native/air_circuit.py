"""Parts of a circuit that hold or restrict air beside its chambers, and which of them hang together."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from afo_sim.common.units import AMBIENT_PRESSURE, STANDARD_DENSITY
from afo_sim.native.air_block import AMBIENT, FIRST_NODE, MOST_EDGES, MOST_NODES, SUPPLY
from afo_sim.physics.air_path import COMPRESSOR, ONE_WAY, QUICK_EXHAUST, REGULATED, RELIEF, TWO_WAY
from afo_sim.physics.pneumatics import laminar_slope

AMBIENT_NAME, SUPPLY_NAME = "ambient", "supply"  # nodes whose pressures are given


@dataclass(frozen=True)
class CircuitVolume:
    """A rigid volume: reservoir, manifold, end of a tube.

    volume : [m³]
    wall_conductance : heat to the wall [W/K]
    start : gauge pressure that it begins with [Pa]
    start_as : chamber whose pressure it begins with instead; none by default
    """

    name: str
    volume: float
    wall_conductance: float = 0.0
    start: float = 0.0
    start_as: str = ""


@dataclass(frozen=True)
class CircuitStore:
    """A finite source: gas bottle or cartridge.

    row : its own parameters, as `store_row` takes them
    content : [kg]
    """

    name: str
    row: Mapping[str, Any]
    content: float


@dataclass(frozen=True)
class CircuitRestriction:
    """What air flows through from `origin` to `end`, nodes by name: a tube, an orifice, a valve, a regulator.

    conductance, critical_ratio : C [m³/(s·Pa)], b [-]
    law : TWO_WAY, ONE_WAY, …
    parameters : up to four, of the law
    steepness : largest slope of the flow by a pressure difference [kg/(s·Pa)]
    valve : its parameters as `valve_row` takes them, where a coil opens it
    pilot : node whose pressure keeps a quick exhaust shut
    """

    name: str
    origin: str
    end: str
    conductance: float
    critical_ratio: float
    law: int = TWO_WAY
    parameters: tuple[float, ...] = ()
    steepness: float = -1.0
    valve: Mapping[str, Any] | None = None
    pilot: str = ""

    @property
    def steepest(self) -> float:
        """Largest slope of the flow by a pressure difference [kg/(s·Pa)], as told or of its ISO 6358 law."""
        if self.steepness >= 0.0:
            return self.steepness
        return laminar_slope(self.conductance, self.critical_ratio) if self.conductance > 0.0 else 0.0

    def times(self, factor: float) -> "CircuitRestriction":
        """The same for a gas of which so many times as much flows."""
        parameters, steepness, valve = self.parameters, self.steepness, self.valve
        if self.law == ONE_WAY:
            parameters = (factor * parameters[0], *parameters[1:])
        elif self.law in (REGULATED, RELIEF):  # a seat that is as far open
            parameters = (parameters[0], factor * parameters[1])
        if valve is not None:
            valve = {**valve, "conductance": factor * valve["conductance"]}
        return dataclasses.replace(
            self,
            conductance=factor * self.conductance,
            parameters=parameters,
            steepness=steepness if steepness < 0.0 else max(factor, 1.0) * steepness,
            valve=valve,
        )


def check_valve(
    name: str,
    origin: str,
    end: str,
    conductance: float,
    critical_ratio: float,
    *,
    cracking: float,
    throttle: float = 0.0,
    throttle_ratio: float = 0.3,
) -> CircuitRestriction:
    """A check valve that lets air from origin to end, with a throttle beside it that is open both ways.

    It opens over a band as wide as its cracking pressure, at least `LEAST_BAND`.
    """
    band = max(cracking, LEAST_BAND)
    # at a difference Δp in the band: C ρ p Δp/band, and the elliptic flow's slope; p up to the highest supply
    opening = conductance * STANDARD_DENSITY * HIGHEST / band
    steep = opening + laminar_slope(conductance, critical_ratio)
    if throttle > 0.0:
        steep += laminar_slope(throttle, throttle_ratio)
    return CircuitRestriction(
        name,
        origin,
        end,
        throttle,
        throttle_ratio,
        ONE_WAY,
        (conductance, critical_ratio, cracking, band),
        steep,
    )


def quick_exhaust(
    name: str, origin: str, pilot: str, conductance: float, critical_ratio: float, *, cracking: float
) -> CircuitRestriction:
    """The way out of a quick exhaust: from origin to ambient air while the pilot's pressure is lower."""
    band = max(cracking, LEAST_BAND)
    # two pressures open it: its own node's and the pilot's
    steep = 2.0 * conductance * STANDARD_DENSITY * HIGHEST / band + laminar_slope(conductance, critical_ratio)
    return CircuitRestriction(
        name,
        origin,
        AMBIENT_NAME,
        conductance,
        critical_ratio,
        QUICK_EXHAUST,
        (0.0, cracking, band),
        steep,
        pilot=pilot,
    )


def regulator(
    name: str,
    origin: str,
    end: str,
    conductance: float,
    critical_ratio: float,
    *,
    setting: float,
    per_droop: float,
) -> CircuitRestriction:
    """A pressure regulator whose outlet is at `setting` (gauge) without flow; per_droop [kg/(s·Pa)]."""
    steep = per_droop + laminar_slope(conductance, critical_ratio)
    parameters = (setting + AMBIENT_PRESSURE, per_droop)
    return CircuitRestriction(name, origin, end, conductance, critical_ratio, REGULATED, parameters, steep)


def relief(
    name: str, origin: str, conductance: float, critical_ratio: float, *, limit: float, per_excess: float
) -> CircuitRestriction:
    """A relief from origin to ambient air that opens above a gauge pressure; per_excess [kg/(s·Pa)]."""
    steep = per_excess + laminar_slope(conductance, critical_ratio)
    parameters = (limit + AMBIENT_PRESSURE, per_excess)
    return CircuitRestriction(
        name, origin, AMBIENT_NAME, conductance, critical_ratio, RELIEF, parameters, steep
    )


def compressor(
    name: str, end: str, *, free_air: float, stall: float, starts: float, stops: float
) -> CircuitRestriction:
    """A compressor into a tank: free air delivery at no gauge pressure [m³/s], and gauge pressures [Pa]."""
    parameters = (free_air, stall, starts, stops)
    return CircuitRestriction(
        name, AMBIENT_NAME, end, 0.0, 0.0, COMPRESSOR, parameters, STANDARD_DENSITY * free_air / stall
    )


LEAST_BAND = 500.0  # of a check valve without a spring: the pressure over which it opens [Pa]
HIGHEST = 12e5  # pressure at which a check valve's steepness is told [Pa]


@dataclass(frozen=True)
class AirEdge:
    """A valve or restriction between two numbered nodes; `key` names it in the circuit's ids."""

    key: str
    origin: int
    end: int


@dataclass(frozen=True)
class AirNetwork:
    """What hangs together: nodes in the order of their numbers from 2 on, and what is between."""

    chambers: tuple[str, ...]
    others: tuple[str, ...]
    edges: tuple[AirEdge, ...]
    upstream: int = 0
    numbers: Mapping[str, int] = field(default_factory=dict)


class HasAir(Protocol):
    """A circuit, as far as its air goes."""

    @property
    def chambers(self) -> tuple[Any, ...]: ...
    @property
    def volumes(self) -> tuple[CircuitVolume, ...]: ...
    @property
    def stores(self) -> tuple[CircuitStore, ...]: ...
    @property
    def restrictions(self) -> tuple[CircuitRestriction, ...]: ...
    @property
    def upstream(self) -> str: ...


def ways(circuit: HasAir) -> list[tuple[str, str, str]]:
    """(key, origin, end) of all valves and restrictions: each chamber's inlet and outlet, then the others."""
    found = []
    for chamber in circuit.chambers:
        port = chamber.port or chamber.name
        found.append((f"{chamber.name}_inlet", chamber.feed, port))
        found.append((f"{chamber.name}_outlet", port, chamber.exhaust))
    return found + [(r.name, r.origin, r.end) for r in circuit.restrictions]


def air_networks(circuit: HasAir) -> list[AirNetwork]:
    """What hangs together by its air, each led by its first chamber.

    The ambient air joins nothing, nor does a supply that never sags.
    """
    names = [each.name for kind in (circuit.chambers, circuit.volumes, circuit.stores) for each in kind]
    if len(set(names) | {AMBIENT_NAME, SUPPLY_NAME}) < len(names) + 2:
        raise ValueError(f"two nodes of the air have one name: {sorted(names)}")
    group = {name: {name} for name in names}
    joined = ways(circuit)
    if circuit.upstream:
        drawing = [
            end if origin == SUPPLY_NAME else origin
            for _, origin, end in joined
            if SUPPLY_NAME in (origin, end)
        ]
        joined = joined + [("", circuit.upstream, name) for name in drawing if name != SUPPLY_NAME]
    pilots = [("", r.origin, r.pilot) for r in circuit.restrictions if r.pilot]
    for key, origin, end in joined + pilots:
        for name in (origin, end):
            if name not in (*names, AMBIENT_NAME, SUPPLY_NAME):
                raise ValueError(f"{key!r} leads to {name!r}, which is no node of the air")
        if origin in group and end in group and group[origin] is not group[end]:
            merged = group[origin] | group[end]
            group |= dict.fromkeys(merged, merged)
    found: list[AirNetwork] = []
    seen: set[str] = set()
    for name in names:
        if name not in seen:
            seen |= group[name]
            # what leads from the supply straight to the ambient air goes with whom the supply draws from
            loose = circuit.upstream in group[name] if circuit.upstream else not found
            found.append(_network(circuit, names, group[name], loose))
    return found


def _network(circuit: HasAir, names: list[str], members: set[str], loose: bool) -> AirNetwork:
    chambers = tuple(each.name for each in circuit.chambers if each.name in members)
    others = tuple(name for name in names if name in members and name not in chambers)
    if not chambers:
        raise ValueError(f"no chamber hangs on {others}")
    numbers = {AMBIENT_NAME: AMBIENT, SUPPLY_NAME: SUPPLY}
    numbers |= {name: FIRST_NODE + k for k, name in enumerate((*chambers, *others))}
    edges = tuple(
        AirEdge(key, numbers[origin], numbers[end])
        for key, origin, end in ways(circuit)
        if origin in members or end in members or (loose and {origin, end} == {AMBIENT_NAME, SUPPLY_NAME})
    )
    if FIRST_NODE + len(chambers) + len(others) > MOST_NODES or len(edges) > MOST_EDGES:
        raise ValueError(f"there is room for {MOST_NODES - FIRST_NODE} nodes and {MOST_EDGES} restrictions")
    upstream = numbers.get(circuit.upstream, 0) if circuit.upstream in members else 0
    return AirNetwork(chambers, others, edges, upstream, numbers)
