"""Whether a stride looks like the walk of the walker who is named: a healthy one's, or a patient's own."""

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait import GaitCycle, off_norm, stance

_PEOPLE = 6.0  # standard deviation of the ankle angle between healthy adults; 4 to 8 (Bovi 2011) [deg]


def walker_doubts(cycle: GaitCycle) -> list[Notice]:
    """A warning where the ankle contradicts `walker`; none where nobody said whose walk it is.

    The swing of a healthy walker whose ankle lies beyond the norm's band by more than a standard deviation
    between people (root mean square), and a patient whose ankle never does.
    """
    off = np.degrees(off_norm(cycle))
    swing = off[cycle.phase > stance(cycle)]
    beyond = float(np.sqrt(np.mean(swing**2)))
    if cycle.walker == "healthy" and beyond > _PEOPLE:
        text = (
            "in swing the ankle is {mean:+.0f} deg off the norm's band ({beyond:.0f} deg RMS), more than "
            "healthy people's spread of {limit:.0f} deg: if it is the patient's own walk, import it with "
            "{subject} patient, else the weakness counts twice"
        )
        mean = float(swing.mean())
        return [Notice("walker-not-usual", text, subject="walker", limit=_PEOPLE, beyond=beyond, mean=mean)]
    most = float(np.abs(off).max())
    if cycle.walker == "patient" and most <= _PEOPLE:
        text = (
            "the ankle stays within {most:.0f} deg of the norm's band, as healthy people's does "
            "({limit:.0f} deg): is it a patient's own walk, without the device ({subject})?"
        )
        return [Notice("walker-usual", text, subject="walker", limit=_PEOPLE, most=most)]
    return []
