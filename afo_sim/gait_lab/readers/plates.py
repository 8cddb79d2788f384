"""Force plates: the ground's force, where it presses, and the constant without load, which is taken off."""

import pathlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.signals import nearest_of, stretches

_COMPONENT = re.compile(r"(?P<plate>.*?)_?(?P<kind>[vp])(?P<axis>[xyz])$")
_BAND = 10.0  # about the constant, within which a plate is unloaded [N]; assumed: twice a plate's noise
_REST = 0.1  # shortest stretch without load [s]; assumed: a third of a swing
_SHARE = 0.03  # of the trial that is without load [-]; assumed
_STEPPED = 100.0  # beyond the constant: somebody was on the plate [N]; assumed
_LARGEST = 0.15  # of the greatest load: beyond, it is somebody standing still [-]; assumed
# What is worth taking off: 2 N is given; 1 N·m moves the pressure of 700 N by 1.4 mm (derived).
_WORTH = (2.0, 1.0)  # [N], [N·m]

PRESSED = 100.0  # force from which on its place must be known [N]
_FAR = 60.0  # from the laboratory's origin, beyond which a place in metres is one in mm [m]; assumed
_MOVED = 0.05  # by which a plate's constant may have moved its centre of pressure [m]; assumed


@dataclass(frozen=True, eq=False)
class Plate(Noted):
    """One plate in the laboratory's axes."""

    name: str
    time: np.ndarray  # [s] (n,)
    force: np.ndarray  # ground on foot [N] (n, 3)
    place: np.ndarray  # centre of pressure [m] (n, 3); meaningless where hardly anything presses
    corners: np.ndarray | None = None  # where the file states them [m] (4, 3)
    notices: tuple[Notice, ...] = ()  # what was odd about it and how it was read


def plate(file: pathlib.Path, name: str, time: np.ndarray, force: np.ndarray, place: np.ndarray) -> Plate:
    """A plate whose numbers are examined; a place that is blank while little presses is the nearest known."""
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
        place = np.where(blank[:, None], place[nearest_of(known, len(place))], place)
    return Plate(name, time, force, np.nan_to_num(place))


def plates_of(table: OpenSimTable) -> list[Plate]:
    """The plates of an OpenSim ground-reaction file; none if it is another kind of file."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for name, values in table.columns.items():
        match = _COMPONENT.match(name)
        if match:
            found.setdefault(match["plate"], {})[match["kind"] + match["axis"]] = values
    for name, parts in found.items():
        if {"vx", "vy"} <= set(parts) and "px" not in parts and "force" in name.lower():
            problem = f"has the force of plate {name}, and not its place"
            allowed = f"{name}_px, _py, _pz beside {name}_vx, _vy, _vz"
            raise InputError(problem, file=table.file, allowed=allowed)
    whole = {name: parts for name, parts in found.items() if {"vx", "vy", "px"} <= set(parts)}
    return [plate_of(table.file, name, table.time, parts) for name, parts in whole.items()]


def plate_of(file: pathlib.Path, name: str, time: np.ndarray, parts: Mapping[str, np.ndarray]) -> Plate:
    """A plate of the columns vx … of its force [N] and px … of its place [m]; those that lack are 0."""
    zero = np.zeros_like(time)
    force, place = (np.column_stack([parts.get(kind + axis, zero) for axis in "xyz"]) for kind in "vp")
    return zeroed(plate(file, name, time, force, place))


def offset_note(name: str, rest: np.ndarray) -> Notice:
    """What a plate read without load."""
    text = "plate {subject}: read {force:.1f} N without load, which was taken off"
    return note("plate-offset", text, subject=name, force=float(np.linalg.norm(rest)))


def zeroed(found: Plate) -> Plate:
    """The plate without the constant that it reads unloaded, and with its place in metres."""
    pressed = np.linalg.norm(found.force, axis=1) > PRESSED
    if not pressed.any():
        return found
    force, place, notices = found.force, found.place, list(found.notices)
    far = float(np.median(np.abs(place[pressed]).max(axis=1)))
    if _FAR < far < 1e3 * _FAR:
        place = place * 1e-3
        text = "plate {subject}: its centre of pressure is {away:.0f} m away; it was read as mm"
        notices.append(Notice("plate-pressure-unit", text, subject=found.name, away=far))
    up = np.eye(3)[int(np.argmax(np.abs(found.force[pressed]).mean(axis=0)))]
    moment = np.cross(place, found.force)
    rest = constant(found.time, found.force @ up, np.column_stack([found.force, moment]))
    if np.linalg.norm(rest[:3]) > _WORTH[0]:
        force = force - rest[:3]
        notices.append(offset_note(found.name, rest[:3]))
        height = float(np.median(place[pressed] @ up))
        moved = place_of(force, moment - rest[3:], up, height)
        way = np.linalg.norm(moved - place, axis=1)[pressed]
        if np.isfinite(way).all() and np.median(way) < _MOVED:
            place = np.where(np.isfinite(moved), moved, place)
    return replace(found, force=force, place=place, notices=tuple(notices))


def _unloaded(time: np.ndarray, load: np.ndarray) -> np.ndarray | None:
    """Samples in which nothing presses, if they are clear."""
    if len(load) < 8 or not np.isfinite(load).all():
        return None
    middle = float(np.median(load))
    up, down = np.quantile(load, 0.999) - middle, middle - np.quantile(load, 0.001)
    # a plate loaded for most of the trial swings to the other side: the end nearer to nothing is its rest
    rest = float(np.quantile(load, 0.03 if abs(np.max(load)) >= abs(np.min(load)) else 0.97))
    if max(up, down) < _STEPPED:
        rest = middle
    for _ in range(3):
        near = np.abs(load - rest) < _BAND
        if not near.any():
            return None
        rest = float(np.median(load[near]))
    near = np.abs(load - rest) < _BAND
    greatest = float(np.abs(load - rest).max())
    still = stretches(near)
    step = float(time[-1] - time[0]) / (len(time) - 1)
    longest = max(stop - first for first, stop in still) * step
    # somebody who stands still is heavier
    largest = _LARGEST * greatest if greatest >= _STEPPED else _STEPPED
    if near.mean() < _SHARE or longest < _REST or abs(rest) > largest:
        return None
    # by chance in the band while a foot comes or goes: the long stretches alone
    kept = np.zeros(len(load), dtype=bool)
    for first, stop in still:
        kept[first:stop] = (stop - first) * step >= 0.5 * _REST
    return kept


def constant(time: np.ndarray, load: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """What the plate's signals read without load; zeros where that is little, or not clear."""
    rest = _unloaded(time, load)
    nothing = np.zeros(signals.shape[1])
    if rest is None or not np.isfinite(signals).all():
        return nothing
    found = np.median(signals[rest], axis=0)
    worth = np.linalg.norm(found[:3]) > _WORTH[0] or np.linalg.norm(found[3:]) > _WORTH[1]
    return np.asarray(found) if worth else nothing


def place_of(force: np.ndarray, moment: np.ndarray, up: np.ndarray, height: float) -> np.ndarray:
    """Where a force presses on a level plane."""
    across = force @ up
    with np.errstate(divide="ignore", invalid="ignore"):
        # from p × F = M and p·u = h: u × (p × F) = p (u·F) − F (u·p)
        place = (np.cross(up, moment) + height * force) / across[:, None]
    return np.where(np.abs(across[:, None]) < 1.0, np.nan, place)
