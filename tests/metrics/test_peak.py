"""The largest mean over a window against closed forms, at steps that divide it and steps that do not."""

import math

import numpy as np
import pytest

from afo_sim.metrics.peak import WINDOW, highest_step, largest_mean

STEPS = [1e-4, 2.5e-4, 3e-4, 1e-3, 2e-3, 3e-3, 7e-3, 10e-3]


@pytest.mark.parametrize("step", STEPS)
def test_a_constant_is_its_own_mean(step: float) -> None:
    assert largest_mean(np.full(200, 3.7), step) == pytest.approx(3.7, rel=1e-12)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("slope", [40.0, -40.0])
def test_a_ramp_has_its_mean_half_a_window_before_its_top(step: float, slope: float) -> None:
    """Of a ramp to T the mean of the last 10 ms is T − slope · 5 ms, whatever the step."""
    ramp = slope * step * np.arange(300)
    assert largest_mean(ramp, step) == pytest.approx(ramp.max() - 40.0 * 5e-3, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("step", [1e-4, 2.5e-4, 3e-4])
def test_a_wave_has_the_mean_about_its_crest(step: float) -> None:
    """Mean of cos ωt over ±w/2 about its crest: sin(ωw/2)/(ωw/2)."""
    time = step * np.arange(round(0.2 / step))
    half = 2.0 * math.pi * 10.0 * 5e-3
    wave = np.cos(2.0 * math.pi * 10.0 * (time - 0.05))
    assert largest_mean(wave, step) == pytest.approx(math.sin(half) / half, abs=1e-4)


@pytest.mark.parametrize("step", STEPS)
def test_it_lies_between_the_lowest_and_the_highest_value(step: float) -> None:
    chance = np.random.default_rng(5)
    for _ in range(20):
        values = chance.standard_normal(60)
        assert values.min() < largest_mean(values, step) <= values.max()


def test_it_is_the_highest_of_all_windows() -> None:
    """Against windows of 33.3 steps integrated one by one."""
    step, values = 3e-4, np.random.default_rng(7).standard_normal(400)
    time = step * np.arange(400)
    means = []
    for start in np.concatenate([time[time + 10e-3 <= time[-1]], time[time >= 10e-3] - 10e-3]):
        inner = time[(time > start) & (time < start + 10e-3)]
        at = np.concatenate([[start], inner, [start + 10e-3]])
        means.append(np.trapezoid(np.interp(at, time, values), at) / 10e-3)
    assert largest_mean(values, step) == pytest.approx(max(means), abs=1e-9)


def test_what_is_shorter_than_the_window_gives_its_mean() -> None:
    assert largest_mean(np.array([5.0]), 1e-3) == 5.0
    assert largest_mean(np.array([0.0, 2.0, 2.0]), 1e-3) == pytest.approx(1.5)
    assert highest_step(np.array([1.0, 3.0]), 0, 2, WINDOW / 1e-3, 1.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("step", "mean"), [(2e-3, 3.8), (4e-3, 4.6), (10e-3, 5.0), (20e-3, 5.0)])
def test_means_of_steps_count_by_their_shares_of_the_window(step: float, mean: float) -> None:
    """Five of 2 ms: 1 + 5 + 4 + 5 + 4; two and a half of 4 ms: 5 + 4 + 5/2; a half of 20 ms, alone."""
    flow = np.array([0.0, 1.0, 5.0, 4.0, 5.0, 4.0, 0.0])
    assert highest_step(flow, 0, 7, WINDOW / step, 1.0) == pytest.approx(mean)
