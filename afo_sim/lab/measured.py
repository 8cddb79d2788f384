"""Measured characteristics of a muscle: a CSV of pressure, contraction or length, and force or load."""

import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import (
    AMBIENT_PRESSURE,
    EXAMPLES,
    GRAVITY,
    InputError,
    in_unit,
    nearest_name,
    number,
    read_facts,
    scale_of,
    split_title,
    table_of,
)

# Column → the SI units that it may be given in.
COLUMNS: dict[str, tuple[str, ...]] = {
    "pressure": ("Pa",),
    "absolute pressure": ("Pa",),
    "contraction": ("",),
    "length": ("m",),
    "change of length": ("m",),
    "force": ("N",),
    "load": ("kg", "N"),
    "curve": (),
}
EXAMPLE = "pressure [bar], contraction [-], force [N]; or pressure [bar], load [kg], change of length [cm]"
# Header line "# key: value" → SI unit; text where there is none.
HEADER: dict[str, str | None] = {
    "total_length": "m",
    "end_length": "m",
    "bore": "m",
    "braid_angle": "rad",
    "hanger": "kg",
    "damping": "m^2*s",
    "braid_stiffness": "N",
    "dead_volume": "m^3",
    "mass": "kg",
    "source": None,
    "licence": None,
    "note": None,
}


# Range of each property of a muscle, SI: from, to.
POSSIBLE = {
    "total_length": (1e-3, 2.0),
    "end_length": (0.0, 1.0),
    "bore": (5e-4, 0.2),
    "braid_angle": (0.0873, 0.872),
    "hanger": (0.0, 50.0),
    "damping": (0.0, 1.0),
    "braid_stiffness": (1.0, 1e7),
    "dead_volume": (1e-9, 0.1),
    "mass": (0.0, 20.0),
}
MOST_LEVELS = 12  # of pressure; more is a sweep
SENSOR_OFFSET = 5e3  # below zero that a gauge may read without air [Pa]


@dataclass(frozen=True, eq=False)
class Measured:
    """Points of a static characteristic, SI."""

    file: pathlib.Path
    pressure: np.ndarray
    force: np.ndarray
    contraction: np.ndarray | None
    change: np.ndarray | None
    curve: np.ndarray
    loaded: bool
    facts: dict[str, Any]
    slack: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.pressure)

    @property
    def name(self) -> str:
        """The file's name with its folder's, which is often the muscle's."""
        return f"{self.file.parent.name}/{self.file.stem}".removeprefix("/")


def level_starts(ordered: np.ndarray, wide: float) -> np.ndarray:
    """Where levels of rising pressures [Pa] begin: nearer than 2 % of their span is one.

    More than a dozen, and one level wider than `wide`, are a sweep, which is cut into five blocks.
    """
    span = float(np.ptp(ordered))
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > max(0.02 * span, 5e3))
    if (len(starts) == 1 and span > wide) or len(starts) > MOST_LEVELS:
        starts = np.linspace(0, len(ordered), 5, endpoint=False).astype(int)
    return starts


def several(data: Any) -> list[Any]:
    """The data sets of an argument that may hold one or more."""
    return list(data) if isinstance(data, list | tuple) else [data]


def require_once(sources: Sequence[Any]) -> None:
    """Refuse a file that is given twice."""
    files = [os.path.realpath(each) for each in sources if isinstance(each, str | os.PathLike)]
    for file in files:
        if files.count(file) > 1:
            raise InputError("is given twice: its points would count double", file=file)


def read_measured(data: Any, known: Mapping[str, float] | None = None) -> Measured:
    """Measured points from a CSV, or from columns in memory."""
    table = table_of(data, EXAMPLE, "data")
    file = table.file
    facts = dict(known or {}) | read_facts(table, HEADER)
    check_facts(file, facts)
    columns = [column_of(file, title) for title in table.titles]
    names = [name for name, _, _ in columns]
    _require(file, names)
    values: dict[str, list[Any]] = {name: [] for name in names}
    for line, cells in table.rows:
        for (name, scale, _), cell in zip(columns, cells, strict=True):
            values[name].append(cell if name == "curve" else number(file, line, name, cell) * scale)
    return _measured(file, values, {name: si for name, _, si in columns}, facts)


def _measured(
    file: pathlib.Path, values: dict[str, list[Any]], units: dict[str, str], facts: dict[str, Any]
) -> Measured:
    arrays = {name: np.array(v) for name, v in values.items()}
    pressure = arrays.get("pressure")
    if pressure is None:
        pressure = arrays["absolute pressure"] - AMBIENT_PRESSURE
    if len(pressure) < 3:
        raise InputError(f"holds {len(pressure)} points", file=file, allowed="at least 3")
    if pressure.min() < -SENSOR_OFFSET or pressure.max() > 2e6:
        raise InputError(
            "is out of range",
            file=file,
            field="pressure",
            value=f"{pressure.min() * 1e-5:g} to {pressure.max() * 1e-5:g} bar",
            allowed="gauge, 0 to 20 bar",
        )
    contraction = arrays.get("contraction")
    change = arrays.get("change of length")
    if "length" in arrays:
        if "total_length" not in facts:
            raise InputError(
                "is measured, so the muscle's length at rest must be stated",
                file=file,
                field="length",
                allowed='a header line "# total_length: 21.5 cm"',
            )
        change = facts["total_length"] - arrays["length"]
    if (
        change is not None
        and "total_length" in facts
        and np.any(np.abs(change) > 0.6 * facts["total_length"])
    ):
        raise InputError(
            "is more than 60 % of the muscle's length; is the unit right?",
            file=file,
            field="change of length",
            value=f"{100 * np.abs(change).max():.3g} cm",
        )
    if contraction is not None and np.any(np.abs(contraction) > 0.6):
        raise InputError(
            "is beyond any muscle; is it in per cent?",
            file=file,
            field="contraction",
            value=f"{np.abs(contraction).max():g}",
            allowed="-0.6 to 0.6, or the title contraction [%]",
        )
    loaded = "load" in arrays
    force = arrays["load"] if loaded else arrays["force"]
    if loaded:
        weight = GRAVITY if units["load"] == "kg" else 1.0
        force = weight * force + GRAVITY * facts.get("hanger", 0.0)
    curve = arrays.get("curve", np.round(pressure, -1))
    return Measured(file, pressure, force, contraction, change, curve, loaded, facts)


def _require(file: pathlib.Path, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError("stands there twice", file=file, field=name)
    for needed, one_of in (
        ("a pressure", ("pressure", "absolute pressure")),
        ("a contraction or a length", ("contraction", "length", "change of length")),
        ("a force or a load", ("force", "load")),
    ):
        found = [name for name in one_of if name in names]
        if len(found) != 1:
            problem = f"lacks {needed}" if not found else f"has {' and '.join(found)}, where one is needed"
            raise InputError(problem, file=file, field="header", value=", ".join(names), allowed=EXAMPLE)


def check_facts(file: pathlib.Path | None, facts: Mapping[str, Any], group: str = "") -> None:
    """Refuse facts about a muscle that cannot be, from a file's header or from the argument `group`."""
    for key, (low, high) in POSSIBLE.items():
        if key in facts and not low <= facts[key] <= high:
            si = HEADER[key] or ""
            usual = EXAMPLES[si].partition(" ")[2]
            shown = [f"{in_unit(value, si, usual):.4g}" for value in (facts[key], low, high)]
            raise InputError(
                "is out of range",
                file=file,
                field=f"{group}.{key}" if group else key,
                value=f"{shown[0]} {usual}",
                allowed=f"{shown[1]} to {shown[2]} {usual}",
            )
    if facts.get("end_length", 0.0) >= facts.get("total_length", 2.0):
        raise InputError("is not less than the total length", file=file, field="end_length")


def column_of(
    file: pathlib.Path, title: str, columns: Mapping[str, tuple[str, ...]] = COLUMNS, example: str = EXAMPLE
) -> tuple[str, float, str]:
    """Name of a column, the factor that takes its values to SI, and that SI unit."""
    name = re.sub(r"[\s_]+", " ", split_title(title)[0].strip().lower())
    if name not in columns:
        raise InputError(
            "is an unknown column",
            file=file,
            field="header",
            value=title,
            allowed=", ".join(columns),
            nearest=nearest_name(name, columns),
        )
    if not columns[name]:
        return name, 1.0, ""
    scale, si = scale_of(file, name, title, columns[name], example)
    return name, scale, si
