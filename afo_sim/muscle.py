"""A muscle as it is described: braid, laws with their parameters, damper, limits."""

from typing import Annotated, Any, Literal, Self

from pydantic import model_serializer, model_validator

from afo_sim.errors import nearest_name
from afo_sim.physics.law import Braid, LawParameter
from afo_sim.physics.static_force import LAWS
from afo_sim.quantity import Described, Quantity, refusal, split_sources
from afo_sim.units import format_quantity, parse_quantity

PositiveLength = Annotated[float, Quantity("m", above=0.0, at_most=2.0)]
Distance = Annotated[float, Quantity("m", at_least=0.0, at_most=2.0)]
Pressure = Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
GaugePressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
Contraction = Annotated[float, Quantity("", at_least=-0.5, at_most=0.9)]


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
    def _read_parameters(cls, table: Any) -> Any:
        """A flat table of parameters and ranges, as it stands under [laws.NAME], to fields."""
        if not isinstance(table, dict) or "parameters" in table:
            return table
        values, sources = split_sources(table)
        law = LAWS[values["law"]]
        read = {}
        for parameter in law.parameters:
            if parameter.name in values:
                read[parameter.name] = _read_parameter(parameter, values.pop(parameter.name))
            elif parameter.default is not None:
                read[parameter.name] = parameter.default
            else:
                raise refusal(f"is missing; {law.name} needs it", parameter.meaning, parameter.name)
        names = [parameter.name for parameter in law.parameters]
        for key in values:
            if key not in ("law", "pressure_range", "contraction_range", "provenance"):
                raise refusal(
                    f"is no parameter of {law.name}",
                    ", ".join(names) or "none",
                    key,
                    nearest_name(key, names) or "",
                )
        ranges = {"pressure_range": law.pressure_range, "contraction_range": law.contraction_range}
        for key, default in ranges.items():
            values.setdefault(key, [f"{x!r} Pa" if key == "pressure_range" else x for x in default])
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
        written = handler(self)
        units = {parameter.name: parameter.unit for parameter in LAWS[self.law].parameters}
        values = {name: format_quantity(value, units[name]) for name, value in self.parameters.items()}
        kept = ("pressure_range", "contraction_range", "provenance")
        return values | {key: written[key] for key in kept}


def _read_parameter(parameter: LawParameter, text: Any) -> float:
    try:
        number = parse_quantity(text, parameter.unit)
    except ValueError as error:
        raise refusal(str(error), "", parameter.name) from None
    if not parameter.lower <= number <= parameter.upper:
        allowed = f"{parameter.lower:g} to {parameter.upper:g} {parameter.unit}".strip()
        raise refusal(f"{text!r} is out of range", allowed, parameter.name)
    return number


class Muscle(Described):
    """A pneumatic artificial muscle: braid, law, damper, limits.

    `laws` holds the parameters of every law that is known for it; `law` says which one is used.
    """

    name: str = ""
    description: str = ""
    grade: Literal["A", "B", "C", "D"] = "D"
    law: str
    laws: dict[str, LawSet]
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
    def _read_laws(cls, table: Any) -> Any:
        if not isinstance(table, dict) or not isinstance(table.get("law"), str):
            return table
        given = table.get("laws", {})
        if not isinstance(given, dict):
            raise refusal("is not a table", "a table [laws.NAME] for each law", "laws")
        read = {}
        for name, parameters in given.items():
            if name not in LAWS:
                raise refusal(
                    f"{name!r} is an unknown law",
                    ", ".join(LAWS),
                    f"laws.{name}",
                    nearest_name(name, LAWS) or "",
                )
            if not isinstance(parameters, dict):
                wanted = ", ".join(parameter.name for parameter in LAWS[name].parameters)
                raise refusal("is not a table", f"a table with {wanted}", f"laws.{name}")
            read[name] = parameters | {"law": name}
        name = table["law"]
        if name not in LAWS:
            raise refusal(
                f"{name!r} is an unknown law", ", ".join(LAWS), "law", nearest_name(name, LAWS) or ""
            )
        if name not in read:
            missing = [p.name for p in LAWS[name].parameters if p.default is None]
            if missing:
                raise refusal(
                    f"this muscle has no parameters for {name!r}: [laws.{name}] with {', '.join(missing)}",
                    f"one of the laws it has: {', '.join(read) or 'none'}",
                    "law",
                    nearest_name(name, read) or "",
                )
            read[name] = {"law": name}
        return table | {"laws": read}

    @property
    def law_set(self) -> LawSet:
        """The parameters and ranges of the law in use."""
        return self.laws[self.law]

    @property
    def coefficients(self) -> tuple[float, ...]:
        """What the kernel of the law in use takes after contraction and pressure."""
        return LAWS[self.law].coefficients(self.braid, self.law_set.parameters)

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
    def nominal_length(self) -> float:
        """L0: the active braid, unpressurised [m]."""
        return self.total_length - self.end_length

    @property
    def braid(self) -> Braid:
        return Braid(self.nominal_length, self.bore / 2.0, self.braid_angle)
