"""A gait as a file: first pose and gains by their names, and how they were found."""

import dataclasses
import math
import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afo_sim.common import InputError, assets, parse_quantity, parse_toml, read_text, unknown, write_text
from afo_sim.physics import GAINS
from afo_sim.walker.gait import OFFSETS, Vector

LARGEST_GAIN = 20.0
TABLES = ("description", "speed", "start", "pose", "gains", "left", "search")


@dataclass(frozen=True, eq=False)
class Gait:
    """A gait that a walker knows.

    name, description : of the file
    speed : that it was searched for [m/s]
    vector : first pose and gains
    search : how it was found, in words and numbers
    """

    name: str
    description: str
    speed: float
    vector: Vector
    search: Mapping[str, Any] = field(default_factory=dict)


def read_gait(name: str | os.PathLike[str]) -> Gait:
    """Read a gait: a shipped name, or a path.

    Raises
    ------
    InputError
        There is no such gait; a table, a gain or a number is wrong.
    """
    file = assets.find("walker", str(name))
    try:
        tables = parse_toml(read_text(file))
    except ValueError as error:
        raise InputError(f"is not TOML: {error}", file=file) from None
    for key in tables:
        if key not in TABLES:
            raise unknown(key, TABLES, file=file, field=key, problem="is not a key of a gait")
    for key in ("speed", "pose", "gains"):
        if key not in tables:
            raise InputError("is missing", file=file, field=key)
    pose = _table(file, "pose", tables["pose"], OFFSETS, math.pi)
    gains = _table(file, "gains", tables["gains"], GAINS, LARGEST_GAIN)
    left = gains | _table(file, "left", tables.get("left", {}), GAINS, LARGEST_GAIN)
    legs = np.array([[leg.get(name, 0.0) for name in GAINS] for leg in (gains, left)])
    return Gait(
        name=file.stem,
        description=str(tables.get("description", "")),
        speed=_speed(file, tables["speed"]),
        vector=Vector(np.array([pose.get(name, 0.0) for name in OFFSETS]), legs),
        search=dict(tables.get("search", {})),
    )


def _speed(file: pathlib.Path, value: object) -> float:
    try:
        found = parse_quantity(str(value), "m/s")
    except ValueError as error:
        raise InputError(str(error), file=file, field="speed", value=value, allowed='"1.25 m/s"') from None
    if not 0.3 <= found <= 2.5:
        raise InputError("is out of range", file=file, field="speed", value=value, allowed="0.3 to 2.5 m/s")
    return float(found)


def _table(
    file: pathlib.Path, key: str, table: object, names: tuple[str, ...], most: float
) -> dict[str, float]:
    if not isinstance(table, Mapping):
        raise InputError("is not a table", file=file, field=key)
    for name, value in table.items():
        if name not in names:
            raise unknown(name, names, file=file, field=f"{key}.{name}", problem="is not a number of a gait")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
            raise InputError(
                "is not a number in range",
                file=file,
                field=f"{key}.{name}",
                value=value,
                allowed=f"-{most:g} to {most:g}",
            )
    return {name: float(value) for name, value in table.items()}


def write_gait(path: os.PathLike[str], gait: Gait) -> None:
    """Write a gait, each number to the digits that give it back."""
    lines = [f'description = "{gait.description}"', f'speed = "{gait.speed:g} m/s"', "", "[pose]  # rad"]
    offsets, gains = gait.vector.offsets, gait.vector.gains
    lines += [f"{name} = {float(value)!r}" for name, value in zip(OFFSETS, offsets, strict=True)]
    lines += ["", "[gains]"] + [f"{name} = {float(v)!r}" for name, v in zip(GAINS, gains[0], strict=True)]
    other = [(name, a) for name, a, b in zip(GAINS, gains[1], gains[0], strict=True) if a != b]
    lines += (["", "[left]"] if other else []) + [f"{name} = {float(value)!r}" for name, value in other]
    lines += ["", "[search]"] + [f"{key} = {_toml(value)}" for key, value in gait.search.items()]
    write_text(pathlib.Path(path), "\n".join(lines) + "\n")


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value!r}".lower()


def with_vector(gait: Gait, vector: Vector, name: str, description: str, search: Mapping[str, Any]) -> Gait:
    """A gait with other numbers, and how they were found."""
    return dataclasses.replace(gait, name=name, description=description, vector=vector, search=dict(search))
