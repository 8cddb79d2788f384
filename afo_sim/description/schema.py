"""Fields of descriptions as their classes define them: type, bounds, unit, meaning, default, and tables.

pydantic keeps the texts below fields, too, but only where it parses every class as it is made, a quarter of a
second of each start. Here they are read when somebody asks what a field means.
"""

import ast
import functools
import inspect
import itertools
import pathlib
import re
import sys
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel

from afo_sim.common import InputError, JsonMapping, Mixed, likeness
from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.source import Source
from afo_sim.description.air.tube import Tube
from afo_sim.description.control.sensor import SensorType
from afo_sim.description.law_set import FrictionSet, LawSet
from afo_sim.description.leg import Leg, Shoe
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import Orthosis, Valve
from afo_sim.description.quantity import Described, Quantity, amount, unknown_key
from afo_sim.description.scenario import Scenario
from afo_sim.description.walking import Limits, Patient
from afo_sim.physics import FRICTIONS, LAWS

Path = tuple[str, ...]
SPECS: dict[str, type[BaseModel]] = {
    "scenario": Scenario, "leg": Leg, "orthosis": Orthosis, "muscle": Muscle, "valve": Valve, "tube": Tube,
    "source": Source, "regulator": Regulator, "patient": Patient, "shoe": Shoe, "limits": Limits,
    "sensor": SensorType,
}  # fmt: skip
KINDS = {spec: kind for kind, spec in SPECS.items()}
Annotation = Any  # a type as a field states it: a class, a union, Annotated, a list of them
SETS: dict[Annotation, JsonMapping] = {LawSet: LAWS, FrictionSet: FRICTIONS}  # tables of a law's parameters
# other words for keys that are not an ankle's alone: everywhere, and of a leg
ALSO = {"from_ankle": "from_joint"}
ALSO_OF_LEG = ALSO | {"proximal": "shank", "distal": "foot", "hinge": "ankle"}
_RANGES = ("pressure_range", "contraction_range")  # of a law's table, beside its parameters


@dataclass(frozen=True)
class Leaf:
    """A field of a description, with its path."""

    path: Path
    annotation: Annotation
    required: bool
    default: Mixed = None
    about: Mixed = ""

    @property
    def key(self) -> str:
        """Its dotted key."""
        return dotted_key(self.path)

    @property
    def meaning(self) -> str:
        """What it means."""
        if isinstance(self.about, str):
            return self.about
        name = self.path[-1]  # the text below the field, in the class that has it first
        return next((texts[name] for base in self.about.__mro__ if name in (texts := _texts(base))), "")


@functools.cache
def _texts(kind: type) -> dict[str, str]:
    found = _classes(kind.__module__).get(kind.__qualname__, []) if kind.__module__ != "builtins" else []
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in itertools.pairwise(found)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }


@functools.cache
def _classes(module: str) -> dict[str, list[Annotation]]:
    """The classes of a module by name, as its source writes them; none where there is no source."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    return {node.name: node.body for node in tree.body if isinstance(node, ast.ClassDef)}


def core(annotation: Annotation) -> tuple[Annotation, tuple[object, ...]]:
    """A type without "or None", and its annotations."""
    marks: tuple[object, ...] = ()
    while True:
        origin = get_origin(annotation)
        if origin is Annotated:
            annotation, *more = get_args(annotation)
            marks += tuple(more)
        elif origin in (typing.Union, types.UnionType):
            annotation = next(part for part in get_args(annotation) if part is not type(None))
        else:
            return annotation, marks


def quantity_of(annotation: Annotation) -> Quantity | None:
    """The unit and bounds of a field that is one number; None of any other."""
    return next((mark for mark in core(annotation)[1] if isinstance(mark, Quantity)), None)


def is_table(kind: Annotation) -> bool:
    """Whether a type is a description of its own, with fields."""
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def tables(annotation: Annotation) -> tuple[Annotation, Literal["one", "named", "list", ""]]:
    """The class of the tables in a field, and whether it is one, named ones or a list; (None, "") of none."""
    inner = core(annotation)[0]
    if is_table(inner):
        return inner, "one"
    if get_origin(inner) is dict and is_table(get_args(inner)[1]):
        return get_args(inner)[1], "named"
    if get_origin(inner) is tuple and is_table(get_args(inner)[0]):
        return get_args(inner)[0], "list"
    return None, ""


def table_names(annotation: Annotation, written: Iterable[str]) -> list[str]:
    """Names of the tables in a field of named ones: those that its type lists, or else the written ones."""
    names = get_args(core(annotation)[0])[0]
    return list(get_args(names)) if get_origin(names) is Literal else list(written)


def of_chambers(kind: Annotation) -> Annotation:
    """Type of the keys that a table has beside its fields, each a chamber; None where it has none."""
    extra = getattr(kind, "__annotations__", {}).get("__pydantic_extra__")
    return get_args(extra)[1] if extra else None


@functools.cache
def fields_of(kind: Annotation, name: str = "") -> dict[str, Leaf]:
    """The fields that a file writes in a table; of a law or friction `name` its parameters come first."""
    entry = SETS[kind].get(name) if kind in SETS else None
    found = {}
    for each in entry.parameters if entry else ():
        bounds = Annotated[float, Quantity(each.unit, at_least=each.lower, at_most=each.upper)]
        text, needed = f"{each.symbol}: {each.meaning}.", each.default is None
        found[each.name] = Leaf((each.name,), bounds, needed, each.default, text)
    for key, info in kind.model_fields.items():
        if key == "provenance" or (kind in SETS and key not in _RANGES):
            continue
        marked = Annotated[(info.annotation, *info.metadata)] if info.metadata else info.annotation
        default = None if info.is_required() or info.default_factory else info.default
        if info.default_factory_takes_validated_data:
            default = info.get_default(call_default_factory=True, validated_data={"joint": "ankle"})
        found[key] = Leaf((key,), marked, info.is_required() and kind not in SETS, default, kind)
    return found


def leaves(kind: Annotation, table: Mixed, path: Path = (), chambers: Iterable[str] = ()) -> Iterator[Leaf]:
    """Every field of a description below which there is none, also of tables that are not written."""
    table = table if isinstance(table, Mapping) else {}
    if kind is Scenario and isinstance(table.get("orthosis"), Mapping):
        chambers = list(table["orthosis"].get("chamber", {}))
    for name, leaf in fields_of(kind, path[-1] if path else "").items():
        yield from _below(replace(leaf, path=(*path, name)), table.get(name), chambers)
    inner = of_chambers(kind)
    for name in chambers if inner is not None else ():
        if is_table(core(inner)[0]):
            yield from leaves(inner, table.get(name), (*path, name))
        else:
            yield Leaf((*path, name), inner, False, None, "Of this chamber.")


def _below(leaf: Leaf, value: Mixed, chambers: Iterable[str]) -> Iterator[Leaf]:
    """A field itself, or what lies below."""
    kind, many = tables(leaf.annotation)
    if many == "named":
        written = value if isinstance(value, Mapping) else {}
        for name in table_names(leaf.annotation, written):
            yield from leaves(kind, written.get(name), (*leaf.path, name))
    elif many == "list" and value:
        for number, item in enumerate(value if isinstance(value, list | tuple) else ()):
            yield from leaves(kind, item, (*leaf.path, str(number)))
    elif many == "one":
        if kind in KINDS:
            yield leaf
        yield from leaves(kind, value, leaf.path, chambers)
    else:
        yield leaf


def type_below(annotation: Annotation, name: str, law: str = "") -> Annotation:
    """Type with bounds of an entry of a table or list; None if there may be none."""
    kind, many = tables(annotation)
    if many == "named":
        return kind
    if many == "list":
        return kind if name.isdigit() else None
    if many == "one":
        known = fields_of(kind, law)
        return known[name].annotation if name in known else of_chambers(kind)
    inner = core(annotation)[0]  # perhaps numbers by name
    return get_args(inner)[1] if get_origin(inner) is dict else None


def table_at(kind: Annotation, path: Path) -> Mixed:
    """The class of the table at a path, None where there is none."""
    for name in path:
        kind = type_below(kind, name)
    inner = core(kind)[0]
    return inner if is_table(inner) else None


@functools.cache
def references(kind: str) -> dict[Path, str]:
    """Where a text in a description is the name of another one, and of which kind; "*" is any name."""
    return dict(_references(SPECS[kind]))


def _references(kind: Annotation, path: Path = ()) -> Iterator[tuple[Path, str]]:
    for name, leaf in fields_of(kind).items():
        inner, many = tables(leaf.annotation)
        here = (*path, name, "*") if many == "named" else (*path, name)
        if many == "one" and inner in KINDS:
            yield here, KINDS[inner]
        if many in ("one", "named"):
            yield from _references(inner, here)


def files_of(kind: str) -> tuple[str, ...]:
    """Fields of a description that are files beside its own."""
    fields = fields_of(SPECS[kind]).items()
    return tuple(name for name, leaf in fields if core(leaf.annotation)[0] is pathlib.Path)


def nearest_key(
    path: Path, known: Iterable[Leaf], beside: Iterable[str] = (), root: object = None
) -> str | None:
    """The key that an unknown one most likely means, on whatever level."""
    # one beside it that holds half its letters goes before the same word in another table
    found = [(likeness(path[-1], name), 0.75, True, 0, name) for name in beside]
    for leaf in known:
        shared = sum(part in leaf.path for part in path[:-1])  # "orthosis.conductance" means an orthosis'
        there = holder(root, leaf.path) is not None
        found.append((likeness(path[-1], leaf.path[-1]), 0.01 * shared, there, -len(leaf.path), leaf.key))
    near = [entry for entry in found if entry[0] > 0.0]
    return max(near, key=lambda entry: (entry[0] + entry[1], *entry[2:4]))[4] if near else None


def child_of(node: Mixed, name: str) -> Mixed:
    """The entry of a table, description or list; None if there is none."""
    if type(node) is dict:
        return node.get(name)
    if isinstance(node, LawSet | FrictionSet) and name in node.parameters:
        return node.parameters[name]
    if isinstance(node, BaseModel):
        return dict(iter(node)).get(name)  # its fields, and chambers; `dict` itself would ask for `keys`
    if isinstance(node, Mapping):
        return node.get(name)
    if isinstance(node, list | tuple) and name.isdigit() and int(name) < len(node):
        return node[int(name)]
    return None


def holder(node: Mixed, path: Path) -> Mixed:
    """The table below a node that contains a field; None if there is none."""
    for name in path[:-1]:
        node = child_of(node, name)
    return node


def found_at(key: str, whole: Mixed) -> tuple[Annotation, Mixed]:
    """Type of what a dotted key leads to in a description, and its value, None where it is not described."""
    path, items = split_key(key)
    annotation: Annotation = type(whole)
    value: Mixed = whole
    for depth, name in enumerate(path):
        if tables(annotation)[1] == "list" and name.isdigit():
            annotation, value = _item(annotation, value, int(name), key)
            continue
        at, names = dotted_key(path[:depth]), names_in(annotation, value, whole)
        if name not in names:
            field = f"{at}.{name}" if at else name
            if not names:
                raise InputError(f"{at} is a value, not a table", field=field)
            raise unknown_key(field, name, names)
        annotation, value = type_below(annotation, name, _law_of(value)), child_of(value, name)
    for item in items:
        annotation, value = _item(annotation, value, item, key)
    return annotation, value


Described.read_key = lambda whole, key: found_at(key, whole)[1]


def _item(annotation: Annotation, value: Mixed, item: int, key: str) -> tuple[Annotation, Mixed]:
    """(type, value where there is one) of an item of a list."""
    if get_origin(core(annotation)[0]) is not tuple:
        raise InputError("is not a list, so it has no items", field=key)
    count = len(value) if isinstance(value, tuple) else 0
    if item >= count:
        allowed = f"[0] to [{count - 1}]" if count else "none: the list is empty here"
        raise InputError(f"there is no item [{item}]", field=key, allowed=allowed)
    return item_type(annotation, item), value[item]


def names_in(annotation: Annotation, value: Mixed, whole: Mixed) -> list[str]:
    """The fields of a table in a description."""
    kind, many = tables(annotation)
    if many == "named":
        return table_names(annotation, value or ())
    if many != "one":
        return [*value] if isinstance(value, Mapping) else []
    own = whole.orthosis.chamber if isinstance(whole, Scenario) else getattr(value, "chambers", ())
    return [*fields_of(kind, _law_of(value)), *(own if of_chambers(kind) is not None else ())]


def _law_of(table: Mixed) -> str:
    """The law or friction whose parameters a table holds; "" of any other table."""
    if isinstance(table, LawSet):
        return table.law
    return table.friction if isinstance(table, FrictionSet) else ""


@functools.lru_cache(maxsize=4096)  # cases of a sweep set the same keys
def split_key(dotted: str) -> tuple[Path, tuple[int, ...]]:
    """The names of a dotted key, and the item of a list at its end."""
    path: list[str] = []
    items: tuple[int, ...] = ()
    for part in dotted.split("."):
        found = re.fullmatch(r"([^\[\]]*)((?:\[[0-9]{1,6}\])*)", part)
        if found is None:
            raise InputError(
                "is not a valid key: an item of a list is its number in brackets, behind the list's name",
                field=dotted,
                allowed="as in insertion.from_joint[0], path[1].surface.radius or "
                "phases.dorsiflexor.inlet[0][1]",
            )
        path += [*map(str, items), ALSO.get(found[1], found[1])]
        items = tuple(int(item) for item in re.findall("[0-9]+", found[2]))
    return tuple(path), items


def dotted_key(path: Path) -> str:
    """The dotted key of a path, as `split_key` reads it: a number is an item of a list."""
    return "".join(f"[{part}]" if part.isdigit() else f".{part}" for part in path).removeprefix(".")


def unit_of(annotation: Annotation) -> str:
    """The SI unit of a field, "" of bare numbers, words and lists of several units."""
    inner, marks = core(annotation)
    units = {mark.unit for mark in marks if isinstance(mark, Quantity)}
    if get_origin(inner) is tuple:
        units |= {unit_of(item) for item in get_args(inner) if item is not Ellipsis}
    return units.pop() if len(units) == 1 else ""


def allowed(annotation: Annotation) -> str:
    """Allowed values of a field, in words."""
    inner, marks = core(annotation)
    quantity = quantity_of(annotation)
    if quantity is not None:
        return quantity.span
    if get_origin(inner) is Literal:
        return " or ".join(f'"{choice}"' for choice in get_args(inner))
    if get_origin(inner) is tuple:
        parts = [allowed(item) for item in get_args(inner) if item is not Ellipsis]
        if Ellipsis in get_args(inner):
            return f"a list, each item {parts[0]}"
        count = {2: "two", 3: "three"}.get(len(parts), str(len(parts)))
        return f"{count} of: {parts[0]}" if len(set(parts)) == 1 else f"{count}: {'; '.join(parts)}"
    if inner is bool:
        return "true or false"
    if inner is int:
        words = (("ge", "at least"), ("le", "at most"))
        bounds = [f"{word} {getattr(m, name)}" for name, word in words for m in marks if hasattr(m, name)]
        return f"a whole number, {' and '.join(bounds)}" if bounds else "a whole number"
    if is_table(inner):
        return "a name or a path" if inner in KINDS else f"a table with {', '.join(fields_of(inner))}"
    return "the path of a file" if inner is pathlib.Path else "a text"


def item_type(annotation: Annotation, number: int) -> Annotation:
    """Type of a list's items; None if unknown."""
    inner = core(annotation)[0]
    kinds = get_args(inner) if get_origin(inner) is tuple else ()
    if kinds and kinds[-1] is Ellipsis:
        return kinds[0]
    return kinds[number] if number < len(kinds) else None


def shown(value: Mixed, annotation: Annotation = None) -> str:
    """A value as a file writes it: SI numbers of a field in its usual unit, the rest as it is."""
    quantity = quantity_of(annotation)
    if isinstance(value, str) or value is None:
        return "" if value is None else value
    if isinstance(value, Mapping):
        return str(value.get("name", ""))
    if isinstance(value, list | tuple):
        return f"[{', '.join(shown(item, item_type(annotation, k)) for k, item in enumerate(value))}]"
    if isinstance(value, float) and quantity is not None and quantity.unit:
        return amount(value, quantity.unit)
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)
