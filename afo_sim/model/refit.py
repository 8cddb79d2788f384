"""An orthosis on a leg of another size: what is fixed to a segment goes with the segment's length.

    p' = r p         anchors, points and surfaces of a segment that is r times as long, from the ankle
    l' = l + L' − L  link, by what the path is longer at an ankle angle of zero

The muscles stay what they are. With l' each has the contraction ratio at angle zero that it had. Over the
angle it then changes with the moment arm, dκ/dθ = a/L0.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.attachment import Anchor, PathPoint, Segment
from afo_sim.description.leg import Leg
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.description.quantity import Provenance
from afo_sim.description.reader import load
from afo_sim.model.paths import mean_length, paths_of

SHANK, FOOT = 0.246, 0.152  # lengths as shares of body height [-] (Winter 2009, after Drillis & Contini 1966)
SMALLEST, LARGEST = 0.25, 4.0  # ratios of two people's segments: a newborn's to an adult's, and back
WIDEST = math.pi / 3.0  # angle to either side up to which a taut muscle is looked for [rad]


@dataclass(frozen=True)
class Ratio:
    """How much longer shank and foot are than those that it was made for [-]; `words` tell of whom."""

    shank: float = 1.0
    foot: float = 1.0
    words: str = ""

    def of(self, segment: Segment) -> float:
        """The segment's ratio."""
        return self.shank if segment == "shank" else self.foot

    def source(self, segment: Segment) -> str:
        """Where a scaled coordinate comes from."""
        who = f", {self.words}" if self.words else ""
        return f"scaled by {self.of(segment):.6g} with the length of the {segment}{who}"


def lengths_of(leg: Leg) -> tuple[float, float]:
    """Length of a leg's shank and foot [m]: its own, or Winter's shares of the body's height."""
    shank = SHANK * leg.body_height if leg.shank_length is None else leg.shank_length
    foot = FOOT * leg.body_height if leg.foot_length is None else leg.foot_length
    return shank, foot


def refit(orthosis: Orthosis, shank: float = 1.0, foot: float = 1.0, *, words: str = "") -> Orthosis:
    """An orthosis whose anchors and paths go with the lengths of shank and foot.

    All three coordinates of what is fixed to a segment go with the segment's length, girth as height; so do
    radii of surfaces. Muscles, their spacing, pulleys, cables, valves, cuff, plate and outsole stay as they
    are. The link takes up what the path is longer or shorter at an ankle angle of zero.

    Parameters
    ----------
    orthosis : as it was made
    shank, foot : how much longer they are now [-], 0.25 to 4
    words : of whom, for the source of each scaled number

    Returns
    -------
    Orthosis; scaled coordinates are of the kind "derived". With ratios of 1 the same orthosis

    Raises
    ------
    InputError
        A ratio is out of range, or a muscle with its fittings is longer than its path on the new leg.

    Examples
    --------
    >>> child = refit(load("orthosis", "s1"), shank=0.8, foot=0.8)
    >>> round(child.muscle["dorsiflexor"].origin.from_ankle[2], 3)  # [m], of 0.3
    0.24

    Source
    ------
    Lengths of segments: Winter 2009, Biomechanics and Motor Control of Human Movement, 4th ed., fig. 4.1.
    """
    for field, ratio in (("shank", shank), ("foot", foot)):
        if not SMALLEST <= ratio <= LARGEST:  # and no NaN
            raise InputError("is out of range", field=field, value=ratio, allowed="0.25 to 4")
    by = Ratio(shank, foot, words)
    if shank == foot == 1.0:
        return orthosis
    groups = {name: _refitted(name, group, by) for name, group in orthosis.muscle.items()}
    changed = orthosis.model_copy(update={"muscle": groups})
    return load("orthosis", changed.model_dump(mode="json"))  # checked as a file is


def _refitted(name: str, group: MuscleGroup, by: Ratio) -> MuscleGroup:
    """A group between two anchors; over a pulley it stays."""
    if group.origin is None or group.insertion is None or group.link_length is None:
        return group
    ends = {"origin": _moved(group.origin, by), "insertion": _moved(group.insertion, by)}
    moved = group.model_copy(update={**ends, "path": tuple(_moved(place, by) for place in group.path)})
    longer = mean_length(moved) - mean_length(group)
    link = group.link_length + longer
    if link < 0.0:
        path, rest = mean_length(moved), group.series_length - group.link_length + group.type.nominal_length
        raise InputError(
            f"is too long for this leg: its path is {100.0 * path:.3g} cm at an angle of zero, and muscle, "
            f"fittings and slack are {100.0 * rest:.3g} cm",
            field=f"muscle.{name}.type",
            value=group.type.name,
            allowed="a shorter muscle",
        )
    told = Provenance(kind="derived", source=link_source(by))
    return moved.model_copy(
        update={"link_length": link, "provenance": group.provenance | {"link_length": told}}
    )


def link_source(by: Ratio) -> str:
    """Where a refitted link's length comes from."""
    who = f" ({by.words})" if by.words else ""
    return f"so that the muscle's contraction at an ankle angle of zero is that before the refit{who}"


def _moved(place: Any, by: Ratio) -> Any:
    """An anchor or point, with its surface, scaled with its segment."""
    assert isinstance(place, Anchor | PathPoint)
    ratio = by.of(place.segment)
    if ratio == 1.0:
        return place
    told = Provenance(kind="derived", source=by.source(place.segment))
    changed: dict[str, Any] = {
        "from_ankle": tuple(ratio * x for x in place.from_ankle),
        "provenance": place.provenance | {"from_ankle": told},
    }
    if isinstance(place, PathPoint) and place.surface is not None:
        surface = place.surface
        update = {"radius": ratio * surface.radius, "provenance": surface.provenance | {"radius": told}}
        changed["surface"] = surface.model_copy(update=update)
    return place.model_copy(update=changed)


@dataclass(frozen=True)
class Fit:
    """How one group fits its leg.

    arm : moment arm at angle zero, dorsiflexion positive [m]
    contraction : ratio that the path leaves over the range of motion, least and most [-]
    taut : angle from which on the muscle is taut without air [rad]; NaN where none is
    """

    arm: float
    contraction: tuple[float, float]
    taut: float


def fits(orthosis: Orthosis) -> Mapping[str, Fit]:
    """How each group of muscles between two anchors fits; of unlike parallel muscles the mean."""
    paths = paths_of(orthosis)
    if not paths.tendons:
        return {}
    angles = np.linspace(*orthosis.range_of_motion, 81)
    wide = np.linspace(-WIDEST, WIDEST, 1201)
    owners = [name.rsplit("_", 1)[0] for name in paths.tendons]
    found = {}
    arms, lengths, far = paths.moment_arms(np.zeros(1)), paths.lengths(angles), paths.lengths(wide)
    for name, group in orthosis.anchored.items():
        own = [k for k, owner in enumerate(owners) if owner == name]
        length = group.type.nominal_length
        left = 1.0 - (lengths[:, own].mean(axis=1) - group.series_length) / length
        over = 1.0 - (far[:, own].mean(axis=1) - group.series_length) / length
        found[name] = Fit(
            float(arms[0, own].mean()), (float(left.min()), float(left.max())), _crossing(wide, over)
        )
    return found


def _crossing(angles: np.ndarray, values: np.ndarray) -> float:
    """The angle nearest to zero at which values change their sign; NaN where they do not."""
    at = np.flatnonzero(np.diff(np.signbit(values)))
    if not len(at):
        return math.nan
    k = at[np.argmin(np.abs(angles[at]))]
    share = values[k] / (values[k] - values[k + 1])
    return float(angles[k] + share * (angles[k + 1] - angles[k]))
