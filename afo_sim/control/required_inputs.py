"""What a controller asks for: columns, and texts that have to be in their units."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from afo_sim.common import InputError, parse_quantity, unknown
from afo_sim.description import STATE_TIME


@dataclass(frozen=True)
class RequiredInput:
    """A column that a controller reads."""

    column: str
    table: str = ""
    key: str = ""
    text: str = ""
    unit: str | None = None


def check_required(asks: Iterable[RequiredInput], known: Iterable[str], unit: Callable[[str], str]) -> None:
    """Refuse what a controller cannot read, before the first step."""
    names = list(known)
    for asked in asks:
        if asked.column == STATE_TIME:
            found = "s"
        elif asked.column in names:
            found = unit(asked.column)
        else:
            problem = "a controller sees no such column"
            key = "column" if asked.text or not asked.key else asked.key
            raise unknown(asked.column, names, field=_key(asked, key), problem=problem)
        if asked.unit is not None and found != asked.unit:
            field = _key(asked, asked.key or "column")
            problem = f"is in {found or 'bare numbers'}, where {asked.unit or 'bare numbers'} are needed"
            alike = ", ".join(name for name in names if unit(name) == asked.unit)
            raise InputError(problem, field=field, value=asked.column, allowed=alike)
        if asked.text:
            try:
                parse_quantity(_plain(asked.text) if found == "" else asked.text, found)
            except ValueError as error:
                field, bare = _key(asked, asked.key), f" [{found}]" if found else ", a bare number"
                allowed = f"a value of {asked.column}{bare}"
                raise InputError(str(error), field=field, value=asked.text, allowed=allowed) from None


def _plain(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def _key(asked: RequiredInput, key: str) -> str:
    return ".".join(filter(None, (asked.table, key)))


def required_inputs(controller: object) -> list[RequiredInput]:
    """The columns that a controller reads: its `asks`, if it has any."""
    asks = getattr(controller, "asks", [])
    return [RequiredInput(ask) if isinstance(ask, str) else ask for ask in asks]
