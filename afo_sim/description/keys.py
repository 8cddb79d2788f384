"""Every key of a description that can be set: value, unit, range, meaning, and where the value comes from."""

import os
import pathlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from afo_sim.common import assets
from afo_sim.description.leaves import Leaf, Path, core, leaves
from afo_sim.description.quantity import Provenance, Whole
from afo_sim.description.ranges import allowed, shown, unit_of
from afo_sim.description.reader import SPECS, Reading, read
from afo_sim.description.tree import child_of, value_at


@dataclass(frozen=True)
class Key:
    """A settable key. `value` is as it is written, `unit` the SI unit, "" of bare numbers and words.

    `source` is the file that the value stands in, "default", or "set"; `kind` and `reference` are of the
    number's provenance, "" where the file tells none.
    """

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
        """Whether a word stands in the key or in its meaning."""
        return word.lower() in self.key.lower() or word.lower() in self.meaning.lower()


def keys(
    source: str | os.PathLike[str] | Mapping[str, Any],
    word: str = "",
    sets: Mapping[str, Any] | None = None,
    kind: str = "scenario",
    *,
    whole: bool = False,
) -> list[Key]:
    """Settable keys of a description, with their present values.

    Parameters
    ----------
    source : a shipped name, a path, or the description as a dict
    word : only keys that mention it
    sets : dotted keys and their values, as `load` takes them
    kind : "scenario", "leg", "orthosis", "muscle", "valve", "tube", "source", "regulator", "patient", "shoe"
        or "limits"
    whole : also lists that are written only as a whole, such as correlations: no key sets them

    Returns
    -------
    list of Key, in the description's order; an item of a list is a key of its own

    Raises
    ------
    InputError
        As `load`.
    """
    reading = read(kind, source, sets)
    found = (
        key
        for leaf in leaves(SPECS[kind], reading.tree.root)
        if holder(reading.description, leaf.path) is not None and (whole or not _is_whole(leaf.annotation))
        for key in _keys_of(reading, leaf)
    )
    return [key for key in found if key.mentions(word)]


def holder(description: BaseModel, path: Path) -> Any:
    """The table that a field stands in; None where it is not there."""
    node: Any = description
    for name in path[:-1]:
        node = getattr(node, name, None) if isinstance(node, BaseModel) else child_of(node, name)
    return node


def _keys_of(reading: Reading[Any], leaf: Leaf) -> Iterator[Key]:
    """A leaf's key, or one for each item of its list."""
    written = value_at(reading.tree.root, leaf.path)
    source, provenance = _source(reading, leaf, written)
    origin = (provenance.kind, provenance.source) if provenance else ("", "")
    default = leaf.default if written is None else written
    if default is None and isinstance(holder(reading.description, leaf.path), BaseModel):
        default = getattr(holder(reading.description, leaf.path), leaf.path[-1], None)
    for name, value, annotation in _items(leaf.key, default, leaf.annotation):
        facts = (shown(value, annotation), unit_of(annotation), allowed(annotation))
        yield Key(name, *facts, leaf.meaning, source, *origin)


def _is_whole(annotation: Any) -> bool:
    """Whether a list is written only as a whole."""
    return any(isinstance(mark, Whole) for mark in core(annotation)[1])


def _items(key: str, value: Any, annotation: Any) -> Iterator[tuple[str, Any, Any]]:
    """(key, value, type) of a field, or of each item of a list that is not marked as a whole."""
    inner, _ = core(annotation)
    if (
        _is_whole(annotation)
        or get_origin(inner) is not tuple
        or not isinstance(value, list | tuple)
        or not value
    ):
        yield key, value, annotation
        return
    kinds = get_args(inner)
    for k, item in enumerate(value):
        yield from _items(f"{key}[{k}]", item, kinds[0] if kinds[-1] is Ellipsis else kinds[k])


def _source(reading: Reading[Any], leaf: Leaf, written: Any) -> tuple[str, Provenance | None]:
    """Source of a value, and its provenance."""
    table = holder(reading.description, leaf.path)
    provenance = getattr(table, "provenance", {}).get(leaf.path[-1])
    tree, path = reading.tree, leaf.path
    file, inner = tree.file_of(path[:-1])
    depth = len(path) - 1 - len(inner)  # of the file; one that a set name stands for holds no set value
    if any(len(k) > depth and (path[: len(k)] == k or k[: len(path)] == path) for k in tree.set_keys):
        return "set", provenance
    if written is None and provenance is None:  # one that another of the table gives has a provenance
        return "default", provenance
    return ("" if file is None else _short(file)), provenance


def _short(file: pathlib.Path) -> str:
    """A shipped file from models/ on, another as it is."""
    models = assets.folder("models")
    return str(file.relative_to(models.parent)) if file.is_relative_to(models) else str(file)
