"""What a healthy gait is held to: angles, moments, forces, EMG, clearance and cost, each within a bound."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim.common import JsonDict, JsonMapping
from afo_sim.walker.strides import ANGLES, EMG, emg, norm_at, numbers, sole_tilt, strides_of
from afo_sim.walker.walking import Walked

WIDER = 1.4  # of what slow and fast gaits are held to
LOADING, STANCE, PUSH_OFF, SWING = slice(0, 16), slice(20, 61), slice(50, 76), slice(65, 101)  # [%]
BOVI = "Bovi et al. 2011, Gait Posture 33(1):6-13"
# On a sole with a drop the shank keeps its way and the foot takes the sole's tilt.
SHOD = "Bovi et al. 2011, on the sole's tilt; Owen, Fatone & Hansen 2018, Prosthet. Orthot. Int."
PERRY = "Perry & Burnfield 2010, Gait Analysis; Ericson et al. 1986, Scand. J. Rehabil. Med. 18"
LOONEY = "Looney et al. 2019, Med. Sci. Sports Exerc. 51(2); Das Gupta et al. 2019, Sci. Rep. 9"


@dataclass(frozen=True)
class Held:
    """What a gait is held to: within `half` of `centre`; None: of what was measured."""

    quantity: str
    unit: str
    half: float  # infinite: only shown
    source: str
    centre: float | None = None
    in_cost: bool = True
    share: bool = False  # `half` is a share of what was measured
    wider: float = WIDER


TABLE = (
    Held("step length", "m", 0.1, BOVI, share=True),
    Held("cadence", "/min", 0.1, BOVI, share=True),
    Held("thigh, RMS off the norm", "deg", 7.0, BOVI),
    Held("knee, RMS off the norm", "deg", 8.0, BOVI),
    Held("ankle, RMS off the norm", "deg", 6.0, SHOD),
    Held("ankle, over that of a joint held at its mean", "-", 0.75, SHOD, wider=1.2),
    Held("ankle in swing, RMS off the norm", "deg", 4.5, SHOD),
    Held("ankle beside bare feet, RMS off the norm", "deg", math.inf, BOVI, in_cost=False),
    Held("ankle beside bare feet in swing, RMS off the norm", "deg", math.inf, BOVI, in_cost=False),
    Held("ankle moment, RMS off the norm", "N·m/kg", 0.2, BOVI),
    Held("ankle, least in loading", "deg", 4.0, SHOD),
    Held("ankle, greatest in stance", "deg", 4.0, SHOD),
    Held("ankle, fall in push-off", "deg", 12.0, SHOD),
    Held("vertical force, first peak", "BW", 0.25, BOVI),
    Held("vertical force, second peak", "BW", 0.25, BOVI),
    Held("toe clearance", "mm", 12.5, "Winter 1991", 22.5),
    Held("tibialis, mean", "-", 0.07, PERRY, 0.15),
    Held("tibialis, correlation with EMG", "-", 0.4, PERRY),
    Held("soleus, greatest in push-off", "-", 0.3, PERRY, 0.6, wider=1.0),
    Held("soleus, when greatest", "%", 10.0, PERRY),
    Held("soleus, correlation with EMG", "-", 0.4, PERRY),
    Held("gastrocnemius, greatest in push-off", "-", 0.3, PERRY, 0.6, wider=1.0),
    Held("gastrocnemius, when greatest", "%", 10.0, PERRY),
    Held("gastrocnemius, correlation with EMG", "-", 0.4, PERRY),
    Held("cost of transport", "J/(kg·m)", 0.4, LOONEY, in_cost=False),
)


def beside_people(walked: Walked, speed: float) -> Iterator[tuple[Held, float, float, float, float]]:
    """Each row of `TABLE` for people at a speed: measured, the walk's, centre and half of its bound."""
    people: JsonDict = dict(norm_at(round(speed, 2), walked.body.size.taller)) | emg()
    people |= {"barefoot": people["ankle"], "ankle": people["ankle"] - sole_tilt(walked.body)}
    people |= {"clearance": 13.0, "cost": measured_cost(speed)}
    theirs, whole, legs = in_numbers(people, people), numbers(walked), []
    for side in ("right", "left"):
        strides = strides_of(walked, side)
        curves: JsonDict = {curve: strides.mean(curve) for curve in ("load", "moment", *ANGLES, *EMG)}
        curves |= {"length": strides.length.mean(), "duration": strides.duration.mean()}
        curves |= {"clearance": 1e3 * whole[f"{side}/clearance"], "cost": whole["cost_of_transport"]}
        legs.append(in_numbers(curves, people))
    for row in TABLE:
        known, own = theirs[row.quantity], float(np.mean([leg[row.quantity] for leg in legs]))
        half = row.half * (known if row.share else 1.0)
        yield row, known, own, known if row.centre is None else row.centre, half


def measured_cost(speed: float) -> float:
    """Healthy adults' cost of transport at a speed, standing included, 48 studies [J/(kg·m)] (`LOONEY`)."""
    return (1.44 + 1.94 * speed**0.43 + 0.24 * speed**4) / speed


def in_numbers(walk: JsonMapping, people: JsonMapping) -> dict[str, float]:
    """The rows of `TABLE` of mean curves (101,) and numbers of a walk, some against people's."""
    ankle, load = np.degrees(walk["ankle"]), walk["load"]
    moment = walk["moment"] - people["moment"]
    off = {name: np.degrees(walk[name] - people[name]) for name in ANGLES}
    off["ankle beside bare feet"] = np.degrees(walk["ankle"] - people["barefoot"])
    off |= {f"{name} in swing": apart[SWING] for name, apart in off.items() if "ankle" in name}
    rms = {f"{name}, RMS off the norm": np.sqrt(np.mean(apart**2)) for name, apart in off.items()}
    found = rms | {
        "ankle moment, RMS off the norm": np.sqrt(np.mean(moment**2)),
        "step length": walk["length"] / 2.0,
        "cadence": 120.0 / walk["duration"],
        "ankle, over that of a joint held at its mean": rms["ankle, RMS off the norm"]
        / np.degrees(np.std(people["ankle"])),
        "ankle, least in loading": ankle[LOADING].min(),
        "ankle, greatest in stance": ankle[STANCE].max(),
        "ankle, fall in push-off": ankle[STANCE].max() - ankle[PUSH_OFF].min(),
        "vertical force, first peak": load[:30].max(),
        "vertical force, second peak": load[35:].max(),
        "toe clearance": walk["clearance"],
        "tibialis, mean": walk["tibialis"][1:].mean(),
        "cost of transport": walk["cost"],
    }
    for name in EMG:
        late = walk[name][35:61]
        found |= {f"{name}, greatest in push-off": late.max(), f"{name}, when greatest": 35 + late.argmax()}
        found[f"{name}, correlation with EMG"] = np.corrcoef(walk[name], people[name])[0, 1]
    return {name: float(value) for name, value in found.items()}
