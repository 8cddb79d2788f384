"""Tables of a study's TOML file, [parameters.NAME] → Parameter, and the rows of a list design's CSV.

`Any` is what such a table holds before it is read: a text, a number or a list.
"""

import copy
import functools
import keyword
import math
import pathlib
from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, StrictBool, StrictInt, StrictStr, ValidationError, model_validator
from pydantic import Field as Option

from afo_sim.common import (
    RATIOS,
    InputError,
    nearest_name,
    number,
    parse_quantity,
    read_table,
    refuse,
    split_title,
)
from afo_sim.description import PROBLEMS, Field, Scenario, field_at, refusal, refused_name
from afo_sim.description.schema import child_of
from afo_sim.metrics import words
from afo_sim.metrics.metric_words import OTHER
from afo_sim.study.parameter import Choice, Normal, OwnSeed, Parameter, Range, Spread
from afo_sim.study.results import EVERY_ROW, NOTICES, OVERRIDES, WARNINGS

# Each way to state a parameter's values: the key that it is known by, and what goes with it.
_WAYS = {
    "from_seed": ("from_seed",),
    "distribution": ("distribution", "mean", "median", "sd", "from", "to"),
    "values": ("values",),
    "from": ("from", "to", "scale", "steps"),
}
_ANY_WAY = "from and to, values, distribution, or from_seed = true"
_BOUNDS = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}
_EXAMPLE = "pressure [bar],patient"
_STRANGE = "is an unknown key"


class StrictTable(BaseModel):
    """A table of a sweep's file; an unknown key is refused with the nearest one."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=False)

    @model_validator(mode="before")
    @classmethod
    def _knows_its_keys(cls, table: Any) -> Any:
        if isinstance(table, cls):
            return table
        known = [option.alias or name for name, option in cls.model_fields.items()]
        if not isinstance(table, Mapping):
            raise refusal("is not a table", f"a table with {', '.join(known)}")
        for key in table:
            if key not in known:
                raise refused_name(_STRANGE, str(key), known, str(key))
        return table

    @classmethod
    def read(cls, file: pathlib.Path, table: Any) -> Self:
        """What a file states; all that is wrong is an InputError and its `others`."""
        found, rest = list[InputError](), copy.deepcopy(dict(table))
        while True:
            try:
                read = cls.model_validate(rest)
                break
            except ValidationError as error:
                entries = error.errors(include_url=False)
            found += [_told(file, rest, entry) for entry in entries]
            strange = [
                (e["loc"], e["ctx"]["key"]) for e in entries if e.get("ctx", {}).get("problem") == _STRANGE
            ]
            if not strange:
                break
            found = [each for each in found if each.problem == _STRANGE]  # the others are told again
            for path, key in strange:  # hides what else is wrong with its table
                del functools.reduce(child_of, map(str, path), rest)[key]
        refuse(found)
        return read


def _told(file: pathlib.Path, table: Any, entry: Any) -> InputError:
    facts = entry.get("ctx", {})
    bound = ", ".join(f"{words} {facts[name]:g}" for name, words in _BOUNDS.items() if name in facts)
    path = [str(part) for part in entry["loc"]] + ([facts["key"]] if facts.get("key") else [])
    value = functools.reduce(child_of, path, table)
    problem = (PROBLEMS | {"dict_type": "is not a table", "too_short": "is empty"}).get(
        entry["type"], entry["msg"]
    )
    told: dict[str, Any] = {"file": file, "field": ".".join(path), "nearest": facts.get("nearest") or None}
    told["allowed"] = str(facts.get("allowed", "") or facts.get("expected", "") or bound)
    return InputError(problem, value=None if isinstance(value, dict) else value, **told)


class ParameterTable(StrictTable):
    """A table [parameters.NAME], as it is written."""

    key: StrictStr | None = None
    keys: tuple[StrictStr, ...] | None = None
    from_: Any = Option(default=None, alias="from")
    to: Any = None
    scale: Literal["linear", "log"] | None = None
    steps: StrictInt | None = Option(default=None, ge=2)
    values: tuple[Any, ...] | None = None
    distribution: Literal["normal", "lognormal"] | None = None
    mean: Any = None
    median: Any = None
    sd: Any = None
    from_seed: StrictBool | None = None


def is_free(name: str) -> bool:
    """True where no other column of the results has this name."""
    return name not in (*EVERY_ROW, OVERRIDES, WARNINGS, NOTICES) and words(name).group == OTHER


class ParameterReader:
    """Reads one [parameters.NAME] of a sweep's `file`; what is wrong names parameter, option and key."""

    def __init__(self, file: pathlib.Path, design: str, name: str, table: ParameterTable, scenario: Scenario):
        self.file, self.design, self.name, self.table = file, design, name, table
        given = table.model_dump(by_alias=True, exclude_none=True)
        self.given: dict[str, Any] = {k: v for k, v in given.items() if k not in ("key", "keys")}
        if not name.isascii() or not name.isidentifier() or keyword.iskeyword(name):
            allowed = "letters, digits and _, a letter first; no word of Python's such as and, from, not"
            problem = "is not a valid name for a column"
            raise InputError(problem, file=file, field=self._at(""), allowed=allowed)
        if not is_free(name):
            problem = "is the name of another column of the results"
            raise InputError(problem, file=file, field=self._at(""), allowed="a name of its own")
        self.fields = self._fields(scenario)
        self.field = self.fields[0]

    def parameter(self) -> Parameter:
        """The parameter, in SI."""
        spread = self._spread()
        files = {}
        if isinstance(spread, Choice) and self.field.kind == "word":
            resolved = {str(word): self.field.resolved(str(word), self.file) for word in spread.values}
            files = {word: path for word, path in resolved.items() if path != word}
        keys = tuple(field.key for field in self.fields)
        whole = self.field.kind == "integer"
        return Parameter(self.name, keys, self.field.unit, spread, whole, self.field.description, files)

    def _fields(self, scenario: Scenario) -> list[Field]:
        keys, table = self.table.keys or (), self.table
        if (table.key is None) == (table.keys is None) or (table.keys is not None and not keys):
            problem = "which field of the scenario is meant is not stated, or twice"
            raise self._error(problem, "key", "key or keys")
        found = []
        for key in keys or (str(table.key),):
            try:
                found.append(field_at(key, scenario))
            except InputError as error:
                at = "" if error.field in ("", key) else f" (at {error.field})"
                problem = f"{error.problem}{at}"
                raise self._error(problem, "key", error.allowed, key, error.nearest) from None
        first = found[0]
        for field in found[1:]:
            if (field.kind, field.unit, field.description) != (first.kind, first.unit, first.description):
                problem = f"{field.key} holds another kind of value than {first.key}"
                raise self._error(problem, "keys", f"{first.form}, at all of them")
        return found

    def _spread(self) -> Spread:
        way = next((way for way in _WAYS if way in self.given), "from" if "to" in self.given else "")
        if not way:
            raise self._error("is missing: its values are not stated", "from", _ANY_WAY)
        for option in self.given:
            if option not in _WAYS[way]:
                raise self._error(f"does not go with {way}", option, ", ".join(_WAYS[way]))
        if way == "from_seed":
            if not self.table.from_seed:
                raise self._error("has no effect", "from_seed", "true", False)
            if self.field.kind != "integer":
                raise self._error("goes to whole numbers only", "from_seed", "a key such as gait.seed")
            for field in self.fields:
                self._read("from_seed", 2**32 - 1, field)
            return OwnSeed()
        if way == "values":
            values = [self._read("values", value) for value in self.table.values or ()]
            if not values:
                raise self._error("is empty", "values", "at least one value")
            twice = next((v for v in values if values.count(v) > 1), None) if self.design != "list" else None
            if twice is not None:
                table = (self.table.values or ())[values.index(twice)]
                raise self._error("is there twice", "values", "different values", table)
            return Choice(tuple(values))  # type: ignore[arg-type]  # all numbers or all words
        if self.field.kind == "word":
            raise self._error("is not a way to state words", way, "values")
        if self.design == "list" or (self.design == "grid" and way == "distribution"):
            raise self._error(f"does not go with the design {self.design!r}", way, "values")
        return self._range() if way == "from" else self._normal()

    def _range(self) -> Range:
        lower, upper = self._number("from"), self._number("to")
        whole, logarithmic = self.field.kind == "integer", self.table.scale == "log"
        self._require_rising(lower, upper)
        if logarithmic and lower <= 0.0:
            raise self._error("has no logarithm", "from", "more than zero with a log scale", self.table.from_)
        steps = self.table.steps
        if self.design == "grid" and steps is None:
            raise self._error("is missing: a grid needs it", "steps", "2 or more")
        if self.design != "grid" and steps is not None:
            raise self._error(f"does not go with the design {self.design!r}", "steps", "the design grid")
        found = Range(lower, upper, logarithmic, steps, whole)
        # by number first: the levels of a slip of some zeros would fill the memory
        if steps is not None and whole and (steps > upper - lower + 1.0 or len(set(found.levels())) < steps):
            raise self._error("is more than there are whole numbers in the range", "steps", "fewer", steps)
        return found

    def _normal(self) -> Normal:
        of_logarithm = self.table.distribution == "lognormal"
        centre_name, other = ("median", "mean") if of_logarithm else ("mean", "median")
        if other in self.given:
            raise self._error(f"does not go with {self.table.distribution}", other, f"{centre_name} and sd")
        centre = self._number(centre_name)
        unit = "" if of_logarithm or self.field.kind == "integer" else self.field.unit
        if "sd" not in self.given:
            raise self._error("is missing", "sd", "a standard deviation")
        try:
            sd = parse_quantity(self.given["sd"], unit)
        except ValueError as error:
            raise self._error(str(error), "sd") from None
        lower, upper = self._number("from", -math.inf), self._number("to", math.inf)
        self._require_rising(lower, upper)
        for option, wrong in ((centre_name, of_logarithm and centre <= 0.0), ("sd", sd <= 0.0)):
            if wrong:
                raise self._error("is out of range", option, "more than zero", self.given[option])
        if of_logarithm and upper <= 0.0:
            problem = "leaves nothing of a lognormal distribution"
            raise self._error(problem, "to", "more than zero", self.table.to)
        return Normal(centre, sd, lower, upper, of_logarithm, self.field.kind == "integer")

    def _require_rising(self, lower: float, upper: float) -> None:
        if not lower < upper:
            raise self._error("is not below to: the range is empty", "from", f"less than {self.table.to}")

    def _number(self, option: str, instead: float | None = None) -> float:
        if option in self.given:
            return float(self._read(option, self.given[option]))
        if instead is None:
            raise self._error("is missing", option, self.field.form)
        return instead

    def _read(self, option: str, value: Any, field: Field | None = None) -> float | str:
        try:
            found = [one.read(value, self.file) for one in ([field] if field else self.fields)]
        except InputError as error:
            problem = error.problem if error.value == value else str(error)
            raise self._error(problem, option, error.allowed, value, error.nearest) from None
        return found[0]

    def _at(self, option: str) -> str:
        return f"parameters.{self.name}" + (f".{option}" if option else "")

    def _error(
        self, problem: str, option: str, allowed: str = "", value: Any = None, nearest: str | None = None
    ) -> InputError:
        """An error of an option of this parameter, with the key of the scenario."""
        keys = self.table.keys or ((self.table.key,) if self.table.key else ())
        about = f" ({', '.join(keys)})" if keys and option != "key" else ""
        value = self.given.get(option) if value is None else value
        told: dict[str, Any] = {"file": self.file, "field": self._at(option), "value": value}
        return InputError(f"{problem}{about}", allowed=allowed, nearest=nearest, **told)


def values_of(
    sweep: pathlib.Path, name: str, parameters: Mapping[str, ParameterTable]
) -> dict[str, tuple[Any, ...]]:
    """Every parameter's values, as [parameters.NAME] would state them."""
    beside = sweep.parent / name
    file = beside if beside.is_file() else pathlib.Path(name)
    table = read_table(file, _EXAMPLE)
    columns = [split_title(title) for title in table.titles]
    titles = [title for title, _ in columns]
    wanted = [parameter for parameter, table in parameters.items() if not table.from_seed]
    for title in titles:
        if title not in wanted or titles.count(title) > 1:
            problem = "is there twice" if title in wanted else "is not a parameter of the sweep"
            near = nearest_name(title, wanted)
            raise InputError(problem, file=file, field=title, allowed=", ".join(wanted), nearest=near)
    for parameter in wanted:
        if parameter not in titles:
            raise InputError("this column is missing", file=file, field=parameter, allowed=", ".join(wanted))
    if not table.rows:
        raise InputError("has no rows: one per case", file=file, allowed=_EXAMPLE)
    return {
        title: tuple(_value(file, line, title, unit, cells[k]) for line, cells in table.rows)
        for k, (title, unit) in enumerate(columns)
    }


def _value(file: pathlib.Path, line: int, title: str, unit: str, cell: str) -> Any:
    """A cell as a TOML value: a quantity in the title's unit, else a whole number, a number or a text."""
    if unit in RATIOS:
        return number(file, line, title, cell) * RATIOS[unit]
    if unit:
        number(file, line, title, cell)
        return f"{cell} {unit}"
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell
