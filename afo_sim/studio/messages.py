"""What a tab may ask the studio for: a table of messages with their fields and bounds, and nothing else."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from afo_sim.common import Foreign, InputError, Json, Mixed, unknown
from afo_sim.description import PROBLEMS

NAME = r"^[^/\\.\x00-\x1f][^/\\\x00-\x1f]{0,199}$"  # of a file of a trial, without its folder
MOST_FILES = 50  # of a trial
_Line = Annotated[str, Field(max_length=1000, pattern=r"^[^\x00-\x1f]*$")]
_Key = Annotated[str, Field(max_length=200, pattern=r"^[\w.\[\]-]+$")]
_Scalar = _Line | Annotated[int, Field(ge=-(10**15), le=10**15)] | float
_Values = _Scalar | Annotated[list[_Scalar | list[_Scalar]], Field(max_length=100)] | None
_Range = Annotated[list[_Scalar], Field(min_length=2, max_length=2)]
_Names = Annotated[list[Annotated[str, Field(pattern=NAME)]], Field(min_length=1, max_length=MOST_FILES)]
_SLOT = {"slot": (Literal["A", "B", "C"], ...)}
_FIELDS: dict[str, dict[str, Mixed]] = {  # of each message, with its default; ... where there is none
    **{op: {} for op in ("undo", "redo", "keep", "bands", "report", "stop")},
    "change": {
        "sets": (Annotated[dict[_Key, _Values], Field(min_length=1, max_length=50)], ...),
        "follow": (bool, True),
        "join": (bool, False),
    },
    "show": _SLOT,
    "remove": _SLOT,
    "rename": {**_SLOT, "name": (Annotated[str, Field(max_length=1000)], ...)},
    "save": {"folder": (_Line, "")},  # "": the last one
    "import": {
        "files": (_Names, ...),
        "walker": (Literal["healthy", "patient"], ...),
        "side": (Literal["right", "left"], "right"),
    },
    "search": {
        "keys": (Annotated[dict[_Key, _Range], Field(min_length=1, max_length=50)], ...),
        "objective": (_Key, "air_per_stride"),
    },
}
_ALLOWED = {
    **dict.fromkeys(("follow", "join"), "true or false"),
    "sets": "keys with a number or a text each, up to 50",
    "keys": "keys with two ends of each range, as [2.0, 4.2]",
    "files": f"1 to {MOST_FILES} names without a folder",
    "name": "up to 1000 letters",
    "folder": "a path of up to 1000 letters in one line",
}


class Message(BaseModel):
    """A tab's message; a problem with it goes back under its key."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)
    key: Annotated[str, Field(max_length=10_000)] = ""


_OP: Foreign = Literal  # of words that no type checker knows
MESSAGES: dict[str, type[Message]] = {
    op: create_model(op, __base__=Message, op=(_OP[op], ...), **fields) for op, fields in _FIELDS.items()
}


def read_message(message: Json) -> Foreign:
    """A tab's message, whole and within its bounds, or InputError for the first thing that is wrong."""
    op = message.get("op") if isinstance(message, dict) else None
    if not isinstance(op, str) or op not in MESSAGES:
        raise unknown(op, MESSAGES, field="op", problem="is not known to this studio")
    try:
        return MESSAGES[op].model_validate(message)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
    path = [str(part) for part in first["loc"]]
    own = path[0] in ("sets", "keys") and len(path) > 1  # of a key of the scenario, which names the field
    problem = "is not a valid value" if own else PROBLEMS.get(first["type"], "is not a valid value")
    known = ", ".join(MESSAGES[op].model_fields) if first["type"] == "extra_forbidden" else ""
    value = None if isinstance(first["input"], dict | list) else first["input"]
    allowed = known or str(first.get("ctx", {}).get("expected", "")) or _ALLOWED.get(path[0], "")
    raise InputError(problem, field=path[own] or path[0], value=value, allowed=allowed)
