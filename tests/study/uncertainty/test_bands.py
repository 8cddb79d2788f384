"""Bands and shares of the variance, against cases that are known by formula."""

import math

import numpy as np
import pytest
from scipy import stats

from afo_sim.study.uncertainty.running import explained, fewest, quantiles, share_below, shares_of_one


def deviates(n: int, k: int, seed: int = 0) -> np.ndarray:
    return np.asarray(np.random.default_rng(seed).standard_normal((n, k)))


def test_quantiles_of_a_normal() -> None:
    even = stats.norm.ppf((np.arange(100_000) + 0.5) / 100_000)
    assert quantiles(3.0 + 2.0 * even) == pytest.approx([3.0 - 3.2897, 3.0, 3.0 + 3.2897], abs=1e-3)


def test_quantiles_of_curves_are_those_of_each_point() -> None:
    curves = np.array([[0.0, 10.0], [1.0, 30.0], [2.0, 20.0]])
    assert quantiles(curves)[1] == [1.0, 20.0]


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


def test_share_of_one_wearer_is_that_of_the_path_alone() -> None:
    # a wearer 6 mm above the floor whose path varies by 3 mm: Φ(−2) of the strides touch it
    path = 0.003 * stats.norm.ppf((np.arange(20_000) + 0.5) / 20_000)
    found = shares_of_one(np.array([0.006, 0.0, -0.1, 0.1]), path, 0.0)
    assert found == pytest.approx([stats.norm.cdf(-2.0), 0.5, 1.0, 0.0], abs=1e-3)
    assert share_below(np.array([-0.001, 0.0, 0.001, 0.02]), 0.0) == 0.5
