"""Force plates: the ground's force on whoever stands there, and where it presses."""

import pathlib
import re
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.plate_baseline import WORTH, constant, place_of

_COMPONENT = re.compile(r"(?P<plate>.*?)_?(?P<kind>[vp])(?P<axis>[xyz])$")

PRESSED = 100.0  # force from which on its place must be known [N]
FAR = 60.0  # from the laboratory's origin, beyond which a place in metres is one in mm [m]; assumed
MOVED = 0.05  # by which a plate's constant may have moved its centre of pressure [m]; assumed


@dataclass(frozen=True, eq=False)
class Plate:
    """One plate in the laboratory's axes."""

    name: str
    time: np.ndarray  # [s] (n,)
    force: np.ndarray  # ground on foot [N] (n, 3)
    place: np.ndarray  # centre of pressure [m] (n, 3); meaningless where hardly anything presses
    corners: np.ndarray | None = None  # where the file tells them [m] (4, 3)
    remarks: tuple[str, ...] = ()  # what was odd about it and how it was read
    warnings: tuple[str, ...] = ()


def plate(file: pathlib.Path, name: str, time: np.ndarray, force: np.ndarray, place: np.ndarray) -> Plate:
    """A plate whose numbers are examined; a place that is blank while little presses is the nearest known.

    Many programs write none, or zeros, below 20 to 50 N: as a place, the origin has a lever of metres.

    Units: time [s] (n,), force [N] (n, 3), place [m] (n, 3).
    """
    for what, bad in (
        ("force", ~np.isfinite(force).all(axis=1)),
        ("place", np.isinf(place).any(axis=1)),
        ("place", np.isnan(place).any(axis=1) & (np.linalg.norm(force, axis=1) > PRESSED)),
    ):
        if bad.any():
            seen = f"its {what} is not a finite number at {time[np.argmax(bad)]:.4g} s"
            raise InputError(seen, file=file, field=f"plate {name}", allowed=f"a {what} for each loaded row")
    blank = np.isnan(place).any(axis=1) | ~place.any(axis=1)
    known = np.flatnonzero(~blank & (force != 0.0).any(axis=1))
    if blank.any() and len(known):
        place = np.where(blank[:, None], place[_nearest(known, len(place))], place)
    return Plate(name, time, force, np.nan_to_num(place))


def _nearest(known: np.ndarray, count: int) -> np.ndarray:
    """Of each of `count` samples, the nearest known one (count,)."""
    rows = np.arange(count)
    after = np.clip(np.searchsorted(known, rows), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    return np.asarray(np.where(rows - known[before] < known[after] - rows, known[before], known[after]))


def plates_of(table: OpenSimTable) -> list[Plate]:
    """The plates of an OpenSim ground-reaction file; none if it is another kind of file.

    A plate is what shares a prefix of `…vx …vy …vz …px …py …pz`: `ground_force_vx`, `1_ground_force_vx`,
    `ground_force_r_vx`. A constant without load is taken off, and places in mm are understood.
    """
    found: dict[str, dict[str, np.ndarray]] = {}
    for name, values in table.columns.items():
        match = _COMPONENT.match(name)
        if match:
            found.setdefault(match["plate"], {})[match["kind"] + match["axis"]] = values
    zero = np.zeros_like(table.time)
    return [
        zeroed(
            plate(
                table.file,
                name,
                table.time,
                np.column_stack([parts.get(f"v{axis}", zero) for axis in "xyz"]),
                np.column_stack([parts.get(f"p{axis}", zero) for axis in "xyz"]),
            )
        )
        for name, parts in found.items()
        if {"vx", "vy", "px"} <= set(parts)
    ]


def zeroed(found: Plate) -> Plate:
    """The plate without the constant that it reads unloaded, and with its place in metres.

    The axis across it is the one that carries most. The centre of pressure is corrected with the force
    where the file gives it without load too, and by little; elsewhere it stays.
    """
    load = np.linalg.norm(found.force, axis=1)
    pressed = load > PRESSED
    if not pressed.any():
        return found
    place, warnings, remarks = found.place, list(found.warnings), list(found.remarks)
    far = float(np.median(np.abs(place[pressed]).max(axis=1)))
    if FAR < far < 1e3 * FAR:
        place = place * 1e-3
        warnings.append(f"plate {found.name}: its centre of pressure is {far:.0f} m away; it was read as mm")
    up = np.eye(3)[int(np.argmax(np.abs(found.force[pressed]).mean(axis=0)))]
    moment = np.cross(place, found.force)
    rest = constant(found.time, found.force @ up, np.column_stack([found.force, moment]))
    force = found.force - rest[:3]
    if np.linalg.norm(rest[:3]) > WORTH[0]:
        remarks.append(
            f"plate {found.name}: read {np.linalg.norm(rest[:3]):.1f} N without load, which was taken off"
        )
        height = float(np.median(place[pressed] @ up))
        moved = place_of(force, moment - rest[3:], up, height)
        way = np.linalg.norm(moved - place, axis=1)[pressed]
        if np.isfinite(way).all() and np.median(way) < MOVED:
            place = np.where(np.isfinite(moved), moved, place)
    else:
        force = found.force
    return replace(found, force=force, place=place, remarks=tuple(remarks), warnings=tuple(warnings))
