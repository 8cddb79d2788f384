"""A patient's quarter of a minute: standing, starts, changes of cadence, a turn and a stop, compiled."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.description import load
from afo_sim.gait import STANCE_FORCE, STANCE_SHARE, GaitCycle
from afo_sim.metrics import HEEL_RISE, loaded
from afo_sim.model import RAMP, STANDS, Built, Track, on_track
from afo_sim.model.build import build
from afo_sim.rl.environments.episodes import Start
from afo_sim.rl.environments.patients import USUAL, Sensors, patient
from afo_sim.rl.environments.reward import scale_of
from afo_sim.rl.environments.task import Task
from afo_sim.simulation import LOWEST

STARTS = 0.8  # time of a start and of a stop [s]
BLEND = 0.6  # time in which cadence and reach change [s]
FAST, BEGUN = 0.75, 0.1  # quantile of speed, share of swing: as in the metrics of clearance [-]
STRIDE, UPWARD, AHEAD = range(2, 5)  # columns of a day's table


@dataclass(frozen=True, eq=False)
class Day(Start):
    """One patient on one path, ready to be stepped."""

    table: np.ndarray
    shape: np.ndarray
    scale: np.ndarray
    sensors: Sensors

    @property
    def strikes(self) -> int:
        """Heel strikes of the whole day."""
        return int(self.table[-1, STRIDE] - self.table[0, STRIDE])


def day_of(number: int, task: Task, sets: Mapping[str, Any]) -> Day:
    """The day of a patient by number; a user's keys stand over the patient's. `USUAL` walks on."""
    keys, sensors = patient(number)
    plain = build(load("scenario", task.scenario, {**keys, **sets, **task.sets}))
    assert plain.walk is not None
    built = on_track(plain, *path(number, plain.walk.time, plain.walk.cycle.stride_time))
    steps = round(task.period / built.scenario.timestep)
    samples = np.maximum(np.arange(task.periods + 1) * steps - 1, 0)
    start, scale = Start.of(built, number), scale_of(built.scenario)
    return Day(**vars(start), table=_table(built)[samples], shape=_shape(built), scale=scale, sensors=sensors)


def smooth(share: np.ndarray) -> np.ndarray:
    """0 up to 0, 1 from 1 on, with two continuous derivatives: 6 s⁵ − 15 s⁴ + 10 s³."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (s * (6.0 * s - 15.0) + 10.0))


def path(number: int, time: np.ndarray, stride_time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phase, share of walking, and reach of a day's steps, each (n,) [-]."""
    random = np.random.default_rng([max(number, 0), 2])
    last, usual = float(time[-1]), number == USUAL
    begun = random.uniform(0.4, 1.2)
    ended = last + 9.0 if usual else random.uniform(0.45, 0.55) * last
    resumed = ended + random.uniform(0.8, 2.0)
    bouts = [(begun, ended)] if usual else [(begun, ended), (resumed, last + 9.0)]
    turned = random.uniform(begun + 2.0, ended - 4.0)
    turn = smooth((time - turned) / BLEND) * smooth((turned + 2.5 + BLEND - time) / BLEND)
    reach, slower = (1.0, 0.0) if usual else (random.uniform(0.7, 0.85), 0.15)
    vary = 0.0 if usual else 0.03 * 2.0**0.5
    waves = [(random.uniform(0.2, 0.7), random.uniform(0.0, 2.0 * np.pi)) for _ in range(2)]
    varied = 1.0 + vary / 2.0**0.5 * sum(np.sin(2.0 * np.pi * f * time + p) for f, p in waves)
    phase, walking = np.full(len(time), STANDS), np.zeros(len(time))
    for start, end in bouts:
        first, then = (1.0, 1.0) if usual else random.uniform(0.8, 1.2, size=2)
        change = smooth((time - random.uniform(start + 2.0, min(end, last) - 2.0)) / BLEND)
        rate = (first + (then - first) * change) * varied * (1.0 - slower * turn)
        rate *= smooth((time - start) / STARTS) * smooth((end - time) / STARTS) / stride_time
        way = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
        if end < last:  # a bout is of whole strides, so that it ends as it began, on this foot
            way *= round(way[-1]) / way[-1]
        left = way[-1] - way if end < last else np.inf
        walking += smooth(np.minimum(way, left) / RAMP)
        phase += way
    return phase, walking, 1.0 - (1.0 - reach) * turn


def _table(built: Built) -> np.ndarray:
    """What is known of every step of a path: see `Day.table`; the ground's force in N."""
    track, steps = built.walk, slice(1, 1 + built.scenario.n_step)
    assert isinstance(track, Track) and track.walking is not None
    share, stride = np.modf(track.phase[steps])
    _, upward, ahead = (values[steps] for values in track.ground)
    upward = upward * built.body_mass * GRAVITY
    walks = (track.walking[steps] > 0.0) & (stride < stride[-1])  # what no heel strike ends does not count
    first, last = passing(track.cycle)
    passes = (share >= first) & (share < last) & walks
    pushes = loaded(upward, built.body_mass) & (share >= HEEL_RISE) & walks
    return np.stack([passes, pushes, stride, upward, ahead], axis=1).astype(float)


def passing(cycle: GaitCycle) -> tuple[float, float]:
    """Phases between which a swinging foot passes the standing leg, as the metrics of clearance have it."""
    phase = np.arange(1000) / 1000.0
    speed, lean = cycle.signal("ankle_x", phase, 1), cycle.signal("shank_angle", phase)
    swing = (cycle.ground(phase)[1] <= STANCE_FORCE) & (phase > STANCE_SHARE[0])
    toe_off = float(phase[np.argmax(swing)])
    upright = float(phase[swing & (lean <= 0.0)][0]) if (swing & (lean <= 0.0)).any() else 1.0
    fast = phase[swing & (speed >= np.quantile(speed, FAST)) & (phase < upright)]
    return max(float(fast[0]), toe_off + BEGUN * (1.0 - toe_off)), upright


def _shape(built: Built) -> np.ndarray:
    assert built.foot is not None
    points, hinge = built.foot.points, built.foot.toes.hinge if built.foot.toes else (0.0, 0.0)
    turning = [np.subtract(points[name], hinge) for name in LOWEST["toe"]]
    parts = [points["heel"], points["ball"], hinge, *turning, [built.foot.level, built.body_mass]]
    return np.concatenate(parts)
