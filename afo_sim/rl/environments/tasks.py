"""The tasks by name: a smooth reference of the ankle angle, seated; and walking with a drop foot."""

import math
from typing import Any

import numpy as np

from afo_sim.common import unknown
from afo_sim.rl.environments.task import Observed, Sample, Task

CHAMBERS = ("dorsiflexor", "plantarflexor")


def _pressure(chamber: str) -> Observed:
    return Observed(
        f"{chamber}_pressure", "Pa", "gauge, in the chamber", -2e4, 1e6, f"chamber/{chamber}/pressure"
    )


# Seated, the foot free in the air: follow a smooth reference of the ankle angle.

SPAN = math.radians(6.0)  # largest reference; muscles at 4 bar hold the ankle at 7.2° either way
SLOWEST, FASTEST = 0.05, 0.25  # frequencies of a reference [Hz]
WAVES = 3  # sines of a reference
NEAR = math.radians(2.0)  # error at which the reward is 1/e
AHEAD = 0.1  # time by which the reference is known beforehand [s]
REFERENCE, LATER = range(2)  # columns of the script


def reference(draws: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Reference now and AHEAD later [rad] (k, 2), at times since the episode's start [s] (k,).

    SPAN Σᵢ wᵢ sin(2π fᵢ t + φᵢ), with random weights wᵢ of sum 1, frequencies and phases.

    Units: draws (3 WAVES,).
    """
    weights, frequencies, phases = draws.reshape(3, WAVES)
    weights = (weights + 1e-3) / np.sum(weights + 1e-3)  # and never 0/0
    frequencies = SLOWEST + (FASTEST - SLOWEST) * frequencies
    instants = np.stack([times, times + AHEAD], axis=1)
    angle = 2.0 * np.pi * (frequencies * instants[..., None] + phases)
    found: np.ndarray = SPAN * np.sum(weights * np.sin(angle), axis=-1)
    return found


def tracking_reward(sample: Sample, _: np.ndarray) -> Any:
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
        *map(_pressure, CHAMBERS),
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
    draws=3 * WAVES,
    script=reference,
)  # fmt: skip

# Walking with a drop foot: lift the toes in swing, with little air, and leave push-off alone.

CLEAR, SMOOTH = 0.015, 0.010  # height of the toe at which clearance is worth nothing, and its width [m]
POWER = 10.0  # taken from push-off, at which its penalty is full [W]
AIR = 2.5e-6  # let into the chambers in a control period, at which its penalty is full [kg]
AGAINST, USED = 0.5, 0.2  # largest penalties of push-off and of air [-]


def walking_reward(sample: Sample, gained: np.ndarray) -> Any:
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


DROPFOOT_WALK = Task(
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
        *map(_pressure, CHAMBERS),
        Observed("heel_load", "N", "of the ground under the heel", 0.0, 5000.0, "foot/heel_load"),
        Observed("toe_load", "N", "of the ground under ball and toes", 0.0, 5000.0, "foot/toe_load"),
    ),
    reward=walking_reward,
    lowest=-1.0 - USED,  # no push-off in swing
    highest=1.0,
    carried=tuple(f"chamber/{name}/mass" for name in CHAMBERS),
    strides=(1, 2),
)

TASKS = {task.name: task for task in (SEATED_TRACKING, DROPFOOT_WALK)}


def task_of(name: str) -> Task:
    """A task by its name; InputError where there is none."""
    if name not in TASKS:
        raise unknown(name, list(TASKS), field="task", problem="there is no such task")
    return TASKS[name]
