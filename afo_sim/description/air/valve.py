"""A valve as it is described: flow paths, switching times or bandwidth, and what its maker rates it for."""

from collections.abc import Callable
from typing import Annotated, Self

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from afo_sim.common import Given, JsonDict, format_quantity, parse_quantity
from afo_sim.description.air.nominal_flow import HOW, NominalFlow
from afo_sim.description.quantity import SET_BY_HAND, Described, Named, Provenance, Quantity, amount, refusal
from afo_sim.physics import (
    conductance_of_cv,
    conductance_of_kv,
    conductance_of_orifice,
    conductance_of_sonic_area,
)

CONDUCTANCE, CRITICAL_RATIO = "conductance", "critical_ratio"
RATINGS = ("nominal_flow", "cv", "kv", "sonic_area", "orifice")  # one of them stands for a conductance
UNIT = "m^3/(s*Pa)"
ALIKE = 1e-9  # relative difference up to which two conductances are one
# {rating: its conductance, its unit, how it is converted}
SIMPLE: dict[str, tuple[Callable[[float], float], str, str]] = {
    "cv": (conductance_of_cv, "", "C ≈ 3.6 Cv dm³/(s·bar), good to ±20 %"),
    "kv": (conductance_of_kv, "", "C ≈ 3.6 Kv/0.865 dm³/(s·bar), good to ±20 %"),
    "sonic_area": (conductance_of_sonic_area, "m^2", "C = S/5.0 dm³/(s·bar) of mm²"),
    "orifice": (conductance_of_orifice, "m", "C = 0.128 d² dm³/(s·bar) of mm, from memory, not verified"),
}


class Rated(Described):
    """A flow path: critical ratio b, and sonic conductance C or one rating that it follows from."""

    critical_ratio: Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]
    """Critical pressure ratio b (ISO 6358); below it the flow is choked."""
    nominal_flow: NominalFlow | None = None
    """Flow between two pressures as a data sheet prints it, instead of a conductance."""
    cv: Annotated[float, Quantity("", above=0.0, at_most=25.0)] | None = None
    """Flow coefficient Cv (US gallons of water a minute at 1 psi), instead of a conductance; good to
    ±20 %."""
    kv: Annotated[float, Quantity("", above=0.0, at_most=20.0)] | None = None
    """Flow coefficient Kv (m³ of water an hour at 1 bar), instead of a conductance; good to ±20 %."""
    sonic_area: Annotated[float, Quantity("m^2", above=0.0, at_most=4e-4)] | None = None
    """Effective area S (JIS), instead of a conductance."""
    orifice: Annotated[float, Quantity("m", above=0.0, at_most=0.02)] | None = None
    """Diameter of the narrowest hole, instead of a conductance."""
    conductance: Annotated[float, Quantity(UNIT, above=0.0, at_most=1e-6)] = Field(
        default=None, validate_default=True
    )
    """Sonic conductance C (ISO 6358) of the open path; it, or one of the ratings, is needed."""

    @field_validator("conductance", mode="before")
    @classmethod
    def _from_its_rating(cls, value: Given, info: ValidationInfo) -> Given:
        if value is not None:
            if isinstance(value, str) and not _is_in(value, UNIT) and _is_in(value, "m^3/s"):
                raise refusal("is a volume flow: without norm and pressures it is no conductance", HOW)
            return value
        data = info.data
        rated = [name for name in RATINGS if data.get(name) is not None]
        if len(rated) > 1:
            told = f"conflicts with {rated[0]}: only one of them may state the conductance"
            raise refusal(told, f"{rated[0]} or {rated[1]}", beside=rated[1])
        if not data.keys() >= {CRITICAL_RATIO, *RATINGS}:
            return f"1e-10 {UNIT}"  # whatever: a field that it follows from is refused already
        if not rated:
            either = f"a conductance, or one of {', '.join(RATINGS)}; for example {HOW}"
            facts = {"problem": "is missing", "allowed": either}
            raise PydanticCustomError("missing", "{problem}", facts)
        return format_quantity(_conductance(rated[0], data[rated[0]], data[CRITICAL_RATIO]), UNIT)

    def _must_say_how_it_was_converted(self) -> None:
        rated = self.rating
        if rated is None:
            return
        given = _conductance(rated, getattr(self, rated), self.critical_ratio)
        if abs(self.conductance - given) > ALIKE * given:
            problem = f"conflicts with {rated}, which gives {amount(given, UNIT, 4)}"
            raise refusal(problem, f"{CONDUCTANCE} or {rated}", CONDUCTANCE)
        self.provenance[CONDUCTANCE] = Provenance(kind="derived", source=self._conversion(rated))

    @property
    def rating(self) -> str | None:
        """Name of the rating that its conductance follows from; None where it is given itself."""
        return next((name for name in RATINGS if getattr(self, name) is not None), None)

    def with_values(self, **values: Given) -> Self:
        """As `Described.with_values`; a conductance replaces its rating, a rating the conductance."""
        if CONDUCTANCE in values and self.rating is not None:
            told = Provenance(kind="user", source=SET_BY_HAND)
            values = {**dict.fromkeys(RATINGS), "provenance": self.provenance | {CONDUCTANCE: told}, **values}
        elif values.keys() & {*RATINGS}:
            values = {CONDUCTANCE: None, **dict.fromkeys(RATINGS), **values}
        elif CRITICAL_RATIO in values and self.rating is not None:
            values = {CONDUCTANCE: None, **values}
        return super().with_values(**values)

    def _conversion(self, rated: str) -> str:
        """What the conductance was computed from, and how far each of those numbers is known."""
        known = {CRITICAL_RATIO: self.provenance.get(CRITICAL_RATIO)}
        value = getattr(self, rated)
        if isinstance(value, NominalFlow):
            known |= {name: value.provenance.get(name) for name in ("flow", "norm", "upstream", "downstream")}
            text = f"from a nominal flow of {value.words} with {CRITICAL_RATIO} = {self.critical_ratio:g}"
        else:
            known = {rated: self.provenance.get(rated)}
            _, unit, how = SIMPLE[rated]
            text = f"from {rated} = {amount(value, unit) if unit else f'{value:g}'}: {how}"
        kinds: dict[str, list[str]] = {}
        for name, told in known.items():
            if told is not None:
                kinds.setdefault(told.kind, []).append(name)
        return "; ".join([text, *(f"{kind}: {', '.join(names)}" for kind, names in kinds.items())])


def make_room(table: JsonDict, key: str) -> bool:
    """Take away what a key that is being set replaces in its table."""
    rated = [name for name in RATINGS if table.get(name) is not None]
    gone: list[str] = []
    if key == CONDUCTANCE:
        gone = rated
    elif key in RATINGS:
        gone = [name for name in (CONDUCTANCE, *rated) if name != key]
    elif key == CRITICAL_RATIO and rated:
        gone = [CONDUCTANCE]
    taken = [table.pop(name, None) for name in gone]
    return any(value is not None for value in taken)


def _conductance(rated: str, value: Given, critical_ratio: float) -> float:
    """C [m³/(s·Pa)] of a rating."""
    if isinstance(value, NominalFlow):
        return value.conductance(critical_ratio)
    return SIMPLE[rated][0](value)


def _is_in(text: str, unit: str) -> bool:
    try:
        parse_quantity(text, unit)
    except ValueError:
        return False
    return True


TIMES = ("opening_delay", "closing_delay", "opening_ramp", "closing_ramp", "threshold", "hold_decay")
Delay = Annotated[float, Quantity("s", at_least=0.0, at_most=1.0)]
WorkingPressure = Annotated[float, Quantity("Pa", at_least=-101_325.0, at_most=5e6)]


class Exhaust(Rated):
    """The second flow path of a 3/2 valve, from its outlet A to its exhaust R, open without current."""


class Valve(Rated, Named):
    """A valve: sonic conductance C, critical ratio b (ISO 6358), and its two delays or its bandwidth.

    It is a 2/2 valve; with an `exhaust` a 3/2 valve, whose first path is P to A. With a `bandwidth` it is a
    proportional valve.
    """

    exhaust: Exhaust | None = None
    """Path from A to R of a 3/2 valve; without it the valve has two ports."""
    bandwidth: Annotated[float, Quantity("Hz", above=0.0, at_most=1e4)] | None = None
    """Frequency at which a proportional valve's opening has fallen by 3 dB; none of a solenoid valve."""
    dead_band: Annotated[float, Quantity("", at_least=0.0, at_most=0.9)] | None = None
    """Share of a proportional valve's command below which it stays shut."""
    opening_delay: Delay = Field(default=None, validate_default=True)
    """On-delay, from the coil's current to the open valve; needed of a solenoid valve."""
    closing_delay: Delay = Field(default=None, validate_default=True)
    """Off-delay, from the end of the current to the shut valve; needed of a solenoid valve."""
    opening_ramp: Delay = 0.0
    """Time that a solenoid valve takes from shut to open after its opening delay."""
    closing_ramp: Delay = 0.0
    """Time that it takes from open to shut after its closing delay."""
    threshold: Annotated[float, Quantity("", at_least=0.0, at_most=0.95)] = 0.0
    """Share of the armature's stroke at which the seat opens and shuts, so that a pulse shorter than the
    stroke opens it for a time; without it the seat opens at the stroke's end and shuts at its start."""
    hold_decay: Delay = 0.0
    """Time constant with which what holds it shut decays against the pressure before it: the opening delay
    grows by hold_decay · ln(hold_pressure/pressure)."""
    hold_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=5e7)] = 0.0
    """Gauge pressure that what holds it shut withstands at first."""
    minimum_on_time: Delay | None = None
    """Shortest pulse that its maker answers for."""
    rated_switches: Annotated[float, Quantity("", above=0.0, at_most=1e12)] | None = None
    """Switchings that its maker rates it for; without it no life is reported."""
    working_pressure: tuple[WorkingPressure, WorkingPressure] | None = None
    """Lowest and highest gauge pressure that its maker allows."""
    mass: Annotated[float, Quantity("kg", above=0.0, at_most=20.0)] | None = None
    """Mass of the valve."""
    power: Annotated[float, Quantity("W", above=0.0, at_most=1e3)] | None = None
    """Electric power while the coil is on."""

    @field_validator("opening_delay", "closing_delay", mode="before")
    @classmethod
    def _is_needed_of_a_solenoid(cls, value: Given, info: ValidationInfo) -> Given:
        if value is not None:
            return value
        if info.data.get("bandwidth", 0.0) is None:
            facts = {"problem": "is missing", "allowed": "0 to 1 s; none of a valve with a bandwidth"}
            raise PydanticCustomError("missing", "{problem}", facts)
        return "0 s"

    def _must_be_one_kind_of_valve(self) -> None:
        if self.bandwidth is None and self.dead_band is not None:
            raise refusal("is a proportional valve's, which has a bandwidth", "a bandwidth", "dead_band")
        for key in TIMES if self.bandwidth is not None else ():
            if getattr(self, key) > 0.0:
                problem = "has no effect: a proportional valve follows with its bandwidth"
                raise refusal(problem, "0 s, or no bandwidth", key)
        if (self.hold_decay > 0.0) != (self.hold_pressure > 0.0):
            key, other = ("hold_decay", "hold_pressure")[:: 1 if self.hold_decay > 0.0 else -1]
            raise refusal(f"has no effect without {other}", f"{other} beside it", key)
        if self.working_pressure is not None and not self.working_pressure[0] < self.working_pressure[1]:
            raise refusal("the first value is not below the second", "", "working_pressure")

    @property
    def three_way(self) -> bool:
        """Whether it is a 3/2 valve: it lets air out by itself."""
        return self.exhaust is not None

    @property
    def proportional(self) -> bool:
        """Whether its opening follows a command, instead of a coil's switching."""
        return self.bandwidth is not None

    @property
    def row(self) -> dict[str, float]:
        """The parameters of its compiled counterpart, SI; of a 3/2 valve its path from P to A."""
        keys = ("conductance", "critical_ratio", *TIMES, "hold_pressure")
        row: dict[str, float] = {key: getattr(self, key) for key in keys}
        if self.bandwidth is None:
            return row
        return row | {"bandwidth": self.bandwidth, "dead_band": self.dead_band or 0.0}
