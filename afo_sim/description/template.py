"""A commented file of a description: every key with what it means, its unit, range and default."""

import json
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args, get_origin

from pydantic import ValidationError

from afo_sim.description.leaves import RANGES, SETS, core, fields_of, is_table, marked, parameter_leaf
from afo_sim.description.meanings import meaning
from afo_sim.description.ranges import allowed, shown, unit_of

WIDTH = 100  # columns of a comment
Table = Mapping[str, Any]
HEAD = (
    "Each key: what it means, [SI unit], what is allowed, its default. A quantity is a text with a unit; "
    "any unit of its dimension will do. A number may say where it comes from: { value = …, kind = …, "
    'source = … }, with the kind "published", "fitted", "derived", "assumed" or "user". '
    "What stands behind # has no effect until the # goes."
)


@dataclass
class Template:
    """Writes one description; a field that occurs again is explained only once.

    `chambers` are what a timer switches; `explained` the fields so far.
    """

    chambers: tuple[str, ...] = ()
    explained: set[tuple[str, str]] = field(default_factory=set)

    def text(self, kind: Any, values: Table, examples: Table, title: str) -> str:
        """The whole file."""
        lines = [*_comment(title), *_comment(HEAD), ""]
        lines += self._table(kind, values, examples, ())
        text = "\n".join(lines).strip("\n") + "\n"
        return re.sub(r"\n{3,}", "\n\n", text)

    def _table(
        self, kind: Any, values: Table | None, examples: Table, path: tuple[str, ...], name: str = ""
    ) -> Iterator[str]:
        """A table: its own keys, then the tables in it. Without values all of it is a comment."""
        live, given = values is not None, values or {}
        if path:
            yield ""
            yield from () if (type_name(kind), "") in self.explained else _comment(_first_line(kind))
            self.explained.add((type_name(kind), ""))
            yield ("" if live else "# ") + f"[{'.'.join(path)}]"
        yield from self._keys(kind, given, examples, live, name)
        for key, info in fields_of(kind).items():
            inner = core(info.annotation)[0]
            if get_origin(inner) is dict and is_table(get_args(inner)[1]):
                yield from self._entries(get_args(inner)[1], key, given, examples, (*path, key))
            elif is_table(inner) and not _is_reference(inner, given.get(key)):
                written = given.get(key)
                if written is not None or not self._known(inner) or info.is_required():
                    yield from self._table(inner, written, examples.get(key) or {}, (*path, key))
        if kind.model_config.get("extra") == "allow":
            inner = get_args(kind.__annotations__["__pydantic_extra__"])[1]
            for chamber in self.chambers if is_table(inner) else ():
                written = given.get(chamber, _empty(inner)) if live else None
                yield from self._table(inner, written, examples.get(chamber) or {}, (*path, chamber))

    def _entries(
        self, kind: Any, key: str, given: Table, examples: Table, path: tuple[str, ...]
    ) -> Iterator[str]:
        """Tables with names of their own, such as muscle groups and laws."""
        example: Table = next(iter((examples.get(key) or {}).values()), {})
        for name, entry in (given.get(key) or {}).items():
            yield from self._table(kind, entry, example, (*path, name), name)
        if not given.get(key):
            for name, entry in (examples.get(key) or {}).items():
                yield from self._table(kind, None, entry, (*path, name), name)

    def _keys(self, kind: Any, given: Table, examples: Table, live: bool, name: str) -> Iterator[str]:
        """The plain keys of a table, each with its comment."""
        for key, text, annotation, required, default in _plain(kind, name, given):
            entry = (f"{type_name(kind)} {name}" if kind in SETS else type_name(kind), key)
            value, known = given.get(key), entry in self.explained
            self.explained.add(entry)
            if not known:
                yield ""
                yield from _comment(text)
                yield from _comment(_facts(annotation, required, default))
            if value is not None:
                yield f"{key} = {toml_value(value)}"
            elif not known:
                example = _plain_value(examples.get(key, _default_value(annotation, default)))
                yield f"# {key} = {toml_value(example)}"

    def _known(self, kind: Any) -> bool:
        return (type_name(kind), "") in self.explained


def _empty(kind: Any) -> Table | None:
    """A table without keys; None where the description needs one at least."""
    try:
        kind.model_validate({})
    except ValidationError:
        return None
    return {}


def type_name(kind: Any) -> str:
    """The name of a description's class."""
    return str(kind.__name__)


def _plain(kind: Any, name: str, given: Table) -> Iterator[tuple[str, str, Any, bool, Any]]:
    """(key, meaning, type, whether it is needed, default) of the keys that are no tables."""
    if kind in SETS:
        for parameter in SETS[kind][name].parameters:
            leaf = parameter_leaf(parameter)
            yield leaf.key, leaf.meaning, leaf.annotation, leaf.required, leaf.default
    for key, info in fields_of(kind).items():
        if kind in SETS and key not in RANGES:
            continue
        inner = core(info.annotation)[0]
        many = get_origin(inner) is dict and is_table(get_args(inner)[1])
        if many or (is_table(inner) and not _is_reference(inner, given.get(key))):
            continue
        required = info.is_required() and kind not in SETS
        default = None if info.is_required() else info.get_default(call_default_factory=True)
        yield key, meaning(kind, key), marked(info), required, default


def _is_reference(kind: Any, value: Any) -> bool:
    """Whether a field is the name of another description."""
    return "name" in kind.model_fields and not isinstance(value, Mapping)


def _facts(annotation: Any, required: bool, default: Any) -> str:
    unit = unit_of(annotation)
    parts = [f"[{unit}] " if unit else "", allowed(annotation)]
    parts.append("; needed" if required else f"; default {_shown_default(default, annotation)}")
    return "".join(parts)


def _plain_value(value: Any) -> Any:
    """An example without where its number comes from."""
    value = value["value"] if isinstance(value, Mapping) and "value" in value else value
    return "" if value is None else value


def _shown_default(default: Any, annotation: Any) -> str:
    if default is None or default in ("", ()):
        return "none"
    text = shown(default, annotation)
    return f'"{text}"' if isinstance(default, str) or unit_of(annotation) else text


def _default_value(annotation: Any, default: Any) -> Any:
    """A default as a file would write it."""
    if isinstance(default, float):
        return shown(default, annotation) if unit_of(annotation) else default
    return default if default is None or isinstance(default, str | int | list) else list(default)


def _first_line(kind: Any) -> str:
    return str(kind.__doc__ or "").strip().split("\n")[0]


def _comment(text: str) -> Iterable[str]:
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), WIDTH - 2)]


def toml_value(value: Any) -> str:
    """Plain data as TOML, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)  # JSON's strings, whole numbers and truths are TOML's
