"""Distributions of one number about its own value, against their formulas."""

import math

import numpy as np
import pytest
from scipy import stats

from afo_sim.study.uncertainty.spreads import Distribution, Kind

EVEN = stats.norm.ppf((np.arange(200_000) + 0.5) / 200_000)  # deviates at even shares


def moments(distribution: Distribution, own: float) -> tuple[float, float, float]:
    found = distribution.at(EVEN, own)
    return float(found.mean()), float(found.std()), float(stats.skew(found))


def test_normal_has_its_standard_deviation_about_the_own_value() -> None:
    assert moments(Distribution("normal", 0.3), 5.0) == pytest.approx((5.0, 0.3, 0.0), abs=1e-3)


def test_lognormal_has_the_own_value_as_its_median() -> None:
    found = Distribution("lognormal", 0.5).at(EVEN, 4000.0)
    assert np.median(found) == pytest.approx(4000.0, rel=1e-4)
    assert found.mean() == pytest.approx(4000.0 * math.exp(0.5 * 0.5**2), rel=1e-3)
    low, high = np.quantile(found, stats.norm.cdf([-1.0, 1.0]))
    assert high / low == pytest.approx(math.exp(2 * 0.5), rel=1e-3)


def test_uniform_reaches_from_end_to_end() -> None:
    found = Distribution("uniform", 5.0).at(EVEN, 11.0)
    assert (found.min(), found.max()) == pytest.approx((6.0, 16.0), abs=1e-4)
    assert found.std() == pytest.approx(10.0 / math.sqrt(12.0), rel=1e-4)


def test_pearson3_has_mean_deviation_and_skew() -> None:
    assert moments(Distribution("pearson3", 3.0, skew=0.6), 0.0) == pytest.approx((0.0, 3.0, 0.6), abs=5e-3)


@pytest.mark.parametrize("kind", ["normal", "lognormal", "uniform", "pearson3"])
def test_zero_width_is_the_own_value_to_the_bit(kind: Kind) -> None:
    skew = 0.6 if kind == "pearson3" else 0.0
    assert (Distribution(kind, 0.0, skew).at(EVEN[::1000], 0.1 + 0.2) == 0.1 + 0.2).all()


@pytest.mark.parametrize(
    ("distribution", "own"),
    [
        (Distribution("normal", 1.0, lower=-0.5), 0.0),
        (Distribution("lognormal", 0.5, upper=1.2), 1.0),
        (Distribution("uniform", 5.0, lower=0.0), 2.0),
    ],
)
def test_nothing_lies_beyond_a_bound_and_nothing_is_heaped_up_at_it(
    distribution: Distribution, own: float
) -> None:
    found = distribution.at(EVEN, own)
    assert found.min() >= distribution.lower and found.max() <= distribution.upper
    assert len(np.unique(found)) > 0.99 * len(found)
    free = Distribution(distribution.kind, distribution.width).at(EVEN, own)
    inside = (free >= distribution.lower) & (free <= distribution.upper)
    # a distribution cut off is that of the free draws which lie within
    shares = np.linspace(0.02, 0.98, 25)
    assert np.quantile(found, shares) == pytest.approx(np.quantile(free[inside], shares), abs=2e-3)
    assert distribution.cut(own) == pytest.approx(1.0 - inside.mean(), abs=1e-4)
