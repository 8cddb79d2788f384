"""Mean of several strides, and how much they scatter."""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.cycle import KINEMATICS, GaitCycle

KINETICS = ("grf_x", "grf_z", "cop_x", "ankle_moment")
NAMED = 6  # strides whose own notes are told in the mean's


def mean_cycle(cycles: Sequence[GaitCycle]) -> tuple[GaitCycle, dict[str, np.ndarray]]:
    """The mean over strides at equal phase, of either side.

    Forces are the mean of the strides that have them. The centre of pressure is weighted by the upward
    force, so that force times place is the mean moment. The ankle's x is each stride's way from its own
    beginning. The walking speed is the mean way over the mean time.
    """
    if not cycles:
        raise InputError("a mean needs at least one stride", field="cycles")
    first = cycles[0]
    for cycle in cycles:
        if len(cycle.phase) != len(first.phase) or not np.allclose(cycle.phase, first.phase):
            raise InputError("strides of other rows have no mean", field="cycles", value=len(cycle.phase))
    loaded = [cycle for cycle in cycles if np.isfinite(cycle.grf_z).all()]
    # without any force they are NaN, but for moments that come from a file of their own
    values = {n: _rows(cycles, n) for n in KINEMATICS} | {n: _rows(loaded or cycles, n) for n in KINETICS}
    values["ankle_x"] = values["ankle_x"] - values["ankle_x"][:, :1]
    means: dict[str, Any] = {name: _mean(rows) for name, rows in values.items()}
    means["cop_x"] = _mean_place(values["cop_x"], values["grf_z"])
    times = np.array([cycle.stride_time for cycle in cycles])
    speeds = np.array([cycle.walking_speed for cycle in cycles])
    mean = dataclasses.replace(
        first,
        source="; ".join(dict.fromkeys(cycle.source for cycle in cycles)),
        licence="; ".join(dict.fromkeys(cycle.licence for cycle in cycles)),
        stride_time=float(times.mean()),
        body_mass=float(np.mean([cycle.body_mass for cycle in cycles])),
        walking_speed=float(speeds @ times / times.sum()),
        ankle_height=float(np.mean([cycle.ankle_height for cycle in cycles])),
        notes=_notes(cycles, len(loaded)),
        **means,
    )
    return mean, {name: _deviation(rows) for name, rows in values.items()}


def _rows(cycles: Sequence[GaitCycle], name: str) -> np.ndarray:
    """A signal of each stride (strides, n)."""
    return np.array([getattr(cycle, name) for cycle in cycles])


def _mean(rows: np.ndarray) -> np.ndarray:
    """Mean of what is known; NaN where nothing is (n,)."""
    known = np.isfinite(rows)
    total = np.where(known, rows, 0.0).sum(axis=0)
    return np.asarray(np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan))


def _mean_place(place: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Mean of places weighted by their forces, where those that have one carry at least half of the force.

    Not half of the strides: about toe-off the feet that still stand carry all of it (n,).
    """
    known = np.isfinite(place)
    weight = np.where(known, force, 0.0)
    total = weight.sum(axis=0)
    enough = (2.0 * total >= np.abs(force).sum(axis=0)) & (total > 0.0)
    moment = (weight * np.where(known, place, 0.0)).sum(axis=0)
    return np.asarray(np.where(enough, moment / np.where(enough, total, 1.0), np.nan))


def _deviation(rows: np.ndarray) -> np.ndarray:
    """Standard deviation of what is known; NaN for fewer than two (n,)."""
    known = np.isfinite(rows)
    count = known.sum(axis=0)
    squares = np.where(known, rows - _mean(rows), 0.0) ** 2
    return np.asarray(np.where(count > 1, np.sqrt(squares.sum(axis=0) / np.maximum(count - 1, 1)), np.nan))


def _notes(cycles: Sequence[GaitCycle], loaded: int) -> dict[str, str]:
    """What all strides say alike, and which they are."""
    sides = Counter(cycle.side for cycle in cycles)
    which = " and ".join(f"{number} {side}" for side, number in sides.items())
    notes = {
        key: text for key, text in cycles[0].notes.items() if all(c.notes.get(key) == text for c in cycles)
    }
    cuts = [cycle.notes["cut"] for cycle in cycles if "cut" in cycle.notes]
    if len(cycles) > 1 and cuts:
        more = f"; and {len(cuts) - NAMED} more" if len(cuts) > NAMED else ""
        notes["cut"] = "; ".join(cuts[:NAMED]) + more
    return notes | {"mean": f"of {len(cycles)} strides ({which}), ground force of {loaded}"}
