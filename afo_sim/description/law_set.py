"""Parameters of force laws and frictions for one muscle, read from flat tables and checked."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import ValidationInfo, field_validator, model_serializer, model_validator
from pydantic_core import PydanticCustomError

from afo_sim.common import Foreign, Given, JsonDict, JsonMapping, format_quantity, parse_quantity
from afo_sim.description.quantity import Described, Quantity, refusal, refuse_all, refused_name, split_sources
from afo_sim.physics import FRICTIONS, LAWS, LawParameter

GaugePressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
Contraction = Annotated[float, Quantity("", at_least=-0.5, at_most=0.9)]


class LawSet(Described):
    """One law's parameters for one muscle, SI, and where they hold."""

    law: str
    """Name of the law."""
    parameters: dict[str, float]
    """Parameters of the law."""
    pressure_range: tuple[GaugePressure, GaugePressure]
    """Lowest and highest gauge pressure at which the parameters hold; the law's by default."""
    contraction_range: tuple[Contraction, Contraction]
    """Lowest and highest contraction ratio at which the parameters hold; the law's by default."""

    @model_validator(mode="before")
    @classmethod
    def _read_flat(cls, table: Given) -> Given:
        """Convert a flat table of parameters and ranges, as under [laws.NAME], to fields."""
        if not isinstance(table, Mapping) or "parameters" in table:
            return table
        read = _split_flat(table, "law", LAWS, ("pressure_range", "contraction_range"))
        law = LAWS[read["law"]]
        read.setdefault("pressure_range", [f"{p!r} Pa" for p in law.pressure_range])
        read.setdefault("contraction_range", list(law.contraction_range))
        return read

    @field_validator("parameters", mode="before")
    @classmethod
    def _are_the_laws(cls, values: Given, info: ValidationInfo) -> Given:
        return _read_parameters(LAWS.get(info.data.get("law", "")), values, info)

    def _must_rise(self) -> None:
        for key in ("pressure_range", "contraction_range"):
            lower, upper = getattr(self, key)
            if not lower < upper:
                raise refusal("the first value is not below the second", "", key)

    @model_serializer(mode="wrap")
    def _write(self, handler: Foreign) -> JsonDict:
        kept = handler(self)
        written = _written(LAWS[self.law].parameters, self.parameters)
        return written | {key: kept[key] for key in ("pressure_range", "contraction_range", "provenance")}


class FrictionSet(Described):
    """One friction's parameters for one muscle, SI."""

    friction: str
    """Name of the friction."""
    parameters: dict[str, float]
    """Parameters of the friction."""

    @model_validator(mode="before")
    @classmethod
    def _read_flat(cls, table: Given) -> Given:
        """Convert a flat table of parameters, as under [frictions.NAME], to fields."""
        if not isinstance(table, Mapping) or "parameters" in table:
            return table
        return _split_flat(table, "friction", FRICTIONS, ())

    @field_validator("parameters", mode="before")
    @classmethod
    def _are_the_frictions(cls, values: Given, info: ValidationInfo) -> Given:
        return _read_parameters(FRICTIONS.get(info.data.get("friction", "")), values, info)

    @model_serializer(mode="wrap")
    def _write(self, handler: Foreign) -> JsonDict:
        written = _written(FRICTIONS[self.friction].parameters, self.parameters)
        return written | {"provenance": handler(self)["provenance"]}


def named(table: JsonDict, kind: str) -> Given:
    """The tables [laws.NAME] or [frictions.NAME], each with its name."""
    given = table.get(f"{kind}s", {})
    if not isinstance(given, Mapping):
        raise refusal("is not a table", f"a table [{kind}s.NAME] for each {kind}", f"{kind}s")
    return {
        name: parameters | {kind: name}
        if isinstance(parameters, dict)
        else parameters
        if isinstance(parameters, Described)
        else {kind: name, "parameters": parameters}
        for name, parameters in given.items()
    }


def _split_flat(table: JsonMapping, kind: str, known: JsonMapping, others: Sequence[str]) -> JsonDict:
    """A flat table as fields: the law's name, its parameters, what else stands there, and the sources."""
    values, sources = split_sources(table)
    name = str(values.get(kind))
    if name not in known:
        raise refused_name(f"{name!r} is an unknown {kind}", name, known)
    kept = {key: value for key, value in values.items() if key in (kind, *others)}
    rest = {key: value for key, value in values.items() if key not in (*kept, "provenance")}
    return kept | {"parameters": rest, "provenance": sources}


def _read_parameters(owner: Given, values: Given, info: ValidationInfo) -> Given:
    """A law's or friction's parameters in SI; refuses all that are missing, unknown or out of range."""
    if owner is None:
        return values
    names = [parameter.name for parameter in owner.parameters]
    if not isinstance(values, Mapping):
        raise refusal("is not a table", f"a table with {', '.join(names)}")
    if info.context and info.context.get("si"):
        return dict(values)  # a perturbed set may leave the bounds of a fit
    read, problems = {}, []
    for parameter in owner.parameters:
        try:
            if parameter.name in values:
                read[parameter.name] = _read_parameter(parameter, values[parameter.name])
            elif parameter.default is not None:
                read[parameter.name] = parameter.default
            else:
                span = Quantity(parameter.unit, at_least=parameter.lower, at_most=parameter.upper).span
                allowed = f"{span} ({parameter.meaning})"
                raise refusal(f"is missing; {owner.name} needs it", allowed, parameter.name)
        except PydanticCustomError as problem:
            problems.append(problem)
    for key in values:
        if key not in names:
            problems.append(refused_name(f"is not a parameter of {owner.name}", key, names, key))
    refuse_all(problems)
    return read


def _read_parameter(parameter: LawParameter, text: Given) -> float:
    try:
        number = parse_quantity(text, parameter.unit)
    except ValueError as error:
        raise refusal(str(error), "", parameter.name) from None
    if not parameter.lower <= number <= parameter.upper:
        allowed = f"{parameter.lower:g} to {parameter.upper:g} {parameter.unit}".strip()
        raise refusal(f"{text!r} is out of range", allowed, parameter.name)
    return number


def _written(parameters: Sequence[LawParameter], values: dict[str, float]) -> JsonDict:
    units = {parameter.name: parameter.unit for parameter in parameters}
    return {name: format_quantity(value, units[name]) for name, value in values.items()}
