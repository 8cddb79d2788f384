"""What the verdict asks of a stride, as a reward: toe, heel, push-off, air; and switchings of the valves.

Each part is 0 to 1 between the two limits of the verdict's question, and is paid when it is decided: lift
as the foot has passed the standing leg, push-off at toe-off, heel, air and switchings at heel strike. The sum
over an episode, over its strides, is the score: 1 of strides that the verdict calls good in toe, heel,
push-off and air, with at most two switchings. Whether the skin bears it is not in the reward.
"""

from typing import Any, NamedTuple

import numpy as np

from afo_sim.description import Scenario, load
from afo_sim.metrics import air_given

# The verdict ranks no question above another: a device that does nothing earns what the patient does without
# it (the usual one 0.5, whose heel lands first while the toe trips), one that lifts and lands well earns 1,
# and one that is bad in push-off or air gives half of that back. Argued in docs/environments.md, before any
# controller was run; they are not to be tuned.
WEIGHTS = {"lift": 0.5, "heel": 0.5, "push_off": -0.5, "air": -0.5, "switching": -0.1}
PARTS = tuple(WEIGHTS)
SWITCHINGS = (2.0, 20.0)  # of all coils in a stride: one filling and one venting; ten times that; assumed
BEYOND = 1e-12 * np.array([-1.0, -1.0, 1.0, 1.0, 1.0])  # from equal limits to the whole price
FEWEST = 1e-9  # strides of a bottle that a limit may ask for; 0 would divide
LOWEST, HIGHEST = -1.1, 1.0  # of a sample's reward: all costs, and both gains


class Events(NamedTuple):
    """What a sample says of the strides of some simulations (n,)."""

    passing: np.ndarray  # whether the swinging foot passes the standing leg
    pushing: np.ndarray  # whether it is push-off, from heel rise to toe-off
    stride: np.ndarray  # its number
    angle: np.ndarray  # of the ankle [rad]
    height: np.ndarray  # of ball and toes above the floor [m]
    pitch: np.ndarray  # of the sole, toes up [rad]
    torque: np.ndarray  # of the orthosis by body mass, dorsiflexion positive [N·m/kg]
    air: np.ndarray  # mass that the chambers have gained since the sample before [kg]
    switched: np.ndarray  # coils that were switched on since then


def scale_of(scenario: Scenario) -> np.ndarray:
    """First and second limit of the verdict on toe [m], heel [rad], torque, work and air a stride (5, 2)."""
    limits = scenario.limits or load("limits", "usual")
    bottle = air_given(limits.bottle_volume, limits.bottle_pressure, scenario.supply.pressure)
    air = bottle / np.maximum(limits.strides_per_bottle, FEWEST)
    against = limits.torque_against_push_off, limits.work_against_push_off
    pairs = np.array([limits.toe_clearance, limits.contact_pitch, *against, air])
    pairs[:, 1] += np.where(pairs[:, 0] == pairs[:, 1], BEYOND, 0.0)
    return pairs


def badness(value: Any, pair: Any) -> Any:
    """0 up to the first limit, 1 from the second on, straight between them; also of limits that fall."""
    good, bad = pair
    return np.clip((value - good) / (bad - good), 0.0, 1.0)


class Strides:
    """What is known of the present stride of some simulations, and what it is worth."""

    def __init__(self, count: int):
        self.scales, self.last = np.zeros((5, 2, count)), np.zeros((4, count))
        self.lowest = np.full(count, np.inf)
        self.peak, self.work, self.air, self.switched = np.zeros((4, count))

    def begin(self, ids: np.ndarray, scales: np.ndarray, first: Events) -> None:
        """Begin episodes at their first samples."""
        self.scales[..., ids], self.last[:, ids] = np.moveaxis(scales, 0, -1), first[:4]
        self.lowest[ids] = np.inf
        for each in (self.peak, self.work, self.air, self.switched):
            each[ids] = 0.0

    def pay(self, ids: np.ndarray, now: Events) -> np.ndarray:
        """Parts of the reward of the next samples (5, n), weighted."""
        passing, pushing, stride, angle = self.last[:, ids]
        toe, heel, torque, work, air = self.scales[..., ids]
        self.lowest[ids] = np.minimum(self.lowest[ids], np.where(now.passing, now.height, np.inf))
        against = np.where(now.pushing, np.maximum(now.torque, 0.0), 0.0)
        self.peak[ids] = np.maximum(self.peak[ids], against)
        self.work[ids] += against * np.maximum(angle - now.angle, 0.0)
        self.air[ids] += now.air
        self.switched[ids] += now.switched
        passed, off, struck = passing > now.passing, pushing > now.pushing, now.stride > stride
        hindered = np.maximum(badness(self.peak[ids], torque), badness(self.work[ids], work))
        found = (
            passed * (1.0 - badness(self.lowest[ids], toe)),
            struck * (1.0 - badness(now.pitch, heel)),
            off * hindered,
            struck * badness(self.air[ids], air),
            struck * badness(self.switched[ids], SWITCHINGS),
        )
        self.lowest[ids[passed]], self.last[:, ids] = np.inf, now[:4]
        for done, each in ((off, self.peak), (off, self.work), (struck, self.air), (struck, self.switched)):
            each[ids[done]] = 0.0
        return np.array(list(WEIGHTS.values()))[:, None] * np.array(found)
