"""Field types of the descriptions: quantities read from text, and numbers that name their source.

`Any` is what a file or a user gives before it is read, or a field's value, of whatever type the field has.
"""

import contextlib
import copy
import functools
import marshal
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, model_validator
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from afo_sim.common import (
    EXAMPLES,
    InputError,
    Shown,
    called,
    format_quantity,
    in_unit,
    magnitudes,
    nearest_name,
    parse_quantity,
)

Part = TypeVar("Part")
_PLAIN = {str, float, int, bool, list, tuple}  # values that are no table
_ROUNDING = 1e-14  # of a number that is converted between units, relative
_VALUE_TABLE = "{ value = …, source = …, kind = … }"


@dataclass(frozen=True)
class Quantity:
    """Marks a float field that is read from text such as "4 bar", in `unit`, within bounds [unit]."""

    unit: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    exact: bool = False  # a rest of rounding is not 0

    @property
    def allowed(self) -> str:
        """The bounds, in words."""
        words = (("more than", self.above), ("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(
            f"{word} {amount(limit, self.unit, 4)}" for word, limit in words if limit is not None
        )

    @property
    def span(self) -> str:
        """The bounds as a range: "0 to 20 bar", "above 0, to 20 bar"."""
        low = self.above if self.above is not None else self.at_least
        if low is None or self.at_most is None:
            return self.allowed or "any number"
        lower, upper = (amount(limit, self.unit, 4).partition(" ") for limit in (low, self.at_most))
        start = lower[0] if lower[2] == upper[2] or low == 0.0 else "".join(lower)
        return (
            f"above {start}, to {''.join(upper)}"
            if self.above is not None
            else f"{start} to {''.join(upper)}"
        )

    def read(self, value: object, info: ValidationInfo | None = None) -> float:
        """Text to SI, or SI itself from `with_values`; raises what pydantic reports as the field's error."""
        plain = (
            f"{float(value)!r} {self.unit}"
            if isinstance(value, Real) and bool(info and info.context and info.context.get("si"))
            else value
        )
        try:
            number = parse_quantity(plain, self.unit)
        except ValueError as error:
            raise refusal(str(error), self.allowed) from None
        if abs(number) < magnitudes(self.unit)[0] and not self.exact:  # a rest of rounding
            number = 0.0
        for bound, beyond in ((self.at_least, -1.0), (self.at_most, 1.0)):
            if bound is None or not beyond * (number - bound) > 0.0:
                continue
            if math.isclose(number, bound, rel_tol=_ROUNDING):  # beyond it by rounding in another unit
                number = bound
        low = self.above is not None and number <= self.above
        lower = self.at_least is not None and number < self.at_least
        high = self.at_most is not None and number > self.at_most
        if low or lower or high:
            least = amount(magnitudes(self.unit)[0], self.unit, 4)
            problem = "is out of range"
            raise refusal(problem, f"{self.allowed}; below {least} it is 0" if low else self.allowed)
        return number

    def write(self, value: float) -> str | float:
        """SI to text that reads again, exactly."""
        return format_quantity(value, self.unit)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        writer = core_schema.plain_serializer_function_ser_schema(self.write)
        return core_schema.with_info_plain_validator_function(self.read, serialization=writer)


@dataclass(frozen=True)
class Whole:
    """Marks a list that is written only as a whole: neither it nor its items are keys of `--set`."""


def amount(value: float, unit: str, digits: int = 12) -> str:
    """An SI value in the unit that people use for it; in SI where that gives a long number."""
    usual = EXAMPLES.get(unit, f"1 {unit}").partition(" ")[2]
    number = in_unit(value, unit, usual) if usual else value
    if abs(number) >= 1e4:
        number, usual = value, unit
    return f"{number:.{digits}g} {usual}".strip()


def refusal(
    problem: str, allowed: str = "", key: str = "", nearest: str = "", *, beside: str = ""
) -> PydanticCustomError:
    """A refused field; `key` names a field below the one being read, `beside` one on its level."""
    facts = {"problem": problem, "allowed": allowed, "key": key, "nearest": nearest, "beside": beside}
    return PydanticCustomError("refused", "{problem}", facts)


def unknown_key(field: str, name: str, known: Collection[str]) -> InputError:
    """An error for a name that is none of a table's keys, with the nearest of them."""
    nearest = nearest_name(name, known)
    return InputError("is an unknown key", field=field, allowed=", ".join(known), nearest=nearest)


def refused_name(problem: str, name: str, known: Collection[str], key: str = "") -> PydanticCustomError:
    """Error for an unknown name, with the known ones and the nearest."""
    return refusal(problem, ", ".join(known), key, nearest_name(name, known) or "")


def provenance_note(described: "Described", key: str) -> str:
    """Kind and source of a number in brackets, " (published: data sheet)"; "" where none is stated."""
    origin = described.provenance.get(key)
    return "" if origin is None else f" ({origin.kind}: {origin.source})"


def refuse_all(problems: Sequence[PydanticCustomError]) -> None:
    """Report several refused fields at once."""
    if problems:
        lines = [InitErrorDetails(type=problem, loc=(), input=None) for problem in problems]
        raise ValidationError.from_exception_data("refused", lines)


SET_BY_HAND = "set for this run"  # source of what a caller lays over a description


class Provenance(BaseModel):
    """Source of a number. A derived number is never called published."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["published", "fitted", "derived", "assumed", "user"]
    source: str


class FrozenDict(dict[Any, Any]):
    """A table of a description, which descriptions share: it refuses to be changed."""

    def _refuse(self, *_: object, **__: object) -> Any:
        raise TypeError("a description is frozen: `set` makes a changed copy")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> Any:
        return type(self), (dict(self),)


@functools.cache
def _checks(described: type) -> list[str]:
    """Methods `_must_…` of a class: they refuse fields that are good alone and not together, bases first."""
    names = (name for base in reversed(described.__mro__) for name in vars(base) if name.startswith("_must_"))
    return list(dict.fromkeys(names))


class Described(Shown, BaseModel):
    """A frozen description whose numbers may be written { value = …, source = …, kind = … }."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    provenance: dict[str, Provenance] = {}
    """Sources of the numbers; a file writes each beside its number: { value = …, kind = …, source = … }."""

    @model_validator(mode="before")
    @classmethod
    def _read_table(cls, table: Any) -> Any:
        if isinstance(table, cls):
            return table
        if not isinstance(table, Mapping):
            keys = ", ".join(_own_keys(cls))
            raise refusal("is not a table", f"a table with {keys}" if keys else "a table")
        values, sources = split_sources(table)
        return values if not sources else values | {"provenance": sources}

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        for check in _checks(type(self)):
            getattr(self, check)()
        return self

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> CoreSchema:
        return core_schema.with_info_wrap_validator_function(cls._shared, handler(source))

    @classmethod
    def _shared(cls, table: Any, read: Callable[[Any], Self], info: ValidationInfo) -> Self:
        """What the same table gave before, where whoever reads keeps parts of a whole: {key: description}."""
        if isinstance(table, cls):  # it was checked
            return table
        kept, whole = (info.context or {}).get("kept", (None, None))
        if kept is None or table is whole or type(table) is not dict:
            return read(table)
        try:
            key = cls, marshal.dumps(table, 2)  # by type and bit of every value
        except ValueError:  # it holds something that no file does
            return read(table)
        found: Self | None = kept.get(key)
        if found is None:
            found = kept[key] = read(table)
            tables = {name: FrozenDict(value) for name, value in vars(found).items() if type(value) is dict}
            vars(found).update(tables)
        return found

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """What is frozen is shared; tables, which may be changed, are copied, and what holds them."""
        held = {k: v for k, v in vars(self).items() if type(v) is dict or isinstance(v, Described)}
        own = {k: copied for k, v in held.items() if (copied := copy.deepcopy(v, memo)) is not v}
        return self.model_copy(update=own) if own else self

    def __hash__(self) -> int:
        # of its own numbers and words; where only parts differ, comparing tells
        return hash((type(self), *[v for v in vars(self).values() if type(v) in (float, str, int)]))

    def __repr__(self) -> str:
        name, about = getattr(self, "name", ""), getattr(self, "description", "")
        if not name:  # a part of a description
            return called(self, {k: v for k, v in self if v is not None and k != "provenance"})
        return f"<{type(self).__name__} {name!r}{': ' if about else ''}{about}>"

    __str__ = __repr__

    read_key: ClassVar[Callable[["Described", str], Any]]  # filled by `schema`, which knows all fields

    def __getitem__(self, key: str) -> Any:
        """The value at a dotted key, as in `set`; numbers in SI."""
        return type(self).read_key(self, key)

    def get(self, key: str, default: Any = None) -> Any:
        """The same, or the default where there is no such key."""
        with contextlib.suppress(InputError):
            return self[key]
        return default

    def __contains__(self, key: str) -> bool:
        return self.get(key, self) is not self

    def with_values(self, **values: Any) -> Self:
        """A copy with some values [SI] replaced, checked as a file's are.

        Raises
        ------
        InputError
            A value is out of its range, does not fit the others, or there is no such field.
        """
        for name in values:
            if name not in type(self).model_fields:
                raise unknown_key(name, name, _own_keys(type(self)))
        table = {name: getattr(self, name) for name in type(self).model_fields} | values
        try:
            return type(self).model_validate(table, context={"si": True})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            facts = first.get("ctx", {})
            path = [*map(str, first["loc"]), *filter(None, [facts.get("key")])]
            value = values.get(path[0]) if path else None
            allowed = str(facts.get("allowed", ""))
            raise InputError(first["msg"], field=".".join(path), value=value, allowed=allowed) from None


class Named(Described):
    """A description with a name and a line about it."""

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""


class OfChambers(Described, Generic[Part]):
    """A description in which every key that is no field of it is a chamber."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Part] = Field(init=False)

    @classmethod
    def __pydantic_init_subclass__(cls, **told: Any) -> None:
        known = (getattr(each, "__pydantic_generic_metadata__", {}).get("args") for each in cls.__mro__)
        of: tuple[Any, ...] = next(filter(None, known), (Any,))
        cls.__annotations__["__pydantic_extra__"] = dict.__class_getitem__((str, *of))  # for pydantic < 2.14

    @property
    def chambers(self) -> dict[str, Part]:
        """What is described of each chamber."""
        return dict(self.__pydantic_extra__ or {})

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {chamber: chamber for chamber in self.chambers}


def split_sources(table: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Separate { value, source, kind } tables into plain values and a map of provenance."""
    values: dict[str, Any] = {}
    given = table.get("provenance", {})
    if not isinstance(given, Mapping):
        raise refusal("is not a table", "a table of { source, kind } by field", "provenance")
    sources: dict[str, Any] = dict(given)
    for key, value in table.items():
        if type(value) in _PLAIN:  # far faster than to ask what it is
            values[key] = value
        elif isinstance(value, Mapping) and "value" in value:
            values[key] = value["value"]
            sources[key] = {k: v for k, v in value.items() if k != "value"}
        elif isinstance(value, Mapping) and value and value.keys() <= {"source", "kind"}:
            raise refusal("is missing: its table says only where it comes from", _VALUE_TABLE, key)
        else:
            values[key] = value
    return values, sources


def _own_keys(cls: type[BaseModel]) -> list[str]:
    return [name for name in cls.model_fields if name != "provenance"]
