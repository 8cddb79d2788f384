"""Where and how a muscle is attached: anchors, points and surfaces of its path, pulley, cable, mounting.

Positions are in metres from the joint at an angle of zero: x forward, y left, z up.
"""

import math
from typing import Annotated, Literal

from afo_sim.description.joint import Segment as Segment
from afo_sim.description.law_set import Contraction
from afo_sim.description.muscle import Distance, PositiveLength
from afo_sim.description.quantity import Described, Quantity, refusal

Side = Literal["right", "left"]
_Length = Annotated[float, Quantity("m", at_least=-2.0, at_most=2.0)]
Coordinates = tuple[_Length, _Length, _Length]
_Stiffness = Annotated[float, Quantity("N/m", above=0.0, at_most=1e9)]
_Component = Annotated[float, Quantity("", at_least=-1.0, at_most=1.0)]

ALIKE = 1e-12  # sideways distances that are equal but for rounding [m]


class Anchor(Described):
    """One end of a muscle group: where on which segment, and how far apart its muscles are."""

    segment: Segment
    """Segment that it is fixed to."""
    from_joint: Coordinates
    """Position in the segment at an angle of zero, from the ankle or other joint: forward, left, up."""
    spacing: Distance = 0.0
    """Distance between parallel muscles, to the side."""

    @property
    def from_ankle(self) -> Coordinates:
        """As `from_joint`; the name of former versions."""
        return self.from_joint


class Surface(Described):
    """A surface that the muscle's path bends around where it touches it: a roller, a pad, a heel."""

    shape: Literal["cylinder", "sphere"] = "cylinder"
    """Cylinder, endless along its axis, or sphere."""
    radius: PositiveLength
    """Radius of the surface."""
    axis: tuple[_Component, _Component, _Component] = (0.0, 1.0, 0.0)
    """Direction of a cylinder's axis: forward, left, up; any length but zero."""

    def _must_have_an_axis(self) -> None:
        if self.shape == "cylinder" and not math.hypot(*self.axis) > 1e-3:
            raise refusal("has no length: it gives no direction", "[0.0, 1.0, 0.0], to the left", "axis")

    @property
    def lateral(self) -> bool:
        """Whether it is a cylinder along the joint's axis: a path may shift sideways along it."""
        return self.shape == "cylinder" and math.hypot(self.axis[0], self.axis[2]) <= ALIKE

    @property
    def is_its_mirror_image(self) -> bool:
        """Whether a mirror from left to right through its centre leaves it as it is."""
        return self.shape == "sphere" or self.lateral or abs(self.axis[1]) <= ALIKE

    def clearance(self, centre: Coordinates, place: Coordinates) -> float:
        """Distance of a place from the surface [m], negative inside; both from the joint, in one frame."""
        away = difference(centre, place)
        if self.shape == "cylinder":
            along = sum(a * x for a, x in zip(away, self.axis, strict=True)) / math.hypot(*self.axis)
            return math.sqrt(max(math.hypot(*away) ** 2 - along**2, 0.0)) - self.radius
        return math.hypot(*away) - self.radius


class PathPoint(Anchor):
    """A place that the muscle's path runs through, or a surface centred there that it bends around."""

    surface: Surface | None = None
    """Surface around this place that the path bends around; without one the path runs through the place."""


def difference(origin: Coordinates, insertion: Coordinates) -> Coordinates:
    """From the upper to the lower end, in the axes that both segments share at an angle of zero [m]."""
    return insertion[0] - origin[0], insertion[1] - origin[1], insertion[2] - origin[2]


class Pulley(Described):
    """A wheel on the joint's axis that a muscle's cable runs over: its moment arm is constant."""

    radius: PositiveLength
    """Radius of the wheel, the muscle's moment arm."""
    direction: Literal["positive", "negative"]
    """Direction in which the muscle turns the joint."""
    initial_contraction: Contraction = 0.0
    """Contraction ratio of the muscle at angle zero."""
    spacing: Distance = 0.0
    """Distance between parallel muscles in pictures."""

    @property
    def moment_arm(self) -> float:
        """−dL/dφ [m]: positive when tension turns the joint to positive angles."""
        return self.radius if self.direction == "positive" else -self.radius


class Stiffening(Described):
    """A mounting that stiffens as it gives: F = a (e^(x/x0) − 1), of stiffness (F + a)/x0."""

    force: Annotated[float, Quantity("N", above=0.0, at_most=1e6)]
    """Force a in F = a (e^(x/x0) − 1)."""
    length: PositiveLength
    """Length x0 over which F + a grows e-fold."""


class Mounting(Described):
    """How a cuff or plate gives along the muscles' pull: a stiffness, or a stiffening law instead."""

    stiffness: _Stiffness | None = None
    """Force over displacement; this, or stiffening."""
    stiffening: Stiffening | None = None
    """Stiffening law, instead of a stiffness."""
    damping: Annotated[float, Quantity("N*s/m", at_least=0.0, at_most=1e6)] = 0.0
    """Viscous damping of the displacement."""

    def _must_have_one_law(self) -> None:
        laws = 'stiffness = "4 kN/m", or stiffening = { force = "33 N", length = "17 mm" }'
        if self.stiffness is not None and self.stiffening is not None:
            raise refusal(
                "conflicts with a stiffening law: only one of them may give the force", laws, "stiffness"
            )
        if self.stiffness is None and self.stiffening is None:
            if self.damping > 0.0:
                problem = "needs a stiffness: nothing would bring it back"
                raise refusal(problem, f"beside it {laws}", "damping")
            problem = "is missing: a table of an anchor needs it; without a table the anchor is rigid"
            raise refusal(problem, laws, "stiffness")

    def displacement(self, pull: float) -> float:
        """Displacement [m] at rest under a pull [N]; none under a push."""
        if pull <= 0.0:
            return 0.0
        if self.stiffening is not None:
            return self.stiffening.length * math.log1p(pull / self.stiffening.force)
        assert self.stiffness is not None
        return pull / self.stiffness


class Interface(Described):
    """How a cuff or plate lies on the body: the area that carries, and how it holds by friction."""

    area: Annotated[float, Quantity("m^2", above=0.0, at_most=1.0)]
    """Area of skin over which the force is spread."""
    friction: Annotated[float, Quantity("", above=0.0, at_most=2.0)]
    """Coefficient of friction between the skin, or the clothes on it, and the cuff."""


class Cable(Described):
    """Cable or bracket in series with one muscle; it only pulls."""

    stiffness: _Stiffness = 1e6
    """Stiffness of each muscle's own cable and brackets."""
    offset: Distance = 0.0
    """Length that it has gained, by bedding in or bending, before it carries anything."""
