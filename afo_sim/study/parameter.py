"""A parameter of a sweep: the keys that it sets, and how its values spread."""

import math
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Given, JsonDict, format_quantity

# A sample's coordinate may be exactly zero, where a normal distribution has no quantile.
_LEAST_SHARE = 2.0**-33


@dataclass(frozen=True)
class Range:
    """From `lower` to `upper` [SI], evenly or by even ratios; `steps` of them in a grid."""

    lower: float
    upper: float
    logarithmic: bool = False
    steps: int | None = None
    whole: bool = False

    def at(self, share: np.ndarray) -> np.ndarray:
        """The values of shares from 0 to 1 (n,): every whole number, both ends too, alike often."""
        if self.whole and not self.logarithmic:
            return np.minimum(np.floor(self.lower + share * (self.upper - self.lower + 1.0)), self.upper)
        if self.logarithmic:
            found = self.lower * np.exp(share * math.log(self.upper / self.lower))
        else:
            found = self.lower + share * (self.upper - self.lower)
        return np.clip(np.round(found) if self.whole else found, self.lower, self.upper)

    def levels(self) -> np.ndarray:
        """The values of a grid (steps,), both ends among them."""
        space = np.geomspace if self.logarithmic else np.linspace
        found = space(self.lower, self.upper, self.steps or 2)
        return np.round(found) if self.whole else found


@dataclass(frozen=True)
class Span:
    """A range as it is written, before the unit of its field is known."""

    lower: Given  # end, with its unit
    upper: Given  # end, with its unit
    steps: int | None = None  # values of a grid; None of a search or a drawn design
    scale: str = "linear"  # "linear" or "log"

    def table(self) -> JsonDict:
        """As a sweep's file states it."""
        scale = {} if self.scale == "linear" else {"scale": self.scale}
        return {"from": self.lower, "to": self.upper} | ({"steps": self.steps} if self.steps else {}) | scale


def span(lower: Given, upper: Given, steps: int | None = None, *, scale: str = "linear") -> Span:
    """A range of a parameter.

    Parameters
    ----------
    lower, upper : as "2 bar", or numbers where the field has no unit
    steps : number of grid values, including both ends
    scale : "linear" or "log"

    Returns
    -------
    Span, which `sweep` and `optimise` take

    Examples
    --------
    >>> span("2 bar", "4 bar", 5)
    Span(lower='2 bar', upper='4 bar', steps=5, scale='linear')
    """
    return Span(lower, upper, steps, scale)


@dataclass(frozen=True)
class Choice:
    """One of some values [SI] or words, by equal shares."""

    values: tuple[float, ...] | tuple[str, ...]

    def at(self, share: np.ndarray) -> np.ndarray:
        """The values of shares from 0 to 1 (n,)."""
        count = len(self.values)
        return self.levels()[np.minimum((share * count).astype(np.intp), count - 1)]

    def levels(self) -> np.ndarray:
        """The values, as they were stated (n,)."""
        words = bool(self.values) and isinstance(self.values[0], str)
        return np.array(self.values, dtype=object if words else np.float64)


def deviate(limit: float, centre: float, sd: float, of_logarithm: bool) -> float:
    """A limit in standard deviations from the centre, of the logarithm on request."""
    if not of_logarithm:
        return (limit - centre) / sd
    if 0.0 < limit < math.inf:
        return math.log(limit / centre) / sd
    return math.inf if limit > 0.0 else -math.inf


@dataclass(frozen=True)
class Normal:
    """Normal, or lognormal where `of_logarithm`; cut off below `lower` and above `upper` [SI]."""

    centre: float
    sd: float
    lower: float = -math.inf
    upper: float = math.inf
    of_logarithm: bool = False
    whole: bool = False

    def at(self, share: np.ndarray) -> np.ndarray:
        """The quantiles of shares from 0 to 1 (n,)."""
        from scipy import stats  # slow to import

        inside = np.clip(share, _LEAST_SHARE, 1.0 - _LEAST_SHARE)
        about = self.centre, self.sd, self.of_logarithm
        ends = (deviate(limit, *about) for limit in (self.lower, self.upper))
        away = self.sd * stats.truncnorm.ppf(inside, *ends)
        found = self.centre * np.exp(away) if self.of_logarithm else self.centre + away
        return np.clip(np.round(found) if self.whole else found, self.lower, self.upper)


@dataclass(frozen=True)
class OwnSeed:
    """Every case's own seed."""


@dataclass(frozen=True)
class Joint:
    """One value [SI] for each case, drawn together with those of other parameters."""

    values: tuple[float, ...]

    def levels(self) -> np.ndarray:
        """The values, case by case (n,)."""
        return np.array(self.values)


Spread = Range | Choice | Normal | OwnSeed | Joint


@dataclass(frozen=True)
class Parameter:
    """One parameter: its name, the dotted keys that it sets alike, its values and their SI unit."""

    name: str
    keys: tuple[str, ...]
    unit: str
    spread: Spread
    whole: bool = False
    description: str = ""
    files: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> bool:
        """True where its values are words."""
        return isinstance(self.spread, Choice) and isinstance(self.spread.values[0], str)

    @property
    def range(self) -> Range:
        """Its spread where a search varies it, which varies no other."""
        assert isinstance(self.spread, Range)
        return self.spread

    def written(self, value: float | str) -> Given:
        """A value as `--set` takes it: text that reads as exactly this value, number, or word."""
        if isinstance(value, str):
            return self.files.get(value, value)
        return int(value) if self.whole else format_quantity(value, self.unit)
