"""A description being put together: names followed, dotted keys set, the file of each part kept."""

import copy
import functools
import json
import pathlib
import warnings
from collections.abc import Mapping

from afo_sim.common import Given, InputError, JsonDict, assets
from afo_sim.description import schema
from afo_sim.description.air.valve import CONDUCTANCE, make_room
from afo_sim.description.quantity import SET_BY_HAND

# fields that are files beside the TOML
FILES = {kind: names for kind in schema.SPECS if (names := schema.files_of(kind))}
SCENARIO_FILES = (*((table, key) for table, keys in FILES.items() for key in keys), ("gait", "cycle"))


class Tree:
    """A description being put together, and which file each part of it came from; its root is its own."""

    def __init__(self, kind: str, file: pathlib.Path | None, root: JsonDict):
        self.kind, self.root = kind, plain_keys(root, kind)
        self.files: dict[schema.Path, pathlib.Path | None] = {(): file}
        self.set_keys: set[schema.Path] = set()
        self.unfound: dict[schema.Path, InputError] = {}  # names that stand for nothing

    def forked(self) -> "Tree":
        """A tree that shares all tables with this one, which stays as it is."""
        found = copy.copy(self)
        found.root, found.files, found.set_keys = dict(self.root), dict(self.files), set()
        found.unfound = dict(self.unfound)
        return found

    def file_of(self, path: schema.Path) -> tuple[pathlib.Path | None, schema.Path]:
        """The file that a path is written in, and the path within that file."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.files:
                return self.files[path[:length]], path[length:]
        return None, path

    def place(self, path: schema.Path) -> JsonDict:
        """File, field and value of a path; no file where `--set` wrote it; that of a name that it set."""
        file, inner = self.file_of(path)
        depth = len(path) - len(inner)  # of the file
        if any(len(k) > depth and (path[: len(k)] == k or k[: len(path)] == path) for k in self.set_keys):
            file = None
        inner = path if file is None else inner
        value = value_at(self.root, path)
        return {"file": file, "field": ".".join(inner), "value": None if isinstance(value, dict) else value}

    def follow(self, path: schema.Path) -> None:
        """Replace the name at `path`, if it is a reference, by what it names."""
        kind = _references(self.kind, path).get(())
        table = schema.holder(self.root, path)
        if kind is None or not isinstance(table, dict) or not isinstance(table.get(path[-1]), str):
            return
        beside, inner = self.file_of(path)
        try:
            found, self.files[path] = read_named(kind, table[path[-1]], beside)
        except InputError as error:
            raise error.replaced(file=beside, field=".".join(inner)) from None
        table[path[-1]] = plain_keys(found, kind)

    def follow_all(self, path: schema.Path = (), table: Given = None) -> None:
        """Follow every reference at and below `path`, a key of `table`; `unfound` has what is not found."""
        if path:
            try:
                self.follow(path)
            except InputError as error:
                self.unfound[path] = error
        node = table[path[-1]] if path else self.root
        if isinstance(node, dict) and any(_references(self.kind, path)):
            if path:
                node = table[path[-1]] = dict(node)
            for key in list(node):
                self.follow_all((*path, key), node)

    def set(self, dotted: str, value: Given) -> None:
        """Put a value at a dotted key, following references on the way down."""
        path, items = schema.split_key(dotted)
        value = plain_keys(value, path[-1])
        self.set_keys.add((*path, *map(str, items)))
        node: Given = self.root
        for depth, key in enumerate(path[:-1], start=1):
            self.follow(path[:depth])
            if isinstance(node, list):
                child = _table_in(node, key, dotted, value)
            elif key.isdigit() and node:
                allowed = ", ".join(f"{schema.dotted_key(path[: depth - 1])}.{name}" for name in node)
                raise InputError("is a table of names, not a list", field=dotted, allowed=allowed)
            else:
                make_room(node, key)
                child = node.setdefault(key, [] if path[depth].isdigit() else {})
            if isinstance(child, list) and not path[depth].isdigit():
                allowed = f"as in {schema.dotted_key(path[:depth])}[0].{schema.dotted_key(path[depth:])}"
                raise InputError("is a list here: name one of its items", field=dotted, allowed=allowed)
            if not isinstance(child, dict | list):
                problem = f"{schema.dotted_key(path[:depth])} is a value, not a table"
                raise InputError(problem, field=dotted, value=value)
            own = copy.copy(child)  # what was given stays as it was
            node[int(key) if isinstance(node, list) else key] = own
            node = own
        if isinstance(node, list):
            raise InputError("is an item of a list: name one of its fields", field=dotted, value=value)
        if items:
            value = _with_item(node.get(path[-1]), items, value, dotted)
        replaces = make_room(node, path[-1]) and path[-1] == CONDUCTANCE
        if replaces or (isinstance(node.get(path[-1]), dict) and "value" in node[path[-1]]):
            value = {"value": value, "source": SET_BY_HAND, "kind": "user"}
        node[path[-1]] = value
        self.files = {place: file for place, file in self.files.items() if place[: len(path)] != path}


@functools.lru_cache(maxsize=1024)  # every description of a kind has the same places
def _references(kind: str, path: schema.Path) -> dict[schema.Path, str]:
    """Kinds of what names at and below `path` refer to, by the rest of the way to them."""
    return {
        pattern[len(path) :]: referred
        for pattern, referred in schema.references(kind).items()
        if len(pattern) >= len(path) and all(p in ("*", key) for p, key in zip(pattern, path, strict=False))
    }


def plain_keys(node: Given, name: str) -> Given:
    """A description as it is written, at a name, with the one word for each key that has several."""
    if not isinstance(node, dict | list):
        return node
    # far faster than to look at every key, of which few have two words
    text = json.dumps(node, default=id, skipkeys=True)
    return _renamed(node, name) if any(f'"{word}": ' in text for word in schema.ALSO_OF_LEG) else node


def _renamed(node: Given, name: str) -> Given:
    if isinstance(node, list):
        return [_renamed(item, "") for item in node]
    if type(node) is not dict:
        return node
    words = schema.ALSO_OF_LEG if name == "leg" else schema.ALSO
    return {
        key if words.get(key) in node else words.get(key, key): _renamed(value, key)
        for key, value in node.items()
    }


def _table_in(items: list[Given], number: str, dotted: str, value: Given) -> Given:
    if not number.isdigit() or int(number) >= len(items):
        allowed = f"[0] to [{len(items) - 1}]" if items else "none: the list is empty"
        problem = f"there is no item [{number}]" if number.isdigit() else "is a list: name one of its items"
        raise InputError(problem, field=dotted, value=value, allowed=allowed)
    return items[int(number)]


def _with_item(old: Given, items: tuple[int, ...], value: Given, dotted: str) -> Given:
    """A copy of a list, perhaps of lists, in which one item is replaced."""
    if not items:
        return value
    if isinstance(old, dict) and "value" in old:
        old = old["value"]
    if not isinstance(old, list | tuple):
        raise InputError("is not a list here, so it has no items", field=dotted, value=value)
    if items[0] >= len(old):
        allowed = f"[0] to [{len(old) - 1}]" if old else "none: the list is empty"
        raise InputError(f"there is no item [{items[0]}]", field=dotted, value=value, allowed=allowed)
    replaced = list(old)
    replaced[items[0]] = _with_item(old[items[0]], items[1:], value, dotted)
    return replaced


def read_named(
    kind: str, name: str, beside: pathlib.Path | None = None
) -> tuple[JsonDict, pathlib.Path | None]:
    """The dict of a description that a name or a path means, and its file; None of a registered one."""
    if (kind, name) in assets.OWN:
        return copy.deepcopy(assets.OWN[kind, name]), None
    file = assets.find(kind, name, beside)
    return read_table(kind, file), file


def read_table(kind: str, file: pathlib.Path) -> JsonDict:
    """A description's TOML as a dict, named after its file, with the files beside it resolved."""
    table = assets.read_toml(file)
    table.setdefault("name", file.stem if kind == "scenario" else file.resolve().parent.name)
    for name, key in SCENARIO_FILES if kind == "scenario" else ():
        part = table.get(name)
        if isinstance(part, dict) and isinstance(part.get(key), str):
            part[key] = assets.file_beside(part[key], file)
    for key in FILES.get(kind, ()):
        if isinstance(table.get(key), str):
            found = pathlib.Path(assets.file_beside(table[key], file))  # beside, or shipped
            table[key] = str(found if found.is_absolute() else (file.parent / found).resolve())
    return table


def value_at(node: Given, path: schema.Path) -> Given:
    """Value written at a path, None where nothing is; of { value = …, source = … } the value."""
    if path:
        node = schema.child_of(schema.holder(node, path), path[-1])
    return node["value"] if isinstance(node, Mapping) and "value" in node else node


# Tables of former versions, by (table, key): what stands for it now.
RETIRED = {
    ("controller", "impedance"): "a function of your own, afo_sim.run(…, controller=…): a few lines, "
    "docs/controllers.md; or [controller.pid]",
    ("leg", "subtalar"): "a leg without it: the foot does not turn to its side, and peak_inversion_moment is "
    "of the muscles about the ankle",
}


def leave_out(tree: Tree) -> None:
    """Take out of a description what nothing reads any more; InputError where a run would depend on it."""
    for (table, key), instead in RETIRED.items():
        own = tree.kind == table
        part = tree.root if own else tree.root.get(table)
        if not isinstance(part, dict) or key not in part:
            continue
        rest = {name: value for name, value in part.items() if name != key}
        if part[key] is not None:  # as a recording has what was not described
            where = tree.place((key,) if own else (table, key))
            # the hinge did not turn in recorded walking, and a leg alone does not run
            if key == "impedance" or not (own or tree.root.get("gait")):
                raise InputError("is retired", **where, allowed=instead)
            warnings.warn(str(InputError("is retired, and has no effect here", **where)), stacklevel=4)
        if own:
            tree.root = rest
        else:
            tree.root[table] = rest
