"""What a gait is searched for: little effort and no fall, and of a healthy one a likeness to people's."""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker.strides import Strides, norm_at, strides_of, swing_clearance
from afo_sim.walker.walking import Walked

SIDES = ("right", "left")
NEAR = 0.8  # share of a bound from which on a likeness costs more [-]
UNLIKE = 3.0  # of each part of the likeness where there are no strides to compare [-]
PUSH_OFF, LOADING, SWING = slice(30, 63), slice(0, 25), slice(62, 101)  # of 101 places over the stride


@dataclass(frozen=True)
class Cost:
    """What a gait is searched for: the sum of these, each a stated weight times a number."""

    target: float  # speed [m/s]
    fall: float = 150.0  # of the share of the time that is lost by a fall
    speed: float = 60.0  # of the distance from the speed beyond 0.02 m/s [1/(m/s)]
    effort: float = 0.5  # of the muscles' energy per mass and way [J/(kg·m)]
    activation: float = 20.0  # of the mean cube of all activations
    force: float = 200.0  # of the mean load beyond 1.25 body weights
    knee: float = 250.0  # of the mean extension beyond 4° of flexion [1/rad]
    lean: float = 60.0  # of the mean lean of the trunk beyond 3° backward and 7° forward [1/rad]
    likeness: float = 0.0  # of the mean square of the parts of `unlikeness`
    pushed: bool = True  # ±50 N push the trunk about every 1.3 s, from a drawn start

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
            parts = [unlikeness(walked, side, self.target) for side in SIDES]
            both = np.array([list(part.values()) for part in parts])
            more = both**2 + 4.0 * np.maximum(both - NEAR, 0.0) ** 2
            found["likeness"] = self.likeness * float(more.mean())
        return {name: float(value) for name, value in found.items()}


def unlikeness(walked: Walked, side: str, speed: float) -> dict[str, float]:
    """How unlike people's a leg's mean stride is at a speed, each over the bound that it is held to [-]."""
    strides, norm = strides_of(walked, side), norm_at(speed)
    if len(strides.duration) < 2:
        return dict.fromkeys(BOUNDS, UNLIKE)
    curves = {name: strides.mean(name) for name in (*_CURVES, *LEG_MUSCLES)}
    off = {name: curves[name] - norm[name] for name in _CURVES}
    rms = {name: float(np.sqrt(np.mean(each**2))) for name, each in off.items()}
    clearance = float(np.median(swing_clearance(walked, strides, side)))
    found = {
        "thigh": rms["thigh"],
        "knee": rms["knee"],
        "ankle": rms["ankle"],
        "swing ankle": float(np.sqrt(np.mean(off["ankle"][SWING] ** 2))),
        "moment": rms["moment"],
        "load": rms["load"],
        "force peak": abs(float(strides.curves["load"].max(axis=1).mean() - norm["load"].max())),
        "clearance": _beyond(clearance, 0.016, 0.026),
        "stride time": abs(float(strides.duration.mean() / norm["duration"]) - 1.0),
        "stride length": abs(float(strides.length.mean() / norm["length"]) - 1.0),
        "tibialis": _beyond(float(curves["tibialis"].mean()), 0.10, 0.17),
        "soleus": _beyond(float(curves["soleus"][PUSH_OFF].max()), 0.45, 0.75),
        "gastrocnemius": _beyond(float(curves["gastrocnemius"][PUSH_OFF].max()), 0.45, 0.75),
    }
    return {name: value / BOUNDS[name] for name, value in found.items()}


_CURVES = ("thigh", "knee", "ankle", "moment", "load")
BOUNDS = {
    "thigh": math.radians(7.0), "knee": math.radians(8.0), "ankle": math.radians(6.0),
    "swing ankle": math.radians(4.5), "moment": 0.15, "load": 0.12, "force peak": 0.25, "clearance": 0.01,
    "stride time": 0.10, "stride length": 0.10, "tibialis": 0.05, "soleus": 0.15, "gastrocnemius": 0.15,
}  # fmt: skip


def _beyond(value: float, least: float, most: float) -> float:
    return max(least - value, value - most, 0.0)
