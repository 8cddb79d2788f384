"""What a supply and a timer need of an orthosis: air to take, size of the network, valves to switch."""

from collections.abc import Collection, Iterator, Sequence

from afo_sim.common import Given, JsonMapping
from afo_sim.description.air.air_graph import HasAir, highest_pressures, ways
from afo_sim.description.air.air_parts import AMBIENT, SUPPLY
from afo_sim.description.air.network_checks import check_room
from afo_sim.description.air.supply import Supply
from afo_sim.description.quantity import amount, refusal

TWO_VALVES = "two 2/2 valves, inlet and outlet"
NO_COIL = "has no coil: a 3/2 valve vents while its coil has no current"


def check_supplied(orthosis: HasAir, supply: Supply) -> None:
    """Refuse regulators that are set above what comes to them, and a network that is too large."""
    highest = highest_pressures(orthosis, supply.pressure)
    for name, each in orthosis.restriction.items():
        if each.regulator is None or each.pressure is None:
            continue
        before = highest.get(each.upstream, 0.0)
        if each.pressure > before * (1.0 + 1e-12):
            problem = f"is above what comes to it: {each.upstream!r} has {amount(before, 'Pa', 4)} at most"
            most = f"at most {amount(before, 'Pa', 4)}, or more pressure before it"
            raise refusal(problem, most, f"orthosis.restriction.{name}.pressure")
    if not orthosis.chamber:
        return
    ends = [{way.origin, way.end} for way in ways(orthosis)]
    taken = any(SUPPLY in each and AMBIENT not in each for each in ends)
    for key in ("source", "regulator"):
        if getattr(supply, key) is not None and not taken:
            problem = f"its {key} has nothing to feed: no chamber or volume takes air from the supply"
            raise refusal(problem, 'a feed or an upstream that is "supply"; or an ideal supply', "supply")
    nodes = restrictions = 0
    if supply.source is not None:
        nodes += 1
        restrictions += supply.source.kind == "compressor"
    if supply.regulator is not None:
        nodes += 1
        restrictions += 1 + (supply.regulator.relief is not None) + (supply.regulator.bleed > 0.0)
    if nodes:
        check_room(orthosis, nodes, restrictions, shared=True, under="orthosis.")


def check_three_way(orthosis: HasAir, drives: Collection[str], controller: Given = None) -> None:
    """Refuse drives and commands that a 3/2 valve cannot follow: it has one coil, and is never shut."""
    three_way = [name for name, chamber in orthosis.chamber.items() if chamber.three_way]
    for name in three_way:
        if name in drives:
            problem = "holds a pressure with both valves shut, and the chamber's 3/2 valve is never shut"
            raise refusal(problem, f"{TWO_VALVES}, in chamber.{name}", f"drive.{name}")
    if controller is None:
        return
    for key, name, problem, mend in _impossible(controller.kind, getattr(controller, controller.kind)):
        if name in three_way:
            raise refusal(problem, mend, f"controller.{controller.kind}.{key}")


def _impossible(kind: str, described: Given) -> Iterator[tuple[str, str, str, str]]:
    """(key, chamber, problem, what would mend it) of commands that only two valves can follow."""
    if kind in ("timer", "gait_phase"):
        for name, told in described.chambers.items():
            if told.outlet:
                yield f"{name}.outlet", name, NO_COIL, "inlet alone, or an outlet valve"
        if kind == "gait_phase" and described.waiting == "shut":
            for name in described.chambers:
                yield "waiting", name, _never_shut(name), '"outlet", which vents; or an outlet valve'
    elif kind == "state_machine":
        for state, told in described.state.items():
            for name, command in told.chambers.items():
                key, both = f"state.{state}.{name}", isinstance(command, tuple) and command[1] > 0.0
                if command == "shut":
                    yield key, name, _never_shut(name), '"inlet" or "outlet"; or an outlet valve'
                elif command == "both" or both:
                    yield key, name, NO_COIL, '"inlet" or "outlet"; or an outlet valve'
    elif kind == "pid" and described.pressures is None:
        for key, name in described.named.items():
            yield key, name, f"switches both valves off between pulses, and {_never_shut(name)}", TWO_VALVES


def _never_shut(name: str) -> str:
    return f"the 3/2 valve of chamber {name!r} vents while its coil has no current"


def check_switched(orthosis: HasAir, named: Sequence[tuple[str, JsonMapping]]) -> None:
    """Refuse times of a valve that is not there."""
    for key, tables in named:
        if key == "start":
            continue
        for name, times in tables.items():
            each = orthosis.restriction.get(name)
            if each is not None and each.valve is None:
                coils = [other for other, one in orthosis.restriction.items() if one.valve is not None]
                allowed = ", ".join([*orthosis.chamber, *coils])
                problem = f"has no coil: the kind of this restriction is {each.kind!r}"
                raise refusal(problem, allowed, f"{key}.{name}")
            sides = [side for side in ("inlet", "outlet") if getattr(times, side)]
            if name in orthosis.restriction and sides:
                problem = "applies to chambers; a valve between other nodes has one path"
                raise refusal(problem, "open", f"{key}.{name}.{sides[0]}")
            if name not in orthosis.chamber:
                continue
            if times.open:
                raise refusal("applies to valves between other nodes", "inlet, outlet", f"{key}.{name}.open")
            if times.outlet and orthosis.chamber[name].three_way:
                raise refusal(NO_COIL, "inlet alone, or an outlet valve", f"{key}.{name}.outlet")
