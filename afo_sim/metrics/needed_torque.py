"""Ankle torques over a stride: what the patient lacks, what the orthosis provides, and push-off."""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Doubles
from afo_sim.metrics import peak
from afo_sim.metrics.heel_contact import LOADING
from afo_sim.metrics.kernel import R, S, base, has, kernel
from afo_sim.metrics.metric import NEED, PUSH_OFF, TORQUE, WORK, Of, reported
from afo_sim.metrics.strides import Stride, at, edge
from afo_sim.metrics.window import mean, place_of, places, rectified, row_at
from afo_sim.physics import register_jitable

NEEDED_MOMENT = "gait/needed_moment"
NEEDED = "healthy ankle's active moment less what the patient gives"
SWING = "from toe-off until the shank stands upright"
LOADED = "from heel strike to 12 % of the stride, where the other foot leaves the floor"
HEEL_RISE = 0.40  # begin of push-off: ankle power turns positive at some 43 % of the stride (Bovi 2011) [-]
OVER = "from 40 % of the stride to toe-off"
TERMINAL = "from the upright shank to heel strike, where the straight knee tightens the calf"
TISSUE = "at the same instant, the part that only balances the ankle's own tissue"
SIDES = {"dorsiflexion": 1.0, "plantarflexion": -1.0}  # sign of a torque that way
RECORDED = "of the recorded ankle's"
INVERSION = "ankle/moment/inversion"
ON_FOOT = "of the muscles on the foot, about the forward axis through the ankle"


@dataclass(frozen=True, eq=False)
class Need:
    """Torque needed to one side in a phase of the stride, over the recorded ankle's angle."""

    phase: str  # of the stride, in words
    metric: str  # of the peak
    side: str  # that it turns to, such as "dorsiflexion"
    angle: np.ndarray  # [rad] (n,)
    torque: np.ndarray  # positive to the side [N·m] (n,)
    peak: float  # largest mean over 10 ms [N·m]


def needs(stride: Stride) -> list[Need]:
    """What each phase needs of an orthosis; nothing in a patient's own walk: its healthy ankle is unknown."""
    # Perry & Burnfield 2010: loading response to 12 % of the stride, initial, mid swing to the upright shank
    found: list[Need] = []
    if NEEDED_MOMENT not in stride.columns:
        return found
    peaks = stride.values((torque_deficit,))
    for phase, metric, side, start, end in (
        ("initial and mid swing", "needed_swing_torque", "dorsiflexion", stride.toe_off, stride.upright),
        ("terminal swing", "needed_terminal_swing_torque", "dorsiflexion", stride.upright, 1.0),
        ("loading response", "needed_loading_torque", "dorsiflexion", 0.0, LOADING),
        ("push-off", "needed_push_off_torque", "plantarflexion", HEEL_RISE, stride.toe_off),
    ):
        part, needed = stride.between(start, end), SIDES[side] * stride.columns[NEEDED_MOMENT]
        angle, torque = part.of(stride.columns["gait/ankle_angle"]), part.of(needed)
        if len(angle):
            found.append(Need(phase, metric, side, angle, torque, peaks[metric]))
    return found


@reported(
    NEED,
    peak.row("needed_dorsiflexion_torque", "Dorsiflexion torque needed", NEEDED),
    peak.row("needed_plantarflexion_torque", "Plantarflexion torque needed", NEEDED),
    peak.row("needed_swing_torque", "Dorsiflexion torque needed in swing", SWING),
    ("needed_swing_torque_mean", "N*m", "Dorsiflexion torque needed in swing, mean", SWING),
    ("needed_swing_torque_tissue", "N*m", "Torque needed in swing, part due to tissue", TISSUE),
    peak.row("needed_loading_torque", "Dorsiflexion torque needed in loading response", LOADED),
    peak.row("needed_push_off_torque", "Plantarflexion torque needed in push-off", OVER),
    peak.row("needed_terminal_swing_torque", "Dorsiflexion torque needed in terminal swing", TERMINAL),
    ("needed_terminal_swing_torque_tissue", "N*m", "Torque needed in terminal swing, part due to tissue",
     TISSUE),
    of=Of.STRIDE,
)  # fmt: skip
@kernel(R.force, R.shank, R.needed, R.tissue)
def torque_deficit(b: Doubles, out: Doubles) -> float:
    """Torque that the patient lacks in the healthy ankle's motion."""
    # Perry & Burnfield 2010: initial and mid swing end, and terminal swing begins, with the upright shank
    if not has(b, R.needed):  # a patient's own walk: no healthy ankle is known of it
        return 0.0
    needed, count = base(b, R.needed), int(b[S.count])
    out[0], out[1] = peak.peak(b, R.needed, 1.0), peak.peak(b, R.needed, -1.0)
    toe_off, upright, strike = edge(b, b[S.toe_off]), edge(b, b[S.upright]), edge(b, 1.0)
    out[3] = peak.clean(mean(b, needed, count, toe_off, upright))
    for to, tissue, start, end, sign in (
        (2, 4, toe_off, upright, 1.0),
        (5, -1, edge(b, 0.0), edge(b, LOADING), 1.0),
        (6, -1, edge(b, HEEL_RISE), toe_off, -1.0),
        (7, 8, upright, strike, 1.0),
    ):
        if start < end:
            out[to] = peak.peak_within(b, R.needed, start, end, sign)
        most, at_most = -np.inf, start
        for k in range(places(start, end) if tissue >= 0 else 0):
            there = place_of(start, end, k)
            lacking = row_at(b, needed, count, there)
            most, at_most = (lacking, there) if lacking > most else (most, at_most)
            out[tissue] = min(rectified(-row_at(b, base(b, R.tissue), count, at_most)), rectified(most))
    return 0.0


@reported(
    TORQUE,
    peak.row("orthosis_peak_dorsiflexion_torque", "Dorsiflexion torque"),
    ("orthosis_mean_dorsiflexion_torque", "N*m", "Dorsiflexion torque, mean", "over the stride"),
    peak.row("orthosis_peak_plantarflexion_torque", "Plantarflexion torque"),
    ("orthosis_mean_plantarflexion_torque", "N*m", "Plantarflexion torque, mean", "over the stride"),
    ("orthosis_swing_torque_mean", "N*m", "Torque in swing, mean", f"dorsiflexion positive, {SWING}"),
    ("torque_covered", "percent", "Needed torque covered", "of its integral over the stride"),
    peak.row("torque_missing", "Torque missing", "need that the orthosis does not meet"),
    peak.row("torque_unneeded", "Torque not needed", "beyond the need or against it"),
    of=Of.WORN,
)
@kernel(R.force, R.shank, R.orthosis, R.needed)
def torque_given(b: Doubles, out: Doubles) -> float:
    """Torque of the orthosis about the ankle, and how much of the need it covers."""
    first, end, own, lacked = int(b[S.first]), int(b[S.end]), base(b, R.orthosis), base(b, R.needed)
    missing, unneeded = base(b, R.one), base(b, R.other)
    up = down = given = wanted = most = 0.0
    for k in range(first, end):
        torque, needed = b[own + k], abs(b[lacked + k])
        up, down = up + rectified(torque), down + rectified(-torque)
        way = -1.0 if b[lacked + k] < 0.0 else 1.0
        met = min(rectified(way * torque), needed)
        given, wanted, most = given + met, wanted + needed, max(most, needed)
        b[missing + k], b[unneeded + k] = needed - met, abs(torque - way * met)
    out[0], out[1] = peak.peak(b, R.orthosis, 1.0), peak.clean(up / (end - first))
    out[2], out[3] = peak.peak(b, R.orthosis, -1.0), peak.clean(down / (end - first))
    out[4] = peak.clean(mean(b, own, int(b[S.count]), edge(b, b[S.toe_off]), edge(b, b[S.upright])))
    if has(b, R.needed):
        if most > peak.ROUNDING:
            out[5] = _share(given, wanted)
        out[6], out[7] = peak.peak(b, R.one, 1.0), peak.peak(b, R.other, 1.0)
    return 0.0


@reported(
    TORQUE,
    peak.row("peak_inversion_moment", "Inversion moment", ON_FOOT),
    peak.row("peak_eversion_moment", "Eversion moment", ON_FOOT),
    of=Of.WORN,
)
@kernel(R.inversion)
def inversion(b: Doubles, out: Doubles) -> float:
    """Greatest moments to the inside and to the outside in a stride, positive numbers."""
    if has(b, R.inversion):
        out[0], out[1] = peak.peak(b, R.inversion, 1.0), peak.peak(b, R.inversion, -1.0)
    return 0.0


@reported(
    WORK,
    ("orthosis_positive_work", "J/kg", "Positive work", "given to the ankle per stride and body mass"),
    ("orthosis_negative_work", "J/kg", "Negative work", "taken from the ankle per stride and body mass"),
    peak.row("orthosis_peak_power", "Power given", unit="W/kg"),
    peak.row("orthosis_peak_absorption", "Power taken", unit="W/kg"),
    ("share_of_positive_work", "percent", "Share of biological positive work", RECORDED),
    of=Of.WORN,
)
@kernel(R.orthosis, R.angle, R.healthy_moment, R.healthy_angle)
def work_given(b: Doubles, out: Doubles) -> float:
    """Work of the orthosis on the ankle, torque over angle; taken power is positive."""
    given, taken, steps = work(b, R.orthosis, R.angle, b[S.start], b[S.stop])
    out[0], out[1] = given, 0.0 - taken
    out[2], out[3] = peak.power_peak(b, steps, 1.0), peak.power_peak(b, steps, -1.0)
    own, _, _ = work(b, R.healthy_moment, R.healthy_angle, b[S.start], b[S.stop])
    out[4] = _share(given, own)
    return 0.0


@register_jitable
def work(
    b: Doubles, torque: int, angle: int, start: float, end: float, least: float = -np.inf
) -> tuple[float, float, int]:
    """Work of a torque in a window [J/kg]: given, taken, steps; its power goes to the row `one` [W/kg]."""
    count, n = int(b[S.count]), places(start, end)
    given = taken = before = there = turned = 0.0
    own, over, power, mass, step = base(b, torque), base(b, angle), base(b, R.one), b[S.mass], b[S.timestep]
    for k in range(n):
        place = place_of(start, end, k)
        value, turn = max(row_at(b, own, count, place), least), row_at(b, over, count, place)
        if k > 0:
            done = 0.5 * (value + before) * (turn - turned) / mass
            given, taken = given + rectified(done), taken + rectified(-done)
            b[power + k - 1] = done / (step * (place - there))
        before, turned, there = value, turn, place
    return peak.clean(given), peak.clean(taken), max(n - 1, 0)


@register_jitable
def _share(part: float, whole: float) -> float:
    """[percent]; NaN of nothing."""
    return 100.0 * part / whole if whole > 0.0 else np.nan


LOST = "recorded minus simulated"
WHOSE = "by the orthosis or by the patient's own weakness: compare it with a run without orthosis"

HELD = "the verdict compares it with the scenario's limits"


@reported(
    PUSH_OFF,
    ("ankle_range_lost", "deg", "Ankle range lost", LOST),
    ("dorsiflexion_lost", "deg", "Dorsiflexion lost in stance", f"{LOST}, {WHOSE}"),
    ("plantarflexion_at_toe_off", "deg", "Plantarflexion at toe-off",
     "plantarflexion positive; a shoe's drop counts"),
    ("plantarflexion_lost_at_toe_off", "deg", "Plantarflexion lost at toe-off", f"{LOST}, {WHOSE}"),
    of=Of.STRIDE,
)  # fmt: skip
@kernel(R.force, R.angle, R.healthy_angle)
def push_off(b: Doubles, out: Doubles) -> float:
    """Range of the ankle, and its plantarflexion at toe-off, beside those of the recorded ankle."""
    first, n, stance = int(b[S.first]), int(b[S.end]) - int(b[S.first]), 0
    while stance < n and b[base(b, R.phase) + first + stance] < b[S.toe_off]:
        stance += 1
    out[0] = out[1] = 0.0
    for row, sign in ((R.healthy_angle, 1.0), (R.angle, -1.0)):
        start = base(b, row) + first
        most = peak.greatest(b, start, n, 1.0) + peak.greatest(b, start, n, -1.0)
        out[0] += sign * math.degrees(most)
        out[1] += sign * math.degrees(peak.greatest(b, start, stance, 1.0))
    out[2] = -math.degrees(at(b, R.angle, b[S.toe_off]))
    out[3] = -math.degrees(at(b, R.healthy_angle, b[S.toe_off])) - out[2]
    return 0.0


@reported(
    PUSH_OFF,
    peak.row("torque_against_push_off", "Dorsiflexion torque against push-off", OVER),
    ("torque_against_push_off_per_mass", "N*m/kg", "Torque against push-off per body mass",
     f"{peak.MEANING}; {HELD}"),
    ("work_against_push_off", "J/kg", "Work against push-off",
     f"that dorsiflexion torque takes from plantarflexion {OVER}; {HELD}"),
    of=Of.WORN,
)  # fmt: skip
@kernel(R.force, R.orthosis, R.angle)
def against_push_off(b: Doubles, out: Doubles) -> float:
    """Dorsiflexion torque of the orthosis in push-off, and the work that it takes from plantarflexion."""
    start, end = edge(b, HEEL_RISE), edge(b, b[S.toe_off])
    out[0] = peak.peak_within(b, R.orthosis, start, end, 1.0)
    out[1] = out[0] / b[S.mass]
    _, out[2], _ = work(b, R.orthosis, R.angle, start, end, 0.0)
    return 0.0


GIVEN = f"of its plantarflexion torque, {OVER}"


@reported(
    PUSH_OFF,
    peak.row("push_off_torque", "Plantarflexion torque in push-off", OVER),
    peak.row("push_off_power", "Power given to push-off", GIVEN, "W/kg"),
    ("push_off_work", "J/kg", "Work given to push-off", GIVEN),
    ("share_of_push_off_work", "percent", "Share of biological push-off work", f"{RECORDED}, {OVER}"),
    ("work_against_dorsiflexion", "J/kg", "Work against dorsiflexion",
     "that plantarflexion torque takes from dorsiflexion over the stride"),
    of=Of.WORN,
)  # fmt: skip
@kernel(R.force, R.orthosis, R.angle, R.healthy_moment, R.healthy_angle)
def for_push_off(b: Doubles, out: Doubles) -> float:
    """Plantarflexion torque of the orthosis in push-off, its work, and what it takes from dorsiflexion."""
    start, end = edge(b, HEEL_RISE), edge(b, b[S.toe_off])
    own, down = base(b, R.orthosis), base(b, R.other)
    for k in range(int(b[S.count])):
        b[down + k] = min(b[own + k], 0.0)
    out[0] = peak.peak_within(b, R.other, start, end, -1.0)
    out[2], _, steps = work(b, R.other, R.angle, start, end)
    if steps:
        out[1] = peak.power_peak(b, steps, 1.0)
    healthy, _, _ = work(b, R.healthy_moment, R.healthy_angle, start, end)
    out[3] = _share(out[2], healthy)
    _, out[4], _ = work(b, R.other, R.angle, b[S.start], b[S.stop])
    return 0.0
