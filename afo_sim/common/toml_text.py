"""Plain data → TOML text that `reader.py` reads again, exactly."""

from collections.abc import Mapping
from typing import Any

import tomli_w


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
    return tomli_w.dumps(_plain(table))


def _plain(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table without None, with the sources beside their values."""
    sources = table.get("provenance", {})
    found = {}
    for key, value in table.items():
        if value is not None and key != "provenance":
            value = _value(value)
            found[key] = {"value": value, **sources[key]} if key in sources else value
    return found


def _value(value: Any) -> Any:
    """A value; a table, or tables in a list, as `_plain` has them."""
    if isinstance(value, Mapping):
        return _plain(value)
    return [_value(item) for item in value] if isinstance(value, list | tuple) else value
