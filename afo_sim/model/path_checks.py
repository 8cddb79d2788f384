"""Refusals of muscles that are mounted so that they cannot work: inside out, or through the ankle."""

import math
from collections.abc import Iterable

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import MuscleGroup, Orthosis

LEAST_ARM = 1e-3  # moment arm on either side that counts as a change of its sign [m]


def check_paths(angles: np.ndarray, lengths: np.ndarray, muscles: Iterable[str], orthosis: Orthosis) -> None:
    """Refuse paths whose moment arm changes its sign, and paths too short for the muscle on them.

    A muscle over a pulley has a constant moment arm and no anchors, and passes.

    Parameters
    ----------
    angles : of the ankle over the range of motion, rising [rad] (n,)
    lengths : of the muscles' paths at these angles [m] (n, n_muscle)
    muscles : their names
    orthosis : whose muscles they are

    Raises
    ------
    InputError
        A muscle would turn the ankle one way at one angle and the other way at another; or the path never
        is as long as fittings, link and the muscle at its shortest.
    """
    slope = np.diff(lengths, axis=0) / np.diff(angles)[:, None]
    turns = (slope.min(axis=0) < -LEAST_ARM) & (slope.max(axis=0) > LEAST_ARM)
    ends = lengths.max(axis=0).tolist()
    bodies = {role: _body(group.type) for role, group in orthosis.muscle.items()}
    for column, (name, longest) in enumerate(zip(muscles, ends, strict=True)):
        role = name.rsplit("_", 1)[0]
        group, body = orthosis.muscle[role], bodies[role]
        if group.pulley is not None:
            continue
        if turns[column] or longest < body + (group.link_length or 0.0):
            _check_sign(name, angles, lengths[:, column], orthosis.name)
            _check_room(name, angles, lengths[:, column], group, orthosis.name)


def _body(muscle: Muscle) -> float:
    """Fittings and the muscle at its shortest [m]."""
    return muscle.end_length + muscle.nominal_length * (1.0 - muscle.limits.contraction_max)


def _check_sign(name: str, angles: np.ndarray, length: np.ndarray, file: str) -> None:
    """The moment arm r = −dL/dθ must not change its sign; between two angles it is −ΔL/Δθ."""
    arm = -np.diff(length) / np.diff(angles)
    low, high = float(arm.min()), float(arm.max())
    if not (low < -LEAST_ARM and high > LEAST_ARM):
        return
    forward = high > -low  # which side the muscle is meant for
    turn = int(np.flatnonzero((arm[1:] > 0.0) != (arm[:-1] > 0.0))[0]) + 1
    missing = -low if forward else high
    raise InputError(
        f"{name} passes through the ankle: at {np.degrees(angles[turn]):.0f} deg, within the range of "
        f"motion, its moment arm changes its sign (it is {1e3 * low:.0f} to {1e3 * high:.0f} mm)",
        file=file,
        field=f"orthosis.muscle.{name.rsplit('_', 1)[0]}.origin.from_ankle",
        allowed=f"origin and insertion, or a point of the path, at least {math.ceil(1e3 * missing)} mm "
        f"further {'forward' if forward else 'back'}, or a narrower range_of_motion",
    )


def _check_room(name: str, angles: np.ndarray, length: np.ndarray, group: MuscleGroup, file: str) -> None:
    """Fittings, link and the muscle at its shortest must fit where the path is longest.

    Where it is shorter they hang through, which `check_stretch` warns of.
    """
    body, link = _body(group.type), group.link_length or 0.0
    long = int(np.argmax(length))
    if length[long] >= body + link:
        return
    role, alone = f"orthosis.muscle.{name.rsplit('_', 1)[0]}", length[long] < body
    what = "fittings and muscle at its shortest" if alone else "fittings, link and muscle at its shortest"
    room = math.floor(1e3 * (length[long] - body))
    raise InputError(
        f"{name} does not fit on its path: even where it is longest, at {np.degrees(angles[long]):.0f} deg, "
        f"the path is {1e3 * length[long]:.0f} mm long, and {what} take "
        f"{1e3 * (body + (0.0 if alone else link)):.0f} mm",
        file=file,
        field=f"{role}.origin.from_ankle" if alone else f"{role}.link_length",
        value=None if alone else f"{1e3 * link:g} mm",
        allowed="anchors further apart, or a shorter muscle"
        if alone
        else f"at most {room} mm, or a shorter muscle",
    )
