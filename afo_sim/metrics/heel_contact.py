"""How a foot meets the floor: with heel, flat or forefoot first, and how hard it slaps down after that."""

import math

from afo_sim.common import Doubles
from afo_sim.metrics import peak
from afo_sim.metrics.facts import Run
from afo_sim.metrics.kernel import R, S, base, kernel
from afo_sim.metrics.metric import CONTACT, Found, Of, reported
from afo_sim.metrics.strides import LEVEL, at

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
    """How far the recorded path was moved to lay the sole on the floor."""
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
@kernel(*LEVEL, R.velocity)
def contact(b: Doubles, out: Doubles) -> float:
    """Pitch at the heel strike that begins the stride, and the slap after it."""
    pitch = math.degrees(at(b, R.angle, 0.0) - at(b, R.shank, 0.0) - b[S.level])
    out[0] = pitch
    if math.isfinite(pitch):
        out[1], out[3] = 100.0 * (pitch > HEEL_PITCH), 100.0 * (pitch < FOREFOOT_PITCH)
        out[2] = 100.0 - out[1] - out[3]
    first, angle, lowest = int(b[S.first]), base(b, R.angle), int(b[S.first])
    for k in range(first, int(b[S.end])):
        if b[base(b, R.phase) + k] <= LOADING and b[angle + k] < b[angle + lowest]:
            lowest = k
    fall, length = base(b, R.velocity) + first, peak.WINDOW / b[S.timestep]
    out[4] = math.degrees(peak.positive(peak.highest(b, fall, lowest + 1 - first, length, -1.0)))
    return 0.0
