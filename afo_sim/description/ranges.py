"""Unit, range and value of a field, in words."""

import pathlib
from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from afo_sim.description.leaves import core, fields_of, is_table
from afo_sim.description.quantity import Quantity, amount


def unit_of(annotation: Any) -> str:
    """The SI unit of a field, "" of bare numbers, words and lists of several units."""
    inner, marks = core(annotation)
    units = {mark.unit for mark in marks if isinstance(mark, Quantity)}
    if get_origin(inner) is tuple:
        units |= {unit_of(item) for item in get_args(inner) if item is not Ellipsis}
    return units.pop() if len(units) == 1 else ""


def allowed(annotation: Any) -> str:
    """Allowed values of a field, in words."""
    inner, marks = core(annotation)
    for mark in marks:
        if isinstance(mark, Quantity):
            return mark.span
    if get_origin(inner) is Literal:
        return " or ".join(f'"{choice}"' for choice in get_args(inner))
    if get_origin(inner) is tuple:
        return _allowed_list(get_args(inner))
    if inner is int:
        words = (("ge", "at least"), ("le", "at most"))
        bounds = [f"{word} {getattr(m, name)}" for name, word in words for m in marks if hasattr(m, name)]
        return f"a whole number, {' and '.join(bounds)}" if bounds else "a whole number"
    if is_table(inner):
        known = "name" in inner.model_fields
        return "a name or a path" if known else f"a table with {', '.join(fields_of(inner))}"
    return "the path of a file" if inner is pathlib.Path else "a text"


def _allowed_list(items: tuple[Any, ...]) -> str:
    if items[-1] is Ellipsis:
        return f"a list, each item {allowed(items[0])}"
    parts = [allowed(item) for item in items]
    count = {2: "two", 3: "three"}.get(len(items), str(len(items)))
    if len(set(parts)) == 1:
        return f"{count} of: {parts[0]}"
    return f"{count}: " + "; ".join(parts)


def shown(value: Any, annotation: Any = None) -> str:
    """A value as a file writes it: SI numbers of a field in its usual unit, the rest as it is."""
    inner, marks = core(annotation)
    quantity = next((mark for mark in marks if isinstance(mark, Quantity)), None)
    if isinstance(value, str) or value is None:
        return "" if value is None else value
    if isinstance(value, Mapping):
        return str(value.get("name", ""))
    if isinstance(value, list | tuple):
        kinds = get_args(inner) if get_origin(inner) is tuple else ()
        several = bool(kinds) and kinds[-1] is Ellipsis
        items = [
            shown(item, kinds[0] if several else kinds[k] if k < len(kinds) else None)
            for k, item in enumerate(value)
        ]
        return f"[{', '.join(items)}]"
    if isinstance(value, float) and quantity is not None and quantity.unit:
        return amount(value, quantity.unit)
    return f"{value:.12g}" if isinstance(value, float) else str(value)
