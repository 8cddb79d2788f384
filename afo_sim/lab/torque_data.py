"""Measured static joint torque: a CSV of angle, pressure and torque, or a worn device's own log."""

import pathlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, InputError, Table, read_facts, split_title, table_of, unknown
from afo_sim.lab.measured import SENSOR_OFFSET, TEXTS, columns_of

EXAMPLE = "angle [deg], pressure [bar], torque [N*m]"
WORDS = {"group": "group", "test": "group", "chamber": "chamber", "muscle": "chamber"}
PATH = ("path length", "moment arm")  # [m]; with a muscle's name behind, where there are several
IGNORED = ("length", "note")  # that may stand in such a file; with a muscle's own length, its moment arm too
UNITS: dict[str, tuple[str, ...] | None] = {"time": ("s",), "angle": ("rad",), "torque": ("N*m",)}
UNITS |= {"cuff": ("m",)} | dict.fromkeys(("pressure", "absolute pressure"), ("Pa",))
NEEDED = {"an angle": ("angle",), "a pressure": ("pressure", "absolute pressure"), "a torque": ("torque",)}
UNITS |= dict.fromkeys(PATH, ("m",)) | dict.fromkeys((*WORDS, *IGNORED))
ONLY = "1"  # the group where there is no such column
HIGHEST, WIDEST, LARGEST = 2e6, np.radians(180.0), 1e4  # gauge pressure [Pa], angle [rad], torque [N·m]
FARTHEST = 0.5  # displacement of a cuff [m]

WITHOUT_AIR = 5e3  # gauge pressure up to which a reading is one without air [Pa]
SAME_ANGLE, SAME_PRESSURE = np.radians(0.05), 500.0  # settings are rounded to such steps
SAME_LENGTH = 5e-4  # and their measured paths to such [m]
ANGLE_RATE, PRESSURE_RATE = np.radians(2.0), 5e3  # up to which a sample of a log is still [rad/s], [Pa/s]
RATES = ANGLE_RATE, PRESSURE_RATE
WINDOW = 0.5  # over which the rates of a log are taken [s]
CELL_ANGLE, CELL_PRESSURE = np.radians(1.0), 5e3  # a still stretch is cut into cells of this size
FEWEST_SAMPLES = 10  # of a log
Columns = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Readings:
    """Static torques of one group (a test, a day, a wearer), SI, one number a setting."""

    file: pathlib.Path
    group: str
    angle: np.ndarray  # dorsiflexion positive
    pressure: np.ndarray  # gauge
    torque: np.ndarray  # dorsiflexion positive
    cuff: np.ndarray  # displacement along the pull; not a number where none was read
    weight: np.ndarray  # readings of a setting; a stretch of a log counts as one
    scatter: np.ndarray  # mean square of their torques about their mean
    path: Mapping[str, np.ndarray] = field(default_factory=dict)  # moment arm too [m] (2, n), by muscle

    def __len__(self) -> int:
        return len(self.angle)

    def take(self, keep: np.ndarray) -> "Readings":
        """Some of the settings."""
        names = ("angle", "pressure", "torque", "cuff", "weight", "scatter")
        path = {muscle: values[:, keep] for muscle, values in self.path.items()}
        return replace(self, path=path, **{name: getattr(self, name)[keep] for name in names})


@dataclass(frozen=True)
class Torques:
    """What was read of a file: a group's readings by its name, the chambers that its rows name, remarks."""

    groups: dict[str, Readings]
    chambers: tuple[str, ...]
    remarks: tuple[str, ...]


def read_torques(
    data: object, *, chamber: str = "", difference: bool = False, rates: tuple[float, float] = RATES
) -> Torques:
    """Measured torques from a CSV, or from columns in memory."""
    table = table_of(data, EXAMPLE, "data")
    read_facts(table, TEXTS)
    columns = _columns(table)
    columns, chambers = _of_chamber(table.file, columns, chamber)
    _check(table.file, columns)
    remarks = []
    if "time" in columns:
        columns, said = _still(table.file, columns, rates)
        remarks.append(said)
    else:
        columns["weight"] = np.ones(len(columns["angle"]))
    pressure, torque = columns["pressure"], np.abs(columns["torque"])
    empty = np.abs(pressure - AMBIENT_PRESSURE) < 5e3
    if pressure.min() >= 0.9e5 and empty.any() and torque[empty].max() <= 0.02 * torque.max():
        remark = "at 1 bar the torque is zero, and no pressure is lower: if these pressures are absolute, "
        remarks.append(f"{remark}the title of their column must be absolute pressure")
    unused = [title for title in table.titles if re.match("length|moment.arm", title.strip().lower())]
    if unused and not _of_path(columns):
        remarks.append(f"{', '.join(unused)}: not used; a path has columns path length and moment arm")
    groups = {}
    for name in dict.fromkeys(columns["group"].tolist()):
        own = {key: values[columns["group"] == name] for key, values in columns.items()}
        if difference:
            own, said = _less_without_air(table.file, own)
            remarks += [f"group {name}: {said}" if said and name != ONLY else said] if said else []
        groups[name] = _settings(table.file, name, own)
    before, after = len(columns["angle"]), sum(len(g) for g in groups.values())
    if after < before and not difference:
        remarks.append(f"{before} readings are of {after} settings; those of one setting count once")
    return Torques(groups, chambers, tuple(remarks))


def _columns(table: Table) -> Columns:
    """Columns by their meaning, SI; nothing twice, nothing unknown, nothing missing."""
    names = [re.sub(r"[\s_]+", " ", split_title(title)[0].strip().lower()) for title in table.titles]
    paths = [name for name in names if name.startswith(PATH)]
    own = "length" in names and not any(name.startswith(PATH[0]) for name in paths)  # a muscle's, and no path
    units: tuple[str, ...] | None = None if own else ("m",)
    columns, _ = columns_of(table, UNITS | dict.fromkeys(paths, units), EXAMPLE, NEEDED)
    found: Columns = {}
    for name in (name for name in columns if name not in IGNORED and not (own and name in paths)):
        meant = WORDS.get(name, "pressure" if name == "absolute pressure" else name)
        if meant in found:
            raise InputError("occurs twice", file=table.file, field=meant, value=name)
        found[meant] = columns[name]
    for name in _of_path(found):
        partner = name.replace(*(PATH if name.startswith(PATH[0]) else PATH[::-1]))
        if partner not in found:
            raise InputError("is given without its partner", file=table.file, field=name, allowed=partner)
    count = len(table.rows)
    if not count:
        raise InputError("holds no points", file=table.file, allowed=EXAMPLE)
    found.setdefault("group", np.full(count, ONLY, dtype=object))
    found.setdefault("chamber", np.full(count, "", dtype=object))
    found.setdefault("cuff", np.full(count, np.nan))
    return found


def _of_chamber(file: pathlib.Path, columns: Columns, chamber: str) -> tuple[Columns, tuple[str, ...]]:
    named = columns.pop("chamber")
    chambers = tuple(dict.fromkeys(name for name in named.tolist() if name))
    if not (chamber and chambers):
        return columns, chambers
    if chamber not in chambers:
        problem = "the file's rows are of other chambers"
        raise unknown(chamber, chambers, field="chamber", file=file, problem=problem)
    keep = (named == chamber) | (columns["pressure"] <= WITHOUT_AIR)
    return {name: values[keep] for name, values in columns.items()}, (chamber,)


def _check(file: pathlib.Path, columns: Columns) -> None:
    """Refuse numbers that no joint and no muscle has: they are of another unit, or absolute."""
    for name, low, high, unit, shown, words in (
        ("pressure", -SENSOR_OFFSET, HIGHEST, "bar", 1e-5, "gauge, 0 to 20 bar; or absolute pressure [bar]"),
        ("angle", -WIDEST, WIDEST, "deg", 180.0 / np.pi, "-180 to 180 deg; is the unit right?"),
        ("torque", -LARGEST, LARGEST, "N·m", 1.0, "-10 to 10 kN*m; is the unit right?"),
        ("cuff", -FARTHEST, FARTHEST, "cm", 100.0, "-50 to 50 cm; is the unit right?"),
    ):
        values = columns[name]
        beyond = values[(values < low) | (values > high)]
        if len(beyond):
            value = f"{shown * beyond[0]:.4g} {unit}"
            raise InputError("is out of range", file=file, field=name, value=value, allowed=words)


def _still(file: pathlib.Path, columns: Columns, rates: tuple[float, float]) -> tuple[Columns, str]:
    """Means over the still stretches of a log, and how many samples and readings these are."""
    time = columns.pop("time")
    if len(time) < FEWEST_SAMPLES:
        few = f"holds {len(time)} samples"
        raise InputError(few, file=file, field="time", allowed=f"a log of at least {FEWEST_SAMPLES}")
    (angle, turning), (pressure, filling) = (_line(time, columns[name]) for name in ("angle", "pressure"))
    still = (np.abs(turning) <= rates[0]) & (np.abs(filling) <= rates[1])
    bounds = f"{np.degrees(rates[0]):.3g} deg/s and {rates[1] * 1e-5:.3g} bar/s"
    if not still.any():
        least = f"{np.degrees(np.abs(turning).min()):.3g} deg/s, {np.abs(filling).min() * 1e-5:.3g} bar/s"
        problem = f"is never still: angle and pressure always change faster than {bounds}"
        allowed = "higher bounds, or held postures"
        raise InputError(problem, file=file, field="time", value=least, allowed=allowed)
    stretch = np.cumsum(np.diff(still.astype(int), prepend=0) == 1)
    turned, filled = np.floor(angle / CELL_ANGLE + 0.5), np.floor(pressure / CELL_PRESSURE + 0.5)
    cells: dict[tuple[object, ...], list[int]] = {}
    for k in np.flatnonzero(still):
        key = columns["group"][k], stretch[k], turned[k], filled[k]
        cells.setdefault(key, []).append(int(k))
    found: Columns = {"group": np.array([key[0] for key in cells], dtype=object)}
    for name in ("angle", "pressure", "torque", "cuff", *_of_path(columns)):
        found[name] = np.array([columns[name][rows].mean() for rows in cells.values()])
    found["weight"] = np.ones(len(cells))
    said = f"{int(still.sum())} of {len(time)} samples are still (slower than {bounds}, over {WINDOW:g} s); "
    said += f"their intervals give {len(cells)} readings"
    return found, said


def _line(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the samples within half a window to either side, and slope of the line through them [1/s]."""
    first = np.searchsorted(time, time - 0.5 * WINDOW)
    last = np.searchsorted(time, time + 0.5 * WINDOW, side="right")
    first, last = np.minimum(first, len(time) - 2), np.maximum(last, 2)
    narrow = last - first < 2  # slow logs: at least the neighbours
    first, last = np.where(narrow, np.maximum(first - 1, 0), first), np.where(narrow, last + 1, last)
    last = np.minimum(last, len(time))
    t, y = time - time.mean(), values - values.mean()

    def total(x: np.ndarray) -> np.ndarray:
        sums = np.concatenate([[0.0], np.cumsum(x)])
        return sums[last] - sums[first]

    n = (last - first).astype(float)
    spread = total(t * t) - total(t) ** 2 / n
    slope = (total(t * y) - total(t) * total(y) / n) / np.maximum(spread, 1e-300)
    return values.mean() + total(y) / n, slope


def _less_without_air(file: pathlib.Path, columns: Columns) -> tuple[Columns, str]:
    """Torques less those read without air at the same angle, between which a straight line is drawn."""
    empty = columns["pressure"] <= WITHOUT_AIR
    if not empty.any():
        return columns, "no reading without air: taken as differences already"
    if empty.all():
        raise InputError("holds readings without air only", file=file, field="pressure")
    angles, where = np.unique(columns["angle"][empty], return_inverse=True)
    base = np.bincount(where, columns["torque"][empty]) / np.bincount(where)
    angle = columns["angle"]
    within = (angle >= angles[0] - SAME_ANGLE) & (angle <= angles[-1] + SAME_ANGLE)
    keep = ~empty & within
    if not keep.any():
        span = f"{np.degrees(angles[0]):.3g} to {np.degrees(angles[-1]):.3g} deg"
        problem = "no reading with air lies within the angles that were read without air"
        raise InputError(problem, file=file, field="angle", value=span)
    found = {name: values[keep] for name, values in columns.items()}
    found["torque"] = found["torque"] - np.interp(found["angle"], angles, base)
    outside = int(np.sum(~empty & ~within))
    said = f"{int(empty.sum())} readings without air were subtracted from the others"
    return found, said + (f"; {outside} at other angles are left out" if outside else "")


def _settings(file: pathlib.Path, group: str, columns: Columns) -> Readings:
    """Means of the readings at one angle and pressure, in the order of the file."""
    measured = _of_path(columns)
    steps = {"angle": SAME_ANGLE, "pressure": SAME_PRESSURE, **dict.fromkeys(measured, SAME_LENGTH)}
    keys = np.column_stack([np.round(columns[name] / step) for name, step in steps.items()])
    _, first, where = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # of the settings, as they come in the file
    where = np.ravel(where)
    weight = np.bincount(where, columns["weight"])

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(where, columns["weight"] * values) / weight

    means = {name: mean(columns[name])[order] for name in ("angle", "pressure", "torque", *measured)}
    scatter = mean((columns["torque"] - mean(columns["torque"])[where]) ** 2)[order]
    seen = np.isfinite(columns["cuff"])
    share = np.bincount(where[seen], minlength=len(order))
    with np.errstate(invalid="ignore"):  # where none was read
        cuff = np.bincount(where[seen], columns["cuff"][seen], len(order)) / np.where(share, share, np.nan)
    pairs = {n.removeprefix(PATH[0]): n for n in measured if n.startswith(PATH[0])}
    path = {k.strip(): np.array([means.pop(n), means.pop(PATH[1] + k)]) for k, n in pairs.items()}
    return Readings(file, group, **means, cuff=cuff[order], weight=weight[order], scatter=scatter, path=path)


def _of_path(columns: Columns) -> list[str]:
    return [name for name in columns if name.startswith(PATH)]


def joined(parts: Mapping[str, Torques]) -> Torques:
    """Several files as one: groups by name, with the file's name if two have the same."""
    groups: dict[str, Readings] = {}
    for name, part in parts.items():
        for group, readings in part.groups.items():
            own = group if len(parts) == 1 else (name if group == ONLY else f"{name}/{group}")
            groups[own] = replace(readings, group=own)
    chambers = tuple(dict.fromkeys(c for part in parts.values() for c in part.chambers))
    return Torques(groups, chambers, tuple(r for part in parts.values() for r in part.remarks))
