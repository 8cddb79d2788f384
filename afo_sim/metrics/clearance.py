"""Minimum clearance of the outsole in swing, where the foot is fast, and contact of a swinging foot.

A height is that of a swing without a floor, which would catch the foot and hide what it lacks.
"""

import math

import numpy as np

from afo_sim.common import Doubles
from afo_sim.metrics import peak
from afo_sim.metrics.kernel import R, S, base, has, kernel
from afo_sim.metrics.metric import CLEARANCE, Of, reported
from afo_sim.metrics.strides import SWING, at, edge
from afo_sim.metrics.window import place_of, places, row_at
from afo_sim.physics import register_jitable

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
    ("swings_without_toe_event", "percent", "Swings without a minimum",
     "of the outsole's height while the foot is fast"),
    ("swings_with_toe_contact", "percent", "Swings in which the forefoot touches the floor", FOREFOOT),
    ("swings_within_10mm", "percent", "Swings within 10 mm of the floor", FOREFOOT),
    ("ball_clearance", "mm", "Ball clearance", "of the ball of the foot alone, at its own minimum"),
    ("ball_clearance_phase", "percent", "Ball clearance, when", "of the gait cycle"),
    ("ball_clearance_to_recorded", "mm", "Ball clearance minus the recorded walk's", TO_RECORDED),
    ("swings_without_ball_event", "percent", "Swings without a minimum of the ball",
     "while the foot is fast"),
    ("swings_with_ball_contact", "percent", "Swings in which the ball touches the floor", PASSING),
    ("toe_drag", "percent", "Share of the swing in which the floor carries the forefoot", PASSING),
    peak.row("toe_drag_force", "Force of the floor on a forefoot that drags", PASSING, "N"),
    of=Of.STRIDE,
)  # fmt: skip
@kernel(
    *(R.sole, R.healthy_sole, R.less_extended, R.more_extended, R.ball, R.healthy_ball),
    *(*SWING, R.toe, R.healthy_toe, R.needed, R.recorded_force, R.toe_load),
)
def clearances(b: Doubles, out: Doubles) -> float:
    """Clearances of the outsole in swing: of all its points, and of the ball alone."""
    # Source: Event: Schulz 2011 (J. Biomech. 44: 1277). The greatest foot speed is 0.014 s behind it: De Asha
    # & Buckley 2015 (abstract). Floor: that of the same outsole standing flat.
    first, end, way, passing = int(b[S.first]), int(b[S.end]), base(b, R.phase), base(b, R.passing)
    fast, among, dragging = base(b, R.fast), base(b, AMONG), base(b, R.one)
    for k in range(first, end):
        b[among + k] = b[fast + k] * b[passing + k]
    event = _clearance(b, R.sole, R.healthy_sole, out, 0, 5)
    _clearance(b, R.ball, R.healthy_ball, out, 8, 11)
    for which in range(2):  # at their own events, else at the same phase
        row = R.less_extended + which
        if out[5] >= 0.0 and has(b, row):
            own = -1.0 if event < 0.0 else _event(b, row)
            out[3 + which] = 1e3 * at(b, row, 0.01 * out[1] if own < 0.0 else own)

    # whether ball and forefoot touch the floor, or come near it, on the way past the standing leg
    start, stop, count, least = edge(b, b[S.begun]), edge(b, b[S.upright]), int(b[S.count]), np.inf
    for k in range(places(start, stop)):
        there = place_of(start, stop, k)
        ball, toe = row_at(b, base(b, R.ball), count, there), row_at(b, base(b, R.toe), count, there)
        least = min(least, ball, toe) if math.isfinite(ball + toe) else -np.inf
    if not math.isfinite(least):
        return 0.0
    out[6] = out[7] = out[12] = 0.0
    for k in range(places(start, stop)):
        there, floor, under = place_of(start, stop, k), 0.0, 0.0
        ball = row_at(b, base(b, R.ball), count, there)
        forefoot = min(ball, row_at(b, base(b, R.toe), count, there))
        if least <= BELOW and has(b, R.needed):
            under = min(row_at(b, base(b, R.healthy_ball), count, there), 0.0)
            floor = min(row_at(b, base(b, R.healthy_toe), count, there), under)
        out[6] = 100.0 if forefoot <= floor - SAME * (floor < 0.0) else out[6]
        out[7] = 100.0 if forefoot <= floor + BELOW * (floor == 0.0) else out[7]
        out[12] = 100.0 if ball <= under - SAME * (under < 0.0) else out[12]
    if has(b, R.recorded_force):
        swing, dragged, load = 0, 0, base(b, R.toe_load)
        for k in range(first, end):
            b[dragging + k] = b[load + k] * b[passing + k]
            dragged += b[dragging + k] > 0.0
            swing += b[way + k] >= b[S.toe_off]
        out[13], out[14] = 100.0 * dragged / swing, peak.peak(b, R.one, 1.0)
    return 0.0


AMONG = R.third  # mask of the rows in which an event may be


@register_jitable
def _clearance(b: Doubles, row: int, recorded: int, out: Doubles, to: int, without: int) -> float:
    """Write a point's clearance, its phase, and that to the recorded one's; phase of its event, or −1."""
    swing, out[to] = 0, math.nan
    for k in range(int(b[S.first]), int(b[S.end])):
        if b[base(b, R.phase) + k] >= b[S.toe_off]:
            swing += 1
            if not math.isfinite(b[base(b, row) + k]):
                return -1.0
    own, there, fastest = _event(b, row), _event(b, recorded), b[S.fastest]
    if not swing or not math.isfinite(fastest):
        return -1.0
    if own >= 0.0 and at(b, row, own) > at(b, row, fastest):
        own = -1.0  # a shoulder of a foot that sinks on to its landing
    phase = fastest if own < 0.0 else own
    out[to], out[to + 1], out[without] = 1e3 * at(b, row, phase), 100.0 * phase, 100.0 * (own < 0.0)
    out[to + 2] = out[to] - 1e3 * at(b, recorded, fastest if there < 0.0 else there)
    return own


@register_jitable
def _event(b: Doubles, row: int) -> float:
    """Phase of a height's lowest local minimum while the foot passes fast [-]; −1 where there is none."""
    first = int(b[S.first])
    k = lowest_minimum(b, base(b, row) + first, base(b, AMONG) + first, int(b[S.end]) - first)
    return -1.0 if k < 0 else b[base(b, R.phase) + first + k]


@register_jitable
def lowest_minimum(b: Doubles, height: int, among: int, count: int) -> int:
    """Row of a height's lowest local minimum, of those where `among` is not 0; −1 where there is none."""
    near, found = max(1, round(NEAR * count)), -1
    for k in range(1, count - 1):
        here = b[height + k]
        if b[among + k] > 0.0 and here < b[height + k - 1] and here <= b[height + k + 1]:
            low, high = max(0, k - near), min(count, k + near + 1)
            lowest = -peak.greatest(b, height + low, high - low, -1.0)
            found = k if here <= lowest and (found < 0 or here < b[height + found]) else found
    return found
