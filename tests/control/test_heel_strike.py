"""The place of a heel strike, from a dip that is put where it should be found."""

import numpy as np
import pytest

from afo_sim.control.heel_strike import DIP, HALF, HeelStrike

RATE, GONE = 0.9, 0.009  # of strides [1/s], of a sample at 100 Hz [-]
NOISE = np.radians(0.5)


def taught(
    place: float | None, depth: float, strides: int, seed: int = 0, noise: float = NOISE
) -> HeelStrike:
    """One that has seen strides with a dip [rad] that is `DIP` behind a strike at a place, or with none."""
    random, strike = np.random.default_rng(seed), HeelStrike()
    phase = np.arange(0.0, strides, GONE)
    left = noise * random.standard_normal(len(phase))
    if place is not None:
        since = ((phase - place + 0.5) % 1.0 - 0.5) / RATE - DIP  # [s] since the dip's lowest
        left -= depth * np.exp(-((2.0 * since / HALF) ** 2))
    for where, each in zip(phase, left, strict=True):
        strike.take(float(where), float(each), GONE)
    strike.find(noise**2, RATE)
    return strike


@pytest.mark.parametrize("place", [-0.04, -0.01, 0.0, 0.02, 0.05])
def test_a_dip_is_found_where_it_is(place: float) -> None:
    strike = taught(place, np.radians(1.5), 12)
    assert strike.seen and strike.phase == pytest.approx(place, abs=0.006)


def test_without_a_dip_the_populations_place_stays() -> None:
    found = [taught(None, 0.0, 12, seed) for seed in range(40)]
    assert np.mean([strike.seen for strike in found]) <= 0.1
    assert np.abs([strike.phase for strike in found]).max() < 0.02


def test_a_dip_in_noise_takes_more_strides() -> None:
    loud = np.radians(2.0)
    seen = [
        np.mean([taught(0.02, np.radians(1.5), strides, seed, loud).seen for seed in range(20)])
        for strides in (3, 60)
    ]
    assert seen[0] < 0.5 < seen[1]


def test_what_was_found_stays_when_the_mean_is_forgotten() -> None:
    strike = taught(0.03, np.radians(1.5), 12)
    found = strike.phase
    strike.forget()
    assert strike.phase == found
    strike.find(NOISE**2, RATE)
    assert abs(strike.phase) < 1e-3 and not strike.seen  # of nothing, the population's
