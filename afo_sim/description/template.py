"""A commented file of a description: every key with what it means, its unit, range and default."""

import json
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from afo_sim.description.schema import (
    KINDS,
    SETS,
    Leaf,
    allowed,
    fields_of,
    is_table,
    of_chambers,
    shown,
    tables,
    unit_of,
)

_WIDTH = 100  # columns of a comment
_Table = Mapping[str, Any]
_HEAD = (
    "Each key: what it means, [SI unit], what is allowed, its default. A quantity is a text with a unit; "
    "any unit of its dimension will do. A number may say where it comes from: { value = …, kind = …, "
    'source = … }, with the kind "published", "fitted", "derived", "assumed" or "user". '
    "What stands behind # has no effect until the # goes."
)


@dataclass
class Template:
    """Writes one description; a field that occurs again is explained only once."""

    chambers: tuple[str, ...] = ()
    explained: set[tuple[str, str]] = field(default_factory=set)

    def text(self, kind: Any, values: _Table, examples: _Table, title: str) -> str:
        """The whole file."""
        lines = [*_comment(title), *_comment(_HEAD), ""]
        lines += self._table(kind, values, examples, ())
        text = "\n".join(lines).strip("\n") + "\n"
        return re.sub(r"\n{3,}", "\n\n", text)

    def _table(
        self, kind: Any, values: _Table | None, examples: _Table, path: tuple[str, ...], name: str = ""
    ) -> Iterator[str]:
        """A table: its own keys, then the tables in it. Without values all of it is a comment."""
        live, given = values is not None, values or {}
        if path:
            yield ""
            yield from () if (kind.__name__, "") in self.explained else _comment(_first_line(kind))
            self.explained.add((kind.__name__, ""))
            yield ("" if live else "# ") + f"[{'.'.join(path)}]"
        yield from self._keys(kind, given, examples, live, name)
        for key, leaf in fields_of(kind).items():
            inner, many = tables(leaf.annotation)
            written = given.get(key)
            if many == "named":
                yield from self._entries(inner, key, given, examples, (*path, key))
            elif many != "one" or _is_reference(inner, written):
                continue
            elif written is not None or not self._known(inner) or leaf.required:
                yield from self._table(inner, written, examples.get(key) or {}, (*path, key))
        inner = of_chambers(kind)
        for chamber in self.chambers if is_table(inner) else ():
            written = given.get(chamber, _empty(inner)) if live else None
            yield from self._table(inner, written, examples.get(chamber) or {}, (*path, chamber))

    def _entries(
        self, kind: Any, key: str, given: _Table, examples: _Table, path: tuple[str, ...]
    ) -> Iterator[str]:
        """Tables with names of their own, such as muscle groups and laws."""
        example: _Table = next(iter((examples.get(key) or {}).values()), {})
        for name, entry in (given.get(key) or {}).items():
            yield from self._table(kind, entry, example, (*path, name), name)
        if not given.get(key):
            for name, entry in (examples.get(key) or {}).items():
                yield from self._table(kind, None, entry, (*path, name), name)

    def _keys(self, kind: Any, given: _Table, examples: _Table, live: bool, name: str) -> Iterator[str]:
        """The plain keys of a table, each with its comment."""
        for key, leaf in fields_of(kind, name).items():
            inner, many = tables(leaf.annotation)
            if many == "named" or (many == "one" and not _is_reference(inner, given.get(key))):
                continue
            entry = (f"{kind.__name__} {name}" if kind in SETS else kind.__name__, key)
            value, known = given.get(key), entry in self.explained
            self.explained.add(entry)
            if not known:
                yield ""
                yield from _comment(leaf.meaning)
                yield from _comment(_facts(leaf))
            if value is not None:
                yield f"{key} = {_toml_value(value)}"
            elif not known:
                example = _plain_value(examples.get(key, _default_value(leaf)))
                yield f"# {key} = {_toml_value(example)}"

    def _known(self, kind: Any) -> bool:
        return (kind.__name__, "") in self.explained


def _empty(kind: Any) -> _Table | None:
    """A table without keys; None where the description needs one at least."""
    try:
        kind.model_validate({})
    except ValidationError:
        return None
    return {}


def _is_reference(kind: Any, value: Any) -> bool:
    """Whether a field is the name of another description."""
    return kind in KINDS and not isinstance(value, Mapping)


def _facts(leaf: Leaf) -> str:
    unit = unit_of(leaf.annotation)
    default = "; needed" if leaf.required else f"; default {shown_default(leaf)}"
    return f"{f'[{unit}] ' if unit else ''}{allowed(leaf.annotation)}{default}"


def _plain_value(value: Any) -> Any:
    """An example without where its number comes from."""
    value = value["value"] if isinstance(value, Mapping) and "value" in value else value
    return "" if value is None else value


def shown_default(leaf: Leaf) -> str:
    if leaf.default is None or leaf.default in ("", ()):
        return "none"
    text = shown(leaf.default, leaf.annotation)
    return f'"{text}"' if isinstance(leaf.default, str) or unit_of(leaf.annotation) else text


def _default_value(leaf: Leaf) -> Any:
    """A default as a file would write it."""
    default = leaf.default
    if isinstance(default, float):
        return shown(default, leaf.annotation) if unit_of(leaf.annotation) else default
    return default if default is None or isinstance(default, str | int | list) else list(default)


def _first_line(kind: Any) -> str:
    return str(kind.__doc__ or "").strip().split("\n")[0]


def _comment(text: str) -> Iterable[str]:
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _WIDTH - 2)]


def _toml_value(value: Any) -> str:
    """Plain data as TOML, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)  # JSON's strings, whole numbers and truths are TOML's
