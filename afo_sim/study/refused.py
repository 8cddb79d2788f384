"""What is wrong with a study's TOML file, as a message for people."""

import pathlib
from typing import Any

from pydantic import ValidationError

from afo_sim.common.errors import InputError
from afo_sim.description.reader import PROBLEMS

BOUNDS = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}


def first_error(file: pathlib.Path, table: Any, error: ValidationError) -> InputError:
    """The first validation error, as a message for people."""
    first = error.errors(include_url=False)[0]
    facts = first.get("ctx", {})
    path = [str(part) for part in first["loc"]] + ([facts["key"]] if facts.get("key") else [])
    value = table
    for part in path:
        if isinstance(value, list):
            value = value[int(part)] if part.isdigit() and int(part) < len(value) else None
        else:
            value = value.get(part) if isinstance(value, dict) else None
    return InputError(
        (PROBLEMS | {"dict_type": "is not a table", "too_short": "is empty"}).get(
            first["type"], first["msg"]
        ),
        file=file,
        field=".".join(path),
        value=None if isinstance(value, dict) else value,
        allowed=str(facts.get("allowed", "") or facts.get("expected", "") or _bound(facts)),
        nearest=facts.get("nearest") or None,
    )


def _bound(facts: dict[str, Any]) -> str:
    """The bound that a number violates, in words."""
    return ", ".join(f"{words} {facts[name]:g}" for name, words in BOUNDS.items() if name in facts)
