"""What a responding walk was like: its strides, curves, clearance, effort, air."""

import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, find_gait
from afo_sim.gait import at_speed
from afo_sim.model import ANKLE, SOLE
from afo_sim.physics import EARLY_STANCE, LEG_MUSCLES
from afo_sim.walker.body import HIP, KNEE, SIDES, Body, floor_of
from afo_sim.walker.walking import Walked

STANDS = 20.0  # load from which on a foot is on the floor [N]
SHORTEST = 0.4  # stride [s]
FIRST = 2  # strides of the start that are not counted
SAMPLES = 101
ANGLES = ("thigh", "knee", "ankle")
SPREAD = math.radians(6.0)  # middle of the 4 to 8° between people that Bovi et al. 2011 show [rad]
BASAL = 1.51  # [W/kg], Wang et al. 2012
NORM = "bovi2011_natural"
LATE = 3.0  # of activation behind EMG, about 30 ms [% of the stride]
# EMG over its greatest in manual tests [%], each 5 % of the stride (Perry & Burnfield 2010)
EMG = {
    "tibialis": (35, 32, 19, 1, 1, 1, 1, 1, 1, 1, 1, 4, 32, 27, 35, 30, 18, 16, 22, 29),
    "soleus": (1, 2, 21, 32, 32, 33, 47, 63, 84, 70, 14, 1, 1, 1, 1, 1, 1, 1, 1, 1),
    "gastrocnemius": (1, 1, 14, 23, 38, 42, 54, 67, 77, 44, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1),
}
HEEL_FIRST, FLAT = 8.0, 5.0  # pitch above which the heel lands first, below which the sole is flat [deg]
_OF_WALK = ("speed", "stride_time", "stride_length", "muscle_power", "cost_of_transport", "trunk_forward")
_OF_DEVICE = ("air_per_stride", "device_torque_swing")
_OF_LEG = (
    "ankle_swing", "force_peak", "force_high", "clearance", "scuffs", "push_off_work", "push_off_peak",
    "moment_peak", "ankle_stance_max", "ankle_mid_stance", "knee_mid_stance", "pitch_contact", "foot_fall",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Strides:
    """The counted strides of one leg of a walk."""

    # curves over the cycle (n_stride, 101): thigh (against the vertical), knee flexion, ankle [rad]; load
    # over body weight; moment (plantarflexion), power of the ankle [N·m/kg, W/kg]; device's torque [N·m]
    begins: np.ndarray  # rows at which the foot comes down, one more than strides
    curves: Mapping[str, np.ndarray]
    duration: np.ndarray  # of each stride [s]
    length: np.ndarray  # of each stride [m]

    def mean(self, name: str) -> np.ndarray:
        """The mean curve (101,)."""
        return np.asarray(self.curves[name].mean(axis=0))


@functools.lru_cache(maxsize=8)
def strides_of(walked: Walked, side: str) -> Strides:
    """The strides of a leg, "right" with the device or "left", without the first two and the last."""
    load, time = walked[f"{side}/load"], walked["time"]
    kept = contacts(walked, side)[FIRST:]
    mass = walked.body.weight / GRAVITY
    moment, velocity = walked[f"{side}/{ANKLE}_moment"], walked[f"{side}/{ANKLE}_velocity"]
    columns = {
        "thigh": walked["trunk/pitch"] + walked[f"{side}/{HIP}"],
        "knee": -walked[f"{side}/{KNEE}"],
        "ankle": walked[f"{side}/{ANKLE}"],
        "load": load / walked.body.weight,
        "moment": -moment / mass,
        "power": moment * velocity / mass,
        "toe": walked[f"{side}/toe_clearance"],
        "torque": walked["device/torque"],
        **{name: walked[f"{side}/{name}/activation"] for name in LEG_MUSCLES},
    }
    table, pairs = np.column_stack(list(columns.values())), list(itertools.pairwise(kept))
    found = np.empty((len(pairs), SAMPLES, len(columns)))
    for k, (first, last) in enumerate(pairs):  # rows are equally apart
        place = np.linspace(first, last, SAMPLES)
        row = np.minimum(place.astype(int), last - 1)
        share = (place - row)[:, None]
        found[k] = (1.0 - share) * table[row] + share * table[row + 1]
    curves = {name: found[:, :, k] for k, name in enumerate(columns)}
    return Strides(kept, curves, np.diff(time[kept]), np.diff(walked["trunk/forward"][kept]))


def contacts(walked: Walked, side: str) -> np.ndarray:
    """Rows of foot contacts: the last touch before the stance reflexes begin."""
    load, time, phase = walked[f"{side}/load"], walked["time"], walked[f"{side}/phase"]
    stands = np.flatnonzero((phase[1:] == EARLY_STANCE) & (phase[:-1] != EARLY_STANCE)) + 1
    begins: list[int] = []
    for row in stands:
        while row > 0 and load[row - 1] > STANDS:
            row -= 1
        if not begins or time[row] - time[begins[-1]] > SHORTEST:
            begins.append(int(row))
    return np.array(begins, dtype=int)


def numbers(walked: Walked) -> dict[str, float]:
    """A walk in numbers, SI and degrees, by name; NaN where it fell before there were strides to count."""
    time, mass = walked["time"], walked.body.weight / GRAVITY
    right, left = (strides_of(walked, side) for side in ("right", "left"))
    count, own = len(right.duration), dict[str, float]()
    if count:
        counted = slice(int(right.begins[0]), int(right.begins[-1]) + 1)
        took = time[counted][-1] - time[counted][0]
        speed = np.ptp(walked["trunk/forward"][counted]) / took
        used = [f"{side}/{name}/energy" for side in ("right", "left") for name in LEG_MUSCLES]
        energy = sum(np.ptp(walked[name][counted]) for name in used)
        masses = [walked[name][counted] for name in walked.columns if "/mass" in name]
        air = [np.maximum(np.diff(values), 0.0).sum() for values in masses]
        own = {
            "speed": speed,
            "stride_time": np.mean(right.duration),
            "stride_length": np.mean(right.length),
            "muscle_power": energy / (mass * took),
            "cost_of_transport": (energy / took + BASAL * mass) / (mass * speed),
            "air_per_stride": float(sum(air)) / count if air else math.nan,
            "device_torque_swing": np.mean(right.curves["torque"][:, 65:95]),
            "trunk_forward": -math.degrees(np.mean(walked["trunk/pitch"][counted])),
        }
    found = {"duration": time[-1], "fell": walked.fell is not None}
    found["strides"] = (count + len(left.duration)) / 2.0
    found |= {name: own.get(name, math.nan) for name in _OF_WALK}
    for side, strides in (("right", right), ("left", left)):
        found |= {f"{side}/{name}": value for name, value in _of_leg(walked, strides, side).items()}
    found |= {name: own.get(name, math.nan) for name in _OF_DEVICE}
    return {name: float(value) for name, value in found.items()}


def _of_leg(walked: Walked, strides: Strides, side: str) -> dict[str, float]:
    if not len(strides.duration):
        return dict.fromkeys((*(f"{a}_{e}" for a in ANGLES for e in ("max", "min")), *_OF_LEG), math.nan)
    drop = math.degrees(sole_tilt(walked.body, side) - floor_of(walked.body.scenario).slope)
    found = shape({name: strides.mean(name) for name in strides.curves}, float(strides.duration.mean()), drop)
    load, power = strides.curves["load"], strides.curves["power"]
    clearance = swing_clearance(walked, strides, side)
    step = strides.duration[:, None] / (SAMPLES - 1)
    late = slice(40, 70)
    found |= {
        "force_peak": float(load.max(axis=1).mean()),
        "force_high": float(np.percentile(load[load > 0.05], 95.0)),
        "clearance": float(np.median(clearance)),
        "scuffs": float(np.mean(clearance <= 0.0)),
        "push_off_work": float((np.maximum(power[:, late], 0.0) * step).sum(axis=1).mean()),
        "push_off_peak": float(power[:, late].max(axis=1).mean()),
        "moment_peak": float(strides.curves["moment"].max(axis=1).mean()),
    }
    return found


def shape(curves: Mapping[str, np.ndarray], duration: float, drop: float = 0.0) -> dict[str, float]:
    """Numbers of a leg's mean curves [deg], fall to flat of a sole that a shoe's drop tilts [deg/s]."""
    angles = {name: np.degrees(curves[name]) for name in ANGLES}
    thigh, knee, ankle = angles.values()
    pitch = thigh - knee + ankle + drop
    free = curves["load"][30:] < 0.05
    off = 30 + int(np.argmax(free))  # when stance is over
    known = 1.0 if free.any() else math.nan  # a foot that never leaves the floor has no end of stance
    flat = int(np.argmax(pitch < FLAT)) if pitch[0] > HEEL_FIRST else 0
    found = {f"{n}_{end}": getattr(x, end)() for n, x in angles.items() for end in ("max", "min")}
    return found | {
        "ankle_swing": ankle[75:90].mean(),
        "ankle_stance_max": known * ankle[10:off].max(),
        "ankle_mid_stance": known * (ankle[round(0.6 * off)] - ankle[round(0.25 * off)]),
        "knee_mid_stance": known * knee[round(0.4 * off) : round(0.6 * off) + 1].mean(),
        "pitch_contact": pitch[0],
        "foot_fall": 100.0 * (pitch[0] - pitch[flat]) / (flat * duration) if flat else math.nan,
        "push_off_peak": curves["power"][40:70].max(),
    }


def swing_clearance(walked: Walked, strides: Strides, side: str) -> np.ndarray:
    """Lowest height of ball, pulp and tip in mid-swing of each stride [m] (n_stride,)."""
    lowest, speed = walked[f"{side}/forefoot_clearance"], np.gradient(walked[f"{side}/foot"], walked["time"])
    found = []
    for a, b in zip(strides.begins[:-1], strides.begins[1:], strict=True):
        fast = speed[a:b] >= np.percentile(speed[a:b], 75.0)
        found.append(float(lowest[a:b][fast].min()))
    return np.array(found)


@functools.lru_cache(maxsize=8)
def norm_at(speed: float, taller: float = 1.0) -> dict[str, np.ndarray]:
    """Healthy adults' mean curves, "duration" [s], "length" [m]: Bovi et al. 2011, Gait Posture 33(1)."""
    quicker, phase = math.sqrt(taller), np.linspace(0.0, 1.0, SAMPLES)  # by dynamic similarity
    cycle = at_speed(find_gait(NORM), quicker * min(max(speed / quicker, 0.85), 1.95), taller)
    knee, shank, moment = (
        np.interp(phase, cycle.phase, curve, period=1.0)
        for curve in (cycle.knee_angle, cycle.shank_angle, cycle.ankle_moment)
    )
    return {
        "thigh": knee - shank,
        "knee": knee,
        "ankle": np.interp(phase, cycle.phase, cycle.ankle_angle, period=1.0),
        "load": cycle.ground(phase % 1.0)[1],
        "moment": -moment * taller,
        "power": moment * cycle.signal("ankle_angle", phase, 1) * quicker,
        "duration": np.array(cycle.stride_time * quicker),
        "length": np.array(cycle.stride_time * quicker * speed),
    }


def emg() -> dict[str, np.ndarray]:
    """Activity over the stride (101,) that measured EMG makes."""
    late, each = np.arange(101.0) - LATE, np.arange(0.0, 100.0, 5.0)
    return {name: np.interp(late, each, row, period=100.0) / 100.0 for name, row in EMG.items()}


def sole_tilt(body: Body, side: str = "right") -> float:
    """By how much a foot points down where its worn sole is flat [rad]."""
    heel, ball = (body.model.site(f"{SIDES[side == 'left']}{SOLE}{end}").pos for end in ("heel", "ball"))
    return math.atan2(ball[2] - heel[2], ball[0] - heel[0])
