"""Ankle alignment: a recorded walker's ankle point is brought to the axis of a leg's ankle."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait.cycle import GaitCycle

_NOTES = ("ankle_shift_along_shank_m", "ankle_shift_vertical_m")


@dataclass(frozen=True, eq=False)
class Placed:
    """A cycle whose ankle is a leg's, and how far it went there, upward positive.

    along is the shift along the shank [m], of a marker to the joint's axis; vertical the one of the whole
    body [m], by soles.
    """

    cycle: GaitCycle
    along: float
    vertical: float


def fit_to_leg(
    cycle: GaitCycle,
    outsole: Iterable[tuple[float, float]],
    *,
    sole_thickness: float | None = None,
    stack: float = 0.0,
) -> Placed:
    """Bring the recorded ankle point to a leg's ankle, so that the leg's outsole stands on the floor.

    The ankle's height is right where the lowest point of the outsole, turned by the recorded pitch, is on the
    floor, on average over the part of stance in which the foot is flat. What lacks has two causes. Soles
    raise the whole body, vertically. The rest is a point of the shank that is not the joint's axis, such as
    the malleolus marker: it is moved along the shank, so that it moves forward and backward, too.

    Parameters
    ----------
    cycle : as read; `ankle_angle` such that pitch = ankle − shank is 0 where this outsole stands flat
    outsole : points (x, z) on which the foot can stand, from the ankle in the axes of the flat foot [m]; of a
        foot whose toes bend those behind the toes, since these yield
    sole_thickness : of what the recorded walker wore under the ankle [m]; by default the cycle's, or 0
    stack : thickness of what this leg wears under the ankle, of which `outsole` is the lower side [m]

    Returns
    -------
    Placed; the ankle's moment is taken about the new point, and its notes hold both shifts
    """
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


def standing_height(outsole: Iterable[tuple[float, float]], pitch: np.ndarray) -> np.ndarray:
    """Height of the ankle at which the lowest point of an outsole is on the floor [m] (n,).

    Units: outsole [m], pitch [rad] (n,).
    """
    heights = [-x * np.sin(pitch) - z * np.cos(pitch) for x, z in outsole]
    return np.asarray(np.max(heights, axis=0))


def _closed(cycle: GaitCycle, name: str) -> np.ndarray:
    """Samples of a signal without their drift, as its series has it and a run walks it (n,)."""
    values: np.ndarray = getattr(cycle, name)
    return values - cycle.series[name].closing_error * (cycle.phase - 0.5)


def _moved(cycle: GaitCycle, along: float, vertical: float) -> GaitCycle:
    """The cycle about a point that lies `along` up the shank, of a body that stands higher by `vertical` [m].

    The internal moment balances the ground's force F at the centre of pressure, M = −(c F_z + z F_x) with c
    ahead of the ankle and z its height. A point that lies forward by a and up by b has c − a and z + b, so
    M + a F_z − b F_x. The foot's own weight and inertia are left out: with a joint 30 mm lower they
    change the moment by less than 0.01 N·m/kg (derived: 1 kg at 20 m/s²).
    """
    forward = along * np.sin(cycle.shank_angle)
    upward = vertical + along * np.cos(cycle.shank_angle)
    return dataclasses.replace(
        cycle,
        ankle_x=cycle.ankle_x + forward,
        ankle_z=cycle.ankle_z + upward,
        cop_x=cycle.cop_x - forward,
        ankle_moment=cycle.ankle_moment + (forward * cycle.grf_z - upward * cycle.grf_x) * GRAVITY,
    )
