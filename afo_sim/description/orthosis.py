"""An orthosis as it is described: muscle groups, where they are mounted, chambers and their valves.

Angles are dorsiflexion positive, positions in metres from the ankle joint: x forward, y left, z up.
"""

import math
import pathlib
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Field, ValidationInfo, field_validator, model_validator

from afo_sim.common.errors import nearest_name
from afo_sim.description.muscle import Contraction, Distance, Muscle, PositiveLength
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.shoe import Outsole

Segment = Literal["shank", "foot"]
Angle = Annotated[float, Quantity("rad", at_least=-3.15, at_most=3.15)]
Length = Annotated[float, Quantity("m", at_least=-2.0, at_most=2.0)]
Delay = Annotated[float, Quantity("s", at_least=0.0, at_most=1.0)]
Stiffness = Annotated[float, Quantity("N/m", above=0.0, at_most=1e9)]
Coordinates = tuple[Length, Length, Length]

ALIKE = 1e-12  # sideways distances that are equal but for rounding [m]


class Valve(Described):
    """A solenoid valve: sonic conductance C, critical ratio b (ISO 6358), and its two delays."""

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""
    conductance: Annotated[float, Quantity("m^3/(s*Pa)", above=0.0, at_most=1e-6)]
    """Sonic conductance C (ISO 6358) of the open valve."""
    critical_ratio: Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]
    """Critical pressure ratio b (ISO 6358); below it the flow is choked."""
    opening_delay: Delay
    """Time from the coil's current to the open valve."""
    closing_delay: Delay
    """Time from the end of the current to the shut valve."""

    @property
    def row(self) -> dict[str, float]:
        """The parameters of its compiled counterpart, SI."""
        return {
            "conductance": self.conductance,
            "critical_ratio": self.critical_ratio,
            "opening_delay": self.opening_delay,
            "closing_delay": self.closing_delay,
        }


class Anchor(Described):
    """One end of a muscle group: where on which segment, and how far apart its muscles are."""

    segment: Segment
    """Segment that it is fixed to."""
    from_ankle: Coordinates
    """Position in the segment at an ankle angle of zero, from the ankle joint: forward, left, up."""
    spacing: Distance = 0.0
    """Distance between parallel muscles, to the side."""


class Pulley(Described):
    """A wheel on the joint's axis that a muscle's cable runs over: its moment arm is constant.

    A `positive` muscle turns the joint to positive angles. `initial_contraction` is its contraction
    ratio at angle zero, κ0 in κ = κ0 ± r φ/L0. `spacing` sets parallel muscles apart in pictures.
    """

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

    stiffness: Stiffness | None = None
    """Force over displacement; this, or stiffening."""
    stiffening: Stiffening | None = None
    """Stiffening law, instead of a stiffness."""
    damping: Annotated[float, Quantity("N*s/m", at_least=0.0, at_most=1e6)] = 0.0
    """Viscous damping of the displacement."""

    @model_validator(mode="after")
    def _has_one_law(self) -> Self:
        laws = 'stiffness = "4 kN/m", or stiffening = { force = "33 N", length = "17 mm" }'
        if self.stiffness is not None and self.stiffening is not None:
            raise refusal("stands beside a stiffening law: one of them gives the force", laws, "stiffness")
        if self.stiffness is None and self.stiffening is None:
            if self.damping > 0.0:
                problem = "stands without a stiffness: nothing would bring it back"
                raise refusal(problem, f"beside it {laws}", "damping")
            problem = "is missing: a table of an anchor needs it; without a table the anchor is rigid"
            raise refusal(problem, laws, "stiffness")
        return self

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

    stiffness: Stiffness = 1e6
    """Stiffness of each muscle's own cable and brackets."""
    offset: Distance = 0.0
    """Length that it has gained, by bedding in or bending, before it carries anything."""


class MuscleGroup(Described):
    """Parallel muscles of one kind on one chamber, between two anchors or over a pulley."""

    count: int = Field(ge=1, le=20)
    """Number of parallel muscles."""
    type: Muscle
    """Muscle: a shipped name, or the path of a muscle's TOML file or folder."""
    origin: Anchor | None = None
    """Anchor of the upper end; with insertion and link_length, or else a pulley."""
    insertion: Anchor | None = None
    """Anchor of the lower end."""
    link_length: Distance | None = None
    """Length of cable and hardware in series with the muscle."""
    slack: Distance = 0.0
    """Length by which the cable hangs through beyond that."""
    pulley: Pulley | None = None
    """Pulley that the muscle's cable runs over, instead of two anchors."""
    cable: Cable = Cable()
    """Stiffness of what is in series with each muscle."""
    chamber: str | None = None
    """Chamber that fills the muscles; the group's own name by default."""

    @model_validator(mode="after")
    def _spans_the_joint(self) -> Self:
        between = {key: getattr(self, key) for key in ("origin", "insertion", "link_length")}
        if self.pulley is None:
            for key, given in between.items():
                if given is None:
                    either = "origin, insertion and link_length; or a pulley"
                    raise refusal("is missing: the muscle is not mounted", either, key)
        else:
            for key, given in (between | {"slack": self.slack or None}).items():
                if given is not None:
                    raise refusal(
                        "does not go with a pulley: its length follows from initial_contraction",
                        "either a pulley, or origin, insertion, link_length and slack",
                        key,
                    )
        if self.origin and self.insertion and self.origin.segment == self.insertion.segment:
            raise refusal(
                "both ends are on the same segment: the muscle cannot move the ankle",
                "the segment that the other end is not on",
                "insertion.segment",
            )
        return self

    @model_validator(mode="after")
    def _has_a_cable_within_its_path(self) -> Self:
        path = min(self.path_lengths, default=math.inf)
        if self.cable.offset >= path:
            raise refusal(
                f"is not shorter than the path between the anchors, {path * 100:.3g} cm at an angle of zero",
                f"less than {path * 100:.3g} cm",
                "cable.offset",
            )
        return self

    @property
    def series_length(self) -> float:
        """Length of the tendon beyond the active braid [m]: ends, link, slack, and the cable's offset.

        The tendon of a pulley measures from angle zero. There it is minus the braid's length, plus the
        offset, which makes the muscle slacker as a higher initial contraction does.
        """
        if self.pulley is not None:
            return self.cable.offset - self.type.nominal_length * (1.0 - self.pulley.initial_contraction)
        return self.type.end_length + (self.link_length or 0.0) + self.slack + self.cable.offset

    @property
    def path_lengths(self) -> tuple[float, ...]:
        """Distance between the anchors of each parallel muscle at an angle of zero [m]; none of a pulley."""
        if self.origin is None or self.insertion is None:
            return ()
        forward, _, up = _difference(self.origin.from_ankle, self.insertion.from_ankle)
        return tuple(math.hypot(forward, aside, up) for aside in self._asides)

    @property
    def alike(self) -> bool:
        """Whether its parallel muscles have the same path length at every angle.

        Over a pulley they have. Between two anchors they have where they stand equally far aside.
        """
        asides = [abs(aside) for aside in self._asides]
        return max(asides, default=0.0) - min(asides, default=0.0) <= ALIKE

    @property
    def _asides(self) -> tuple[float, ...]:
        """How far each parallel muscle's lower end is to the left of its upper end [m]; none of a pulley."""
        if self.origin is None or self.insertion is None:
            return ()
        middle = _difference(self.origin.from_ankle, self.insertion.from_ankle)[1]
        spread = self.insertion.spacing - self.origin.spacing
        return tuple(middle + (k - 0.5 * (self.count - 1)) * spread for k in range(self.count))


def _difference(origin: Coordinates, insertion: Coordinates) -> Coordinates:
    """From the upper to the lower end, in the axes that shank and foot share at an angle of zero [m]."""
    return insertion[0] - origin[0], insertion[1] - origin[1], insertion[2] - origin[2]


class Chamber(Described):
    """Muscles that share their valves: inlet from the supply, outlet to ambient."""

    inlet: Valve
    """Valve from the supply: a shipped name, or the path of a valve's TOML file or folder."""
    outlet: Valve
    """Valve to the air outside."""
    tube_volume: Annotated[float, Quantity("m^3", at_least=0.0, at_most=0.1)]
    """Volume of the tubes between valves and muscles."""
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e4)]
    """Heat conductance from the air inside to the air outside; 0 is adiabatic."""


class Orthosis(Described):
    """Cuff on the shank, plate under the foot, muscles between them, air to the muscles.

    Cuff or plate may be missing where the leg's own bodies hold the muscles.
    """

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""
    cuff: pathlib.Path | None = None
    """MJCF file of the cuff, which is fixed to the shank."""
    plate: pathlib.Path | None = None
    """MJCF file of the plate, which is fixed under the foot."""
    outsole: Outsole | None = None
    """Outsole of the plate, where it is one: worn instead of a shoe."""
    range_of_motion: tuple[Angle, Angle]
    """Lowest and highest ankle angle that the device is built for; a muscle that locks within is
    refused."""
    anchor: dict[Segment, Mounting] = Field(default_factory=dict)
    """How the cuff on the shank and the plate under the foot give; without a table they are rigid."""
    interface: dict[Segment, Interface] = Field(default_factory=dict)
    """How the cuff on the shank and the plate under the foot lie on the skin; without a table no pressure on
    it is told."""
    muscle: dict[str, MuscleGroup] = Field(default_factory=dict)
    """Muscle groups by name."""
    chamber: dict[str, Chamber] = Field(default_factory=dict)
    """Chambers by name; each holds the air of one or several muscle groups."""

    @field_validator("anchor", "interface", mode="before")
    @classmethod
    def _are_segments(cls, tables: Any, info: ValidationInfo) -> Any:
        known = get_args(Segment)
        for name in tables if isinstance(tables, Mapping) else ():
            if name not in known:
                nearest = nearest_name(str(name), known) or ""
                raise refusal(f"is an unknown {info.field_name}", " or ".join(known), str(name), nearest)
        return tables

    @model_validator(mode="after")
    def _anchors_are_pulled_on(self) -> Self:
        if self.anchor and self.muscle and not self.anchored:
            problem = "is pulled on by no muscle: all of them run over pulleys"
            raise refusal(problem, "no such table, or a muscle between two anchors", "anchor")
        return self

    @model_validator(mode="after")
    def _chambers_pull_alike(self) -> Self:
        for chamber in self.chamber if self.anchor else ():
            over_pulleys = {group.pulley is not None for group in self.muscles_of(chamber).values()}
            if len(over_pulleys) > 1:
                problem = "holds muscles over pulleys and between anchors, and only these pull on the anchors"
                raise refusal(problem, "a chamber for each", f"chamber.{chamber}")
        return self

    @model_validator(mode="after")
    def _chambers_exist(self) -> Self:
        if not self.muscle and (self.cuff or self.plate or self.chamber or self.anchor):
            raise refusal("there is no muscle", "at least one muscle group", "muscle")
        for kind in ("muscle", "chamber"):
            for name in getattr(self, kind):
                if not re.fullmatch(r"[A-Za-z][\w-]*", name):
                    raise refusal(f"{name!r} is no name", "letters, digits, - and _, a letter first", kind)
        for name, group in self.muscle.items():
            if (group.chamber or name) not in self.chamber:
                raise refusal(
                    f"there is no chamber {group.chamber or name!r}",
                    ", ".join(self.chamber),
                    f"muscle.{name}.chamber",
                    nearest_name(group.chamber or name, self.chamber) or "",
                )
        for name in self.chamber:
            if not self.muscles_of(name):
                raise refusal("no muscle hangs on this chamber", "", f"chamber.{name}")
        if not self.range_of_motion[0] < self.range_of_motion[1]:
            raise refusal("the first angle is not below the second", "", "range_of_motion")
        return self

    @property
    def anchored(self) -> dict[str, MuscleGroup]:
        """The muscle groups that pull on both anchors: all but those over a pulley."""
        return {name: group for name, group in self.muscle.items() if group.pulley is None}

    def muscles_of(self, chamber: str) -> dict[str, MuscleGroup]:
        """The muscle groups that hang on a chamber."""
        return {n: g for n, g in self.muscle.items() if (g.chamber or n) == chamber}
