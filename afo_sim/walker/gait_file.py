"""A gait as a file: first pose and gains by their names, and how they were found."""

import dataclasses
import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import tomli_w

from afo_sim.common import InputError, JsonMapping, assets, quantity_at, unknown, write_sealed
from afo_sim.physics import GAINS
from afo_sim.walker.bounds import BOUNDS
from afo_sim.walker.gait import OFFSETS, Vector

STARTS = {"speed": (0.0, 2.0)}  # over the first speed of all gaits [-]
TABLES = ("description", "speed", "start", "pose", "gains", "left", "search")


@dataclass(frozen=True, eq=False)
class Gait:
    """A gait that a walker knows."""

    name: str
    description: str
    speed: float  # that it was searched for [m/s]
    vector: Vector  # first pose and gains
    search: JsonMapping = field(default_factory=dict)  # how it was found, in words and numbers


def read_gait(name: str | os.PathLike[str]) -> Gait:
    """Read a gait: a shipped name, or a path."""
    file = assets.find("walker", str(name))
    tables = assets.read_toml(file)
    for key in tables:
        if key not in TABLES:
            raise unknown(key, TABLES, file=file, field=key, problem="is not a key of a gait")
    for key in ("speed", "pose", "gains"):
        if key not in tables:
            raise InputError("is missing", file=file, field=key)
    value = str(tables["speed"])
    speed = quantity_at("speed", value, "m/s", file=file, allowed='"1.25 m/s"')
    if not 0.3 <= speed <= 2.5:
        raise InputError("is out of range", file=file, field="speed", value=value, allowed="0.3 to 2.5 m/s")
    spans = {name: BOUNDS[name] for name in GAINS}
    pose = _table(file, "pose", tables["pose"], {name: BOUNDS[name] for name in OFFSETS})
    gains = _table(file, "gains", tables["gains"], spans)
    begun = _table(file, "start", tables.get("start", {}), STARTS)
    left = gains | _table(file, "left", tables.get("left", {}), spans)
    none = {name: min(max(0.0, low), high) for name, (low, high) in spans.items()}
    legs = np.array([list((none | leg).values()) for leg in (gains, left)])
    return Gait(
        name=file.stem,
        description=str(tables.get("description", "")),
        speed=speed,
        vector=Vector(np.array([pose.get(name, 0.0) for name in OFFSETS]), legs, begun.get("speed", 1.0)),
        search=dict(tables.get("search", {})),
    )


def _table(
    file: pathlib.Path, key: str, table: object, spans: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    if not isinstance(table, Mapping):
        raise InputError("is not a table", file=file, field=key)
    for name, value in table.items():
        field = f"{key}.{name}"
        if name not in spans:
            raise unknown(name, spans, file=file, field=field, problem="is not a number of a gait")
        low, high = spans[name]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            span = f"{low:g} to {high:g}"
            raise InputError("is not a number in range", file=file, field=field, value=value, allowed=span)
    return {name: float(value) for name, value in table.items()}


def write_gait(path: os.PathLike[str], gait: Gait) -> None:
    """Write a gait, each number to the digits that give it back."""
    own, other = ({n: float(g) for n, g in zip(GAINS, leg, strict=True)} for leg in gait.vector.gains)
    apart = {name: gain for name, gain in other.items() if gain != own[name]}
    tables = {
        "description": gait.description,
        "speed": f"{float(gait.speed)!r} m/s",
        "start": {"speed": float(gait.vector.speed)},
        "pose": {name: float(angle) for name, angle in zip(OFFSETS, gait.vector.offsets, strict=True)},
        "gains": own,
        **({"left": apart} if apart else {}),
        "search": dict(gait.search),
    }
    write_sealed(pathlib.Path(path), tomli_w.dumps(tables), "adapted gait")


def with_vector(gait: Gait, vector: Vector, name: str, description: str, search: JsonMapping) -> Gait:
    """A gait with other numbers, and how they were found."""
    return dataclasses.replace(gait, name=name, description=description, vector=vector, search=dict(search))
