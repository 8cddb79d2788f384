"""The oscillator: derivatives, the filter against its textbook form, turning, and the same code compiled."""

import numba
import numpy as np
import pytest
from campaign import size

from afo_sim.physics import oscillator, register_all

N = 9


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    state = random.standard_normal(N)
    root = random.standard_normal((N, N))
    return state, root @ root.T


def signal(state: np.ndarray) -> float:
    """Written out, independently."""
    total = state[2]
    for k in (1, 2, 3):
        angle = 2.0 * np.pi * k * state[0]
        total += state[1 + 2 * k] * np.cos(angle) + state[2 + 2 * k] * np.sin(angle)
    return float(total)


def test_the_wave_is_the_derivative_of_the_signal() -> None:
    state, _ = drawn(1)
    wave = np.empty(N)
    found, slope = oscillator.series(state, wave)
    assert found == pytest.approx(signal(state), rel=1e-12)
    small = 1e-6 * np.eye(N)
    expected = [(signal(state + d) - signal(state - d)) / 2e-6 for d in small]
    assert wave == pytest.approx(expected, abs=1e-6)
    assert slope == wave[0]


def test_the_filter_is_kalmans() -> None:
    state, covariance = drawn(2)
    wave = np.random.default_rng(3).standard_normal(N)
    moved, spread = state.copy(), covariance.copy()
    oscillator.correct(moved, spread, wave, 0.3, 0.7)
    # information form: independent of the gain
    posterior = np.linalg.inv(np.linalg.inv(covariance) + np.outer(wave, wave) / 0.7)
    assert spread == pytest.approx(posterior, abs=1e-9)
    assert moved == pytest.approx(state + posterior @ wave * 0.3 / 0.7, abs=1e-9)


def test_a_step_passes_as_by_its_matrix() -> None:
    state, covariance = drawn(4)
    moved, spread = state.copy(), covariance.copy()
    oscillator.advance(moved, spread, 0.02, 3.0, 5.0)
    matrix = np.eye(N)
    matrix[0, 1] = 0.02
    noise = 0.02 * np.diag([0.0, 3.0, 5.0, 5.0, 5.0, 5.0 / 4, 5.0 / 4, 5.0 / 9, 5.0 / 9])
    assert moved == pytest.approx(matrix @ state, abs=1e-12)
    assert spread == pytest.approx(matrix @ covariance @ matrix.T + noise, abs=1e-12)


def test_a_looser_size_scales_the_signal_about_its_mean() -> None:
    state, covariance = drawn(7)
    spread, wave = covariance.copy(), np.empty(N)
    oscillator.loosen_size(state, spread, 0.04, 0.5)
    found, _ = oscillator.series(state, wave)
    wave[0] = 0.0  # of the shape alone
    # a signal s · (y − a₀) + a₀ + m with independent s and m
    assert wave @ (spread - covariance) @ wave == pytest.approx(0.04 * (found - state[2]) ** 2 + 0.5)


@pytest.mark.parametrize("shift", [0.01, -0.3, 2.2])
def test_turning_keeps_the_signal(shift: float) -> None:
    state, _ = drawn(5)
    turned = state.copy()
    oscillator.turn(turned, shift)
    assert turned[0] == pytest.approx(state[0] + shift)
    for ahead in (0.0, 0.17, 0.6):
        unit = np.eye(N)[0] * ahead
        assert signal(turned + unit) == pytest.approx(signal(state + unit), abs=1e-12)
    moved = oscillator.origin(turned) - oscillator.origin(state) - shift
    assert moved == pytest.approx(round(moved), abs=1e-12)


# Those with arithmetic of whole arrays take seconds to compile.
NAMES = ["turn", "series", "advance", "correct"][: size(2, 4)]


@pytest.mark.slow  # numba
@pytest.mark.parametrize("name", NAMES)
def test_the_same_code_compiles(name: str) -> None:
    register_all()
    turn, series = oscillator.turn, oscillator.series
    advance, correct = oscillator.advance, oscillator.correct
    used = {
        "turn": lambda state, covariance, wave: turn(state, 0.001),
        "series": lambda state, covariance, wave: series(state, wave),
        "advance": lambda state, covariance, wave: advance(state, covariance, 0.01, 0.1, 0.01),
        "correct": lambda state, covariance, wave: correct(state, covariance, wave, 0.3, 1.0),
    }[name]
    results = []
    for run in (used, numba.njit(used)):
        (state, covariance), wave = drawn(6), np.linspace(-1.0, 1.0, N)
        returned = [run(state, covariance, wave) for _ in range(50)]
        given = [] if returned[0] is None else np.ravel(returned)
        results.append(np.concatenate([state, covariance.ravel(), wave, given]))
    assert results[0] == pytest.approx(results[1], rel=1e-9, abs=1e-9)
