"""The tracking task: its reference, its reward, and that the device can do it."""

import math

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.rl import TASKS
from afo_sim.rl.environments.episodes import Episodes, setting
from afo_sim.rl.environments.task import Sample
from afo_sim.rl.environments.tasks import FASTEST, NEAR, SPAN, reference, tracking_reward


def test_the_reference_is_smooth_and_within_its_span() -> None:
    times = np.arange(0.0, 20.0, 0.001)
    for seed in range(20):
        now = reference(np.random.default_rng(seed).uniform(size=9), times)[:, 0]
        assert np.abs(now).max() <= SPAN
        assert np.abs(np.diff(now)).max() / 0.001 <= SPAN * 2.0 * math.pi * FASTEST  # of its fastest sine


def test_the_reference_told_ahead_comes_to_be() -> None:
    times = np.arange(0.0, 20.0, 0.01)
    found = reference(np.random.default_rng(1).uniform(size=9), times)
    np.testing.assert_allclose(found[:-10, 1], found[10:, 0], atol=1e-12)


def test_an_episode_asks_from_its_start_on_for_what_the_seed_draws() -> None:
    made = setting(TASKS["seated_tracking"])
    draws = np.random.default_rng(3).uniform(0.0, 1.0, size=10)[1:]
    asked = made.draw(np.random.default_rng(3))
    np.testing.assert_array_equal(asked[:2], reference(draws, np.array([0.0, 0.008])))


def test_one_sine_is_the_formula() -> None:
    draws = np.array([1.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.25, 0.0, 0.0])  # weights, frequencies, phases
    found = reference(draws, np.array([0.0]))[0, 0]
    weights = np.array([1.001, 0.001, 0.001]) / 1.003
    assert found == pytest.approx(SPAN * weights[0] * math.sin(math.pi / 2))  # the other two are at phase 0


def test_the_reward_is_one_at_the_reference_and_falls_off() -> None:
    def at(error: float) -> float:
        readers = {"ankle/angle": lambda s: 0.02 - error}
        return float(tracking_reward(Sample(readers, {}, np.array([0.02, 0.0]))))

    assert at(0.0) == 1.0
    assert at(NEAR) == pytest.approx(math.exp(-1.0)) and at(-NEAR) == pytest.approx(math.exp(-1.0))
    assert 0.0 <= at(1.0) < 1e-12


def test_the_device_reaches_every_reference(antagonist: afo.Recording) -> None:
    settled = antagonist["ankle/angle"][[1999, -1]]  # dorsiflexors filled for 4 s, then plantarflexors
    assert settled.max() > SPAN and settled.min() < -SPAN


def test_feedback_tracks_better_than_shut_valves() -> None:
    made = setting(TASKS["seated_tracking"])
    totals = []
    for gain in (40.0, 0.0):
        episodes = Episodes(made)
        seen, total = episodes.begin([0], [np.random.default_rng(7)])[0], 0.0
        for _ in range(500):
            push = np.clip(gain * (seen[5] - seen[0]), -1.0, 1.0)  # of the reference told ahead
            outcome = episodes.step([0], np.array([[push, -push]]))
            seen, total = outcome.observation[0], total + outcome.reward[0]
        episodes.close()
        totals.append(total / 500)
    assert totals[0] > 0.8 and totals[1] < 0.5
