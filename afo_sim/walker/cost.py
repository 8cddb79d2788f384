"""What a gait is searched for: little effort and no fall, and of a healthy one a likeness to people's."""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker.likeness import TABLE, beside_people
from afo_sim.walker.strides import strides_of
from afo_sim.walker.walking import Walked

SIDES = ("right", "left")
NEAR, BEYOND = 0.8, 12.0  # share of a bound from which on a distance from people costs more, how much [-]
MOST = 3.0  # distance that counts at most, and of what has no strides to compare [bounds]


@dataclass(frozen=True)
class Cost:
    """What a gait is searched for: the sum of these, each a stated weight times a number."""

    target: float  # speed [m/s]
    fall: float = 150.0  # of the share of the time that is lost by a fall
    speed: float = 300.0  # of the distance from the speed beyond 0.02 m/s [1/(m/s)]
    effort: float = 0.5  # of the muscles' energy per mass and way [J/(kg·m)]
    activation: float = 20.0  # of the mean cube of all activations
    force: float = 200.0  # of the mean load beyond 1.25 body weights
    knee: float = 250.0  # of the mean extension beyond 4° of flexion [1/rad]
    lean: float = 300.0  # of the mean lean of the trunk beyond 3° backward and 7° forward [1/rad]
    likeness: float = 0.0  # of the mean square of `unlikeness`, more beyond 0.8
    weak: float = 60.0  # of the share of the time that is lost by a drawn body's fall
    pushed: bool = True  # ±50 N push the trunk about every 1.3 s, from a drawn start

    @property
    def most(self) -> float:
        """Of a walk that ends in an error: twice what a fall at once and no strides cost."""
        return 2.0 * (self.fall + self.likeness * (MOST**2 + BEYOND * (MOST - NEAR) ** 2))

    def of(self, walked: Walked, duration: float) -> dict[str, float]:
        """The parts of the cost of a walk."""
        time, mass = walked["time"], walked.body.weight / GRAVITY
        late = time > min(1.0, 0.5 * time[-1])
        way = walked["trunk/forward"]
        speed = np.ptp(way[late]) / max(np.ptp(time[late]), 0.1)
        energy = sum(walked[f"{s}/{m}/energy"][-1] for s in SIDES for m in LEG_MUSCLES)
        activation = np.mean([walked[f"{s}/{m}/activation"] ** 3 for s in SIDES for m in LEG_MUSCLES])
        lean = np.abs(walked["trunk/pitch"][late] + 0.03) - 0.09
        load = np.array([walked[f"{s}/load"][late] for s in SIDES]) / walked.body.weight
        straight = np.array([walked[f"{s}/knee"][late] for s in SIDES]) + math.radians(4.0)
        found = {
            "fall": 0.0 if walked.fell is None else self.fall * (1.0 - time[-1] / duration),
            "speed": self.speed * max(abs(speed - self.target) - 0.02, 0.0),
            "effort": self.effort * energy / (mass * max(way[-1], 1.0)),
            "activation": self.activation * activation,
            "force": self.force * np.mean(np.maximum(load - 1.25, 0.0)),
            "knee": self.knee * np.mean(np.maximum(straight, 0.0)),
            "lean": self.lean * np.mean(np.maximum(lean, 0.0)),
        }
        if self.likeness:
            off = unlikeness(walked, self.target)
            found["likeness"] = self.likeness * np.mean(off**2 + BEYOND * np.maximum(off - NEAR, 0.0) ** 2)
        return {name: float(value) for name, value in found.items()}


def unlikeness(walked: Walked, speed: float) -> np.ndarray:
    """How far a walk is from what a gait of a speed is held to, over each bound [-]."""
    if min(len(strides_of(walked, side).duration) for side in SIDES) < 2:
        return np.full(sum(row.in_cost for row in TABLE), MOST)
    found = [
        abs(own - centre) / half for row, _, own, centre, half in beside_people(walked, speed) if row.in_cost
    ]
    return np.minimum(np.nan_to_num(found, nan=MOST), MOST)
