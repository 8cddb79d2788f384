"""TOML → spec: follow the names of legs, orthoses, muscles and valves, apply --set, check."""

import copy
import os
import pathlib
import re
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.description.scenario import Leg, Muscle, Orthosis, Scenario, Valve
from afo_sim.description.walking import Patient

Path = tuple[str, ...]
SPECS: dict[str, type[BaseModel]] = {
    "scenario": Scenario,
    "leg": Leg,
    "orthosis": Orthosis,
    "muscle": Muscle,
    "valve": Valve,
    "patient": Patient,
}
# A string at such a place is the name of another description; "*" is any key.
REFERENCES: dict[str, dict[Path, str]] = {
    "scenario": {
        ("leg",): "leg",
        ("orthosis",): "orthosis",
        ("patient",): "patient",
        ("orthosis", "muscle", "*", "type"): "muscle",
        ("orthosis", "chamber", "*", "inlet"): "valve",
        ("orthosis", "chamber", "*", "outlet"): "valve",
    },
    "orthosis": {
        ("muscle", "*", "type"): "muscle",
        ("chamber", "*", "inlet"): "valve",
        ("chamber", "*", "outlet"): "valve",
    },
}
# pydantic's kinds of error in our words, and what lists look like
PROBLEMS = {
    "missing": "is missing",
    "extra_forbidden": "is an unknown key",
    "tuple_type": "is not a list",
    "too_long": "has too many items",
    "literal_error": "is no choice",
    "int_type": "is not a whole number",
    "int_parsing": "is not a whole number",
    "int_from_float": "is not a whole number",
    "string_type": "is not a text",
}
FORMS = {
    "from_ankle": '["6 cm", "0 cm", "30 cm"]',
    "range_of_motion": '["-20 deg", "20 deg"]',
    "inlet": '[["0 s", "4 s"]]',
    "outlet": '[["4 s", "8 s"]]',
    "count": "1 to 20",
}
FILES = {"leg": ("file",), "orthosis": ("cuff", "plate")}  # fields that are files beside the TOML
SCENARIO_FILES = (*((table, key) for table, keys in FILES.items() for key in keys), ("gait", "cycle"))


class _Tree:
    """A description being put together, and which file each part of it came from."""

    def __init__(self, kind: str, file: pathlib.Path | None, root: dict[str, Any]):
        self.kind, self.root = kind, root
        self.files: dict[Path, pathlib.Path | None] = {(): file}

    def file_of(self, path: Path) -> tuple[pathlib.Path | None, Path]:
        """The file that a path is written in, and the path within that file."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.files:
                return self.files[path[:length]], path[length:]
        return None, path

    def follow(self, path: Path) -> None:
        """Replace the name at `path`, if it is a reference, by what it names."""
        kind = self._reference(path)
        holder = self._holder(path)
        if kind is None or holder is None or not isinstance(holder.get(path[-1]), str):
            return
        beside, inner = self.file_of(path)
        try:
            file = assets.find(kind, holder[path[-1]], beside)
        except InputError as error:
            raise InputError(
                error.problem,
                file=beside,
                field=".".join(inner),
                value=error.value,
                allowed=error.allowed,
                nearest=error.nearest,
            ) from None
        holder[path[-1]] = read_table(kind, file)
        self.files[path] = file

    def follow_all(self, path: Path = ()) -> None:
        """Follow every reference at and below `path`."""
        if path:
            self.follow(path)
        if not self._may_hold_references(path):
            return
        holder = self._holder(path)
        node = self.root if not path else (holder or {}).get(path[-1])
        if isinstance(node, dict):
            for key in list(node):
                self.follow_all((*path, key))

    def set(self, dotted: str, value: Any) -> None:
        """Put a value at a dotted key, following references on the way down."""
        path, items = split_key(dotted)
        node = self.root
        for depth, key in enumerate(path[:-1], start=1):
            self.follow(path[:depth])
            child = node.setdefault(key, {})
            if not isinstance(child, dict):
                raise InputError(
                    f"{'.'.join(path[:depth])} is a value, not a table", field=dotted, value=value
                )
            node = child
        if items:
            value = _with_item(node.get(path[-1]), items, value, dotted)
        if isinstance(node.get(path[-1]), dict) and "value" in node[path[-1]]:
            value = {"value": value, "source": "set for this run", "kind": "user"}
        node[path[-1]] = value

    def _may_hold_references(self, path: Path) -> bool:
        """Whether a reference can stand below `path`."""
        return any(
            len(pattern) > len(path) and all(p in ("*", key) for p, key in zip(pattern, path, strict=False))
            for pattern in REFERENCES.get(self.kind, {})
        )

    def _reference(self, path: Path) -> str | None:
        for pattern, kind in REFERENCES.get(self.kind, {}).items():
            if len(pattern) == len(path) and all(
                p in ("*", key) for p, key in zip(pattern, path, strict=True)
            ):
                return kind
        return None

    def _holder(self, path: Path) -> dict[str, Any] | None:
        node: Any = self.root
        for key in path[:-1]:
            node = node.get(key) if isinstance(node, dict) else None
        return node if isinstance(node, dict) else None


def split_key(dotted: str) -> tuple[Path, tuple[int, ...]]:
    """The names of a dotted key, and the item of a list at its end.

    "gait.seed" → (("gait", "seed"), ()) and "phases.dorsiflexor.inlet[0][1]" →
    (("phases", "dorsiflexor", "inlet"), (0, 1)).
    """
    names, bracket, rest = dotted.partition("[")
    if bracket and not re.fullmatch(r"[0-9]{1,6}\](?:\[[0-9]{1,6}\])*", rest):
        raise InputError(
            "is no key: an item of a list is its number in brackets, at the end",
            field=dotted,
            allowed="as in insertion.from_ankle[0] or phases.dorsiflexor.inlet[0][1]",
        )
    return tuple(names.split(".")), tuple(int(item) for item in re.findall("[0-9]+", rest))


def _with_item(told: Any, items: tuple[int, ...], value: Any, dotted: str) -> Any:
    """A copy of a list, perhaps of lists, in which one item is replaced."""
    if not items:
        return value
    if isinstance(told, dict) and "value" in told:
        told = told["value"]
    if not isinstance(told, list | tuple):
        raise InputError("is not a list here, so it has no items", field=dotted, value=value)
    if items[0] >= len(told):
        allowed = f"[0] to [{len(told) - 1}]" if told else "none: the list is empty"
        raise InputError(f"there is no item [{items[0]}]", field=dotted, value=value, allowed=allowed)
    replaced = list(told)
    replaced[items[0]] = _with_item(told[items[0]], items[1:], value, dotted)
    return replaced


def read_table(kind: str, file: pathlib.Path) -> dict[str, Any]:
    """A description's TOML as a dict, named after its file, with the files beside it resolved."""
    table = assets.read_toml(file)
    table.setdefault("name", file.stem if kind == "scenario" else file.resolve().parent.name)
    for name, key in SCENARIO_FILES if kind == "scenario" else ():
        holder = table.get(name)
        if isinstance(holder, dict) and isinstance(holder.get(key), str):
            holder[key] = assets.file_beside(holder[key], file)
    for key in FILES.get(kind, ()):
        if isinstance(table.get(key), str):
            table[key] = str((file.parent / table[key]).resolve())
    return table


def load(
    kind: str, source: str | os.PathLike[str] | Mapping[str, Any], sets: Mapping[str, Any] | None = None
) -> Any:
    """Read a description.

    Parameters
    ----------
    kind : "scenario", "leg", "orthosis", "muscle" or "valve"
    source : a shipped name, a path, or the description itself as a dict
    sets : dotted keys and their values, as `--set` takes them; "key[0]" is an item of a list

    Returns
    -------
    the frozen Scenario, Leg, Orthosis, Muscle or Valve

    Raises
    ------
    InputError
        The first thing that is wrong, with its file, field, value and what is allowed.
    """
    if isinstance(source, Mapping):
        file, root = None, copy.deepcopy(dict(source))
    elif isinstance(source, str | os.PathLike):
        file = assets.find(kind, os.fspath(source))
        root = read_table(kind, file)
    else:
        raise InputError("is no description", field=kind, value=source, allowed="a name, a path or a dict")
    tree = _Tree(kind, file, root)
    # a whole before its parts
    for key in sorted(sets or {}, key=lambda key: (key.count("."), key.count("["))):
        tree.set(key, (sets or {})[key])
    tree.follow_all()
    try:
        return SPECS[kind].model_validate(tree.root)
    except ValidationError as error:
        raise _input_error(tree, error, set(sets or {})) from None


def expand(kind: str, source: str | os.PathLike[str]) -> dict[str, Any]:
    """A description as one dict with every name followed, which `load` takes without reading a file."""
    file = assets.find(kind, os.fspath(source))
    tree = _Tree(kind, file, read_table(kind, file))
    tree.follow_all()
    return tree.root


def _input_error(tree: _Tree, error: ValidationError, sets: set[str]) -> InputError:
    """The first validation error, as a message for people."""
    first = error.errors(include_url=False)[0]
    facts = first.get("ctx", {})
    path = tuple(str(part) for part in first["loc"])
    if facts.get("key"):
        path += tuple(facts["key"].split("."))
    if "provenance" in path[:-1]:  # of a { value, source, kind } table: where it was written
        at = path.index("provenance")
        path = (*path[:at], *path[at + 1].split("."), *path[at + 2 :])
    file, inner = tree.file_of(path)
    dotted = ".".join(path)
    sets = {key.replace("[", ".").replace("]", "") for key in sets}
    if any(dotted == key or dotted.startswith(key + ".") or key.startswith(dotted + ".") for key in sets):
        file, inner = None, path
    value = _value_at(tree.root, path)
    problem = PROBLEMS.get(first["type"], first["msg"])
    name = next((part for part in reversed(path) if not part.isdigit()), "")
    return InputError(
        problem,
        file=file,
        field=".".join(inner),
        value=None if isinstance(value, dict) else value,
        allowed=str(facts.get("allowed", "") or facts.get("expected", "") or FORMS.get(name, "")),
        nearest=facts.get("nearest") or None,
    )


def _value_at(node: Any, path: Path) -> Any:
    for key in path:
        if isinstance(node, dict):
            node = node.get(key)
        elif isinstance(node, list | tuple) and key.isdigit() and int(key) < len(node):
            node = node[int(key)]
        else:
            return None
    return node["value"] if isinstance(node, dict) and "value" in node else node
