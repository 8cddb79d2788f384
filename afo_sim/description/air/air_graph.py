"""The air path as a graph: what air can flow from where to where, as it is described."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

from afo_sim.description.air.air_parts import AMBIENT, PARTS, SUPPLY, AirPart, Restriction, Volume
from afo_sim.description.air.chamber import Chamber


class HasAir(Protocol):
    """An orthosis, as far as its air goes."""

    @property
    def chamber(self) -> Mapping[str, Chamber]: ...
    @property
    def volume(self) -> Mapping[str, Volume]: ...
    @property
    def restriction(self) -> Mapping[str, Restriction]: ...


@dataclass(frozen=True)
class Way:
    """A way that air can take from one node to another."""

    key: str  # what it belongs to, such as "restriction.feed"
    origin: str  # a node
    end: str  # a node
    part: AirPart = PARTS["valve"]  # the restriction's whose own way it is, or a valve's


def ways(orthosis: HasAir) -> Iterator[Way]:
    """All ways; both of a restriction that lets air through both. A chamber's valves lead its own way."""
    for name, chamber in orthosis.chamber.items():
        yield Way(f"chamber.{name}", chamber.feed, name)
        yield Way(f"chamber.{name}", name, chamber.exhaust)
        if chamber.quick_exhaust is not None:
            yield Way(f"chamber.{name}", name, AMBIENT)
    for name, each in orthosis.restriction.items():
        key, (own, *branches) = f"restriction.{name}", each.edges(name)
        yield Way(key, own.origin, own.end, each.part)
        if each.part.both_ways:
            yield Way(key, own.end, own.origin, each.part)
        yield from (Way(key, branch.origin, branch.end) for branch in branches)


def reached(begun: Iterable[str], ways: Iterable[Way], *, back: bool = False) -> dict[str, list[Way]]:
    """Nodes that air reaches from some nodes, each with its ways; `back` against the flow."""
    found: dict[str, list[Way]] = {node: [] for node in begun}
    waiting, ways = list(found), list(ways)
    while waiting:
        node = waiting.pop(0)
        if found[node] and node in (SUPPLY, AMBIENT):
            continue
        for way in ways:
            here, there = (way.end, way.origin) if back else (way.origin, way.end)
            if here == node and there not in found:
                found[there] = [*found[node], way]
                waiting.append(there)
    return found


def highest_pressures(orthosis: HasAir, supply: float) -> dict[str, float]:
    """The highest gauge pressure that the supply [Pa] can bring each node to, past what regulators hold."""
    known = {SUPPLY: supply, AMBIENT: 0.0}
    known |= {name: each.start_pressure or 0.0 for name, each in orthosis.volume.items()}
    settings = {f"restriction.{name}": each.pressure for name, each in orthosis.restriction.items()}
    changed = True
    while changed:
        changed = False
        for way in ways(orthosis):
            pressure = known.get(way.origin, 0.0)
            setting = settings.get(way.key)
            if setting is not None:
                pressure = min(pressure, setting)
            if way.end not in (SUPPLY, AMBIENT) and pressure > known.get(way.end, 0.0):
                known[way.end], changed = pressure, True
    return known
