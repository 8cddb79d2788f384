"""The field at a dotted key of a scenario: a number in a unit, a whole number, or a word."""

import math
import pathlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic import TypeAdapter, ValidationError

from afo_sim.common import assets
from afo_sim.common.errors import InputError, nearest_name, unknown
from afo_sim.common.units import EXAMPLES
from afo_sim.description.leaves import (
    RANGES,
    SELECTOR,
    SETS,
    core,
    fields_of,
    is_list_of_tables,
    is_table,
    marked,
    parameter_leaf,
    table_names,
)
from afo_sim.description.quantity import Quantity
from afo_sim.description.reader import SPECS, load, split_key
from afo_sim.description.scenario import Scenario
from afo_sim.description.tree import dotted_key
from afo_sim.physics.law import LawParameter


@dataclass(frozen=True)
class Field:
    """A field that a dotted key leads to.

    `unit` is the SI unit, "" for bare numbers and words. `annotation` is its type with bounds;
    `description` the kind of description that a word names here ("patient"), "" where it names none.
    `value` is what the scenario has there [SI], None where nothing.
    """

    key: str
    kind: Literal["number", "integer", "word"]
    unit: str
    annotation: Any
    description: str = ""
    value: Any = None

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and greatest number allowed [SI]; infinite where the description sets no bound."""
        quantity = next((mark for mark in core(self.annotation)[1] if isinstance(mark, Quantity)), None)
        if quantity is None:
            return -math.inf, math.inf
        lower = quantity.at_least if quantity.at_least is not None else quantity.above
        upper = quantity.at_most
        return -math.inf if lower is None else lower, math.inf if upper is None else upper

    @property
    def form(self) -> str:
        """The form of a value, in words."""
        if self.kind == "word":
            return f"the name of a {self.description}" if self.description else "a text"
        return "a whole number" if self.kind == "integer" else f'such as "{EXAMPLES.get(self.unit, "")}"'

    def read(self, value: Any, beside: pathlib.Path) -> float | str:
        """A value as the scenario would read it: SI number, whole number as float, or word.

        Parameters
        ----------
        value : as TOML has it
        beside : file in which it was found, for words that are paths

        Raises
        ------
        InputError
            No unit, another dimension, out of range, no whole number, no such name.
        """
        if self.kind == "word":
            return self._word(value, beside)
        whole = isinstance(value, int) and not isinstance(value, bool)
        if self.kind == "integer" and (not whole or abs(value) > 2**53):
            raise InputError("is not a whole number", value=value, allowed="up to 2^53")
        try:
            return float(TypeAdapter(self.annotation).validate_python(value))
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            allowed = str(first.get("ctx", {}).get("allowed", ""))
            raise InputError(first["msg"], value=value, allowed=allowed) from None

    def _word(self, value: Any, beside: pathlib.Path) -> str:
        if not isinstance(value, str):
            raise InputError("is not a text", value=value, allowed=self.form)
        if self.description:
            load(self.description, self.resolved(value, beside))
            return value
        if self.key == "gait.cycle":
            assets.find_gait(self.resolved(value, beside))
        if (
            core(self.annotation)[0] is pathlib.Path
            and not pathlib.Path(self.resolved(value, beside)).is_file()
        ):
            raise InputError("there is no such file", value=value)
        try:
            TypeAdapter(self.annotation).validate_python(value)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            choices = [c for c in get_args(core(self.annotation)[0]) if isinstance(c, str)]
            problem = "is no choice" if choices else first["msg"]
            raise unknown(value, choices, problem=problem) from None
        return value

    def resolved(self, word: str, beside: pathlib.Path) -> str:
        """A word that is the path of a file beside `beside` as its whole path; else the word itself."""
        path = beside.parent / word
        shipped = assets.names(self.description) if self.description else []
        names_a_file = (
            self.description or self.key == "gait.cycle" or core(self.annotation)[0] is pathlib.Path
        )
        return str(path.resolve()) if names_a_file and word not in shipped and path.exists() else word


def field_at(key: str, scenario: Scenario) -> Field:
    """The field that a dotted key leads to.

    Parameters
    ----------
    key : as `--set` takes it; "key[0]" is an item of a list
    scenario : tells which muscles, chambers and laws there are

    Raises
    ------
    InputError
        There is no such field, or it is a table, or a list whose items are not named.
    """
    path, items = split_key(key)
    annotation: Any = Scenario
    value: Any = scenario
    for depth, name in enumerate(path):
        if is_list_of_tables(core(annotation)[0]) and name.isdigit():
            annotation, value = _item(annotation, value, int(name), key)
        else:
            annotation, value = _below(annotation, value, name, dotted_key(path[:depth]), scenario)
    for item in items:
        annotation, value = _item(annotation, value, item, key)
    kind, marks = core(annotation)
    if get_origin(kind) is tuple:
        raise InputError("is a list: name one of its items", field=key, allowed=f"{key}[0]")
    quantity = next((mark for mark in marks if isinstance(mark, Quantity)), None)
    if quantity is not None:
        return Field(key, "number", quantity.unit, annotation, value=value)
    if kind is int:
        return Field(key, "integer", "", annotation, value=value)
    if kind is str or kind is pathlib.Path or get_origin(kind) is Literal:
        return Field(key, "word", "", annotation, value=value)
    description = next((name for name, spec in SPECS.items() if spec is kind), "")
    if description:
        return Field(key, "word", "", annotation, description)
    allowed = ", ".join(f"{key}.{name}" for name in _names(kind, value, scenario))
    raise InputError("is a table: name one of its fields", field=key, allowed=allowed)


def _below(annotation: Any, value: Any, name: str, at: str, scenario: Scenario) -> tuple[Any, Any]:
    """(type, value where there is one) of a field of a table."""
    kind, _ = core(annotation)
    names = _names(kind, value, scenario)
    if name not in names:
        whole = f"{at}.{name}" if at else name
        if not names:
            raise InputError(f"{at} is a value, not a table", field=whole)
        nearest = nearest_name(name, names)
        raise InputError("is an unknown key", field=whole, allowed=", ".join(names), nearest=nearest)
    if get_origin(kind) is dict:
        return get_args(kind)[1], (value or {}).get(name)
    if kind in SETS and name in _parameters(kind, value):
        return parameter_leaf(_parameters(kind, value)[name]).annotation, value.parameters[name]
    if name in kind.model_fields:
        return marked(kind.model_fields[name]), getattr(value, name, None)
    extra = kind.__annotations__["__pydantic_extra__"]  # a chamber's valves, of timer or phases
    return get_args(extra)[1], None if value is None else value.chambers.get(name)


def _item(annotation: Any, value: Any, item: int, key: str) -> tuple[Any, Any]:
    """(type, value where there is one) of an item of a list."""
    kind, _ = core(annotation)
    if get_origin(kind) is not tuple:
        raise InputError("is not a list, so it has no items", field=key)
    kinds = get_args(kind)
    count = len(value) if isinstance(value, tuple) else 0
    if item >= count:
        allowed = f"[0] to [{count - 1}]" if count else "none: the list is empty here"
        raise InputError(f"there is no item [{item}]", field=key, allowed=allowed)
    return kinds[0] if kinds[-1] is Ellipsis else kinds[item], value[item]


def _names(kind: Any, value: Any, scenario: Scenario) -> list[str]:
    """The fields of a table."""
    if get_origin(kind) is dict:
        return table_names(kind, value or ())
    if not is_table(kind):
        return []
    if kind in SETS:
        return [*_parameters(kind, value), *(name for name in RANGES if name in kind.model_fields)]
    chambers: Iterable[str] = scenario.orthosis.chamber if kind.model_config.get("extra") == "allow" else ()
    return [*fields_of(kind), *chambers]


def _parameters(kind: Any, value: Any) -> dict[str, LawParameter]:
    owner = SETS[kind][getattr(value, SELECTOR[kind])]
    return {parameter.name: parameter for parameter in owner.parameters}
