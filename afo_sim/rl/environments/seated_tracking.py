"""Seated, the foot free in the air: follow a smooth reference of the ankle angle."""

import math
from typing import Any

import numpy as np

from afo_sim.rl.environments.sample import Sample
from afo_sim.rl.environments.task import Observed, Task

SPAN = math.radians(6.0)  # largest reference; muscles at 4 bar hold the ankle at 7.2° either way
SLOWEST, FASTEST = 0.05, 0.25  # frequencies of a reference [Hz]
WAVES = 3  # sines of a reference
NEAR = math.radians(2.0)  # error at which the reward is 1/e
AHEAD = 0.1  # time by which the reference is told beforehand [s]
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


def reward(sample: Sample, _: np.ndarray) -> Any:
    """exp(−(e / NEAR)²) of the error e = reference − angle [-], 0 to 1."""
    error = (sample.script[REFERENCE] - sample["ankle/angle"]) / NEAR
    return np.exp(-error * error)


def _pressure(chamber: str) -> Observed:
    return Observed(
        f"{chamber}_pressure", "Pa", "gauge, in the chamber", -2e4, 1e6, f"chamber/{chamber}/pressure"
    )


TASK = Task(
    name="seated_tracking",
    title="seated, the foot free in the air: the ankle follows a smooth random reference",
    scenario="seated",
    sets={"duration": "20 s", "timestep": "2 ms"},
    period=0.01,
    duration=20.0,
    observed=(
        Observed("ankle_angle", "rad", "dorsiflexion positive", -1.0, 1.0, "ankle/angle"),
        Observed("ankle_velocity", "rad/s", "dorsiflexion positive", -20.0, 20.0, "ankle/velocity"),
        _pressure("dorsiflexor"),
        _pressure("plantarflexor"),
        Observed(
            "reference", "rad", "ankle angle that is asked for", -SPAN, SPAN,
            formula=lambda s: s.script[REFERENCE],
        ),
        Observed(
            "reference_ahead", "rad", f"the same, {AHEAD:g} s later", -SPAN, SPAN,
            formula=lambda s: s.script[LATER],
        ),
    ),
    reward=reward,
    lowest=0.0,
    highest=1.0,
    draws=3 * WAVES,
    script=reference,
)  # fmt: skip
