"""What is simulated: frozen descriptions, checked at birth, SI inside.

Muscle, Valve, Leg, Orthosis, Scenario are read from TOML by `reader.py`. Angles are dorsiflexion
positive, pressures gauge, positions in metres from the ankle joint: x forward, y left, z up.
"""

import pathlib
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from afo_sim.common.errors import nearest_name
from afo_sim.description.muscle import Contraction, Distance, Muscle, PositiveLength, Pressure
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.walking import Gait, Ground, Patient, Phases

Angle = Annotated[float, Quantity("rad", at_least=-3.15, at_most=3.15)]
Length = Annotated[float, Quantity("m", at_least=-2.0, at_most=2.0)]
Time = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
PositiveTime = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]
Delay = Annotated[float, Quantity("s", at_least=0.0, at_most=1.0)]
Moment = Annotated[float, Quantity("N*m", at_least=-1e3, at_most=1e3)]
Coordinates = tuple[Length, Length, Length]
Word = Annotated[str, Field(pattern=r"^[a-z]+$")]

MAX_STEPS = 20_000_000  # steps of one run: about 10 GB of rows


class Valve(Described):
    """A solenoid valve: sonic conductance C, critical ratio b (ISO 6358), and its two delays."""

    name: str = ""
    description: str = ""
    conductance: Annotated[float, Quantity("m^3/(s*Pa)", above=0.0, at_most=1e-6)]
    critical_ratio: Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]
    opening_delay: Delay
    closing_delay: Delay


class Anchor(Described):
    """One end of a muscle group: where on which segment, and how far apart its muscles are."""

    segment: Literal["shank", "foot"]
    from_ankle: Coordinates
    spacing: Distance = 0.0


class Pulley(Described):
    """A wheel on the joint's axis that a muscle's cable runs over: its moment arm is constant.

    A `positive` muscle turns the joint to positive angles. `initial_contraction` is its contraction
    ratio at angle zero, κ0 in κ = κ0 ± r φ/L0. `spacing` sets parallel muscles apart in pictures.
    """

    radius: PositiveLength
    direction: Literal["positive", "negative"]
    initial_contraction: Contraction = 0.0
    spacing: Distance = 0.0

    @property
    def moment_arm(self) -> float:
        """−dL/dφ [m]: positive when tension turns the joint to positive angles."""
        return self.radius if self.direction == "positive" else -self.radius


class MuscleGroup(Described):
    """Parallel muscles of one kind on one chamber, between two anchors or over a pulley."""

    count: int = Field(ge=1, le=20)
    type: Muscle
    origin: Anchor | None = None
    insertion: Anchor | None = None
    link_length: Distance | None = None
    slack: Distance = 0.0
    pulley: Pulley | None = None
    chamber: str | None = None

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

    @property
    def series_length(self) -> float:
        """What the tendon is longer than the active braid [m]: ends, link and slack.

        The tendon of a pulley measures from angle zero, so there it is minus the braid's length.
        """
        if self.pulley is not None:
            return -self.type.nominal_length * (1.0 - self.pulley.initial_contraction)
        return self.type.end_length + (self.link_length or 0.0) + self.slack


class Chamber(Described):
    """Muscles that share their valves: inlet from the supply, outlet to ambient."""

    inlet: Valve
    outlet: Valve
    tube_volume: Annotated[float, Quantity("m^3", at_least=0.0, at_most=0.1)]
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e4)]


class Orthosis(Described):
    """Cuff on the shank, plate under the foot, muscles between them, air to the muscles.

    Cuff or plate may be missing where the leg's own bodies hold the muscles.
    """

    name: str = ""
    description: str = ""
    cuff: pathlib.Path | None = None
    plate: pathlib.Path | None = None
    range_of_motion: tuple[Angle, Angle]
    muscle: dict[str, MuscleGroup] = Field(default_factory=dict)
    chamber: dict[str, Chamber] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _chambers_exist(self) -> Self:
        if not self.muscle and (self.cuff is not None or self.plate is not None or self.chamber):
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

    def muscles_of(self, chamber: str) -> dict[str, MuscleGroup]:
        """The muscle groups that hang on a chamber."""
        return {n: g for n, g in self.muscle.items() if (g.chamber or n) == chamber}


class PassiveAnkle(Described):
    """The relaxed ankle, as a factor and a shift of Riener & Edrich's healthy mean."""

    scale: Annotated[float, Quantity("", at_least=0.0, at_most=20.0)] = 1.0
    offset: Annotated[float, Quantity("rad", at_least=-0.35, at_most=0.35)] = 0.0


class Leg(Described):
    """A leg: its MJCF or URDF, which bodies and joint are meant, and its passive ankle.

    `friction` (Coulomb's, about the ankle) and `inertia` (about the ankle; what else turns with the foot)
    come on top of what the file has.
    Any two bodies with one hinge will do, such as an arm on a stand; `directions` is what turning
    the joint to positive and to negative angles is called.
    """

    name: str = ""
    description: str = ""
    file: pathlib.Path
    shank: str = "shank"
    foot: str = "foot"
    ankle: str = "ankle"
    directions: tuple[Word, Word] = ("dorsiflexion", "plantarflexion")
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=1e3)]
    body_mass: Annotated[float, Quantity("kg", at_least=10.0, at_most=300.0)] = 75.0
    body_height: Annotated[float, Quantity("m", at_least=0.5, at_most=2.5)] = 1.75
    friction: Annotated[float, Quantity("N*m", at_least=0.0, at_most=100.0)] = 0.0
    inertia: Annotated[float, Quantity("kg*m^2", at_least=0.0, at_most=10.0)] = 0.0
    passive: PassiveAnkle = PassiveAnkle()


class Supply(Described):
    """Compressed air at constant gauge pressure."""

    pressure: Pressure


class Shank(Described):
    """What holds the shank, and the knee angle that the passive ankle depends on."""

    pose: Literal["fixed", "driven"] = "fixed"
    knee_angle: Annotated[float, Quantity("rad", at_least=0.0, at_most=2.8)] | None = None

    @model_validator(mode="after")
    def _has_a_knee(self) -> Self:
        if self.pose == "fixed" and self.knee_angle is None:
            raise refusal("is missing; a fixed shank needs it", 'such as "90 deg"', "knee_angle")
        if self.pose == "driven" and self.knee_angle is not None:
            raise refusal("is told by the gait, where the shank is driven", "nothing", "knee_angle")
        return self


class ValveTimes(Described):
    """When a chamber's two valves are open, as [from, to] within the timer's period."""

    inlet: tuple[tuple[Time, Time], ...] = ()
    outlet: tuple[tuple[Time, Time], ...] = ()


class Timer(Described):
    """A repeating timer; every key but `period` is a chamber."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, ValveTimes] = Field(init=False)

    period: PositiveTime

    @property
    def chambers(self) -> dict[str, ValveTimes]:
        """When each chamber's valves are open."""
        return dict(self.__pydantic_extra__ or {})

    @model_validator(mode="after")
    def _events_fit(self) -> Self:
        for name, times in self.chambers.items():
            for valve in ("inlet", "outlet"):
                for start, end in getattr(times, valve):
                    if not 0.0 <= start < end <= self.period * (1.0 + 1e-12):
                        raise refusal(
                            f"the event [{start:g} s, {end:g} s] is not within the period",
                            f"0 s ≤ from < to ≤ {self.period:g} s",
                            f"{name}.{valve}",
                        )
        return self


class Scenario(Described):
    """One simulation, whole: leg, orthosis, patient, supply, valve times, duration; SI inside.

    `load("scenario", …)` reads one, `set` changes it, `run` simulates it.

    Examples
    --------
    >>> seated = load("scenario", "seated")
    >>> seated.duration, list(seated.orthosis.muscle)
    (16.0, ['dorsiflexor', 'plantarflexor'])
    """

    name: str = ""
    description: str = ""
    duration: PositiveTime
    leg: Leg
    orthosis: Orthosis
    timestep: Annotated[float, Quantity("s", at_least=1e-6, at_most=0.01)] = 0.001
    record_rate: Annotated[float, Quantity("Hz", above=0.0, at_most=1e6)] = 1000.0
    callback: Literal["native", "python"] = "native"
    supply: Supply
    shank: Shank
    load_moment: Moment = 0.0  # constant about the joint, against positive angles
    timer: Timer | None = None
    phases: Phases | None = None
    gait: Gait | None = None
    patient: Patient | None = None
    ground: Ground | None = None

    # filled by `reader`, which follows names; a description reads no files
    with_keys: ClassVar[Callable[["Scenario", Mapping[str, Any]], "Scenario"]]

    def set(self, sets: Mapping[str, Any]) -> "Scenario":
        """A copy with dotted keys set, checked like a file.

        Parameters
        ----------
        sets : keys as `--set` takes them ("supply.pressure", "phases.dorsiflexor.inlet[0][1]") and their
            values: text with a unit, a bare number where there is none, a name, or a description such as
            a Muscle

        Raises
        ------
        InputError
            There is no such key, or the value is out of range, has no unit or another dimension.

        Examples
        --------
        >>> walk = load("scenario", "walk-dropfoot-afo")
        >>> walk.set({"supply.pressure": "3 bar"}).supply.pressure
        300000.0
        >>> muscle = load("muscle", "s1_215mm")
        >>> walk.set({"orthosis.muscle.dorsiflexor.type": muscle}).orthosis.muscle["dorsiflexor"].type.name
        's1_215mm'
        """
        return type(self).with_keys(self, sets)

    @property
    def walking(self) -> bool:
        """Whether recorded walking drives the shank."""
        return self.shank.pose == "driven"

    @property
    def contact(self) -> bool:
        """Whether the foot meets a floor, rather than the recorded force."""
        return self.ground is not None and self.ground.mode == "contact"

    @model_validator(mode="after")
    def _walks_or_sits(self) -> Self:
        for key in ("gait", "patient"):
            there = getattr(self, key) is not None
            if there and not self.walking:
                raise refusal("goes with a driven shank", 'shank.pose = "driven"', key)
            if self.walking and not there:
                raise refusal("is missing; a driven shank needs it", f"a table or name for {key}", key)
        for key in ("phases", "ground"):
            if getattr(self, key) is not None and not self.walking:
                raise refusal("goes with a driven shank", 'shank.pose = "driven"', key)
        if self.timer is not None and self.phases is not None:
            raise refusal(
                "stands beside a timer: one of them switches the valves", "phases or timer", "phases"
            )
        if self.orthosis.chamber and self.timer is None and self.phases is None:
            raise refusal("is missing: nothing switches the valves", "timer, or phases when walking", "timer")
        return self

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        for kind, switched in (("timer", self.timer), ("phases", self.phases)):
            for name in switched.chambers if switched else ():
                if name not in self.orthosis.chamber:
                    raise refusal(
                        "the orthosis has no such chamber",
                        ", ".join(self.orthosis.chamber),
                        f"{kind}.{name}",
                        nearest_name(name, self.orthosis.chamber) or "",
                    )
        if self.name and not re.fullmatch(r"\w[\w .-]*", self.name):
            raise refusal("is no name for a folder", "letters, digits, space, . - and _", "name")
        if self.n_step < 1:
            raise refusal("is shorter than one time step", f"at least {self.timestep:g} s", "duration")
        if self.n_step > MAX_STEPS:
            raise refusal(
                f"is {self.n_step:.3g} steps of {self.timestep:g} s, more than one run can hold",
                f"at most {MAX_STEPS * self.timestep:g} s",
                "duration",
            )
        stride = 1.0 / (self.record_rate * self.timestep)
        if stride < 1.0 - 1e-9 or abs(stride - round(stride)) > 1e-6 * stride:
            raise refusal(
                "is not a whole fraction of the step rate",
                f"{1.0 / self.timestep:g} Hz divided by 1, 2, 3, …",
                "record_rate",
            )
        return self

    @property
    def n_step(self) -> int:
        """Steps of the run."""
        return round(self.duration / self.timestep)

    @property
    def record_stride(self) -> int:
        """Steps per recorded row."""
        return round(1.0 / (self.record_rate * self.timestep))

    def resolved(self) -> dict[str, Any]:
        """The whole scenario as plain data that `reader.py` reads again, exactly."""
        return self.model_dump(mode="json", exclude_defaults=False)
