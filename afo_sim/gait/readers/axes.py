"""The laboratory's axes: which is forward, which is up."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.choices import Choices
from afo_sim.gait.readers.markers import Markers

OBLIQUE = 20.0  # largest angle between the foot and an axis that is taken for walking along it [deg]


@dataclass(frozen=True)
class Axes:
    """Signed axis names, such as forward "x" and up "y" (OpenSim's)."""

    forward: str = "x"
    up: str = "y"

    def plane(self, points: np.ndarray) -> np.ndarray:
        """(…, 3) in the laboratory → (…, 2): forward, up."""
        return np.stack([_along(self.forward, points), _along(self.up, points)], axis=-1)


def find_axes(markers: Markers, choices: Choices) -> Axes:
    """The axes that the markers show: the shank stands upright, the foot points forward.

    Parameters
    ----------
    markers : with knee and ankle; heel and toe, or else a walk of half a metre, for forward
    choices : whose `forward` and `up` go before what is found

    Raises
    ------
    InputError
        Forward cannot be told, or the person walks across the axes.
    """
    knee, ankle = (markers.point(markers.name(role, choices)) for role in ("knee", "ankle"))
    up = choices.up or _nearest_axis(np.nanmean(knee - ankle, axis=0))
    if choices.forward and choices.forward[-1] == up[-1]:
        problem = "is the axis in which the leg stands upright"
        raise InputError(problem, field="forward", value=choices.forward)
    if choices.forward:
        return Axes(choices.forward, up)
    if markers.has("heel", choices) and markers.has("toe", choices):
        heel, toe = (markers.point(markers.name(role, choices)) for role in ("heel", "toe"))
        way = np.nanmean(toe - heel, axis=0)
    else:
        seen = ankle[np.all(np.isfinite(ankle), axis=1)]
        way = seen[-1] - seen[0]
        if np.linalg.norm(way) < 0.5:
            raise InputError(
                "which way the person walks cannot be told without heel and toe markers",
                field="forward",
                allowed="x, y, z, -x, -y, -z",
            )
    way["xyz".index(up[-1])] = 0.0
    forward = _nearest_axis(way)
    off = np.degrees(np.arccos(_along(forward, way) / np.linalg.norm(way)))
    if off > OBLIQUE:
        raise InputError(
            f"the foot points {off:.0f} deg away from the nearest axis, {forward}",
            field="forward",
            allowed="a walk along an axis of the laboratory; or the axis to look along, given here",
        )
    return Axes(forward, up)


def _along(axis: str, points: np.ndarray) -> np.ndarray:
    sign = -1.0 if axis.startswith("-") else 1.0
    return np.asarray(sign * points[..., "xyz".index(axis[-1])])


def _nearest_axis(vector: np.ndarray) -> str:
    k = int(np.argmax(np.abs(vector)))
    return ("-" if vector[k] < 0.0 else "") + "xyz"[k]
