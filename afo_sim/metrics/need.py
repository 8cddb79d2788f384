"""Torque that the patient lacks in the healthy ankle's motion, over the stride and in the parts of swing."""

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.metric import NEED, Found, tells
from afo_sim.metrics.strides import Stride

NEEDED = "healthy ankle's active moment less what the patient gives"
SWING = "from toe-off until the shank stands upright"
TERMINAL = "from the upright shank to heel strike, where the straight knee tightens the calf"
TISSUE = "at the same instant, the part of it that only holds against the ankle's own tissue"
SIDES = {"dorsiflexion": 1.0, "plantarflexion": -1.0}  # sign of a torque that way


@tells(
    NEED,
    *peak.rows("needed_dorsiflexion_torque", "Dorsiflexion torque needed", NEEDED),
    *peak.rows("needed_plantarflexion_torque", "Plantarflexion torque needed", NEEDED),
    *peak.rows("needed_swing_torque", "Dorsiflexion torque needed in swing", SWING),
    ("needed_swing_torque_mean", "N*m", "Dorsiflexion torque needed in swing, mean", SWING),
    ("needed_swing_torque_tissue", "N*m", "Of the torque needed in swing, tissue's", TISSUE),
    *peak.rows("needed_terminal_swing_torque", "Dorsiflexion torque needed in terminal swing", TERMINAL),
    ("needed_terminal_swing_torque_tissue", "N*m", "Of that in terminal swing, tissue's", TISSUE),
)
def needs(stride: Stride) -> Found:
    """Torque that the patient lacks in the healthy ankle's motion.

    Swing is told in two: a foot is carried until the shank stands upright, then it is held up against a calf
    that the straightening knee tightens. The tissue's part is the passive moment of this ankle at the
    recorded angles of ankle and knee.

    Source
    ------
    Initial and mid-swing end, and terminal swing begins, with the upright shank: Perry & Burnfield 2010.
    """
    needed = stride["gait/needed_moment"]
    for side, sign in SIDES.items():
        yield from peak.told(f"needed_{side}_torque", sign * needed, stride.timestep)
    held = np.clip(-stride["gait/passive_moment"], 0.0, np.maximum(needed, 0.0))
    for name, rows in (
        ("needed_swing_torque", stride.carried),
        ("needed_terminal_swing_torque", stride.swing & ~stride.carried),
    ):
        yield from peak.told(name, needed[rows], stride.timestep)
        if name == "needed_swing_torque":
            yield f"{name}_mean", peak.mean(needed[rows])
        if rows.any():
            yield f"{name}_tissue", float(held[rows][np.argmax(needed[rows])])
