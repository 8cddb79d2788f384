"""Minimum clearance of the outsole in swing, where the foot is fast, and contact of a swinging foot.

A height is that of a swing without a floor, which would catch the foot and hide what it lacks.
"""

import math
from collections.abc import Iterator

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.metric import CLEARANCE, Found, Of, reported
from afo_sim.metrics.needed_torque import NEEDED_MOMENT
from afo_sim.metrics.strides import RECORDED_FORCE, Stride, without_floor

NEAR = 0.01  # of the stride to each side: a local minimum is the lowest within it [-]
HEIGHTS = {  # of a point's clearance: the column, and that of the same foot with the recorded ankle
    "toe": ("sole/height", "gait/sole_height"),
    "ball": ("ball/height", "gait/ball_height"),
}
EXTENSIONS = ("less_extended", "more_extended")
BELOW = 0.010  # height that a swing comes within [m]
SAME = 1e-4  # height by which a foot counts as lower than the recorded one in the floor [m]

EVENT = (
    "least height of the outsole above the floor on which it stands flat, while the ankle's forward speed is "
    "in its upper quartile, before the shank stands upright"
)
TO_RECORDED = "the same foot with the recorded ankle angle"
PASSING = "from a tenth of the swing on until the shank stands upright"
FOREFOOT = f"ball, pulp or tip {PASSING}; the heel is then on its way to the floor"


@reported(
    CLEARANCE,
    ("toe_clearance", "mm", "Toe clearance", EVENT),
    ("toe_clearance_phase", "percent", "Toe clearance, when", "of the gait cycle"),
    ("toe_clearance_to_recorded", "mm", "Toe clearance minus the recorded walk's", TO_RECORDED),
    ("toe_clearance_less_extended", "mm", "Toe clearance, toes less extended", "the least that is assumed"),
    ("toe_clearance_more_extended", "mm", "Toe clearance, toes more extended", "the most that is assumed"),
    (
        "swings_without_toe_event",
        "percent",
        "Swings without a minimum",
        "of the outsole's height while the foot is fast",
    ),
    ("swings_with_toe_contact", "percent", "Swings in which the forefoot touches the floor", FOREFOOT),
    ("swings_within_10mm", "percent", "Swings within 10 mm of the floor", FOREFOOT),
    ("ball_clearance", "mm", "Ball clearance", "of the ball of the foot alone, at its own minimum"),
    ("ball_clearance_phase", "percent", "Ball clearance, when", "of the gait cycle"),
    ("ball_clearance_to_recorded", "mm", "Ball clearance minus the recorded walk's", TO_RECORDED),
    (
        "swings_without_ball_event",
        "percent",
        "Swings without a minimum of the ball",
        "while the foot is fast",
    ),
    ("swings_with_ball_contact", "percent", "Swings in which the ball touches the floor", PASSING),
    ("toe_drag", "percent", "Share of the swing in which the floor carries the forefoot", PASSING),
    peak.row("toe_drag_force", "Force of the floor on a forefoot that drags", PASSING, "N"),
    of=Of.STRIDE,
)
def clearances(stride: Stride) -> Found:
    """Clearances of the outsole in swing: of all its points, and of the ball alone.

    Source: Event: Schulz 2011 (J. Biomech. 44: 1277). The greatest foot speed is 0.014 s behind it: De
    Asha & Buckley 2015 (abstract). Floor: that of the same outsole standing flat.
    """
    for point, (column, recorded) in HEIGHTS.items():
        column = without_floor(stride.columns, column)
        height = stride[column]
        if not np.isfinite(height[stride.swing]).all() or not stride.swing.any():
            yield f"{point}_clearance", math.nan
            continue
        own = event(stride, column)
        if own is not None and stride.at(column, own) > stride.at(column, stride.fastest):
            own = None  # a shoulder of a foot that sinks on to its landing
        at = stride.fastest if own is None else own
        least = float(stride.at(column, at))
        yield f"{point}_clearance", 1e3 * least
        yield f"{point}_clearance_phase", 100.0 * at
        there = event(stride, recorded)
        healthy = float(stride.at(recorded, stride.fastest if there is None else there))
        yield f"{point}_clearance_to_recorded", 1e3 * (least - healthy)
        yield f"swings_without_{point}_event", 100.0 * (own is None)
        for how in EXTENSIONS if point == "toe" else ():  # at their own events, else at the same phase
            column = f"sole/height_{how}"
            if column in stride.columns:
                there = None if own is None else event(stride, column)
                yield f"toe_clearance_{how}", 1e3 * float(stride.at(column, at if there is None else there))
    yield from _passing(stride)


def _passing(stride: Stride) -> Iterator[tuple[str, float]]:
    """Whether ball and forefoot touch the floor, or come near it, on the way past the standing leg."""
    part = stride.between(stride.begun, stride.upright)
    ball = part.of(stride.columns[without_floor(stride.columns, "ball/height")])
    forefoot = np.minimum(ball, part.of(stride.columns[without_floor(stride.columns, "toe/height")]))
    if not len(ball) or not np.isfinite(forefoot).all():
        return
    floor, under = np.zeros(len(ball)), np.zeros(len(ball))
    if forefoot.min() <= BELOW and NEEDED_MOMENT in stride.columns:
        under = np.minimum(part.of(stride.columns["gait/ball_height"]), 0.0)
        floor = np.minimum(part.of(stride.columns["gait/toe_height"]), under)
    yield "swings_with_toe_contact", 100.0 * bool((forefoot <= floor - SAME * (floor < 0.0)).any())
    yield "swings_within_10mm", 100.0 * bool((forefoot <= floor + BELOW * (floor == 0.0)).any())
    if RECORDED_FORCE in stride.columns:
        load = stride["foot/toe_load"] * stride.passing
        yield "toe_drag", 100.0 * float((load > 0.0).sum()) / float(stride.swing.sum())
        yield "toe_drag_force", peak.highest_mean(load, stride.timestep)
    yield "swings_with_ball_contact", 100.0 * bool((ball <= under - SAME * (under < 0.0)).any())


def event(stride: Stride, column: str) -> float | None:
    """Phase of a height's lowest local minimum while the foot passes fast [-]; None where there is none."""
    row = lowest_minimum(stride[column], stride.fast & stride.passing)
    return None if row is None else float(stride.phase[row])


def lowest_minimum(height: np.ndarray, among: np.ndarray) -> int | None:
    """Row of the lowest local minimum of a stride's height; None where there is none."""
    near = max(1, round(NEAR * len(height)))
    inner = height[1:-1]
    turns = np.flatnonzero((inner < height[:-2]) & (inner <= height[2:]) & among[1:-1]) + 1
    found = [k for k in turns if height[k] <= height[max(0, k - near) : k + near + 1].min()]
    return int(found[np.argmin(height[found])]) if found else None
