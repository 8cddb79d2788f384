"""A flow path by ISO 6358: C and b, or b and one figure that a data sheet prints instead of C."""

from collections.abc import Callable
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from afo_sim.common.units import format_quantity, parse_quantity
from afo_sim.description.air.nominal_flow import HOW, NominalFlow
from afo_sim.description.air.ratings import CONDUCTANCE, CRITICAL_RATIO, RATINGS
from afo_sim.description.quantity import Described, Provenance, Quantity, amount, refusal
from afo_sim.physics.ratings import (
    conductance_of_cv,
    conductance_of_kv,
    conductance_of_orifice,
    conductance_of_sonic_area,
)

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
    def _from_its_rating(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None:
            if _is_flow(value):
                raise refusal("is a volume flow: without norm and pressures it is no conductance", HOW)
            return value
        data = info.data
        rated = [name for name in RATINGS if data.get(name) is not None]
        if len(rated) > 1:
            told = f"stands beside {rated[0]}: one of them gives the conductance"
            raise refusal(told, f"{rated[0]} or {rated[1]}", beside=rated[1])
        if not data.keys() >= {CRITICAL_RATIO, *RATINGS}:
            return f"1e-10 {UNIT}"  # whatever: a field that it follows from is refused already
        if not rated:
            either = f"a conductance, or one of {', '.join(RATINGS)}; for example {HOW}"
            facts = {"problem": "is missing", "allowed": either}
            raise PydanticCustomError("missing", "{problem}", facts)
        return format_quantity(_conductance(rated[0], data[rated[0]], data[CRITICAL_RATIO]), UNIT)

    @model_validator(mode="after")
    def _says_how_it_was_converted(self) -> Self:
        rated = self.rating
        if rated is None:
            return self
        given = _conductance(rated, getattr(self, rated), self.critical_ratio)
        if abs(self.conductance - given) > ALIKE * given:
            raise refusal(
                f"stands beside {rated}, which gives {amount(given, UNIT, 4)}",
                f"{CONDUCTANCE} or {rated}",
                CONDUCTANCE,
            )
        self.provenance[CONDUCTANCE] = Provenance(kind="derived", source=self._conversion(rated))
        return self

    @property
    def rating(self) -> str | None:
        """Name of the rating that its conductance follows from; None where it is given itself."""
        return next((name for name in RATINGS if getattr(self, name) is not None), None)

    def with_values(self, **values: Any) -> Self:
        """As `Described.with_values`; a conductance replaces its rating, a rating the conductance."""
        if CONDUCTANCE in values and self.rating is not None:
            told = Provenance(kind="user", source="set for this run")
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


def _conductance(rated: str, value: Any, critical_ratio: float) -> float:
    """C [m³/(s·Pa)] of a rating."""
    if isinstance(value, NominalFlow):
        return value.conductance(critical_ratio)
    return SIMPLE[rated][0](value)


def _is_flow(value: Any) -> bool:
    """Whether a text is no conductance but a volume flow, such as "100 l/min"."""
    return isinstance(value, str) and not _is_in(value, UNIT) and _is_in(value, "m^3/s")


def _is_in(text: str, unit: str) -> bool:
    try:
        parse_quantity(text, unit)
    except ValueError:
        return False
    return True
