"""An orthosis as it is described: muscle groups, where they are mounted, chambers and their valves.

Angles are dorsiflexion positive, of other joints flexion; positions in metres from the joint: x forward,
y left, z up.
"""

import itertools
import math
import pathlib
import re
from collections.abc import Mapping
from typing import Annotated, get_args

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from afo_sim.common import Given, nearest_name
from afo_sim.description.air.air_parts import Restriction, Volume
from afo_sim.description.air.chamber import Chamber as Chamber
from afo_sim.description.air.network_checks import check_network
from afo_sim.description.air.valve import Valve as Valve
from afo_sim.description.attachment import (
    ALIKE,
    Anchor,
    Cable,
    Coordinates,
    Interface,
    Mounting,
    PathPoint,
    Pulley,
    Segment,
    Side,
    difference,
)
from afo_sim.description.joint import JOINTS, Joint, JointName, a_joint
from afo_sim.description.leg import Outsole
from afo_sim.description.muscle import Distance, Muscle
from afo_sim.description.quantity import Described, Named, Quantity, refusal, refused_name

_Angle = Annotated[float, Quantity("rad", at_least=-3.15, at_most=3.15)]
_Length = Annotated[float, Quantity("m", at_least=-2.0, at_most=2.0)]

_MOST_PLACES = 12  # on a muscle's path between its ends


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
    path: tuple[PathPoint, ...] = Field(default=(), max_length=_MOST_PLACES)
    """Points and surfaces between origin and insertion, in this order; a straight path by default."""
    wrap_friction: Annotated[float, Quantity("", at_least=0.0, at_most=1.0)] = 0.0
    """Coefficient of friction (capstan) at the path's points and surfaces on the origin's segment; none by
    default."""
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

    def _must_span_the_joint(self) -> None:
        between = {key: getattr(self, key) for key in ("origin", "insertion", "link_length")}
        if self.pulley is None:
            for key, given in between.items():
                if given is None:
                    either = "origin, insertion and link_length; or a pulley"
                    raise refusal("is missing: the muscle is not mounted", either, key)
        else:
            for key, given in (between | {"slack": self.slack or None}).items():
                if given is not None:
                    problem = "does not go with a pulley: its length follows from initial_contraction"
                    either = "either a pulley, or origin, insertion, link_length and slack"
                    raise refusal(problem, either, key)
        if self.origin and self.insertion and self.origin.segment == self.insertion.segment:
            problem = "both ends are on the same segment: the muscle cannot move the joint"
            raise refusal(problem, "another segment than that of the other end", "insertion.segment")
        if self.path and self.pulley is not None:
            problem = "does not go with a pulley: its cable runs over the pulley alone"
            raise refusal(problem, "either a pulley, or origin, path and insertion", "path")
        for number in range(1, len(self.path)):
            if self.path[number].surface and self.path[number - 1].surface:
                problem = "is a surface next to a surface: where the path runs between them is not defined"
                raise refusal(problem, "a point without surface before it", f"path.{number}.surface")
        for number, k in itertools.product(range(len(self.path)), range(self.count)):
            if refused := self._inside(number, k):
                raise refused

    def _must_rub_where_it_slides(self) -> None:
        if self.wrap_friction == 0.0:
            return
        if not self.path:
            problem = "has no effect: the path is straight, and touches nothing"
            raise refusal(problem, "0, or a path with points or surfaces", "wrap_friction")
        segments = [place.segment for place in self.places]
        if sum(a != b for a, b in itertools.pairwise(segments)) > 1:
            problem = "is known only where the path goes from segment to segment once"
            allowed = "0, or a path whose points on the origin's segment come first"
            raise refusal(problem, allowed, "wrap_friction")
        if self.path[0].segment != segments[0]:
            raise refusal(
                "has no effect: the cable slides on the segment of its origin, where the muscle is, and "
                "nothing guides it there",
                f"0, or a point or surface of the path on the {segments[0]}",
                "wrap_friction",
            )

    def _must_have_a_cable_within_its_path(self) -> None:
        if self.guided_by_surfaces:  # only the compiled model knows how long it is
            return
        path = min(self.path_lengths, default=math.inf)
        if self.cable.offset >= path:
            long = f"{path * 100:.3g} cm"
            problem = f"is not shorter than the path between the anchors, {long} at an angle of zero"
            raise refusal(problem, f"less than {long}", "cable.offset")

    @property
    def series_length(self) -> float:
        """Length of the tendon beyond the active braid [m]: ends, link, slack, and the cable's offset."""
        if self.pulley is not None:
            return self.cable.offset - self.type.nominal_length * (1.0 - self.pulley.initial_contraction)
        return self.type.end_length + (self.link_length or 0.0) + self.slack + self.cable.offset

    @property
    def path_lengths(self) -> tuple[float, ...]:
        """Length of each parallel muscle's path at an angle of zero [m]; none of a pulley."""
        if self.origin is None or self.insertion is None:
            return ()
        if self.path:
            points = [place for place in self.places if place.surface is None]
            return tuple(
                sum(math.dist(a, b) for a, b in itertools.pairwise(self.beside(p, k) for p in points))
                for k in range(self.count)
            )
        forward, _, up = difference(self.origin.from_joint, self.insertion.from_joint)
        return tuple(math.hypot(forward, aside, up) for aside in self._asides)

    @property
    def places(self) -> tuple[PathPoint, ...]:
        """Origin, path and insertion, in this order; none of a pulley."""
        if self.origin is None or self.insertion is None:
            return ()
        first, last = (PathPoint.model_construct(**dict(end)) for end in (self.origin, self.insertion))
        return (first, *self.path, last)

    @property
    def guided_by_surfaces(self) -> bool:
        """Whether its path has a surface."""
        return any(place.surface is not None for place in self.path)

    def beside(self, place: PathPoint, number: int) -> Coordinates:
        """A place of its path as the parallel muscle `number` has it, from 0 [m]."""
        x, y, z = place.from_joint
        return x, y + (number - 0.5 * (self.count - 1)) * place.spacing, z

    def _inside(self, number: int, muscle: int) -> PydanticCustomError | None:
        """The refusal where a neighbouring point lies inside the surface `number`, which would not act."""
        centre, surface = self.path[number], self.path[number].surface
        for point in (self.places[number], self.places[number + 2]) if surface else ():
            if point.segment != centre.segment:
                continue
            assert surface is not None
            clear = surface.clearance(self.beside(centre, muscle), self.beside(point, muscle))
            if clear <= 0.0:
                apart = f"{100.0 * (clear + surface.radius):.3g} cm"
                return refusal(
                    f"encloses the neighbouring point of the path, {apart} from its "
                    f"{'axis' if surface.shape == 'cylinder' else 'centre'}: the path would run straight "
                    "through it",
                    f"less than {apart}, or a point further off",
                    f"path.{number}.surface.radius",
                )
        return None

    @property
    def alike(self) -> bool:
        """Whether its parallel muscles have the same path length at every angle."""
        if not self.path:
            asides = [abs(aside) for aside in self._asides]
            return max(asides, default=0.0) - min(asides, default=0.0) <= ALIKE
        if self.count == 1:
            return True
        spacings = [place.spacing for place in self.places]
        if max(spacings) - min(spacings) <= ALIKE:  # each has its own surfaces, moved aside with it
            return True
        bending = [place for place in self.places if place.surface is None or not place.surface.lateral]
        if all(place.surface is None for place in bending):
            return all(self._equally_far_aside(a, b) for a, b in itertools.pairwise(bending))
        middles = [place.from_joint[1] for place in bending]
        mirrored = all(place.surface is None or place.surface.is_its_mirror_image for place in bending)
        return self.count == 2 and mirrored and max(middles) - min(middles) <= ALIKE

    def _equally_far_aside(self, above: PathPoint, below: PathPoint) -> bool:
        """Whether each parallel muscle runs equally far aside, to the left or right, between two places."""
        asides = [abs(self.beside(below, k)[1] - self.beside(above, k)[1]) for k in range(self.count)]
        return max(asides) - min(asides) <= ALIKE

    @property
    def _asides(self) -> tuple[float, ...]:
        """How far each parallel muscle's lower end is to the left of its upper end [m]; none of a pulley."""
        if self.origin is None or self.insertion is None:
            return ()
        middle = difference(self.origin.from_joint, self.insertion.from_joint)[1]
        spread = self.insertion.spacing - self.origin.spacing
        return tuple(middle + (k - 0.5 * (self.count - 1)) * spread for k in range(self.count))


class Orthosis(Named):
    """Cuff on the shank, plate under the foot, muscles between them, air to the muscles.

    About another joint than the ankle the cuff is on the proximal segment, the plate on the distal one.
    Cuff or plate may be missing where the leg's own bodies hold the muscles.
    """

    joint: JointName = "ankle"
    """Joint that it is for; its segments are shank and foot of an ankle, else proximal and distal."""
    side: Side = "right"
    """Leg that its coordinates are for; on the other leg it is mirrored."""
    cuff: pathlib.Path | None = None
    """MJCF file of the cuff, which is fixed to the shank."""
    plate: pathlib.Path | None = None
    """MJCF file of the plate, which is fixed under the foot."""
    outsole: Outsole | None = None
    """Outsole of the plate, where it is one: worn instead of a shoe."""
    range_of_motion: tuple[_Angle, _Angle]
    """Lowest and highest angle that the device is built for; a muscle that locks within is
    refused."""
    joint_centre: tuple[tuple[_Angle, _Length, _Length], ...] = ()
    """Centre of rotation where it moves, for a fit of torques: rows of rising angle, forward, up."""
    anchor: dict[Segment, Mounting] = Field(default_factory=dict)
    """How the cuff on the shank and the plate under the foot give; without a table they are rigid."""
    interface: dict[Segment, Interface] = Field(default_factory=dict)
    """How the cuff on the shank and the plate under the foot lie on the skin; without a table no pressure on
    it is reported."""
    muscle: dict[str, MuscleGroup] = Field(default_factory=dict)
    """Muscle groups by name."""
    chamber: dict[str, Chamber] = Field(default_factory=dict)
    """Chambers by name; each holds the air of one or several muscle groups."""
    volume: dict[str, Volume] = Field(default_factory=dict)
    """Rigid volumes by name: reservoirs, manifolds."""
    restriction: dict[str, Restriction] = Field(default_factory=dict)
    """Tubes, orifices, valves and others between two nodes, by name."""

    @field_validator("anchor", "interface", mode="before")
    @classmethod
    def _are_segments(cls, tables: Given, info: ValidationInfo) -> Given:
        known = get_args(Segment)
        for name in tables if isinstance(tables, Mapping) else ():
            if name not in known:
                nearest = nearest_name(str(name), known) or ""
                raise refusal(f"is an unknown {info.field_name}", " or ".join(known), str(name), nearest)
        return tables

    def _must_have_its_joints_segments(self) -> None:
        places = []
        for name, group in self.muscle.items():
            keys = ("origin", *(f"path.{k}" for k in range(len(group.path))), "insertion")
            for key, place in zip(keys, group.places, strict=False):  # none over a pulley
                places.append((f"muscle.{name}.{key}.segment", place.segment))
        tables = [(f"{kind}.{s}", s) for kind in ("anchor", "interface") for s in getattr(self, kind)]
        own, known = self.words.segments, " or ".join(self.words.segments)
        for key, segment in (*places, *tables):
            if segment not in own:
                problem = f"{segment!r} is not a segment of {a_joint(self.joint)}, its `joint`"
                raise refusal(problem, known, key)

    def _must_be_pulled_on(self) -> None:
        if self.anchor and self.muscle and not self.anchored:
            problem = "is pulled by no muscle: all run over pulleys"
            raise refusal(problem, "no such table, or a muscle between two anchors", "anchor")
        for chamber in self.chamber if self.anchor else ():
            if len({group.pulley is not None for group in self.muscles_of(chamber).values()}) > 1:
                problem = "mixes muscles over pulleys and between anchors, but only these pull on the anchors"
                raise refusal(problem, "a chamber for each", f"chamber.{chamber}")

    def _must_move_centre(self) -> None:
        angles = [angle for angle, *_ in self.joint_centre]
        if angles and (angles != sorted({*angles}) or not angles[0] <= 0.0 <= angles[-1] or len(angles) < 2):
            raise refusal("is not over rising angles about 0", "two rows or more", "joint_centre")
        if angles and any(group.path or group.pulley for group in self.muscle.values()):
            raise refusal("needs muscles straight between two anchors", "no path, no pulley", "joint_centre")

    def _must_know_chambers(self) -> None:
        if not self.muscle and (self.cuff or self.plate or self.chamber or self.anchor):
            raise refusal("there is no muscle", "at least one muscle group", "muscle")
        for kind in ("muscle", "chamber", "volume", "restriction"):
            for name in getattr(self, kind):
                if not re.fullmatch(r"[A-Za-z][\w-]*", name):
                    problem = f"{name!r} is not a valid name"
                    raise refusal(problem, "letters, digits, - and _, a letter first", kind)
        for name, group in self.muscle.items():
            own = group.chamber or name
            if own not in self.chamber:
                problem = f"there is no chamber {own!r}"
                raise refused_name(problem, own, self.chamber, f"muscle.{name}.chamber")
        for name in self.chamber:
            if not self.muscles_of(name):
                raise refusal("no muscle belongs to this chamber", "", f"chamber.{name}")
        if not self.range_of_motion[0] < self.range_of_motion[1]:
            raise refusal("the first angle is not below the second", "", "range_of_motion")
        check_network(self)

    @property
    def words(self) -> Joint:
        """The words of its joint, and which way is positive."""
        return JOINTS[self.joint]

    @property
    def switched(self) -> tuple[str, ...]:
        """What a timer may switch: chambers, and valves between other nodes."""
        return (*self.chamber, *(name for name, each in self.restriction.items() if each.valve is not None))

    @property
    def anchored(self) -> dict[str, MuscleGroup]:
        """The muscle groups that pull on both anchors: all but those over a pulley."""
        return {name: group for name, group in self.muscle.items() if group.pulley is None}

    def muscles_of(self, chamber: str) -> dict[str, MuscleGroup]:
        """The muscle groups of a chamber."""
        return {n: g for n, g in self.muscle.items() if (g.chamber or n) == chamber}
