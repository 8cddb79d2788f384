"""Whether an air path holds together: its nodes are there, air comes into each and out of it, and it is not
too large for compiled code.
"""

from afo_sim.description.air.air_graph import HasAir, Way, reached, ways
from afo_sim.description.air.air_parts import AMBIENT, SUPPLY, Restriction
from afo_sim.description.quantity import amount, refusal, refused_name

MOST_NODES = 32  # of one network, beside the ambient air and the supply
MOST_RESTRICTIONS = 64  # of one network, valves included
TOO_MANY = "too many for one network"
WAYS, ENDS = ("feed", "exhaust"), ("upstream", "downstream")  # keys that name a node


def check_room(
    orthosis: HasAir, extra_nodes: int = 0, extra_restrictions: int = 0, *, shared: bool = False,
    under: str = "",
) -> None:  # fmt: skip
    """Refuse a network that is larger than compiled code has room for."""
    group = {node: {node} for node in (*orthosis.chamber, *orthosis.volume)}
    parts = []  # (node, node, number of restrictions) of all that air flows through
    for name, chamber in orthosis.chamber.items():
        own = (chamber.tube is not None) + 2 * (chamber.quick_exhaust is not None)
        parts += [(chamber.feed, name, 1 + own), (name, chamber.exhaust, 1)]
    parts += [(each.upstream, each.downstream, len(each.edges(""))) for each in orthosis.restriction.values()]
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
            problem = f"connect {nodes} volumes (a tube has two ends),  {TOO_MANY}"
            raise refusal(problem, f"up to {MOST_NODES}", f"{under}{kind}")
        if restrictions > MOST_RESTRICTIONS:
            problem = f"connect {restrictions} valves and restrictions,  {TOO_MANY}"
            raise refusal(problem, f"up to {MOST_RESTRICTIONS}", f"{under}restriction")


def _merge(group: dict[str, set[str]], a: str, b: str) -> None:
    if a in group and b in group and group[a] is not group[b]:
        merged = group[a] | group[b]
        group |= dict.fromkeys(merged, merged)


TAKEN = {  # names of nodes and restrictions that a supply has of its own
    "node": ("source", "regulator"),
    "restriction": ("compressor", "regulator", "regulator_relief", "regulator_bleed"),
}
TABLE_KEYS = ("period", "restart", "provenance")  # of a timer, beside its chambers


def check_network(orthosis: HasAir) -> None:
    """Refuse nodes that are not there, or that air cannot come into or leave, and sources that conflict."""
    names = _names(orthosis)
    told = [(f"chamber.{n}.{key}", getattr(c, key)) for n, c in orthosis.chamber.items() for key in WAYS]
    told += [
        (f"restriction.{n}.{key}", getattr(r, key)) for n, r in orthosis.restriction.items() for key in ENDS
    ]
    for key, node in told:
        if node not in names:
            problem = f"there is no node {node!r}"
            ends = [name for name in orthosis.chamber if node in (f"{name}_valve_end", f"{name}_tube_end")]
            if ends:
                problem = f"{node!r} is an end of a chamber's own tube, which nothing else may connect to"
                mend = f"another node; a quick exhaust behind the tube is chamber.{ends[0]}.quick_exhaust"
                raise refusal(problem, mend, key)
            raise refused_name(problem, node, names, key)
    _check_ends(orthosis)
    found = list(ways(orthosis))
    _check_touched(orthosis, found)
    _check_ways_in(orthosis, found)
    _check_ways_out(orthosis, found)
    _check_regulators(orthosis, found)
    check_room(orthosis)


def _names(orthosis: HasAir) -> list[str]:
    """The nodes of an orthosis; refuses a name that two of them have, or that is the simulator's own."""
    names = [SUPPLY, AMBIENT]
    for kind, table in (("chamber", orthosis.chamber), ("volume", orthosis.volume)):
        for name in table:
            if name in names:
                raise refusal("is the name of another node", "another name", f"{kind}.{name}")
            if name in TAKEN["node"] or (kind == "chamber" and name in TABLE_KEYS):
                raise refusal(_own(name), "another name", f"{kind}.{name}")
            names.append(name)
    for name, chamber in orthosis.chamber.items():
        ends = {f"{name}_valve_end": "valves' end", f"{name}_tube_end": "muscles' end"}
        own = (chamber.tube is not None) + (chamber.quick_exhaust is not None)
        for end, where in [*ends.items()][:own]:
            if end in names:
                kind = "chamber" if end in orthosis.chamber else "volume"
                problem = f"is the node at the {where} of the tube of chamber {name!r}"
                raise refusal(problem, "another name", f"{kind}.{end}")
    _check_names_of_restrictions(orthosis)
    return names


def _own(name: str) -> str:
    return f"{name!r} is reserved by the supply or a table of times"


def _check_names_of_restrictions(orthosis: HasAir) -> None:
    """The parts of what is described have names of their own, made of its name."""
    taken = {
        f"{name}_{part}": f"a part of chamber {name!r}"
        for name in orthosis.chamber
        for part in ("inlet", "outlet", "tube", "quick_exhaust", "quick_exhaust_exhaust")
    }
    taken |= {
        f"{name}_{part}": f"a part of restriction {name!r}"
        for name, each in orthosis.restriction.items()
        for part in each.part.branches
    }
    for name, each in orthosis.restriction.items():
        key = f"restriction.{name}"
        if name in orthosis.chamber:
            raise refusal("is a chamber's name", "another name", key)
        if name in TAKEN["restriction"] or (each.kind == "valve" and name in TABLE_KEYS):
            raise refusal(_own(name), "another name", key)
        if name in taken:
            raise refusal(f"is the name of {taken[name]}", "another name", key)


def _check_ends(orthosis: HasAir) -> None:
    """Ends that lead air where it cannot be wanted."""
    for name, chamber in orthosis.chamber.items():
        for key, node, wrong, why in (
            ("feed", chamber.feed, AMBIENT, "is the ambient air, which fills nothing"),
            ("exhaust", chamber.exhaust, SUPPLY, "is the supply, which takes back no air"),
        ):
            if node == wrong:
                others = [SUPPLY if key == "feed" else AMBIENT, "a volume", "another chamber"]
                raise refusal(why, ", ".join(others), f"chamber.{name}.{key}")
            if node == name:
                problem = "is the chamber itself: its valve would lead nowhere"
                raise refusal(problem, "another node", f"chamber.{name}.{key}")
    for name, each in orthosis.restriction.items():
        ends, key = {each.upstream, each.downstream}, f"restriction.{name}"
        if ends == {SUPPLY, AMBIENT} and each.kind != "leak":
            problem = "leads from the supply straight to the ambient air: it would leak all the time"
            raise refusal(problem, 'a volume between, or the kind "leak"', key)
        if not each.part.both_ways and each.downstream == SUPPLY:
            raise refusal("is the supply, which takes back no air", "another node", f"{key}.downstream")
        if not (each.part.both_ways or each.part.to_ambient) and each.upstream == AMBIENT:
            raise refusal("is the ambient air, which fills nothing", "another node", f"{key}.upstream")


def _check_touched(orthosis: HasAir, found: list[Way]) -> None:
    """Volumes without a chamber."""
    near = {name: {name} for name in (*orthosis.chamber, *orthosis.volume)}
    for way in found:
        _merge(near, way.origin, way.end)
    touched = {node for way in found for node in (way.origin, way.end)}
    for name in orthosis.volume:
        if name not in touched:
            problem = "is unused: no chamber or restriction names it"
            raise refusal(problem, "a chamber's feed or exhaust, or a restriction", f"volume.{name}")
        if not near[name] & set(orthosis.chamber):
            problem = "is connected to no chamber: it would affect no muscle"
            raise refusal(problem, "a chamber's feed or exhaust, or a restriction to it", f"volume.{name}")


def _check_ways_in(orthosis: HasAir, found: list[Way]) -> None:
    filled = [name for name, each in orthosis.volume.items() if each.start_pressure]
    into = reached([SUPPLY, *filled], found)
    for kind, table in (("chamber", orthosis.chamber), ("volume", orthosis.volume)):
        for name in table:
            if name in into:
                continue
            problem = "no air comes into it: nothing leads from the supply to it"
            for key, each in orthosis.restriction.items():
                if not each.part.both_ways and each.upstream == name and each.downstream in into:
                    problem = f"no air comes into it: {key!r} lets air out of it only"
                    break
            if kind == "chamber":
                mend = "a feed that the supply's air comes to, or that has a start_pressure"
                raise refusal(problem, mend, f"chamber.{name}.feed")
            mend = "a restriction from the supply, or a start_pressure"
            raise refusal(problem, mend, f"volume.{name}")


def _check_ways_out(orthosis: HasAir, found: list[Way]) -> None:
    out = reached([AMBIENT], found, back=True)
    for name, chamber in orthosis.chamber.items():
        if name not in out:
            problem = f"no air leaves the chamber: nothing leads from {chamber.exhaust!r} to the ambient air"
            mend = "ambient, or a volume that another chamber is fed from or that a restriction vents"
            raise refusal(problem, mend, f"chamber.{name}.exhaust")


def _check_regulators(orthosis: HasAir, found: list[Way]) -> None:
    regulators = {name: each for name, each in orthosis.restriction.items() if each.regulator is not None}
    for name, each in regulators.items():
        assert each.regulator is not None and each.pressure is not None
        low, high = each.regulator.set_range
        if not low <= each.pressure <= high:
            told = f"{amount(low, 'Pa', 4)} to {amount(high, 'Pa', 4)}, as of this regulator"
            raise refusal("cannot be set on this regulator", told, f"restriction.{name}.pressure")
        _check_by_passes(f"restriction.{name}", each, found)
    # those that hold the same air must hold it at the same pressure
    open_ways = [way for way in found if way.part.feeds and way.part.both_ways]
    holds: dict[str, str] = {}
    for name, each in regulators.items():
        for node in reached([each.downstream], open_ways):
            if node in (SUPPLY, AMBIENT):
                continue
            other = holds.setdefault(node, name)
            setting = regulators[other].pressure
            if setting is not None and setting != each.pressure:
                problem = f"conflicts with {other!r}, which holds the same air at {amount(setting, 'Pa', 4)}"
                mend = "the same pressure, or a valve or check valve between them"
                raise refusal(problem, mend, f"restriction.{name}.pressure")


def _check_by_passes(key: str, regulator: Restriction, found: list[Way]) -> None:
    """Its own air must not come before it again, nor what is before it behind it."""
    lasting = [way for way in found if way.key != key and way.part.feeds and way.part.blows_off]
    others = [way for way in lasting if way.part is not regulator.part]
    around = reached([regulator.upstream], others).get(regulator.downstream)
    if around:
        problem = (
            f"is by-passed: air comes from {regulator.upstream!r} to what it holds through {_told(around)}"
        )
        raise refusal(problem, "a valve between, or no such way", key)
    others += [way for way in lasting if way.part is regulator.part]
    back = reached([regulator.downstream], others).get(regulator.upstream)
    if back:
        problem = f"is fed by its own outlet, through {_told(back)}"
        raise refusal(problem, "another node, or a valve between", f"{key}.upstream")


def _told(through: list[Way]) -> str:
    return ", ".join(way.key.partition(".")[2] for way in through)
