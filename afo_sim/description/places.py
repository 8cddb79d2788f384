"""Places on shank and foot that a muscle's path runs through, or bends around.

Positions are in metres from the ankle joint at an ankle angle of zero: x forward, y left, z up.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import model_validator

from afo_sim.description.muscle import Distance, PositiveLength
from afo_sim.description.quantity import Described, Quantity, refusal

Segment = Literal["shank", "foot"]
Side = Literal["right", "left"]
Length = Annotated[float, Quantity("m", at_least=-2.0, at_most=2.0)]
Coordinates = tuple[Length, Length, Length]
Component = Annotated[float, Quantity("", at_least=-1.0, at_most=1.0)]

ALIKE = 1e-12  # sideways distances that are equal but for rounding [m]


class Anchor(Described):
    """One end of a muscle group: where on which segment, and how far apart its muscles are."""

    segment: Segment
    """Segment that it is fixed to."""
    from_ankle: Coordinates
    """Position in the segment at an ankle angle of zero, from the ankle joint: forward, left, up."""
    spacing: Distance = 0.0
    """Distance between parallel muscles, to the side."""


class Surface(Described):
    """A surface that the muscle's path bends around where it touches it: a roller, a pad, a heel."""

    shape: Literal["cylinder", "sphere"] = "cylinder"
    """Cylinder, endless along its axis, or sphere."""
    radius: PositiveLength
    """Radius of the surface."""
    axis: tuple[Component, Component, Component] = (0.0, 1.0, 0.0)
    """Direction of a cylinder's axis: forward, left, up; any length but zero."""

    @model_validator(mode="after")
    def _has_an_axis(self) -> Self:
        if self.shape == "cylinder" and not math.hypot(*self.axis) > 1e-3:
            raise refusal("has no length: it gives no direction", "[0.0, 1.0, 0.0], to the left", "axis")
        return self

    @property
    def lateral(self) -> bool:
        """Whether it is a cylinder along the ankle's axis: a path may shift sideways along it."""
        return self.shape == "cylinder" and math.hypot(self.axis[0], self.axis[2]) <= ALIKE

    @property
    def is_its_mirror_image(self) -> bool:
        """Whether a mirror from left to right through its centre leaves it as it is."""
        return self.shape == "sphere" or self.lateral or abs(self.axis[1]) <= ALIKE

    def clearance(self, centre: Coordinates, place: Coordinates) -> float:
        """Distance of a place from the surface [m], negative inside; both from the ankle, in one frame."""
        away = difference(centre, place)
        if self.shape == "cylinder":
            along = sum(a * x for a, x in zip(away, self.axis, strict=True)) / math.hypot(*self.axis)
            return math.sqrt(max(math.hypot(*away) ** 2 - along**2, 0.0)) - self.radius
        return math.hypot(*away) - self.radius


class PathPoint(Described):
    """A place that the muscle's path runs through, or a surface centred there that it bends around.

    Points of a path stand in their order from origin to insertion. A surface stands between two points, of
    which origin and insertion are the outermost; the path touches it only where the straight line would
    pass through it.
    """

    segment: Segment
    """Segment that it is fixed to."""
    from_ankle: Coordinates
    """Position in the segment at an ankle angle of zero, from the ankle joint: forward, left, up."""
    spacing: Distance = 0.0
    """Distance between parallel muscles, to the side."""
    surface: Surface | None = None
    """Surface around this place that the path bends around; without one the path runs through the place."""


def difference(origin: Coordinates, insertion: Coordinates) -> Coordinates:
    """From the upper to the lower end, in the axes that shank and foot share at an angle of zero [m]."""
    return insertion[0] - origin[0], insertion[1] - origin[1], insertion[2] - origin[2]
