"""Where the points of a leg come from, in few words: what they share is said once."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride

CARRIED = ", carried by "  # what follows names the markers that carry a centre


def centres_told(points: Mapping[str, LegPoint]) -> str:
    """Each point with its error and its way; those of one way stand together."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for role, point in points.items():
        how = point.how.partition(CARRIED)[0].removesuffix(" of the model")
        name, _, way = how.partition(", ")
        groups.setdefault(way or name, []).append((f"{role}{_error(point)}", name if way else ""))
    words = "; ".join(_together(way, members) for way, members in groups.items())
    return re.sub(r"(±\d+ mm)", r"\1 fore-aft", words, count=1)


def _error(point: LegPoint) -> str:
    return "" if point.error is None else f" ±{1e3 * point.error:.0f} mm"


def _together(way: str, members: Sequence[tuple[str, str]]) -> str:
    """Points of one way: (role with error, the name of its own)."""
    roles, names = zip(*members, strict=True)
    if len(set(names)) == 1:
        return f"{', '.join(roles)}: {names[0] + ', ' if names[0] else ''}{way}"
    return f"{', '.join(f'{role} {name}'.strip() for role, name in members)}: {way}"


def bridged_told(leg: LegPoints, strides: Sequence[RecordedStride]) -> list[str]:
    """Points that were not seen in a part of the strides, where their segment's markers stand in for them."""
    inside = np.zeros(len(leg.time), dtype=bool)
    for stride in strides:
        if stride.side == leg.side:
            first, last = (stride.start, stride.end) if stride.closed is None else stride.closed.window
            inside |= (leg.time >= first) & (leg.time <= last)
    shares: dict[str, list[str]] = {}
    for role, point in leg.points.items():
        if point.bridged is not None and point.bridged[inside].any():
            shares.setdefault(f"{100.0 * point.bridged[inside].mean():.0f} %", []).append(role)
    return [
        f"{', '.join(roles)} by the segment's markers in {share} of the stride"
        for share, roles in shares.items()
    ]
