"""How a foot meets the floor: with heel, flat or forefoot first, and how hard it slaps down after that."""

import math

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.facts import Run
from afo_sim.metrics.metric import CONTACT, Found, Of, reported
from afo_sim.metrics.strides import Stride

HEEL_PITCH, FOREFOOT_PITCH = 8.0, -1.6  # of the sole at contact; beyond them heel, forefoot come first [deg]
LOADING = 0.12  # end of the loading response [-]
SLAP = "highest plantarflexion velocity as the foot comes down after heel strike"
LAID = "the recorded ankle is moved up or down by as much, the most late in push-off"


@reported(
    CONTACT,
    ("sole_laid", "mm", "Recorded sole off the floor in stance, before it is laid there", LAID),
    of=Of.RUN,
)
def laid(run: Run) -> Found:
    """How far the recorded path was moved so that the sole stands on the floor."""
    if run.facts.laid is not None:
        yield "sole_laid", 1e3 * run.facts.laid


@reported(
    CONTACT,
    ("foot_pitch_at_contact", "deg", "Foot pitch at initial contact", "outsole to floor, toe up positive"),
    ("contacts_with_heel", "percent", "Strides that begin with the heel", "pitch above 8°"),
    ("contacts_with_flat", "percent", "Strides that begin flat", "pitch from −1.6° to 8°"),
    ("contacts_with_forefoot", "percent", "Strides that begin with the forefoot", "pitch below −1.6°"),
    ("foot_slap_velocity", "deg/s", "Foot slap", SLAP),
    of=Of.STRIDE,
)
def contact(stride: Stride) -> Found:
    """Pitch at the heel strike that begins the stride, and the slap after it."""
    angle, shank = stride.at("ankle/angle", 0.0), stride.at("shank/angle", 0.0)
    pitch = math.degrees(angle) - math.degrees(shank) - math.degrees(stride.level)
    yield "foot_pitch_at_contact", pitch
    if math.isfinite(pitch):
        yield "contacts_with_heel", 100.0 * (pitch > HEEL_PITCH)
        yield "contacts_with_flat", 100.0 * (FOREFOOT_PITCH <= pitch <= HEEL_PITCH)
        yield "contacts_with_forefoot", 100.0 * (pitch < FOREFOOT_PITCH)
    loading = np.count_nonzero(stride.phase <= LOADING)
    lowest = int(np.argmin(stride["ankle/angle"][:loading]))
    yield (
        "foot_slap_velocity",
        math.degrees(peak.highest_mean(-stride["ankle/velocity"][: lowest + 1], stride.timestep)),
    )
