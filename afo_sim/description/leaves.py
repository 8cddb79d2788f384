"""Fields of a description as its types tell them: what can be set, in which unit, and what it means."""

import difflib
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from afo_sim.description.meanings import meaning
from afo_sim.description.muscle import FrictionSet, LawSet
from afo_sim.description.quantity import Quantity
from afo_sim.description.tree import dotted_key
from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.law import LawParameter
from afo_sim.physics.laws import LAWS

Path = tuple[str, ...]
SETS: dict[Any, Mapping[str, Any]] = {LawSet: LAWS, FrictionSet: FRICTIONS}  # tables of a law's parameters
SELECTOR: dict[Any, str] = {LawSet: "law", FrictionSet: "friction"}  # field that names the law or friction
RANGES = ("pressure_range", "contraction_range")  # of a law's table, beside its parameters
CUTOFF = 0.6  # likeness from which on a name counts as misspelt


@dataclass(frozen=True)
class Leaf:
    """A field below which there is none, or a description that a name stands for.

    `annotation` is its type with bounds; `default` None where there is none, or none is needed.
    """

    path: Path
    annotation: Any
    meaning: str
    required: bool
    default: Any = None

    @property
    def key(self) -> str:
        """Its dotted key."""
        return dotted_key(self.path)


def core(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """A type without "or nothing", and the marks that stand at it."""
    marks: tuple[Any, ...] = ()
    while True:
        origin = get_origin(annotation)
        if origin is Annotated:
            annotation, *more = get_args(annotation)
            marks += tuple(more)
        elif origin in (typing.Union, types.UnionType):
            annotation = next(part for part in get_args(annotation) if part is not type(None))
        else:
            return annotation, marks


def is_table(kind: Any) -> bool:
    """Whether a type is a description of its own, with fields."""
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def is_list_of_tables(kind: Any) -> bool:
    """Whether a type is a list of any length of descriptions with fields."""
    return get_origin(kind) is tuple and is_table(get_args(kind)[0])


def table_names(kind: Any, written: Iterable[str]) -> list[str]:
    """Names of the tables in a dict type: those that its type lists, or else those that are written."""
    names = get_args(kind)[0]
    return list(get_args(names)) if get_origin(names) is Literal else list(written)


def fields_of(kind: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields that a file writes."""
    return {name: info for name, info in kind.model_fields.items() if name != "provenance"}


def marked(info: FieldInfo) -> Any:
    """A field's type with its bounds."""
    return Annotated[(info.annotation, *info.metadata)] if info.metadata else info.annotation


def parameter_leaf(parameter: LawParameter, path: Path = ()) -> Leaf:
    """A law's or friction's parameter as a field."""
    bounds = Quantity(parameter.unit, at_least=parameter.lower, at_most=parameter.upper)
    meaning = f"{parameter.symbol}: {parameter.meaning}."
    needed = parameter.default is None
    return Leaf((*path, parameter.name), Annotated[float, bounds], meaning, needed, parameter.default)


def leaves(kind: Any, table: Any, path: Path = (), chambers: Iterable[str] = ()) -> Iterator[Leaf]:
    """Every field of a description, also of tables that are not written.

    Parameters
    ----------
    kind : class of the description
    table : as it is written, its names followed: tells which muscles, chambers and laws there are
    path : where the description stands
    chambers : what a timer switches

    Yields
    ------
    Leaf, in the order of the class
    """
    table = table if isinstance(table, Mapping) else {}
    if kind in SETS:
        known = SETS[kind].get(path[-1])
        yield from (parameter_leaf(parameter, path) for parameter in (known.parameters if known else ()))
    if kind.__name__ == "Scenario" and isinstance(table.get("orthosis"), Mapping):
        chambers = list(table["orthosis"].get("chamber", {}))
    for name in fields_of(kind):
        if kind not in SETS or name in RANGES:
            yield from _below(kind, name, table.get(name), path, chambers)
    if kind.model_config.get("extra") == "allow":
        inner = get_args(kind.__annotations__["__pydantic_extra__"])[1]
        for name in chambers:
            if is_table(core(inner)[0]):
                yield from leaves(inner, table.get(name), (*path, name))
            else:
                yield Leaf((*path, name), inner, "Of this chamber.", False)


def _below(kind: Any, name: str, value: Any, path: Path, chambers: Iterable[str]) -> Iterator[Leaf]:
    """The leaves of one field: itself, or what lies below."""
    info = kind.model_fields[name]
    here, (inner, _) = (*path, name), core(info.annotation)
    default = None if info.is_required() else info.default
    leaf = Leaf(here, marked(info), meaning(kind, name), info.is_required(), default)
    if get_origin(inner) is dict and is_table(get_args(inner)[1]):
        written = value if isinstance(value, Mapping) else {}
        for key in table_names(inner, written):
            yield from leaves(get_args(inner)[1], written.get(key), (*here, key))
    elif is_list_of_tables(inner) and value:
        for number, item in enumerate(value if isinstance(value, list | tuple) else ()):
            yield from leaves(get_args(inner)[0], item, (*here, str(number)))
    elif is_table(inner):
        if "name" in inner.model_fields:
            yield leaf
        yield from leaves(inner, value, here, chambers)
    else:
        yield leaf


def table_at(kind: Any, path: Path) -> Any:
    """The class of the table at a path, None where there is none."""
    for name in path:
        inner = core(kind)[0]
        if get_origin(inner) is dict:
            kind = get_args(inner)[1]
        elif is_list_of_tables(inner) and name.isdigit():
            kind = get_args(inner)[0]
        elif is_table(inner) and name in inner.model_fields:
            kind = inner.model_fields[name].annotation
        elif is_table(inner) and inner.model_config.get("extra") == "allow":
            kind = get_args(inner.__annotations__["__pydantic_extra__"])[1]
        else:
            return None
    inner = core(kind)[0]
    return inner if is_table(inner) else None


def nearest_key(
    path: Path, known: Iterable[Leaf], beside: Iterable[str] = (), root: object = None
) -> str | None:
    """The key that an unknown one most likely means, on whatever level."""

    def likeness(name: str) -> float:
        return difflib.SequenceMatcher(None, path[-1], name).ratio()

    found = [(likeness(name) + 0.05, True, 0, name) for name in beside]
    for leaf in known:
        shared = sum(part in leaf.path for part in path[:-1])  # "orthosis.conductance" means an orthosis'
        there = _has_table(root, leaf.path[:-1])
        found.append((likeness(leaf.path[-1]) + 0.01 * shared, there, -len(leaf.path), leaf.key))
    best = max(found, key=lambda entry: entry[:3], default=(0.0, False, 0, ""))
    return best[3] if best[0] >= CUTOFF else None


def _has_table(root: object, path: Path) -> bool:
    for name in path:
        root = root.get(name) if isinstance(root, Mapping) else None
    return root is not None
