"""Which parts of a circuit hang together by their air."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from afo_sim.native.air_block import AMBIENT, FIRST_NODE, MOST_EDGES, MOST_NODES, SUPPLY
from afo_sim.native.circuit import AMBIENT_NAME, SUPPLY_NAME, Circuit


@dataclass(frozen=True)
class AirNetwork:
    """What is joined: nodes in the order of their numbers from 2 on, and the two of each edge."""

    chambers: tuple[str, ...]
    others: tuple[str, ...]
    edges: Mapping[str, tuple[int, int]]
    upstream: int = 0
    numbers: Mapping[str, int] = field(default_factory=dict)


def ways(circuit: Circuit) -> list[tuple[str, str, str]]:
    """(key, origin, end) of all valves and restrictions: each chamber's inlet and outlet, then the others."""
    found = []
    for chamber in circuit.chambers:
        port = chamber.port or chamber.name
        found.append((f"{chamber.name}_inlet", chamber.feed, port))
        found.append((f"{chamber.name}_outlet", port, chamber.exhaust))
    return found + [(r.name, r.origin, r.end) for r in circuit.restrictions]


def air_networks(circuit: Circuit) -> list[AirNetwork]:
    """What hangs together by its air, each led by its first chamber."""
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
                raise ValueError(f"{key!r} leads to {name!r}, which is not a node of the air")
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


def _network(circuit: Circuit, names: list[str], members: set[str], loose: bool) -> AirNetwork:
    chambers = tuple(each.name for each in circuit.chambers if each.name in members)
    others = tuple(name for name in names if name in members and name not in chambers)
    if not chambers:
        raise ValueError(f"no chamber hangs on {others}")
    numbers = {AMBIENT_NAME: AMBIENT, SUPPLY_NAME: SUPPLY}
    numbers |= {name: FIRST_NODE + k for k, name in enumerate((*chambers, *others))}
    edges = {
        key: (numbers[origin], numbers[end])
        for key, origin, end in ways(circuit)
        if origin in members or end in members or (loose and {origin, end} == {AMBIENT_NAME, SUPPLY_NAME})
    }
    if FIRST_NODE + len(chambers) + len(others) > MOST_NODES or len(edges) > MOST_EDGES:
        raise ValueError(f"there is room for {MOST_NODES - FIRST_NODE} nodes and {MOST_EDGES} restrictions")
    upstream = numbers.get(circuit.upstream, 0) if circuit.upstream in members else 0
    return AirNetwork(chambers, others, edges, upstream, numbers)
