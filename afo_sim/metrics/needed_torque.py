"""Torques about the ankle over a stride: what the patient lacks, what the orthosis gives, and push-off."""

import math
import operator
from dataclasses import dataclass

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.facts import Columns, cut
from afo_sim.metrics.heel_contact import LOADING
from afo_sim.metrics.metric import NEED, PUSH_OFF, TORQUE, WORK, Found, Of, reported
from afo_sim.metrics.strides import ORTHOSIS, Stride
from afo_sim.metrics.window import increments

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

    phase: str
    metric: str  # of the peak
    side: str
    angle: np.ndarray  # [rad] (n,)
    torque: np.ndarray  # positive to the side [N·m] (n,)
    peak: float  # largest mean over 10 ms [N·m]


def needs(stride: Stride) -> list[Need]:
    """What each phase needs of an orthosis; nothing in a patient's own walk: its healthy ankle is unknown.

    Source: Loading response to 12 % of the stride, initial and mid swing to the upright shank: Perry &
    Burnfield 2010.
    """
    found: list[Need] = []
    if NEEDED_MOMENT not in stride.columns:
        return found
    for phase, metric, side, start, end in (
        ("initial and mid swing", "needed_swing_torque", "dorsiflexion", stride.toe_off, stride.upright),
        ("terminal swing", "needed_terminal_swing_torque", "dorsiflexion", stride.upright, 1.0),
        ("loading response", "needed_loading_torque", "dorsiflexion", 0.0, LOADING),
        ("push-off", "needed_push_off_torque", "plantarflexion", HEEL_RISE, stride.toe_off),
    ):
        part, needed = stride.between(start, end), SIDES[side] * stride.columns[NEEDED_MOMENT]
        angle, torque = part.of(stride.columns["gait/ankle_angle"]), part.of(needed)
        if len(angle):
            most = peak.highest_mean(needed, stride.timestep, part)
            found.append(Need(phase, metric, side, angle, torque, most))
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
    (
        "needed_terminal_swing_torque_tissue",
        "N*m",
        "Torque needed in terminal swing, part due to tissue",
        TISSUE,
    ),
    of=Of.STRIDE,
)
def torque_deficit(stride: Stride) -> Found:
    """Torque that the patient lacks in the healthy ankle's motion.

    Source: Initial and mid-swing end, and terminal swing begins, with the upright shank: Perry &
    Burnfield 2010.
    """
    if NEEDED_MOMENT not in stride.columns:  # a patient's own walk: no healthy ankle is known of it
        return
    needed, passive = stride.columns[NEEDED_MOMENT], stride.columns["gait/passive_moment"]
    for side, sign in SIDES.items():
        yield f"needed_{side}_torque", peak.highest_mean(sign * needed[stride.rows], stride.timestep)
    for need in needs(stride):
        yield need.metric, need.peak
    swing, terminal = stride.between(stride.toe_off, stride.upright), stride.between(stride.upright, 1.0)
    yield "needed_swing_torque_mean", peak.clean(swing.mean(needed))
    for name, part in (("needed_swing_torque", swing), ("needed_terminal_swing_torque", terminal)):
        lacking = part.of(needed)
        if len(lacking):
            k = int(np.argmax(lacking))
            yield f"{name}_tissue", min(max(-float(part.of(passive)[k]), 0.0), max(float(lacking[k]), 0.0))


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
def torque_given(stride: Stride) -> Found:
    """Torque of the orthosis about the ankle, and how much of the need it covers."""
    torque = stride[ORTHOSIS]
    for side, sign in SIDES.items():
        yield f"orthosis_peak_{side}_torque", peak.highest_mean(sign * torque, stride.timestep)
        yield f"orthosis_mean_{side}_torque", peak.clean(float(np.maximum(sign * torque, 0.0).mean()))
    carried = stride.between(stride.toe_off, stride.upright)
    yield "orthosis_swing_torque_mean", peak.clean(carried.mean(stride.columns[ORTHOSIS]))
    if NEEDED_MOMENT not in stride.columns:
        return
    needed = stride[NEEDED_MOMENT]
    way = np.where(needed < 0.0, -1.0, 1.0)
    given = np.minimum(np.maximum(way * torque, 0.0), np.abs(needed))
    if np.abs(needed).max(initial=0.0) > peak.ROUNDING:
        yield "torque_covered", _share(float(given.sum()), float(np.abs(needed).sum()))
    yield "torque_missing", peak.highest_mean(np.abs(needed) - given, stride.timestep)
    yield "torque_unneeded", peak.highest_mean(np.abs(torque - way * given), stride.timestep)


@reported(
    TORQUE,
    peak.row("peak_inversion_moment", "Inversion moment", ON_FOOT),
    peak.row("peak_eversion_moment", "Eversion moment", ON_FOOT),
    of=Of.WORN,
)
def inversion(stride: Stride) -> Found:
    """Greatest moments to the inside and to the outside in a stride, positive numbers."""
    return inversion_peaks(cut(stride.columns, operator.itemgetter(stride.rows)), stride.timestep)


def inversion_peaks(rows: Columns, timestep: float) -> Found:
    """Greatest moments to the inside and to the outside, positive numbers; none without such a column."""
    if INVERSION in rows:
        yield "peak_inversion_moment", peak.highest_mean(rows[INVERSION], timestep)
        yield "peak_eversion_moment", peak.highest_mean(0.0 - rows[INVERSION], timestep)


@reported(
    WORK,
    ("orthosis_positive_work", "J/kg", "Positive work", "given to the ankle per stride and body mass"),
    ("orthosis_negative_work", "J/kg", "Negative work", "taken from the ankle per stride and body mass"),
    peak.row("orthosis_peak_power", "Power given", unit="W/kg"),
    peak.row("orthosis_peak_absorption", "Power taken", unit="W/kg"),
    ("share_of_positive_work", "percent", "Share of biological positive work", RECORDED),
    of=Of.WORN,
)
def work_given(stride: Stride) -> Found:
    """Work of the orthosis on the ankle, torque over angle; taken power is positive."""
    whole, columns = stride.whole, stride.columns
    work = increments(whole.of(columns[ORTHOSIS]), whole.of(columns["ankle/angle"])) / stride.body_mass
    recorded = whole.of(columns["gait/ankle_moment"]), whole.of(columns["gait/ankle_angle"])
    healthy = increments(*recorded) / stride.body_mass
    power = work / (stride.timestep * np.diff(whole.places))
    given, taken, own = (peak.clean(float(np.maximum(part, 0.0).sum())) for part in (work, -work, healthy))
    yield "orthosis_positive_work", given
    yield "orthosis_negative_work", 0.0 - taken
    yield "orthosis_peak_power", peak.clean(max(peak.flow_peak(power, stride.timestep), 0.0))
    yield "orthosis_peak_absorption", peak.clean(max(peak.flow_peak(-power, stride.timestep), 0.0))
    yield "share_of_positive_work", _share(given, own)


def _share(part: float, whole: float) -> float:
    """[percent]; NaN of nothing."""
    return 100.0 * part / whole if whole > 0.0 else math.nan


LOST = "recorded minus simulated"
WHOSE = "by the orthosis or by the patient's own weakness: compare it with a run without orthosis"

HELD = "the verdict compares it with the scenario's limits"


@reported(
    PUSH_OFF,
    ("ankle_range_lost", "deg", "Ankle range lost", LOST),
    ("dorsiflexion_lost", "deg", "Dorsiflexion lost in stance", f"{LOST}, {WHOSE}"),
    (
        "plantarflexion_at_toe_off",
        "deg",
        "Plantarflexion at toe-off",
        "plantarflexion positive; a shoe's drop counts",
    ),
    ("plantarflexion_lost_at_toe_off", "deg", "Plantarflexion lost at toe-off", f"{LOST}, {WHOSE}"),
    of=Of.STRIDE,
)
def push_off(stride: Stride) -> Found:
    """Range of the ankle, and its plantarflexion at toe-off, beside those of the recorded ankle."""
    angle, recorded = np.degrees(stride["ankle/angle"]), np.degrees(stride["gait/ankle_angle"])
    yield "ankle_range_lost", float(np.ptp(recorded) - np.ptp(angle))
    stance = ~stride.swing
    yield "dorsiflexion_lost", float(recorded[stance].max() - angle[stance].max())
    here = -math.degrees(stride.at("ankle/angle", stride.toe_off))
    yield "plantarflexion_at_toe_off", here
    healthy = -math.degrees(stride.at("gait/ankle_angle", stride.toe_off))
    yield "plantarflexion_lost_at_toe_off", healthy - here


@reported(
    PUSH_OFF,
    peak.row("torque_against_push_off", "Dorsiflexion torque against push-off", OVER),
    (
        "torque_against_push_off_per_mass",
        "N*m/kg",
        "Torque against push-off per body mass",
        f"{peak.MEANING}; {HELD}",
    ),
    (
        "work_against_push_off",
        "J/kg",
        "Work against push-off",
        f"that dorsiflexion torque takes from plantarflexion {OVER}; {HELD}",
    ),
    of=Of.WORN,
)
def against_push_off(stride: Stride) -> Found:
    """Dorsiflexion torque of the orthosis in push-off, and the work that it takes from plantarflexion."""
    part, torque = stride.between(HEEL_RISE, stride.toe_off), stride.columns[ORTHOSIS]
    against = peak.highest_mean(torque, stride.timestep, part)
    yield "torque_against_push_off", against
    yield "torque_against_push_off_per_mass", against / stride.body_mass
    given = increments(np.maximum(part.of(torque), 0.0), part.of(stride.columns["ankle/angle"]))
    taken = float(np.maximum(-given, 0.0).sum())
    yield "work_against_push_off", peak.clean(taken / stride.body_mass)


GIVEN = f"of its plantarflexion torque, {OVER}"


@reported(
    PUSH_OFF,
    peak.row("push_off_torque", "Plantarflexion torque in push-off", OVER),
    peak.row("push_off_power", "Power given to push-off", GIVEN, "W/kg"),
    ("push_off_work", "J/kg", "Work given to push-off", GIVEN),
    ("share_of_push_off_work", "percent", "Share of biological push-off work", f"{RECORDED}, {OVER}"),
    (
        "work_against_dorsiflexion",
        "J/kg",
        "Work against dorsiflexion",
        "that plantarflexion torque takes from dorsiflexion over the stride",
    ),
    of=Of.WORN,
)
def for_push_off(stride: Stride) -> Found:
    """Plantarflexion torque of the orthosis in push-off, its work, and what it takes from dorsiflexion."""
    part, columns = stride.between(HEEL_RISE, stride.toe_off), stride.columns
    down = np.minimum(columns[ORTHOSIS], 0.0)
    over_stride, over_part = (
        increments(each.of(down), each.of(columns["ankle/angle"])) / stride.body_mass
        for each in (stride.whole, part)
    )
    recorded = part.of(columns["gait/ankle_moment"]), part.of(columns["gait/ankle_angle"])
    own = float(np.maximum(increments(*recorded), 0.0).sum()) / stride.body_mass
    given = peak.clean(float(np.maximum(over_part, 0.0).sum()))
    power = over_part / (stride.timestep * np.diff(part.places))
    yield "push_off_torque", peak.highest_mean(-down, stride.timestep, part)
    if len(power):
        yield "push_off_power", peak.clean(max(peak.flow_peak(power, stride.timestep), 0.0))
    yield "push_off_work", given
    yield "share_of_push_off_work", _share(given, own)
    yield "work_against_dorsiflexion", peak.clean(float(np.maximum(-over_stride, 0.0).sum()))
