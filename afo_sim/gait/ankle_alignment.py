"""Ankle alignment: a recorded walker's ankle point is brought to the axis of a leg's ankle, and in stance its
sole to the floor.

Markers, mean curves and a foot of few points leave the sole millimetres, at toe-off centimetres, off the
floor while the recorded force acts. A foot that is caught by a floor must stand on it there.
"""

import dataclasses
import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait.checks import STANCE_FORCE, stance
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.fourier import FourierSeries, Wave

LEAVES, COMES = 0.15, 0.1  # of the stride, after toe-off and before heel strike; assumed
SHARP = 20  # harmonics of that movement: as few as a path has would let it ring into mid-swing
_NOTES = ("ankle_shift_along_shank_m", "ankle_shift_vertical_m")


@dataclass(frozen=True, eq=False)
class Placed:
    """A cycle on a leg's ankle; how far it went there, upward positive, and at most onto the floor [m]."""

    cycle: GaitCycle
    along: float
    vertical: float
    laid: float = 0.0


def fit_to_leg(
    cycle: GaitCycle, outsole: Iterable[tuple[float, float]], *, sole_thickness: float | None = None,
    stack: float = 0.0,
) -> Placed:  # fmt: skip
    """Bring the recorded ankle point to a leg's ankle, so that the leg's outsole stands on the floor."""
    worn = cycle.sole_thickness if sole_thickness is None else sole_thickness
    vertical = stack - (worn or 0.0)
    flat = cycle.foot_flat()
    shank, ankle, height = (_closed(cycle, name)[flat] for name in ("shank_angle", "ankle_angle", "ankle_z"))
    wanted = standing_height(outsole, ankle - shank)
    lacking = float(np.mean(wanted - height)) - vertical
    along = lacking / float(np.mean(np.cos(shank)))
    moved = _moved(cycle, along, vertical)
    notes = {**cycle.notes} | dict(zip(_NOTES, (f"{along:.4f}", f"{vertical:.4f}"), strict=True))
    moved = dataclasses.replace(moved, ankle_height=float(wanted.mean()), sole_thickness=stack, notes=notes)
    vars(moved)["flat"] = cycle.flat  # the same samples, so that their mean height stays the wanted one
    placed = {name: moved.fitted(name) for name in ("ankle_x", "ankle_z")}
    vars(moved)["series"] = cycle.series | placed  # the others are the same
    return Placed(moved, along, vertical)


def lay_on_floor(placed: Placed, low: np.ndarray) -> tuple[Placed, FourierSeries | None]:
    """Move the ankle vertically, so that the sole's lowest point, at heights `low` [m] (n,), is on the floor
    while it is loaded, and by what; the moment about the ankle stays.

    The ankle is back on its recorded path `LEAVES` of the stride after toe-off, smoothly to its acceleration:
    a shorter way would jerk the foot, a longer one reaches mid-swing, where clearance is read.
    """
    cycle, on_floor = placed.cycle, _on_floor(placed.cycle)
    if on_floor is None:  # nothing is borne
        return placed, None
    first, last = np.interp(on_floor.ends, cycle.phase, low)
    away = np.where(on_floor.stands, low, last * on_floor.leaves + first * on_floor.comes)
    lift = FourierSeries.fit(cycle.phase, -away, SHARP)
    raised = lift(on_floor.at)
    pressed = cycle.cop_x - raised * on_floor.forward
    moved = dataclasses.replace(cycle, ankle_z=cycle.ankle_z + raised, cop_x=pressed)
    vars(moved)["flat"] = cycle.flat
    vars(moved)["series"] = cycle.series | {"ankle_z": cycle.series["ankle_z"] + lift}
    laid = float(np.abs(raised[on_floor.stands]).max())
    return dataclasses.replace(placed, cycle=moved, laid=laid), lift


@dataclass(frozen=True, eq=False)
class _OnFloor:
    """Of a cycle's samples (n,)."""

    ends: tuple[float, float]  # first and last loaded phase
    stands: np.ndarray  # whether between these
    leaves: np.ndarray  # share of what the sole is off the floor at the last …
    comes: np.ndarray  # … and at the first
    forward: np.ndarray  # over upward force
    at: Wave


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _on_floor(cycle: GaitCycle) -> _OnFloor | None:
    phase, off = cycle.phase, stance(cycle)
    if off == 0.0:
        return None
    on = float(phase[np.argmax(cycle.grf_z > STANCE_FORCE)])
    leaves, comes = (_eased(1.0 - gap % 1.0 / of) for gap, of in ((phase - off, LEAVES), (on - phase, COMES)))
    forward = cycle.grf_x / np.where(cycle.grf_z > STANCE_FORCE, cycle.grf_z, np.inf)
    return _OnFloor((on, off), (phase >= on) & (phase <= off), leaves, comes, forward, Wave.at(phase))


def _eased(share: np.ndarray) -> np.ndarray:
    """From 0 to 1 with a share, without a jump of the second derivative."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def standing_height(outsole: Iterable[tuple[float, float]], pitch: np.ndarray) -> np.ndarray:
    """Height of the ankle at which the lowest point of an outsole is on the floor [m] (n,)."""
    heights = [-x * np.sin(pitch) - z * np.cos(pitch) for x, z in outsole]
    return np.asarray(np.max(heights, axis=0))


def _closed(cycle: GaitCycle, name: str) -> np.ndarray:
    """Samples of a signal without their drift, as its series has it and a run walks it (n,)."""
    values: np.ndarray = getattr(cycle, name)
    return values - cycle.series[name].closing_error * (cycle.phase - 0.5)


def _moved(cycle: GaitCycle, along: float, vertical: float) -> GaitCycle:
    """The cycle about a point `along` up the shank, of a body that stands higher by `vertical` [m]."""
    forward = along * np.sin(cycle.shank_angle)
    upward = vertical + along * np.cos(cycle.shank_angle)
    return dataclasses.replace(
        cycle,
        ankle_x=cycle.ankle_x + forward,
        ankle_z=cycle.ankle_z + upward,
        cop_x=cycle.cop_x - forward,
        ankle_moment=cycle.ankle_moment + (forward * cycle.grf_z - upward * cycle.grf_x) * GRAVITY,
    )
