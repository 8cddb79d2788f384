"""How one number spreads about its own value, as a map from standard normal deviates."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

Kind = Literal["normal", "lognormal", "uniform", "pearson3"]


@dataclass(frozen=True)
class Distribution:
    """Of one number [SI] about its own value.

    kind : "normal", "lognormal" (own value = median), "uniform", or "pearson3" (skewed, own value = mean)
    width : standard deviation; of a lognormal that of the natural logarithm; of a uniform half its width
    skew : of pearson3
    lower, upper : nothing is drawn beyond them; pearson3 has none

    A width of zero gives the own value to the last bit.
    """

    kind: Kind
    width: float
    skew: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf

    def at(self, deviates: np.ndarray, own: float) -> np.ndarray:
        """The values of standard normal deviates (n,), rising with them.

        Units: deviates (n,), own [SI].
        """
        if self.kind == "pearson3":
            share = stats.norm.cdf(deviates)
            return np.asarray(own + self.width * stats.pearson3.ppf(share, self.skew))
        if self.width == 0.0:
            return np.full(len(deviates), own)
        inside = self._within(deviates, own)
        if self.kind == "uniform":
            return np.asarray(own + self.width * (2.0 * stats.norm.cdf(inside) - 1.0))
        if self.kind == "lognormal":
            return np.asarray(own * np.exp(self.width * inside))
        return np.asarray(own + self.width * inside)

    def cut(self, own: float) -> float:
        """Share of the distribution that lies beyond its bounds [-]; the rest is drawn in its stead."""
        if self.kind == "pearson3" or self.width == 0.0:
            return 0.0
        low, high = stats.norm.cdf([self._deviate(self.lower, own), self._deviate(self.upper, own)])
        return float(1.0 - (high - low))

    def _within(self, deviates: np.ndarray, own: float) -> np.ndarray:
        """Deviates of the distribution that is cut off at its bounds: the same shares of what is left."""
        low, high = (self._deviate(bound, own) for bound in (self.lower, self.upper))
        if low == -math.inf and high == math.inf:
            return deviates
        return np.asarray(stats.truncnorm.ppf(stats.norm.cdf(deviates), low, high))

    def _deviate(self, bound: float, own: float) -> float:
        """The standard normal deviate of a bound."""
        return _INVERSE[self.kind](bound, own, self.width)


def _normal(bound: float, own: float, width: float) -> float:
    return (bound - own) / width


def _lognormal(bound: float, own: float, width: float) -> float:
    if math.isinf(bound) or bound <= 0.0:
        return math.inf if bound > 0.0 else -math.inf
    return math.log(bound / own) / width


def _uniform(bound: float, own: float, width: float) -> float:
    share = 0.5 + 0.5 * (bound - own) / width if math.isfinite(bound) else (0.0 if bound < 0.0 else 1.0)
    return float(stats.norm.ppf(min(max(share, 0.0), 1.0)))


_INVERSE: dict[str, Callable[[float, float, float], float]] = {
    "normal": _normal,
    "lognormal": _lognormal,
    "uniform": _uniform,
}
