"""Force plates: the ground's force on whoever stands there, and where it presses."""

import re
from dataclasses import dataclass

import numpy as np

from afo_sim.gait.readers.opensim_table import OpenSimTable

_COMPONENT = re.compile(r"(?P<plate>.*?)_?(?P<kind>[vp])(?P<axis>[xyz])$")


@dataclass(frozen=True, eq=False)
class Plate:
    """One plate in the laboratory's axes."""

    name: str
    time: np.ndarray  # [s] (n,)
    force: np.ndarray  # ground on foot [N] (n, 3)
    place: np.ndarray  # centre of pressure [m] (n, 3); meaningless where hardly anything presses


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
        Plate(
            name,
            table.time,
            np.column_stack([np.nan_to_num(parts.get(f"v{axis}", zero)) for axis in "xyz"]),
            np.column_stack([np.nan_to_num(parts.get(f"p{axis}", zero)) for axis in "xyz"]),
        )
        for name, parts in found.items()
        if {"vx", "vy", "px"} <= set(parts)
    ]
