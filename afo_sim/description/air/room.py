"""How large an air network may be: compiled code has room for so many nodes and restrictions."""

from collections.abc import Iterator

from afo_sim.description.air.air_graph import HasAir
from afo_sim.description.air.air_parts import SUPPLY
from afo_sim.description.quantity import refusal

MOST_NODES = 32  # of one network, beside the ambient air and the supply
MOST_RESTRICTIONS = 64  # of one network, valves included


def check_room(
    orthosis: HasAir,
    extra_nodes: int = 0,
    extra_restrictions: int = 0,
    *,
    shared: bool = False,
    under: str = "",
) -> None:
    """Refuse a network that is larger than compiled code has room for."""
    group = {node: {node} for node in (*orthosis.chamber, *orthosis.volume)}
    parts = list(_parts(orthosis))
    for origin, end, _ in parts:
        _merge(group, origin, end)
    if shared:
        fed = [b if a == SUPPLY else a for a, b, _ in parts if SUPPLY in (a, b)]
        for node in fed[1:]:
            _merge(group, fed[0], node)
    for members in {id(each): each for each in group.values()}.values():
        tubes = [name for name in members if name in orthosis.chamber and orthosis.chamber[name].tube]
        ports = [name for name in tubes if orthosis.chamber[name].quick_exhaust]
        nodes = len(members) + len(tubes) + len(ports) + extra_nodes
        restrictions = sum(count for a, b, count in parts if {a, b} & members) + extra_restrictions
        kind = "volume" if len(orthosis.volume) > len(orthosis.chamber) else "chamber"
        if nodes > MOST_NODES:
            problem = (
                f"make {nodes} volumes that hang together (a tube has two ends), too many for one network"
            )
            raise refusal(problem, f"up to {MOST_NODES}", f"{under}{kind}")
        if restrictions > MOST_RESTRICTIONS:
            problem = (
                f"make {restrictions} valves and restrictions that hang together, too many for one network"
            )
            raise refusal(problem, f"up to {MOST_RESTRICTIONS}", f"{under}restriction")


def _merge(group: dict[str, set[str]], a: str, b: str) -> None:
    if a in group and b in group and group[a] is not group[b]:
        merged = group[a] | group[b]
        group |= dict.fromkeys(merged, merged)


def _parts(orthosis: HasAir) -> Iterator[tuple[str, str, int]]:
    """(node, node, number of restrictions) of all that air flows through."""
    for name, chamber in orthosis.chamber.items():
        own = (chamber.tube is not None) + 2 * (chamber.quick_exhaust is not None)
        yield chamber.feed, name, 1 + own
        yield name, chamber.exhaust, 1
    for each in orthosis.restriction.values():
        yield each.upstream, each.downstream, len(each.edges(""))
