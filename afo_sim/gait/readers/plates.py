"""Force plates: the ground's force on whoever stands there, and where it presses."""

import pathlib
import re
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.opensim_table import OpenSimTable

_COMPONENT = re.compile(r"(?P<plate>.*?)_?(?P<kind>[vp])(?P<axis>[xyz])$")

PRESSED = 100.0  # force from which on its place must be known [N]


@dataclass(frozen=True, eq=False)
class Plate:
    """One plate in the laboratory's axes."""

    name: str
    time: np.ndarray  # [s] (n,)
    force: np.ndarray  # ground on foot [N] (n, 3)
    place: np.ndarray  # centre of pressure [m] (n, 3); meaningless where hardly anything presses


def plate(file: pathlib.Path, name: str, time: np.ndarray, force: np.ndarray, place: np.ndarray) -> Plate:
    """A plate whose numbers are examined; a place without a number is 0 while hardly anything presses.

    Parameters
    ----------
    file, name : of the plate, for messages
    time : [s] (n,)
    force : ground on foot, in the laboratory's axes [N] (n, 3)
    place : centre of pressure [m] (n, 3)

    Raises
    ------
    InputError
        A force, or the place of a force, is not a finite number.
    """
    for what, bad in (
        ("force", ~np.isfinite(force).all(axis=1)),
        ("place", np.isinf(place).any(axis=1)),
        ("place", np.isnan(place).any(axis=1) & (np.linalg.norm(force, axis=1) > PRESSED)),
    ):
        if bad.any():
            seen = f"its {what} is not a finite number at {time[np.argmax(bad)]:.4g} s"
            raise InputError(seen, file=file, field=f"plate {name}", allowed=f"a {what} for each loaded row")
    return Plate(name, time, force, np.nan_to_num(place))


def plates_of(table: OpenSimTable) -> list[Plate]:
    """The plates of an OpenSim ground-reaction file; none if it is another kind of file.

    A plate is what shares a prefix of `…vx …vy …vz …px …py …pz`: `ground_force_vx`, `1_ground_force_vx`,
    `ground_force_r_vx`.
    """
    found: dict[str, dict[str, np.ndarray]] = {}
    for name, values in table.columns.items():
        match = _COMPONENT.match(name)
        if match:
            found.setdefault(match["plate"], {})[match["kind"] + match["axis"]] = values
    zero = np.zeros_like(table.time)
    return [
        plate(
            table.file,
            name,
            table.time,
            np.column_stack([parts.get(f"v{axis}", zero) for axis in "xyz"]),
            np.column_stack([parts.get(f"p{axis}", zero) for axis in "xyz"]),
        )
        for name, parts in found.items()
        if {"vx", "vy", "px"} <= set(parts)
    ]
