"""Keys that can be set: all of a description with value, unit, range and source, and the field at one."""

import math
import os
import pathlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, get_args, get_origin

from pydantic import TypeAdapter, ValidationError

from afo_sim.common import EXAMPLES, InputError, JsonMapping, Mixed, assets, unknown
from afo_sim.description import schema
from afo_sim.description.quantity import Provenance, Whole
from afo_sim.description.reader import Reading, load, read
from afo_sim.description.scenario import Scenario
from afo_sim.description.tree import value_at


@dataclass(frozen=True)
class Key:
    """A settable key. `value` is as it is written, `unit` the SI unit, "" of bare numbers and words."""

    key: str
    value: str
    unit: str
    allowed: str
    meaning: str
    source: str
    kind: str = ""
    reference: str = ""

    @property
    def origin(self) -> str:
        """File and provenance of the value, on one line."""
        reference = f"{self.kind}: {self.reference}" if self.kind else ""
        return "; ".join(filter(None, (self.source, reference)))

    def mentions(self, word: str) -> bool:
        """Whether a word occurs in the key or in its meaning."""
        return word.lower() in self.key.lower() or word.lower() in self.meaning.lower()


def keys(
    source: str | os.PathLike[str] | JsonMapping, word: str = "", sets: Mapping[str, object] | None = None,
    kind: str = "scenario", *, whole: bool = False,
) -> list[Key]:  # fmt: skip
    """Settable keys of a description, with their present values."""
    reading = read(kind, source, sets)
    found = (
        key
        for leaf in schema.leaves(schema.SPECS[kind], reading.tree.root)
        if schema.holder(reading.description, leaf.path) is not None
        and (whole or not _is_whole(leaf.annotation))
        for key in _keys_of(reading, leaf)
    )
    return [key for key in found if key.mentions(word)]


def _keys_of(reading: Reading[Mixed], leaf: schema.Leaf) -> Iterator[Key]:
    written = value_at(reading.tree.root, leaf.path)
    source, provenance = _source(reading, leaf, written)
    origin = (provenance.kind, provenance.source) if provenance else ("", "")
    present = leaf.default if written is None else written
    if present is None:
        present = schema.child_of(schema.holder(reading.description, leaf.path), leaf.path[-1])
    for name, value, annotation in _items(leaf.key, present, leaf.annotation):
        facts = (schema.shown(value, annotation), schema.unit_of(annotation), schema.allowed(annotation))
        yield Key(name, *facts, leaf.meaning, source, *origin)


def _is_whole(annotation: schema.Annotation) -> bool:
    return any(isinstance(mark, Whole) for mark in schema.core(annotation)[1])


def _items(key: str, value: Mixed, annotation: schema.Annotation) -> Iterator[tuple[str, Mixed, Mixed]]:
    """(key, value, type) of a field, or of each item of a list that is not marked as a whole."""
    inner, _ = schema.core(annotation)
    if (
        _is_whole(annotation)
        or get_origin(inner) is not tuple
        or not isinstance(value, list | tuple)
        or not value
    ):
        yield key, value, annotation
        return
    for k, item in enumerate(value):
        yield from _items(f"{key}[{k}]", item, schema.item_type(annotation, k))


def _source(reading: Reading[Mixed], leaf: schema.Leaf, written: Mixed) -> tuple[str, Provenance | None]:
    """Source of a value, and its provenance."""
    table = schema.holder(reading.description, leaf.path)
    provenance = getattr(table, "provenance", {}).get(leaf.path[-1])
    tree, path = reading.tree, leaf.path
    file, inner = tree.file_of(path[:-1])
    depth = len(path) - 1 - len(inner)  # of the file; one that a set name stands for holds no set value
    if any(len(k) > depth and (path[: len(k)] == k or k[: len(path)] == path) for k in tree.set_keys):
        return "set", provenance
    if written is None and provenance is None:  # one that another of the table gives has a provenance
        return "default", provenance
    models = assets.folder("models")
    if file is not None and file.is_relative_to(models):
        file = file.relative_to(models.parent)
    return (str(file) if file else "registered" if depth else ""), provenance


@dataclass(frozen=True)
class Field:
    """A field that a dotted key leads to."""

    key: str
    kind: Literal["number", "integer", "word"]
    unit: str
    annotation: schema.Annotation
    description: str = ""
    value: Mixed = None

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and greatest number allowed [SI]; infinite where the description sets no bound."""
        quantity = schema.quantity_of(self.annotation)
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

    def read(self, value: Mixed, beside: pathlib.Path) -> float | str:
        """A value as the scenario would read it: SI number, whole number as float, or word."""
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

    def _word(self, value: Mixed, beside: pathlib.Path) -> str:
        if not isinstance(value, str):
            raise InputError("is not a text", value=value, allowed=self.form)
        whole = self.resolved(value, beside)
        if self.description:
            load(self.description, whole)
            return value
        if self.key == "gait.cycle":
            assets.find_gait(whole)
        if schema.core(self.annotation)[0] is pathlib.Path and not pathlib.Path(whole).is_file():
            raise InputError("there is no such file", value=value)
        try:
            TypeAdapter(self.annotation).validate_python(value)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            choices = [c for c in get_args(schema.core(self.annotation)[0]) if isinstance(c, str)]
            problem = "is not a valid choice" if choices else first["msg"]
            raise unknown(value, choices, problem=problem) from None
        return value

    def resolved(self, word: str, beside: pathlib.Path) -> str:
        """A word that is the path of a file beside `beside` as its whole path; else the word itself."""
        path = beside.parent / word
        shipped = assets.names(self.description) if self.description else []
        names_a_file = self.key == "gait.cycle" or schema.core(self.annotation)[0] is pathlib.Path
        found = (self.description or names_a_file) and word not in shipped and path.exists()
        return str(path.resolve()) if found else word


def field_at(key: str, scenario: Scenario) -> Field:
    """The field that a dotted key leads to."""
    annotation, value = schema.found_at(key, scenario)
    kind = schema.core(annotation)[0]
    if get_origin(kind) is tuple:
        raise InputError("is a list: name one of its items", field=key, allowed=f"{key}[0]")
    quantity = schema.quantity_of(annotation)
    if quantity is not None:
        return Field(key, "number", quantity.unit, annotation, value=value)
    if kind is int:
        return Field(key, "integer", "", annotation, value=value)
    if kind in (str, bool, pathlib.Path) or get_origin(kind) is Literal:
        return Field(key, "word", "", annotation, value=value)
    if kind in schema.KINDS:
        return Field(key, "word", "", annotation, schema.KINDS[kind])
    allowed = ", ".join(f"{key}.{name}" for name in schema.names_in(annotation, value, scenario))
    raise InputError("is a table: name one of its fields", field=key, allowed=allowed)
