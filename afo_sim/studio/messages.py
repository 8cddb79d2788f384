"""What a tab may ask the studio for: each kind of message with its fields and their bounds, and no other."""

from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from afo_sim.common import InputError, Json, nearest_name
from afo_sim.description import PROBLEMS

NAME = r"^[^/\\.\x00-\x1f][^/\\\x00-\x1f]{0,199}$"  # of a file of a trial, without its folder
MOST_FILES = 50  # of a trial
_Words = Annotated[str, Field(max_length=1000, pattern=r"^[^\x00-\x1f]*$")]
_Key = Annotated[str, Field(max_length=200, pattern=r"^[\w.\[\]-]+$")]
_Whole = Annotated[int, Field(ge=-(10**15), le=10**15)]
_Scalar = _Words | _Whole | float
_Parts = Annotated[list[_Scalar | list[_Scalar]], Field(max_length=100)]
_Range = Annotated[list[_Scalar], Field(min_length=2, max_length=2)]
_Slot = Literal["A", "B", "C"]
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


class Step(Message):
    """A step back or forth, or the design as a variant."""

    op: Literal["undo", "redo", "keep"]


class Further(Message):
    """What is computed on demand, or no longer."""

    op: Literal["bands", "report", "stop"]


class Change(Message):
    """Values to lay over the design; `join` makes it one step back with the change before it."""

    op: Literal["change"]
    sets: Annotated[dict[_Key, _Scalar | _Parts | None], Field(min_length=1, max_length=50)]
    follow: bool = True
    join: bool = False


class OfVariant(Message):
    """A variant to go on with, or to keep no longer."""

    op: Literal["show", "remove"]
    slot: _Slot


class Rename(Message):
    """A variant's new name, which is cleaned."""

    op: Literal["rename"]
    slot: _Slot
    name: Annotated[str, Field(max_length=1000)]


class Save(Message):
    """A folder to write; "" for the last one."""

    op: Literal["save"]
    folder: _Words = ""


class Import(Message):
    """Files of a trial that were put here, and whose walk they show."""

    op: Literal["import"]
    files: Annotated[list[Annotated[str, Field(pattern=NAME)]], Field(min_length=1, max_length=MOST_FILES)]
    walker: Literal["healthy", "patient"]
    side: Literal["right", "left"] = "right"


class Search(Message):
    """Ranges to search for the lowest objective."""

    op: Literal["search"]
    keys: Annotated[dict[_Key, _Range], Field(min_length=1, max_length=50)]
    objective: _Key = "air_per_stride"


Asked = Step | Further | Change | OfVariant | Rename | Save | Import | Search
OPS = {op: kind for kind in get_args(Asked) for op in get_args(kind.model_fields["op"].annotation)}
_READER: TypeAdapter[Asked] = TypeAdapter(Annotated[Asked, Field(discriminator="op")])


def read_message(message: Json) -> Asked:
    """A tab's message, whole and within its bounds, or InputError for the first thing that is wrong."""
    op = message.get("op") if isinstance(message, dict) else None
    if not isinstance(op, str) or op not in OPS:
        nearest = nearest_name(op, OPS) if isinstance(op, str) else None
        raise InputError(
            "is not known to this studio", field="op", value=op, allowed=", ".join(OPS), nearest=nearest
        )
    try:
        return _READER.validate_python(message)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
    path = [str(part) for part in first["loc"][1:]]
    own = path[0] in ("sets", "keys") and len(path) > 1  # of a key of the scenario, which names the field
    problem = "is not a valid value" if own else PROBLEMS.get(first["type"], "is not a valid value")
    known = ", ".join(OPS[op].model_fields) if first["type"] == "extra_forbidden" else ""
    value = None if isinstance(first["input"], dict | list) else first["input"]
    allowed = known or str(first.get("ctx", {}).get("expected", "")) or _ALLOWED.get(path[0], "")
    raise InputError(problem, field=path[own], value=value, allowed=allowed)
