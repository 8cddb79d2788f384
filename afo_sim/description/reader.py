"""TOML → description: follow the names of legs, orthoses, muscles and valves, apply --set, check.

`Any` is what a file or a user gives before it is read, or a part of one of the description's kinds.
"""

import copy
import os
import re
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar, overload

import numpy as np
from pydantic import BaseModel, ValidationError

from afo_sim.common import MOST_FAULTS, InputError, Shown, assets, nearest_name, refuse, takes, unknown
from afo_sim.description import schema
from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.source import Source as GasSource
from afo_sim.description.air.tube import Tube
from afo_sim.description.control.sensor import SensorType
from afo_sim.description.leg import Leg, Shoe
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import Orthosis, Valve
from afo_sim.description.quantity import SET_BY_HAND, Described
from afo_sim.description.scenario import Scenario
from afo_sim.description.schema import split_key as split_key
from afo_sim.description.tree import Tree, leave_out, read_named, value_at
from afo_sim.description.walking import Limits, Patient


@dataclass(frozen=True, eq=False)
class Base:
    """A description from which others are read that differ in some keys; its parts are checked."""

    tree: Tree
    parts: Mapping[str, Described]

    @classmethod
    def of(cls, kind: str, source: "_Source") -> "Base":
        """Of a description that may need those keys to be one: it has no parts then."""
        tree = _tree(kind, source)
        tree.follow_all()
        with suppress(InputError, ValidationError), warnings.catch_warnings(action="ignore"):
            whole = tree.forked()
            leave_out(whole)
            kept = {name for name, table in whole.root.items() if table is tree.root[name]}
            parts = {n: part for n, part in _described(whole) if n in kept and isinstance(part, Described)}
            return cls(tree, parts)
        return cls(tree, {})


_Source = str | os.PathLike[str] | Mapping[str, Any] | Described | Base
_Sets = Mapping[str, Any] | None
D = TypeVar("D", bound=Described)
USUAL_LIMITS = "usual"
LONG = 10**15  # number that a title leaves out
MOST_KEPT = 1000  # parts of descriptions; a scenario has some 60
KEPT: dict[Any, Any] = {}  # parts by class and table: the cases of a sweep share what they do not change
# pydantic's kinds of error in our words, and what lists look like
PROBLEMS = {
    "missing": "is missing", "extra_forbidden": "is an unknown key", "dict_type": "is not a table",
    "tuple_type": "is not a list", "too_long": "has too many items", "too_short": "has too few items",
    "literal_error": "is not a valid choice", "int_type": "is not a whole number",
    "int_parsing": "is not a whole number", "int_from_float": "is not a whole number",
    "string_type": "is not a text", "string_too_short": "is empty", "greater_than_equal": "is out of range",
    "greater_than": "is out of range", "less_than_equal": "is out of range", "less_than": "is out of range",
}  # fmt: skip
_FORMS = {
    "from_joint": '["6 cm", "0 cm", "30 cm"]',
    "axis": "[0.0, 1.0, 0.0]",
    "path": '[{ segment = "shank", from_joint = ["6 cm", "0 cm", "5 cm"] }]',
    "range_of_motion": '["-20 deg", "20 deg"]',
    "inlet": '[["0 s", "4 s"]]',
    "outlet": '[["4 s", "8 s"]]',
    "count": "1 to 20",
    "freedom": "at least 1",
    "critical_ratio": "0 to 0.9; makers seldom print it, and 0.3 is usual for small poppet valves: "
    'critical_ratio = { value = 0.3, kind = "assumed", source = "usual for small poppet valves" }',
}


@dataclass(frozen=True)
class Reading(Generic[D]):
    """A description, and the tree of files and set keys that it was read from."""

    description: D
    tree: Tree


@overload
def load(kind: Literal["scenario"], source: _Source, sets: _Sets = None) -> Scenario: ...
@overload
def load(kind: Literal["leg"], source: _Source, sets: _Sets = None) -> Leg: ...
@overload
def load(kind: Literal["orthosis"], source: _Source, sets: _Sets = None) -> Orthosis: ...
@overload
def load(kind: Literal["muscle"], source: _Source, sets: _Sets = None) -> Muscle: ...
@overload
def load(kind: Literal["valve"], source: _Source, sets: _Sets = None) -> Valve: ...
@overload
def load(kind: Literal["tube"], source: _Source, sets: _Sets = None) -> Tube: ...
@overload
def load(kind: Literal["source"], source: _Source, sets: _Sets = None) -> GasSource: ...
@overload
def load(kind: Literal["regulator"], source: _Source, sets: _Sets = None) -> Regulator: ...
@overload
def load(kind: Literal["patient"], source: _Source, sets: _Sets = None) -> Patient: ...
@overload
def load(kind: Literal["shoe"], source: _Source, sets: _Sets = None) -> Shoe: ...
@overload
def load(kind: Literal["limits"], source: _Source, sets: _Sets = None) -> Limits: ...
@overload
def load(kind: Literal["sensor"], source: _Source, sets: _Sets = None) -> SensorType: ...
@overload
def load(kind: str, source: _Source, sets: _Sets = None) -> Described: ...
def load(kind: str, source: _Source, sets: _Sets = None) -> Described:
    """Read a description.

    Parameters
    ----------
    kind : "scenario", "leg", "orthosis", "muscle", "valve", "tube", "source", "regulator", "patient", "shoe",
        "limits" or "sensor"
    source : a shipped name, a path, or the description itself, read already or as a dict
    sets : dotted keys and their values, as `--set` takes them; "key[0]" is an item of a list

    Returns
    -------
    the frozen Scenario, Leg, Orthosis, Muscle, Valve, Tube, Source, Regulator, Patient, Shoe, Limits or
    SensorType

    Raises
    ------
    InputError
        The first error, with file, field, value and what is allowed; `others`
        holds the rest.

    Examples
    --------
    >>> seated = load("scenario", "seated", {"supply.pressure": "3 bar"})
    >>> seated.supply.pressure  # [Pa]
    300000.0
    >>> load("muscle", "dmsp_20").law
    'sarosi_2012'
    """
    if kind in schema.SPECS and isinstance(source, schema.SPECS[kind]):
        return with_keys(source, sets) if sets else source
    return read(kind, source, sets).description


def read(kind: str, source: _Source, sets: _Sets = None) -> Reading[Any]:
    """A description with its sources; parameters and errors as of `load`."""
    _require_table(sets)
    base = source if isinstance(source, Base) else None
    tree = _tree(kind, source) if base is None else base.tree.forked()
    changed = {}
    # a whole before its parts
    for key in sorted(sets or {}, key=lambda key: (key.count("."), key.count("["))):
        value, (path, items) = _plain((sets or {})[key]), split_key(key)
        if value_at(tree.root, (*path, *map(str, items))) != value:
            changed[key] = value
        tree.set(key, value)
        if base is not None and isinstance(table := schema.holder(tree.root, path), dict):
            tree.unfound = {at: told for at, told in tree.unfound.items() if at[: len(path)] != path}
            tree.follow_all(path, table)
    if base is None:
        tree.follow_all()
    leave_out(tree)
    for key, value in changed.items():
        _say_what_is_set(tree.root, key, value)
    try:
        description = _described(tree, base)
    except ValidationError as error:
        problems = _problems(tree, error)
    else:
        problems = list(tree.unfound.values())
    refuse(problems)
    return Reading(description, tree)


def _described(tree: Tree, base: Base | None = None) -> Any:
    if len(KEPT) > MOST_KEPT:
        KEPT.clear()
    table = dict(tree.root)
    if base is not None:
        same = (name for name in base.parts if table.get(name) is base.tree.root[name])
        table |= {name: base.parts[name] for name in same}
    return schema.SPECS[tree.kind].model_validate(table, context={"kept": (KEPT, table)})


def with_keys(description: D, sets: Mapping[str, Any]) -> D:
    """A copy of a description with dotted keys set, checked as a file's are."""
    _require_table(sets)
    kind = schema.KINDS[type(description)]
    table = description.model_dump(mode="json", exclude_none=True)
    for key in sets:  # whose source is the user, where a number names one
        path = split_key(key)[0]
        owner = schema.holder(table, path)
        sources = owner.get("provenance") if isinstance(owner, dict) else None
        if sources and path[-1] in sources:
            sources[path[-1]] = {"kind": "user", "source": SET_BY_HAND}
    return read(kind, table, sets).description


def expand(kind: str, source: _Source) -> dict[str, Any]:
    """A description as one dict with every name followed, which `load` takes without reading a file."""
    tree = _tree(kind, source)
    tree.follow_all()
    refuse(tree.unfound.values())
    return copy.deepcopy(tree.root)


def _require_table(sets: Any) -> None:
    if sets is not None and not isinstance(sets, Mapping):
        example = '{"supply.pressure": "3 bar"}'
        problem = "is not a dict of keys and values"
        raise InputError(problem, field="sets", value=sets, allowed="as in " + example)


def _tree(kind: str, source: Any) -> Tree:
    """A description as written; a scenario without limits gets the usual ones."""
    if kind not in schema.SPECS:
        raise unknown(kind, schema.SPECS, field="kind", problem="is not a kind of description")
    if isinstance(source, Mapping) and not isinstance(source, Shown):  # a result is none
        tree = Tree(kind, None, dict(source))
    elif isinstance(source, str | os.PathLike):
        table, file = read_named(kind, os.fspath(source))
        tree = Tree(kind, file, table)
    else:
        raise InputError("is not a description", field=kind, value=source, allowed="a name, a path or a dict")
    if kind == "scenario":
        tree.root.setdefault("limits", USUAL_LIMITS)
    return tree


def _problems(tree: Tree, error: ValidationError) -> list[InputError]:
    """Each validation error once, as a message for people: unfound names, unknown keys, then the rest."""
    found = list(tree.unfound.values())
    entries = [(entry, _path(entry)) for entry in error.errors(include_url=False)[:MOST_FAULTS]]
    derived = "default_factory_not_called"  # of a default that follows from a refused field
    entries = [(e, path) for e, path in entries if path not in tree.unfound and e["type"] != derived]
    unknown = [(entry, path) for entry, path in entries if entry["type"] == "extra_forbidden"]
    strange = [_unknown_key(tree, path) for _, path in unknown]
    meant = {(*path[:-1], problem.nearest) for (_, path), problem in zip(unknown, strange, strict=True)}
    found += strange
    for entry, path in entries:
        misspelt = entry["type"] == "missing" and path in meant
        if entry["type"] != "extra_forbidden" and not misspelt:
            found.append(_problem(tree, entry, path))
    return found


def _path(entry: Any) -> schema.Path:
    """The place that a validation error is about, as the file writes it."""
    facts = entry.get("ctx", {})
    path = tuple(str(part) for part in entry["loc"])
    if facts.get("beside"):
        path = (*path[:-1], facts["beside"])
    if facts.get("key"):
        path += tuple(facts["key"].split("."))
    if "provenance" in path[:-1]:  # of a { value, source, kind } table: where it was written
        at = path.index("provenance")
        path = (*path[:at], *path[at + 1].split("."), *path[at + 2 :])
    if {"laws", "frictions"} & {*path} and "parameters" in path:  # of a law's flat table
        path = tuple(part for part in path if part != "parameters")
    return path


def _problem(tree: Tree, entry: Any, path: schema.Path) -> InputError:
    facts = entry.get("ctx", {})
    name = next((part for part in reversed(path) if not part.isdigit()), "")
    expected = facts.get("allowed", "") or facts.get("expected", "")
    table = schema.table_at(schema.SPECS[tree.kind], path[:-1])
    leaf = schema.fields_of(table).get(name) if table else None  # none of a { value, source, kind } table
    # a chamber's inlet is no list
    if not expected and not (leaf and schema.tables(leaf.annotation)[1] == "one"):
        expected = _FORMS.get(name, "")
    if entry["type"] == "dict_type":
        expected = f"tables of their own, [{tree.place(path)['field']}.NAME]"
    if not expected and "min_length" in facts:
        expected = f"at least {facts['min_length']}"
    if not expected and leaf and PROBLEMS.get(entry["type"]) == "is out of range":
        expected = schema.allowed(leaf.annotation)
    if entry["type"] == "missing" and leaf and not expected:
        expected = f"{schema.allowed(leaf.annotation)} ({' '.join(leaf.meaning.split()).rstrip('.')})"
    nearest = facts.get("nearest") or None
    if entry["type"] == "literal_error" and isinstance(entry["input"], str):
        nearest = nearest_name(entry["input"], re.findall("'([^']+)'", expected))
    problem = PROBLEMS.get(entry["type"], entry["msg"])
    return InputError(problem, **tree.place(path), allowed=str(expected), nearest=nearest)


def _unknown_key(tree: Tree, path: schema.Path) -> InputError:
    """An unknown key, with the nearest one on whatever level."""
    spec = schema.SPECS[tree.kind]
    table = schema.table_at(spec, path[:-1])
    names = list(schema.fields_of(table)) if table else []
    place = tree.place(path)
    word = schema.ALSO_OF_LEG.get(path[-1])
    if word in names and value_at(tree.root, (*path[:-1], word)) is not None:  # both are left by `plain_keys`
        return InputError(f"is a synonym of {word}, which is also given", **place, allowed=f"{word} alone")
    written_in, inner = tree.file_of(path)
    within = path[: len(path) - len(inner)] if place["file"] == written_in else ()
    known = [leaf for leaf in schema.leaves(spec, tree.root) if leaf.path[: len(within)] == within]
    nearest = schema.nearest_key(path, known, names, tree.root)
    if nearest and nearest not in names:
        nearest = ".".join(nearest.split(".")[len(within) :])
    return InputError("is an unknown key", **place, allowed=", ".join(names), nearest=nearest)


def _say_what_is_set(table: Any, key: str, value: Any) -> None:
    """Begin each description above a key with it and its value: the words behind may hold no more."""
    short = isinstance(value, str | float) or (isinstance(value, int) and abs(value) < LONG)
    path = split_key(key)[0]
    for depth, name in enumerate(path):
        told = table.get("description") if isinstance(table, dict) else None
        if isinstance(told, str) and path[-1] not in ("description", "name"):
            now = f"set {schema.dotted_key(path[depth:])}{key[len(schema.dotted_key(path)) :]}"
            stale = f"{now}=", f"{now}.", f"{now}["  # of the same key, or of one below it
            before = [part for part in told.split("; ") if part and not f"{part}=".startswith(stale)]
            table["description"] = "; ".join([f"{now}={value}" if short else now, *before])
        table = schema.child_of(table, name)


def unchanged(description: str) -> tuple[str, int]:
    """A description without what `_say_what_is_set` has put before it."""
    parts = description.split("; ")
    kept = [part for part in parts if not part.startswith("set ")]
    return "; ".join(kept), len(parts) - len(kept)


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return {key: _plain(item) for key, item in value.items()} if isinstance(value, Mapping) else value


Scenario.with_keys = with_keys


def _add(part: Any) -> None:
    """Make a description available by its name, like a shipped one."""
    kind = schema.KINDS[type(part)]
    if part.name in assets.names(kind) and (kind, part.name) not in assets.OWN:
        if part == load(kind, part.name):  # as a module has it that changes it
            return
        allowed = f'another name: load("{kind}", …, {{"name": "my_{kind}"}})'
        raise InputError(f"is the name of a shipped {kind}", field="name", value=part.name, allowed=allowed)
    if not part.name:
        allowed = f'a name: load("{kind}", …, {{"name": "my_{kind}"}})'
        raise InputError("has no name", field="register", value=part, allowed=allowed)
    assets.OWN[kind, part.name] = part.model_dump(mode="json", exclude_none=True)


for _part in schema.KINDS.keys() - {Scenario}:
    takes(_part, _add)
