"""A muscle as it is described: braid, laws and frictions with their parameters, damper, limits."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_serializer, model_validator
from pydantic_core import PydanticCustomError

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import format_quantity, parse_quantity
from afo_sim.description.quantity import Described, Quantity, refusal, split_sources
from afo_sim.description.rest_curves import RestCurves
from afo_sim.physics.frictions import FRICTIONS
from afo_sim.physics.law import Braid, LawParameter
from afo_sim.physics.laws import LAWS

PositiveLength = Annotated[float, Quantity("m", above=0.0, at_most=2.0)]
Distance = Annotated[float, Quantity("m", at_least=0.0, at_most=2.0)]
Pressure = Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
GaugePressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
Contraction = Annotated[float, Quantity("", at_least=-0.5, at_most=0.9)]
Damping = Annotated[float, Quantity("N*s/m", at_least=-1e6, at_most=1e6)]
DampingSlope = Annotated[float, Quantity("N*s/(m*Pa)", at_least=-1.0, at_most=1.0)]


class Limits(Described):
    """What a muscle may be asked for; beyond it a run warns."""

    pressure: Pressure
    force: Annotated[float, Quantity("N", above=0.0, at_most=1e6)]
    contraction_min: Annotated[float, Quantity("", at_least=-0.5, at_most=0.0)]
    contraction_max: Annotated[float, Quantity("", above=0.0, at_most=0.6)]


class LawSet(Described):
    """One law's parameters for one muscle, SI, and where they hold."""

    law: str
    parameters: dict[str, float]
    pressure_range: tuple[GaugePressure, GaugePressure]
    contraction_range: tuple[Contraction, Contraction]

    @model_validator(mode="before")
    @classmethod
    def _read_flat(cls, table: Any) -> Any:
        """A flat table of parameters and ranges, as it stands under [laws.NAME], to fields."""
        if not isinstance(table, dict) or "parameters" in table:
            return table
        values, sources = split_sources(table)
        law = LAWS[values["law"]]
        kept = ("law", "pressure_range", "contraction_range")
        read = _take_parameters(law.name, law.parameters, values, kept)
        values.setdefault("pressure_range", [f"{p!r} Pa" for p in law.pressure_range])
        values.setdefault("contraction_range", list(law.contraction_range))
        return values | {"parameters": read, "provenance": sources}

    @model_validator(mode="after")
    def _ranges_rise(self) -> Self:
        for key in ("pressure_range", "contraction_range"):
            lower, upper = getattr(self, key)
            if not lower < upper:
                raise refusal("the first value is not below the second", "", key)
        return self

    @model_serializer(mode="wrap")
    def _write(self, handler: Any) -> dict[str, Any]:
        kept = handler(self)
        written = _written(LAWS[self.law].parameters, self.parameters)
        return written | {key: kept[key] for key in ("pressure_range", "contraction_range", "provenance")}


class FrictionSet(Described):
    """One friction's parameters for one muscle, SI."""

    friction: str
    parameters: dict[str, float]

    @model_validator(mode="before")
    @classmethod
    def _read_flat(cls, table: Any) -> Any:
        """A flat table of parameters, as it stands under [frictions.NAME], to fields."""
        if not isinstance(table, dict) or "parameters" in table:
            return table
        values, sources = split_sources(table)
        friction = FRICTIONS[values["friction"]]
        read = _take_parameters(friction.name, friction.parameters, values, ("friction",))
        return values | {"parameters": read, "provenance": sources}

    @model_serializer(mode="wrap")
    def _write(self, handler: Any) -> dict[str, Any]:
        written = _written(FRICTIONS[self.friction].parameters, self.parameters)
        return written | {"provenance": handler(self)["provenance"]}


class ThreeElementDamper(Described):
    """Damping of the three-element model, B = b0 + b1 p, another while contracting than while relaxing."""

    contracting: tuple[Damping, DampingSlope]
    relaxing: tuple[Damping, DampingSlope]
    switch_pressure: GaugePressure = 0.0
    relaxing_above: tuple[Damping, DampingSlope] | None = None

    @property
    def coefficients(self) -> tuple[float, ...]:
        """What the kernel takes after pressure and contraction rate."""
        above = self.relaxing if self.relaxing_above is None else self.relaxing_above
        return (*self.contracting, self.switch_pressure, *self.relaxing, *above)


class Muscle(Described, RestCurves):
    """A pneumatic artificial muscle: braid, law, friction, damper, limits.

    `laws` holds the parameters of every law that is known for it; `law` says which one is used; so do
    `frictions` and `friction`, which may be "none". The damping R p_abs κ̇ and a `damper` add up. SI inside.
    `force`, `contraction`, `pressure` and `volume` are its curves at rest.

    Examples
    --------
    >>> muscle = load("muscle", "dmsp_20")
    >>> muscle.nominal_length, muscle.limits.pressure  # [m], [Pa]
    (0.3, 600000.0)
    """

    name: str = ""
    description: str = ""
    grade: Literal["A", "B", "C", "D"] = "D"
    law: str
    laws: dict[str, LawSet]
    friction: str = "none"
    frictions: dict[str, FrictionSet] = Field(default_factory=dict)
    damper: ThreeElementDamper | None = None
    total_length: PositiveLength
    end_length: Distance
    bore: Annotated[float, Quantity("m", above=0.0, at_most=0.2)]
    braid_angle: Annotated[float, Quantity("rad", at_least=0.0873, at_most=0.872)]
    damping: Annotated[float, Quantity("m^2*s", at_least=0.0, at_most=1.0)]
    braid_stiffness: Annotated[float, Quantity("N", above=0.0, at_most=1e7)]
    dead_volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    mass: Annotated[float, Quantity("kg", at_least=0.0, at_most=20.0)]
    limits: Limits

    @model_validator(mode="before")
    @classmethod
    def _read_sets(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        if isinstance(table.get("law"), str):
            table = table | {"laws": _read_tables(table, "law", LAWS)}
        if isinstance(table.get("friction", "none"), str):
            table = table | {"frictions": _read_tables(table, "friction", FRICTIONS)}
        return table

    @model_validator(mode="after")
    def _has_a_braid(self) -> Self:
        if self.end_length >= self.total_length:
            raise refusal(
                f"the ends ({self.end_length * 100:g} cm) are not shorter than the whole muscle "
                f"({self.total_length * 100:g} cm): no braid is left",
                f"less than the total length, {self.total_length * 100:g} cm",
                "end_length",
            )
        return self

    @property
    def law_set(self) -> LawSet:
        """The parameters and ranges of the law in use."""
        return self.laws[self.law]

    def using(self, *, law: str | None = None, friction: str | None = None) -> Self:
        """The same muscle with another of its laws or frictions in use.

        Parameters
        ----------
        law : one of `laws`; as it is by default
        friction : one of `frictions`, or "none"; as it is by default

        Raises
        ------
        InputError
            The muscle has no parameters for it.

        Examples
        --------
        >>> load("muscle", "dmsp_20").using(law="kerscher_2006").law
        'kerscher_2006'
        """
        for kind, name, known in (
            ("law", law, [*self.laws]),
            ("friction", friction, [*self.frictions, "none"]),
        ):
            if name is not None and name not in known:
                raise InputError(
                    "the muscle has no parameters for it",
                    field=kind,
                    value=name,
                    allowed=", ".join(known),
                    nearest=nearest_name(name, known),
                )
        return self.with_values(law=law or self.law, friction=friction or self.friction)

    @property
    def coefficients(self) -> tuple[float, ...]:
        """What the kernel of the law in use takes after contraction and pressure."""
        return LAWS[self.law].coefficients(self.braid, self.law_set.parameters)

    @property
    def friction_coefficients(self) -> tuple[float, ...]:
        """What the kernel of the friction in use takes; nothing without friction."""
        if self.friction == "none":
            return ()
        return FRICTIONS[self.friction].coefficients(self.braid, self.frictions[self.friction].parameters)

    @property
    def row(self) -> dict[str, Any]:
        """What `native.muscle_row` takes of the muscle itself, wherever it is mounted."""
        return {
            "law": self.law,
            "coefficients": self.coefficients,
            "lowest_pressure": self.law_set.pressure_range[0],
            "braid": self.braid,
            "damping": self.damping,
            "braid_stiffness": self.braid_stiffness,
            "dead_volume": self.dead_volume,
            "damper": () if self.damper is None else self.damper.coefficients,
            "friction": 0 if self.friction == "none" else FRICTIONS[self.friction].native_id,
            "friction_coefficients": self.friction_coefficients,
        }

    @property
    def nominal_length(self) -> float:
        """L0: the active braid, unpressurised [m]."""
        return self.total_length - self.end_length

    @property
    def braid(self) -> Braid:
        """Its geometry, as the laws take it."""
        return Braid(self.nominal_length, self.bore / 2.0, self.braid_angle)


def _read_tables(table: dict[str, Any], kind: str, known: Mapping[str, Any]) -> dict[str, Any]:
    """The tables [laws.NAME] or [frictions.NAME], each told its name; the one in use must be there."""
    plural, chosen = f"{kind}s", table.get(kind, "none")
    none = ["none"] if kind == "friction" else []
    given = table.get(plural, {})
    if not isinstance(given, dict):
        raise refusal("is not a table", f"a table [{plural}.NAME] for each {kind}", plural)
    read = {}
    for name, parameters in given.items():
        if name not in known:
            raise _unknown(name, kind, known, f"{plural}.{name}")
        if not isinstance(parameters, dict):
            wanted = ", ".join(parameter.name for parameter in known[name].parameters)
            raise refusal("is not a table", f"a table with {wanted}", f"{plural}.{name}")
        read[name] = parameters | {kind: name}
    if chosen in read or chosen in none:
        return read
    if chosen not in known:
        raise _unknown(chosen, kind, [*known, *none], kind)
    # even where every parameter has a default: the braid angle was fitted together with another law
    wanted = ", ".join(p.name for p in known[chosen].parameters if p.default is None)
    raise refusal(
        f"this muscle has no parameters for {chosen!r}: a table [{plural}.{chosen}]"
        + (f" with {wanted}" if wanted else ""),
        f"one of those it has: {', '.join([*read, *none]) or 'none'}",
        kind,
        nearest_name(chosen, read) or "",
    )


def _unknown(name: str, kind: str, known: Iterable[str], key: str) -> PydanticCustomError:
    names = list(known)
    nearest = nearest_name(name, names) or ""
    return refusal(f"{name!r} is an unknown {kind}", ", ".join(names), key, nearest)


def _take_parameters(
    owner: str, parameters: Sequence[LawParameter], values: dict[str, Any], others: Sequence[str]
) -> dict[str, float]:
    """Read a law's or friction's parameters out of `values`; refuse what is missing or unknown."""
    read = {}
    for parameter in parameters:
        if parameter.name in values:
            read[parameter.name] = _read_parameter(parameter, values.pop(parameter.name))
        elif parameter.default is not None:
            read[parameter.name] = parameter.default
        else:
            raise refusal(f"is missing; {owner} needs it", parameter.meaning, parameter.name)
    names = [parameter.name for parameter in parameters]
    for key in values:
        if key not in (*others, "provenance"):
            allowed = ", ".join(names) or "none"
            raise refusal(f"is no parameter of {owner}", allowed, key, nearest_name(key, names) or "")
    return read


def _read_parameter(parameter: LawParameter, text: Any) -> float:
    try:
        number = parse_quantity(text, parameter.unit)
    except ValueError as error:
        raise refusal(str(error), "", parameter.name) from None
    if not parameter.lower <= number <= parameter.upper:
        allowed = f"{parameter.lower:g} to {parameter.upper:g} {parameter.unit}".strip()
        raise refusal(f"{text!r} is out of range", allowed, parameter.name)
    return number


def _written(parameters: Sequence[LawParameter], values: dict[str, float]) -> dict[str, Any]:
    """SI values as text that reads again."""
    units = {parameter.name: parameter.unit for parameter in parameters}
    return {name: format_quantity(value, units[name]) for name, value in values.items()}
