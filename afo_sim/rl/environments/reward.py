"""What the verdict asks of a stride, as a reward: toe, heel, push-off, air; and switchings of the valves.

Each part is 0 to 1 between the two limits of the verdict's question, and is paid when it is decided: lift
as the foot has passed the standing leg, push-off at toe-off, heel, air and switchings at heel strike. The sum
over an episode, over its strides, is the score: 1 of strides that the verdict calls good in everything.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from afo_sim.description import Scenario, load
from afo_sim.metrics import air_given

# The verdict ranks no question above another: a device that does nothing earns 0, one that lifts and lands
# well earns 1, and one that is bad in push-off or air gives half of that back. Argued in
# docs/environments.md, before any controller was run; they are not to be tuned.
WEIGHTS = {"lift": 0.5, "heel": 0.5, "push_off": -0.5, "air": -0.5, "switching": -0.1}
PARTS = tuple(WEIGHTS)
SWITCHINGS = (2.0, 20.0)  # of all coils in a stride: one filling and one venting; ten times that; assumed
LOWEST, HIGHEST = -1.1, 1.0  # of a sample's reward: all costs, and both gains


class Events(NamedTuple):
    """What a sample says of a stride, in one simulation or in several (n,).

    passing : whether the swinging foot passes the standing leg
    pushing : whether it is push-off, from heel rise to toe-off
    stride : number of the stride
    height : of ball and toes above the floor [m]
    pitch : of the sole, toes up [rad]
    torque : of the orthosis by body mass, dorsiflexion positive [N·m/kg]
    angle : of the ankle [rad]
    air : mass that the chambers have gained since the sample before [kg]
    switched : coils that were switched on since then
    """

    passing: Any
    pushing: Any
    stride: Any
    height: Any
    pitch: Any
    torque: Any
    angle: Any
    air: Any
    switched: Any


@dataclass(frozen=True)
class Scale:
    """Limits of a verdict, each (bad, good): [m], [rad], [N·m/kg], [J/kg], and air in a stride [kg]."""

    lift: tuple[float, float]
    heel: tuple[float, float]
    torque: tuple[float, float]
    work: tuple[float, float]
    air: tuple[float, float]

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Its own limits, or the usual ones."""
        limits = scenario.limits or load("limits", "usual")
        bottle = air_given(limits.bottle_volume, limits.bottle_pressure, scenario.supply.pressure)
        pairs = (limits.toe_clearance, limits.contact_pitch)
        costs = (limits.torque_against_push_off, limits.work_against_push_off)
        wanted, few = limits.strides_per_bottle
        return cls(*((bad, good) for good, bad in (*pairs, *costs, (bottle / wanted, bottle / few))))


def quality(value: Any, pair: tuple[Any, Any]) -> Any:
    """0 at the first number of a pair and beyond it, 1 at the second, straight between them."""
    bad, good = pair
    return np.minimum(np.maximum((value - bad) / (good - bad), 0.0), 1.0)


class Strides:
    """What is known of the present stride of some simulations, and what it is worth.

    Units: scales (n,) as `Scale` of each.
    """

    def __init__(self, count: int):
        self.scales = np.zeros((count, 5, 2))
        self.last = np.zeros((4, count))  # passing, pushing, stride, angle of the sample before
        self.lowest, self.peak, self.work = np.full(count, np.inf), np.zeros(count), np.zeros(count)
        self.air, self.switched = np.zeros(count), np.zeros(count)

    def begin(self, ids: np.ndarray, scales: Sequence[Scale], first: Events) -> None:
        """Begin episodes at their first samples."""
        self.scales[ids] = [list(vars(scale).values()) for scale in scales]
        self.last[:, ids] = first.passing, first.pushing, first.stride, first.angle
        for each in (self.peak, self.work, self.air, self.switched):
            each[ids] = 0.0
        self.lowest[ids] = np.inf

    def pay(self, ids: np.ndarray, now: Events) -> np.ndarray:
        """Parts of the reward of the next samples (5, n), weighted."""
        passing, pushing, stride, angle = self.last[:, ids]
        lift, heel, torque, work, air = np.moveaxis(self.scales[ids], 0, -1)
        self.lowest[ids] = np.where(now.passing, np.minimum(self.lowest[ids], now.height), self.lowest[ids])
        against = np.where(now.pushing, np.maximum(now.torque, 0.0), 0.0)
        self.peak[ids] = np.maximum(self.peak[ids], against)
        self.work[ids] += against * np.maximum(angle - now.angle, 0.0)
        self.air[ids] += np.maximum(now.air, 0.0)
        self.switched[ids] += now.switched
        passed, off = (passing > now.passing), (pushing > now.pushing)
        struck = now.stride > stride
        hindered = np.maximum(
            1.0 - quality(self.peak[ids], (torque[0], torque[1])),
            1.0 - quality(self.work[ids], (work[0], work[1])),
        )
        found = np.array(
            [
                passed * quality(self.lowest[ids], (lift[0], lift[1])),
                struck * quality(now.pitch, (heel[0], heel[1])),
                off * hindered,
                struck * (1.0 - quality(self.air[ids], (air[0], air[1]))),
                struck * quality(self.switched[ids], SWITCHINGS),
            ]
        )
        self.lowest[ids] = np.where(passed, np.inf, self.lowest[ids])
        for done, each in ((off, self.peak), (off, self.work), (struck, self.air), (struck, self.switched)):
            each[ids] = np.where(done, 0.0, each[ids])
        self.last[:, ids] = now.passing, now.pushing, now.stride, now.angle
        return np.array(list(WEIGHTS.values()))[:, None] * found
