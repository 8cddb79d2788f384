"""Parameters of a resolved scenario by their dotted keys, and values a little beside them."""

import fnmatch
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from afo_sim.description import load

# Not physical: what runs, how finely, and what is only said; what other tests move.
NOT_PHYSICAL = (
    *("*name", "*description", "*provenance*", "*.file", "*.cuff", "*.plate", "callback"),
    *("duration", "timestep", "record_rate", "leg.shank", "leg.foot", "leg.ankle", "shank.pose"),
    # nodes of the air, by name; test_air_liveness.py moves what an air path has
    *("*.feed", "*.exhaust", "*.open"),
    "*.joint",  # test_any_joint.py has others
    "*.joint_centre",  # of torque fits; a run refuses one
    "*.range_of_motion",
    "*side",  # test_liveness.py moves the sides
)
# What a parameter that is zero is changed by.
AMOUNT = {"m": 0.005, "rad": 0.035, "N*m": 0.1, "kg*m^2": 0.002, "N": 20.0, "N*s/m": 20.0, "N*m*s/rad": 0.5}


def leaves(node: Any, path: str = "") -> dict[str, Any]:
    """Every value of nested tables by its dotted key; lists stay whole. What is not told is left out."""
    if isinstance(node, dict):
        return {
            k: v for key, child in node.items() for k, v in leaves(child, f"{path}.{key}".strip(".")).items()
        }
    return {} if node is None else {path: node}


def nudged(value: Any, share: float = 0.05) -> Any:
    """A share more, of a whole number one; of zero AMOUNT of its unit, or 0.05 of a plain number."""
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return value * (1.0 + share) if value else 0.05
    number, unit = value.split(" ", 1)
    amount = float(number) * (1.0 + share) if float(number) else AMOUNT[unit]
    return f"{amount!r} {unit}"


def is_one(key: str, patterns: Iterable[str]) -> str | None:
    """The first pattern that a key fits."""
    return next((pattern for pattern in patterns if fnmatch.fnmatch(key, pattern)), None)


def parameters(scenario: str, sets: Mapping[str, Any], left_out: Iterable[str]) -> dict[str, Any]:
    """Every value of a resolved scenario by its dotted key, but for what fits a pattern."""
    told = leaves(load("scenario", scenario, dict(sets)).resolved())
    return {k: v for k, v in told.items() if is_one(k, (*NOT_PHYSICAL, *left_out)) is None}


def assert_moves(before: Any, after: Any, column: str, share: float, told: str) -> None:
    """A column of a run has moved by more than a share of its largest value."""
    assert after.ok, after.status
    moved, largest = np.abs(after[column] - before[column]).max(), np.abs(before[column]).max()
    assert moved > share * max(largest, 1e-12), f"{told} does not move {column}"
