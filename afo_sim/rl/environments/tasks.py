"""The tasks by name: a smooth reference of the ankle angle, seated; and walking with a drop foot."""

import math
from collections.abc import Callable, Mapping
from typing import NoReturn

import numpy as np

from afo_sim.common import RETIRED, FloatOrArray, refuse_retired, unknown
from afo_sim.rl.environments.episodes import Setting, setting
from afo_sim.rl.environments.task import Observed, Sample, Task
from afo_sim.rl.environments.walking import CLOSES, FIRST_NOISE, LEAST, MOST, readers, script, walking_reward

CHAMBERS = ("dorsiflexor", "plantarflexor")
_GAUGE = ("Pa", "gauge, in the chamber")


# Seated, the foot free in the air: follow a smooth reference of the ankle angle.

SPAN = math.radians(6.0)  # largest reference; muscles at 4 bar hold the ankle at 7.2° either way
SLOWEST, FASTEST = 0.05, 0.25  # frequencies of a reference [Hz]
WAVES = 3  # sines of a reference
NEAR = math.radians(2.0)  # error at which the reward is 1/e
AHEAD = 0.1  # time by which the reference is known beforehand [s]
REFERENCE, LATER = range(2)  # columns of the script


def reference(draws: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Reference now and AHEAD later [rad] (k, 2), at times since the episode's start [s] (k,)."""
    weights, frequencies, phases = draws.reshape(3, WAVES)
    weights = (weights + 1e-3) / np.sum(weights + 1e-3)  # and never 0/0
    frequencies = SLOWEST + (FASTEST - SLOWEST) * frequencies
    instants = np.stack([times, times + AHEAD], axis=1)
    angle = 2.0 * np.pi * (frequencies * instants[..., None] + phases)
    return SPAN * np.sum(weights * np.sin(angle), axis=-1)


def tracking_reward(sample: Sample) -> FloatOrArray:
    """exp(−(e / NEAR)²) of the error e = reference − angle [-], 0 to 1."""
    error = (sample.script[REFERENCE] - sample["ankle/angle"]) / NEAR
    return np.exp(-error * error)


SEATED_TRACKING = Task(
    name="seated_tracking",
    title="seated, the foot free in the air: the ankle follows a smooth random reference",
    scenario="seated",
    sets={"duration": "20 s", "timestep": "2 ms"},
    period=0.01,
    duration=20.0,
    observed=(
        Observed("ankle_angle", "rad", "dorsiflexion positive", -1.0, 1.0, "ankle/angle"),
        Observed("ankle_velocity", "rad/s", "dorsiflexion positive", -20.0, 20.0, "ankle/velocity"),
        *(Observed(f"{c}_pressure", *_GAUGE, -2e4, 1e6, f"chamber/{c}/pressure") for c in CHAMBERS),
        Observed(
            "reference", "rad", "ankle angle that is asked for", -SPAN, SPAN,
            formula=lambda s: s.script[REFERENCE],
        ),
        Observed(
            "reference_ahead", "rad", f"the same, {AHEAD:g} s later", -SPAN, SPAN,
            formula=lambda s: s.script[LATER],
        ),
    ),
    reward=tracking_reward,
    lowest=0.0,
    highest=1.0,
    script=lambda built, times: lambda random: reference(
        random.uniform(0.0, 1.0, size=1 + 3 * WAVES)[1:], times
    ),
)  # fmt: skip

# Walking with a drop foot: what the verdict asks, by what sensors see.


def _noisy(column: str, k: int) -> Callable[[Sample], FloatOrArray]:
    return lambda s: s[column] + s.script[FIRST_NOISE + k]


def _switch(column: str) -> Callable[[Sample], FloatOrArray]:
    return lambda s: np.asarray(s[column] > CLOSES, float)


DROPFOOT_WALK = Task(
    name="dropfoot_walk",
    title="walking with a drop foot on S1's orthosis: what the verdict asks",
    scenario="walk-dropfoot-afo",
    sets={
        "duration": "18 s",
        "timestep": "2 ms",
        "gait.settled": "walked",
        "start": None,
        "reference": None,
        "ground.mode": "recorded",  # switches are read from that force; a floor would hide what is earned
    },
    period=0.01,
    duration=18.0,
    observed=(
        Observed(
            "shank_angle", "rad", "of an inertial unit: knee ahead of ankle positive", -2.0, 2.0,
            formula=_noisy("shank/angle", 0),
        ),
        Observed(
            "shank_velocity", "rad/s", "of its gyro", -8.7, 8.7, formula=_noisy("shank/velocity", 1)
        ),
        Observed(
            "heel_switch", "1", "1 where the heel is loaded, else 0", 0.0, 1.0,
            formula=_switch("foot/heel_load"),
        ),
        Observed(
            "toe_switch", "1", "1 where ball and toes are loaded, else 0", 0.0, 1.0,
            formula=_switch("foot/toe_load"),
        ),
        *(
            Observed(f"{c}_pressure", *_GAUGE, -2e4, 7e5, formula=_noisy(f"chamber/{c}/pressure", k))
            for k, c in enumerate(CHAMBERS, start=2)
        ),
    ),
    reward=walking_reward,
    lowest=LEAST,
    highest=MOST,
    script=script,
    readers=readers,
    version=2,
)  # fmt: skip

TASKS = {task.name: task for task in (SEATED_TRACKING, DROPFOOT_WALK)}


def task_of(name: str) -> Task:
    """A task by its name; InputError where there is none."""
    if name in RETIRED:
        refuse_retired(name)
    if name not in TASKS:
        raise unknown(name, list(TASKS), field="task", problem="there is no such task")
    return TASKS[name]


def retired_day(**_: object) -> NoReturn:
    """Refuse the benchmark's task."""
    refuse_retired("dropfoot_day")


def setting_of(name: str, sets: Mapping[str, object] | None = None) -> Setting:
    """Compile a task."""
    return setting(task_of(name), sets, (setting_of, (name, sets)))
