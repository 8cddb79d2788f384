"""Push-off: what the ankle loses of it beside the recorded one, and what the orthosis takes from it."""

import math

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.metric import PUSH_OFF, Found, Of, reported
from afo_sim.metrics.strides import ORTHOSIS, Stride

HEEL_RISE = 0.40  # begin of push-off: ankle power turns positive at some 43 % of the stride (Bovi 2011) [-]
OVER = "from 40 % of the stride to toe-off"
LOST = "recorded less this one's"
WHOSE = "by the orthosis or by the patient's own weakness: hold it against a run without orthosis"

HELD = "held against the scenario's limits.{}"  # where the limits stand


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
    (
        "plantarflexion_lost_at_toe_off",
        "deg",
        "Plantarflexion lost at toe-off",
        f"{LOST}, {WHOSE}",
    ),
    of=Of.STRIDE,
)
def push_off(stride: Stride) -> Found:
    """Range of the ankle, and its plantarflexion at toe-off, beside those of the recorded healthy ankle."""
    angle, recorded = (np.degrees(stride[name]) for name in ("ankle/angle", "gait/ankle_angle"))
    yield "ankle_range_lost", float(np.ptp(recorded) - np.ptp(angle))
    stance = ~stride.swing
    yield "dorsiflexion_lost", float(recorded[stance].max() - angle[stance].max())
    here = -math.degrees(stride.at("ankle/angle", stride.toe_off))
    yield "plantarflexion_at_toe_off", here
    healthy = -math.degrees(stride.at("gait/ankle_angle", stride.toe_off))
    yield "plantarflexion_lost_at_toe_off", healthy - here


@reported(
    PUSH_OFF,
    *peak.rows("torque_against_push_off", "Dorsiflexion torque against push-off", OVER),
    (
        "torque_against_push_off_per_mass",
        "N*m/kg",
        "Torque against push-off per body mass",
        f"{peak.MEANING}; {HELD.format('torque_against_push_off')}",
    ),
    (
        "work_against_push_off",
        "J/kg",
        "Work against push-off",
        f"that dorsiflexion torque takes from plantarflexion {OVER}; {HELD.format('work_against_push_off')}",
    ),
    of=Of.WORN,
)
def against_push_off(stride: Stride) -> Found:
    """Dorsiflexion torque of the orthosis in push-off, and the work that it takes from plantarflexion."""
    rows = (stride.phase >= HEEL_RISE) & ~stride.swing
    torque, velocity = stride[ORTHOSIS][rows], stride["ankle/velocity"][rows]
    peaks = dict(peak.told("torque_against_push_off", torque, stride.timestep))
    yield from peaks.items()
    yield "torque_against_push_off_per_mass", peaks[f"torque_against_push_off{peak.OVER}"] / stride.body_mass
    taken = np.maximum(torque, 0.0) * np.maximum(-velocity, 0.0)
    yield "work_against_push_off", peak.clean(float(taken.sum()) * stride.timestep / stride.body_mass)
