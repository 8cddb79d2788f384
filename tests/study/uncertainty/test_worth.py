"""What it is worth to know a group: shares of variance, band and wrong guesses, of known functions."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from afo_sim.study.uncertainty.worth import explained, fewest


def deviates(n: int, k: int, seed: int = 0) -> np.ndarray:
    return np.asarray(np.random.default_rng(seed).standard_normal((n, k)))


def test_shares_of_the_variance_of_a_known_sum() -> None:
    # y = 3 a + (b² − 1) + 2 c₁ c₂ + d₁ e₁ + noise: variances 9, 2, 4, and 1 that two groups have together
    n = 4000
    a, b, c, d, e = (deviates(n, k, seed) for seed, k in enumerate((1, 1, 2, 1, 1)))
    together = d[:, 0] * e[:, 0]
    y = 7.0 + 3.0 * a[:, 0] + (b[:, 0] ** 2 - 1.0) + 2.0 * c[:, 0] * c[:, 1] + together
    found = explained([a, b, c, d, e], y)
    assert found is not None
    assert found.shares == pytest.approx([9 / 16, 2 / 16, 4 / 16, 0.0, 0.0], abs=0.03)
    assert found.rest == pytest.approx(1 / 16, abs=0.03)


def test_chance_explains_nothing_on_average() -> None:
    # 40 seeds of 120 draws that explain nothing; unadjusted, 9 terms would explain 9/119 of each
    shares = []
    for seed in range(40):
        found = explained([deviates(120, 3, seed)], deviates(120, 1, 1000 + seed)[:, 0])
        assert found is not None
        shares.append(found.shares[0])
    assert np.mean(shares) == pytest.approx(0.0, abs=3.0 * np.std(shares) / math.sqrt(len(shares)))
    assert abs(np.mean(shares)) < 0.5 * 9 / 119


def test_near_singular_parameters_are_no_trouble_to_their_deviates() -> None:
    # two fitted numbers with a correlation of −0.9999: the metric sees their sum only
    z = deviates(500, 2)
    root = np.linalg.cholesky(np.array([[1.0, -0.9999], [-0.9999, 1.0]]))
    x = z @ root.T
    other = deviates(500, 1, 5)
    found = explained([z, other], 100.0 * (x[:, 0] + x[:, 1]) + other[:, 0])
    assert found is not None
    variance = 1e4 * (2.0 - 2.0 * 0.9999)
    assert found.shares == pytest.approx([variance / (variance + 1.0), 1.0 / (variance + 1.0)], abs=0.1)


def test_nothing_is_told_of_what_does_not_vary_or_of_few_draws() -> None:
    groups = [deviates(100, 3)]
    assert explained(groups, np.full(100, 13.2)) is None
    few = fewest(groups) - 1
    assert explained([groups[0][:few]], deviates(few, 1)[:, 0]) is None


def test_two_straight_lines_leave_what_integration_says() -> None:
    # y = 12 + a z₁ + b z₂: known z₁ leaves b/√(a² + b²) of the band
    a, b, mean, wanted = 4.0, 3.0, 12.0, 10.0
    z = [deviates(4000, 1, seed) for seed in (1, 2)]
    found = explained(z, mean + a * z[0][:, 0] + b * z[1][:, 0], wanted)
    assert found is not None
    band, wrong, band_error, wrong_error = found.left

    def left(own: float, other: float) -> float:
        def guess(x: float) -> float:
            reached = stats.norm.cdf((mean + own * x - wanted) / other)
            return float(stats.norm.pdf(x) * min(reached, 1.0 - reached))

        turn = (wanted - mean) / own
        return float(quad(guess, -9.0, turn)[0] + quad(guess, turn, 9.0)[0])

    now = stats.norm.cdf((wanted - mean) / math.hypot(a, b))
    for k, expected in enumerate([(1.0, now), (b / 5.0, left(a, b)), (a / 5.0, left(b, a))]):
        assert band[k] == pytest.approx(expected[0], abs=4.0 * band_error[k] + 1e-9)
        assert wrong[k] == pytest.approx(expected[1], abs=4.0 * wrong_error[k])
        assert wrong_error[k] < 0.02


def test_a_bent_function_leaves_what_nested_draws_say() -> None:
    # a skewed group, one whose two deviates act together, one that acts only with another, and noise
    def metric(a: np.ndarray, b: np.ndarray, c: np.ndarray, e: np.ndarray) -> np.ndarray:
        bent = 4.0 * (np.exp(0.5 * a[..., 0]) - 1.0) + 2.0 * b[..., 0] * b[..., 1] - 3.0 * b[..., 0]
        return np.asarray(11.0 + bent + 0.8 * a[..., 0] * c[..., 0] + 1.5 * e[..., 0])

    widths, wanted, n = (1, 2, 1, 1), 10.0, 1000
    z = [deviates(n, k, seed) for seed, k in enumerate(widths)]
    found = explained(z[:3], metric(*z), wanted)
    many = metric(*(deviates(200_000, k, 10 + seed) for seed, k in enumerate(widths)))
    assert found is not None

    def width(values: np.ndarray) -> np.ndarray:
        low, high = np.quantile(values, [0.05, 0.95], axis=-1)
        return np.asarray(high - low)

    share = float(np.mean(many >= wanted))
    assert found.left[1, 0] == pytest.approx(min(share, 1.0 - share), abs=3.0 * found.left[3, 0])
    for k in range(3):
        inner = [deviates(3000, m, 20 + seed)[None] for seed, m in enumerate(widths)]
        inner[k] = deviates(600, widths[k], 30)[:, None]
        nested = metric(*inner)
        reached = np.mean(nested >= wanted, axis=1)
        band, wrong = np.mean(width(nested)) / width(many), np.mean(np.minimum(reached, 1.0 - reached))
        # 0.03: neither metric nor rest is normal
        assert found.left[0, k + 1] == pytest.approx(band, abs=3.0 * found.left[2, k + 1] + 0.03)
        assert found.left[1, k + 1] == pytest.approx(wrong, abs=3.0 * found.left[3, k + 1] + 0.03)


def test_standard_errors_are_the_scatter_of_other_draws() -> None:
    found = []
    for seed in range(60):
        z = [deviates(200, 1, 100 + seed), deviates(200, 2, 500 + seed)]
        one = explained(z, 2.0 * z[0][:, 0] + z[1][:, 0] + deviates(200, 1, 900 + seed)[:, 0], 0.5)
        assert one is not None
        found.append(one.left[:, 1])
    band, wrong, band_error, wrong_error = np.array(found).T
    assert np.std(band) == pytest.approx(np.mean(band_error), rel=0.35)
    assert np.std(wrong) == pytest.approx(np.mean(wrong_error), rel=0.35)
