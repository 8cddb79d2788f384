"""Plain data → TOML text that `reader.py` reads again, exactly."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any


def toml_text(table: Mapping[str, Any]) -> str:
    """A description as TOML.

    Parameters
    ----------
    table : plain data, as `Scenario.resolved` gives it: what is None is left out, and a map
        `provenance` goes back to the numbers that it is about, { value = …, kind = …, source = … }

    Returns
    -------
    text, with a trailing newline
    """
    return "\n".join(_lines(table, ())).strip("\n") + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """The values of a table under its header, then the tables in it."""
    sources = table.get("provenance", {})
    inner, header = {}, f"\n[{'.'.join(map(_key, path))}]" if path else ""
    for key, value in table.items():
        if isinstance(value, Mapping) and key != "provenance":
            inner[key] = value
        elif value is not None and key != "provenance":
            if header:
                yield header
                header = ""
            yield f"{_key(key)} = {_value({'value': value, **sources[key]} if key in sources else value)}"
    if header and not inner:
        yield header  # an empty table is one, too
    for key, value in inner.items():
        yield from _lines(value, (*path, key))


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)  # JSON's strings, whole numbers and truths are TOML's
