"""A walk's reward, period by period: toe and heel earn, a hindered push-off and air cost.

Each part is 0 to 1 between the two limits of the verdict's question (docs/verdict.md). A stride with toe and
heel within their first limits, nothing against push-off and no air is worth 1.
"""

from typing import Any

import numpy as np

from afo_sim.description import Scenario, load
from afo_sim.metrics import air_given
from afo_sim.rl.environments.task import Sample

# The verdict ranks no question above another; doing nothing earns what the patient does without the device.
LIFT, HEEL, PUSH_OFF, AIR = 0.5, 0.5, -0.5, -0.5
LOWEST, HIGHEST = PUSH_OFF + AIR, 1.0  # of a period [-]
BEYOND = 1e-12  # from equal limits to the whole price
FEWEST = 1e-9  # strides of a bottle that a limit may ask for; 0 would divide


def limits_of(scenario: Scenario) -> np.ndarray:
    """Limits of the verdict on toe [m], heel [rad], torque [N·m/kg] and air of a stride [kg] (4, 2)."""
    limits = scenario.limits or load("limits", "usual")
    bottle = air_given(limits.bottle_volume, limits.bottle_pressure, scenario.supply.pressure)
    air = bottle / np.maximum(limits.strides_per_bottle, FEWEST)
    pairs = np.array([limits.toe_clearance, limits.contact_pitch, limits.torque_against_push_off, air])
    falling = np.array([-1.0, -1.0, 1.0, 1.0])
    pairs[:, 1] += np.where(pairs[:, 0] == pairs[:, 1], BEYOND * falling, 0.0)
    return pairs


def badness(value: Any, pair: Any) -> Any:
    """0 up to the first limit, 1 from the second on, straight between them; also of limits that fall."""
    good, bad = pair
    return np.clip((value - good) / (bad - good), 0.0, 1.0)


def walking_reward(sample: Sample) -> Any:
    """Of a period of walking [-], LOWEST to HIGHEST."""
    toe, heel, torque, air = sample["limits"]
    earned = LIFT * sample["passing"] * (1.0 - badness(sample["toe/height"], toe))
    earned += HEEL * sample["struck"] * (1.0 - badness(sample["sole/pitch"], heel))
    against = sample["pushing"] * badness(sample["ankle/moment/orthosis"], torque)
    return earned + PUSH_OFF * against + AIR * np.minimum(sample["air/taken"] / air[1], 1.0)
