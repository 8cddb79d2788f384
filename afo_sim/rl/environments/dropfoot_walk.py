"""Walking with a drop foot: lift the toes in swing, with little air, and leave push-off alone."""

from typing import Any

import numpy as np

from afo_sim.rl.environments.sample import Sample
from afo_sim.rl.environments.task import Observed, Task

CLEAR, SMOOTH = 0.015, 0.010  # height of the toe at which clearance is worth nothing, and its width [m]
POWER = 10.0  # taken from push-off, at which its penalty is full [W]
AIR = 2.5e-6  # let into the chambers in a control period, at which its penalty is full [kg]
AGAINST, USED = 0.5, 0.2  # largest penalties of push-off and of air [-]
CHAMBERS = ("dorsiflexor", "plantarflexor")


def reward(sample: Sample, gained: np.ndarray) -> Any:
    """Clearance in swing less penalties [-], −1.2 to 1.

    swing tanh((h − CLEAR) / SMOOTH) − AGAINST min(P / POWER, 1) − USED min(Δm / AIR, 1)

    h is the height of the toe above the floor. P is the power that the orthosis' dorsiflexion moment takes
    from plantarflexion, from heel rise to toe-off. Δm is the air that the chambers have gained since the
    sample before; what they lose is not given back.
    """
    lifted = sample["swing"] * np.tanh((sample["toe/height"] - CLEAR) / SMOOTH)
    moment, velocity = sample["ankle/moment/orthosis"], sample["ankle/velocity"]
    taken = sample["push_off"] * np.maximum(moment, 0.0) * np.maximum(-velocity, 0.0)
    air = np.add.reduce(np.maximum(gained, 0.0))
    return lifted - AGAINST * np.minimum(taken / POWER, 1.0) - USED * np.minimum(air / AIR, 1.0)


TASK = Task(
    name="dropfoot_walk",
    title="walking with a drop foot on S1's orthosis: clear the floor in swing, with little air",
    scenario="walk-dropfoot-afo",
    sets={"duration": "9 s", "timestep": "1 ms", "gait.settled": "walked"},
    period=0.01,
    duration=5.0,
    observed=(
        Observed(
            "shank_angle", "rad", "from the vertical, knee ahead of ankle positive", -2.0, 2.0, "shank/angle"
        ),
        Observed("shank_velocity", "rad/s", "as shank_angle", -20.0, 20.0, "shank/velocity"),
        Observed("ankle_angle", "rad", "dorsiflexion positive", -1.5, 1.5, "ankle/angle"),
        Observed("ankle_velocity", "rad/s", "dorsiflexion positive", -50.0, 50.0, "ankle/velocity"),
        *(
            Observed(f"{name}_pressure", "Pa", "gauge, in the chamber", -2e4, 1e6, f"chamber/{name}/pressure")
            for name in CHAMBERS
        ),
        Observed("heel_load", "N", "of the ground under the heel", 0.0, 5000.0, "foot/heel_load"),
        Observed("toe_load", "N", "of the ground under ball and toes", 0.0, 5000.0, "foot/toe_load"),
    ),
    reward=reward,
    lowest=-1.0 - USED,  # no push-off in swing
    highest=1.0,
    carried=tuple(f"chamber/{name}/mass" for name in CHAMBERS),
    strides=(1, 2),
)
