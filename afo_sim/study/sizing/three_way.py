"""Valve times of one 3/2 valve in place of two 2/2 valves, and the other way round.

A 3/2 valve vents while its coil has no current. So its coil stays on from where the inlet would open until
the outlet would. The other way round the outlet is open wherever that coil has no current.
"""

from collections.abc import Sequence

from afo_sim.common import JsonDict
from afo_sim.description import Scenario

Interval = tuple[float, float]


def one_coil(inlets: Sequence[Interval], outlets: Sequence[Interval], period: float) -> list[Interval]:
    """Intervals in which a 3/2 valve's coil is on, in place of an inlet and an outlet."""
    if not outlets:
        return list(inlets)
    found: dict[float, Interval] = {}
    for start, end in inlets:
        held = min(((outlet - start) % period, outlet) for outlet, _ in outlets)
        if held[0] == 0.0:  # both open at once: nothing is held
            held = ((end - start) % period, end)
        until = held[1]
        if until not in found or held[0] > (until - found[until][0]) % period:
            found[until] = (start, until)
    return sorted(found.values())


def two_coils(inlets: Sequence[Interval], period: float) -> list[Interval]:
    """Intervals in which the outlet is open, in place of a 3/2 valve whose coil is on in `inlets`."""
    ordered = sorted(inlets)
    if not ordered:
        return [(0.0, period)]
    following = [*ordered[1:], ordered[0]]
    gaps = [(end, after) for (_, end), (after, _) in zip(ordered, following, strict=True)]
    return [(a % period, b or period) for a, b in gaps if (b - a) % period > 0.0]


def within(intervals: Sequence[Interval], period: float) -> list[Interval]:
    """The same without any that runs over the period's end."""
    found: list[Interval] = []
    for start, end in intervals:
        found += [(start, end)] if start < end else [(start, period)] + ([(0.0, end)] if end > 0.0 else [])
    return sorted(found)


def times_for(scenario: Scenario, chamber: str, *, three_way: bool) -> JsonDict:
    """The keys that set a chamber's valve times for one 3/2 valve, or for two 2/2 valves."""
    for key, table in (("phases", scenario.phases), ("timer", scenario.timer)):
        if table is None or chamber not in table.chambers:
            continue
        times = table.chambers[chamber]
        cycle = 1.0 if scenario.timer is None else scenario.timer.period
        if three_way:
            sides = {"inlet": one_coil(times.inlet, times.outlet, cycle), "outlet": []}
        else:
            sides = {"inlet": list(times.inlet), "outlet": two_coils(times.inlet, cycle)}
        if key == "phases":
            return {f"{key}.{chamber}.{side}": [[*each] for each in on] for side, on in sides.items()}
        return {
            f"{key}.{chamber}.{side}": [[f"{t!r} s" for t in each] for each in within(on, cycle)]
            for side, on in sides.items()
        }
    return {}
