"""Marker trajectories, and which marker sits where on the leg."""

import pathlib
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.gait.readers.choices import ROLES, Choices

# Usual names by role, lower case without punctuation, "?" for the side's letter. The first line is the
# outer side's marker; where the inner side's of the second line is there too, their midpoint counts.
USUAL = {
    "hip": (("?hjc", "?gtro", "?gtr", "?troch", "?hip", "?hipjc"), ()),
    "knee": (
        ("?kjc", "?kneelat", "?lek", "?kne", "?knee", "?lfc", "?lfe", "?fle"),
        ("?kneemed", "?mek", "?mfc", "?mfe", "?fme", "?kneem"),
    ),
    "ankle": (
        ("?ajc", "?anklelat", "?lm", "?ank", "?ankle", "?lmal", "?fal", "?mall"),
        ("?anklemed", "?mm", "?mmal", "?tam", "?medmal"),
    ),
    "heel": (("?heel", "?hee", "?cal", "?calc", "?fcc"), ()),
    "toe": (("?mt5", "?toelat", "?5mt", "?toe", "?vmh", "?fm5", "?d5m", "?fmt5"), ()),
}


@dataclass(frozen=True, eq=False)
class Markers:
    """Trajectories in the laboratory's axes; a marker that was not seen is NaN."""

    file: pathlib.Path
    time: np.ndarray  # [s] (n,)
    positions: dict[str, np.ndarray]  # name: (n, 3) [m]

    def name(self, role: str, choices: Choices) -> tuple[str, ...]:
        """The markers that give a point of the leg; their midpoint is meant.

        Raises
        ------
        InputError
            A name that the file has not, or none of the usual names for this role.
        """
        if role in choices.markers:
            for name in choices.markers[role]:
                if name not in self.positions:
                    raise unknown(
                        name,
                        self.positions,
                        field=f"marker.{role}",
                        problem=f"there is no such marker in {self.file}",
                    )
            return choices.markers[role]
        outer, inner = (self._usual(names, choices.letter) for names in USUAL[role])
        if outer is None:
            raise InputError(
                f"no marker of the {choices.side} {role} in {self.file} is known by its name",
                field=f"marker.{role}",
                allowed=f"one of {', '.join(self.positions)}",
            )
        return (outer,) if inner is None else (outer, inner)

    def has(self, role: str, choices: Choices) -> bool:
        """Whether `name` would find something."""
        return role in choices.markers or self._usual(USUAL[role][0], choices.letter) is not None

    def point(self, names: Sequence[str]) -> np.ndarray:
        """The midpoint of some markers [m] (n, 3)."""
        return np.asarray(np.mean([self.positions[name] for name in names], axis=0))

    def _usual(self, patterns: Sequence[str], letter: str) -> str | None:
        plain = {re.sub("[^a-z0-9]", "", name.split(":")[-1].lower()): name for name in self.positions}
        for pattern in patterns:
            found = plain.get(pattern.replace("?", letter))
            if found is not None:
                return found
        return None


def known_roles(markers: Markers, choices: Choices) -> dict[str, tuple[str, ...]]:
    """The roles that markers are known for, each with its markers."""
    return {role: markers.name(role, choices) for role in ROLES if markers.has(role, choices)}
