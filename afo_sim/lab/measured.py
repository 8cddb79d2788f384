"""Measured characteristics of a muscle: a CSV of pressure, contraction or length, and force or load."""

import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import (
    AMBIENT_PRESSURE,
    EXAMPLES,
    GRAVITY,
    InputError,
    JsonDict,
    JsonMapping,
    Table,
    TableLike,
    in_unit,
    nearest_name,
    number,
    read_facts,
    scale_of,
    split_title,
    table_of,
)

Known = Mapping[str, tuple[str, ...] | None]  # column → SI units that it may be given in; None for texts
COLUMNS: Known = {
    "pressure": ("Pa",),
    "absolute pressure": ("Pa",),
    "contraction": ("",),
    "length": ("m",),
    "change of length": ("m",),
    "force": ("N",),
    "load": ("kg", "N"),
    "curve": None,
}
NEEDED = {
    "a pressure": ("pressure", "absolute pressure"),
    "a contraction or a length": ("contraction", "length", "change of length"),
    "a force or a load": ("force", "load"),
}
EXAMPLE = "pressure [bar], contraction [-], force [N]; or pressure [bar], load [kg], change of length [cm]"
# Header line "# key: value" of a property of a muscle → SI unit, least and greatest value.
POSSIBLE = {
    "total_length": ("m", 1e-3, 2.0),
    "end_length": ("m", 0.0, 1.0),
    "bore": ("m", 5e-4, 0.2),
    "braid_angle": ("rad", 0.0873, 0.872),
    "hanger": ("kg", 0.0, 50.0),
    "damping": ("m^2*s", 0.0, 1.0),
    "braid_stiffness": ("N", 1.0, 1e7),
    "dead_volume": ("m^3", 1e-9, 0.1),
    "mass": ("kg", 0.0, 20.0),
}
TEXTS: dict[str, str | None] = dict.fromkeys(("source", "licence", "note"))
HEADER = {name: unit for name, (unit, *_) in POSSIBLE.items()} | TEXTS
MOST_LEVELS = 12  # of pressure; more is a sweep
SENSOR_OFFSET = 5e3  # below zero that a gauge may read without air [Pa]


@dataclass(frozen=True, eq=False)
class Measured:
    """Points of a static characteristic, SI."""

    file: pathlib.Path  # of the points
    pressure: np.ndarray  # gauge [Pa] (n,)
    force: np.ndarray  # [N] (n,)
    contraction: np.ndarray | None  # ratio [-] (n,); None where changes of length were measured
    change: np.ndarray | None  # of length [m] (n,); None where ratios were measured
    curve: np.ndarray  # number of each point's curve (n,)
    loaded: bool  # a load was set, and the length measured
    facts: JsonDict  # of the muscle, from the file's header [SI]
    slack: np.ndarray | None = None  # points of a slack muscle (n,); None where none is known

    def __len__(self) -> int:
        return len(self.pressure)

    @property
    def response(self) -> np.ndarray:
        """What a law is compared with: forces, or under set loads changes of length or contractions."""
        moved = self.change if self.contraction is None else self.contraction
        return self.force if moved is None or not self.loaded else moved

    @property
    def name(self) -> str:
        """The file's name with its folder's, which is often the muscle's."""
        return f"{self.file.parent.name}/{self.file.stem}".removeprefix("/")


def levels(pressure: np.ndarray, wide: float) -> np.ndarray:
    """The number of each pressure's level; a sweep, with a level wider than `wide` [Pa], has five."""
    ordered = np.sort(pressure)
    span = float(np.ptp(ordered))
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > max(0.02 * span, 5e3))
    if (len(starts) == 1 and span > wide) or len(starts) > MOST_LEVELS:
        starts = np.linspace(0, len(ordered), 5, endpoint=False).astype(int)
    return np.searchsorted(np.unique(ordered[starts]), pressure, side="right") - 1


def several(data: TableLike) -> list[TableLike]:
    """The data sets of an argument that may hold one or more."""
    return list(data) if isinstance(data, list | tuple) else [data]


def require_once(sources: Sequence[TableLike]) -> None:
    """Refuse a file that is given twice."""
    files = [os.path.realpath(each) for each in sources if isinstance(each, str | os.PathLike)]
    for file in files:
        if files.count(file) > 1:
            raise InputError("is given twice: its points would count double", file=file)


def read_measured(data: TableLike, known: Mapping[str, float] | None = None) -> Measured:
    """Measured points from a CSV, or from columns in memory."""
    table = table_of(data, EXAMPLE, "data")
    file = table.file
    facts = dict(known or {}) | read_facts(table, HEADER)
    check_facts(file, facts)
    arrays, units = columns_of(table, COLUMNS, EXAMPLE, NEEDED)
    pressure = arrays["pressure" if "pressure" in arrays else "absolute pressure"]
    if len(pressure) < 3:
        raise InputError(f"holds {len(pressure)} points", file=file, allowed="at least 3")
    if pressure.min() < -SENSOR_OFFSET or pressure.max() > 2e6:
        value, allowed = f"{pressure.min() * 1e-5:g} to {pressure.max() * 1e-5:g} bar", "gauge, 0 to 20 bar"
        raise InputError("is out of range", file=file, field="pressure", value=value, allowed=allowed)
    contraction, change = arrays.get("contraction"), arrays.get("change of length")
    total = facts.get("total_length", np.inf)
    if "length" in arrays:
        if "total_length" not in facts:
            problem = "is measured, so the muscle's length at rest must be stated"
            allowed = 'a header line "# total_length: 21.5 cm"'
            raise InputError(problem, file=file, field="length", allowed=allowed)
        change = total - arrays["length"]
    if change is not None and np.any(np.abs(change) > 0.6 * total):
        problem = "is more than 60 % of the muscle's length; is the unit right?"
        value = f"{100 * np.abs(change).max():.3g} cm"
        raise InputError(problem, file=file, field="change of length", value=value)
    if contraction is not None and np.any(np.abs(contraction) > 0.6):
        problem, value = "is beyond any muscle; is it in per cent?", f"{np.abs(contraction).max():g}"
        allowed = "-0.6 to 0.6, or the title contraction [%]"
        raise InputError(problem, file=file, field="contraction", value=value, allowed=allowed)
    loaded = "load" in arrays
    force = arrays["load"] if loaded else arrays["force"]
    if loaded:
        weight = GRAVITY if units["load"] == "kg" else 1.0
        force = weight * force + GRAVITY * facts.get("hanger", 0.0)
    curve = arrays.get("curve", np.round(pressure, -1))
    return Measured(file, pressure, force, contraction, change, curve, loaded, facts)


def check_facts(file: pathlib.Path | None, facts: JsonMapping, group: str = "") -> None:
    """Refuse facts about a muscle that cannot be, from a file's header or from the argument `group`."""
    for key, (si, low, high) in POSSIBLE.items():
        if key in facts and not low <= facts[key] <= high:
            usual, field = EXAMPLES[si].partition(" ")[2], f"{group}.{key}" if group else key
            shown = [f"{in_unit(value, si, usual):.4g}" for value in (facts[key], low, high)]
            value, allowed = f"{shown[0]} {usual}", f"{shown[1]} to {shown[2]} {usual}"
            raise InputError("is out of range", file=file, field=field, value=value, allowed=allowed)
    if facts.get("end_length", 0.0) >= facts.get("total_length", 2.0):
        raise InputError("is not less than the total length", file=file, field="end_length")


def columns_of(
    table: Table, known: Known, example: str, needed: Mapping[str, Sequence[str]] | None = None
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """A table's columns by name, each once and `known`, in SI, pressures gauge; and their SI units."""
    file, found, units = table.file, dict[str, np.ndarray](), dict[str, str]()
    for k, title in enumerate(table.titles):
        name = " ".join(split_title(title)[0].split())
        name = name if name in known else " ".join(re.split(r"[\s_]+", name.lower()))
        if name not in known:
            plain = [each for each in known if "/" not in each]
            allowed = ", ".join([*plain, *(["a column of a run"] if len(plain) < len(known) else [])])
            problem, near = "is an unknown column", nearest_name(name, known)
            raise InputError(problem, file=file, field="header", value=title, allowed=allowed, nearest=near)
        if name in found:
            raise InputError("occurs twice", file=file, field=name, value=title)
        scale, units[name] = 1.0, ""
        if si := known[name]:
            scale, units[name] = scale_of(file, name, title, si, example)
        if si is None:
            found[name] = np.array([cells[k] for _, cells in table.rows])
        else:
            found[name] = np.array([number(file, line, name, cells[k]) for line, cells in table.rows]) * scale
        if name == "time" and len(late := np.flatnonzero(np.diff(found[name]) <= 0.0)):
            line, at = table.rows[late[0] + 1][0], f"{found[name][late[0] + 1]:g} s"
            raise InputError(f"line {line}: time does not increase", file=file, field=name, value=at)
        if name.startswith("absolute "):
            found[name] = found[name] - AMBIENT_PRESSURE
    for words, names in (needed or {}).items():
        there = [name for name in names if name in found]
        if len(there) != 1:
            problem = f"has {' and '.join(there)}, where one is needed" if there else f"lacks {words}"
            value = ", ".join(table.titles)
            raise InputError(problem, file=file, field="header", value=value, allowed=example)
    return found, units
