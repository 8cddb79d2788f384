"""Least squares of a posed fit: where it ends, how far each parameter can be off, errors of the unseen."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from afo_sim.common import InputError, JsonDict, JsonMapping, Mixed, Notice, in_unit
from afo_sim.lab.identifiability import intervals, unidentified

Progress = Callable[[str], None]
CORRELATED = 0.98  # two parameters with more are not told apart
VAGUE = 0.5  # a half-interval of more than this share of the parameter's size tells nothing
POINTS_PER_PARAMETER = 2.0  # with fewer no interval is given
Refit = Callable[[Mixed], Mapping[str, float]]  # of the problem without a part of its data


@dataclass(frozen=True)
class FitParameter:
    """A number that is searched. SI."""

    name: str  # of the law or the scenario
    unit: str  # SI
    shown: str  # unit for people's eyes
    lower: float  # bound
    upper: float  # bound
    low: float  # usual values, to high
    high: float  # usual values, from low
    size: float  # unit of a coordinate, or of a logarithm its reference
    neutral: float | None = None  # where it does nothing
    logarithmic: bool = False  # its logarithm is searched
    of_law: bool = False  # of the muscle's law
    keys: Mapping[str, float] = field(default_factory=dict)  # that it sets in a scenario, each with its share

    def coordinate(self, value: float) -> float:
        """A value [SI] as it is searched."""
        return math.log(value / self.size) if self.logarithmic else value / self.size

    def value(self, coordinate: float) -> float:
        """The value [SI] of what is searched, within its bounds."""
        # an interval's end may overflow
        ratio = math.exp(min(max(coordinate, -700.0), 700.0)) if self.logarithmic else coordinate
        return float(min(max(self.size * ratio, self.lower), self.upper))

    def number(self, value: float) -> float:
        """A value in the unit for people's eyes."""
        return in_unit(value, self.unit, self.shown) if self.shown else value

    def text(self, value: float) -> str:
        """A value [SI] for people."""
        return f"{self.number(value):.3g} {self.shown}".strip()


class FitProblem:
    """What is fitted to what; residuals are in units of their size, `x` are coordinates."""

    free: tuple[FitParameter, ...]
    near = 1e-4  # share of a parameter's range that counts as being at its bound
    inside = 0.0  # share of it by which a search begins off its bounds
    least_size = 1.0  # of a coordinate, which half its interval is held against
    counted = "independent errors"
    residuals: Callable[[np.ndarray], np.ndarray]  # what the search makes small
    take: Callable[[np.ndarray], Self]  # some of the data, the rest is predicted from it
    parts: Callable[[str], dict[str, np.ndarray]]  # what is left out together, by a name for people
    missed: Callable[[Mapping[str, float]], tuple[np.ndarray, np.ndarray, np.ndarray]]
    """Errors [SI], weights, and mean squares within them, of fitted values."""

    @property
    def options(self) -> JsonMapping:
        """Of scipy's least_squares."""
        return {}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the free parameters."""
        return tuple(p.name for p in self.free)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates."""
        lower = np.array([p.coordinate(p.lower) for p in self.free])
        return lower, np.array([p.coordinate(p.upper) for p in self.free])

    def values(self, x: np.ndarray) -> dict[str, float]:
        """The parameters [SI]."""
        return {p.name: p.value(float(c)) for p, c in zip(self.free, x, strict=True)}

    def ended(self, x: np.ndarray) -> dict[str, float]:
        """The parameters [SI] where a search ended."""
        return self.values(x)

    def at(self, values: Mapping[str, float]) -> np.ndarray:
        """The coordinates of values [SI]."""
        return np.array([p.coordinate(values[p.name]) for p in self.free])

    def search(self, x: np.ndarray) -> OptimizeResult:
        """Where a search from `x` ends."""
        lower, upper = self.bounds
        margin = self.inside * (upper - lower)
        start = np.clip(x, lower + margin, upper - margin)
        return least_squares(self.residuals, start, bounds=(lower, upper), **self.options)

    def best(self, starts: Sequence[np.ndarray]) -> OptimizeResult:
        """The best end of several searches."""
        return min(map(self.search, starts), key=lambda found: found.cost)

    def jacobian(self, best: OptimizeResult) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the informative residuals, and their mask."""
        return best.jac, np.ones(len(best.fun), dtype=bool)

    def held(self, best: OptimizeResult) -> np.ndarray:
        """Mask of the parameters at their bounds."""
        lower, upper = self.bounds
        return np.minimum(best.x - lower, upper - best.x) <= self.near * (upper - lower)

    def variance(self, residuals: np.ndarray, freedom: float) -> float:
        """Of a residual, which goes with the Jacobian."""
        return float(np.sum(residuals**2)) / freedom

    def memory(self, best: OptimizeResult) -> float:
        """Correlation of neighbouring errors [-]."""
        return 0.0

    @property
    def curves(self) -> float:
        """The least number of independent errors."""
        return 0.0

    def settled(self, best: OptimizeResult) -> bool:
        """Whether a search came to its end."""
        return bool(best.status > 0)

    @property
    def telling(self) -> int:
        """The number of informative data."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a search ended; `half` are half the 95 % intervals of the coordinates `x`."""

    problem: Mixed
    x: np.ndarray
    half: np.ndarray
    correlation: np.ndarray
    jacobian: np.ndarray
    residuals: np.ndarray
    variance: float
    memory: float
    independent: float
    freedom: float
    settled: bool
    inner: np.ndarray

    @property
    def values(self) -> dict[str, float]:
        """Of the parameters [SI]."""
        return self.problem.ended(self.x)

    def interval(self, k: int) -> tuple[float, float]:
        """95 % interval of a parameter [SI], within what it can be."""
        p, x, half = self.problem.free[k], float(self.x[k]), float(self.half[k])
        return p.value(x - half), p.value(x + half)


def believed(problem: FitProblem, best: OptimizeResult) -> Solution:
    """The end of a search with its intervals."""
    inner = ~problem.held(best)
    jacobian, telling = problem.jacobian(best)
    memory, n = problem.memory(best), len(jacobian)
    rho = min(max(memory, 0.0), 0.999)
    independent = max(n * (1.0 - rho) / (1.0 + rho), problem.curves)
    freedom = max(independent - int(inner.sum()), 1.0)
    variance = problem.variance(best.fun[telling], freedom)
    half, correlation = np.full(len(inner), np.inf), np.eye(len(inner))
    if inner.any():
        half[inner], correlation[np.ix_(inner, inner)] = intervals(jacobian[:, inner], variance, freedom)
    numbers = (variance, memory, independent, freedom, problem.settled(best))
    return Solution(problem, best.x, half, correlation, jacobian, best.fun, *numbers, inner)


def verdict(solution: Solution) -> list[Notice]:
    """A notice for each group of parameters that the linearised model does not identify."""
    problem, names, found = solution.problem, solution.problem.names, []
    points = int(solution.independent)
    if not solution.settled:
        found.append(unidentified("unsettled", names, "not identifiable: the search did not settle"))
    if points < POINTS_PER_PARAMETER * len(names):
        return [*found, *_too_few(solution, points)]
    lower, upper = problem.bounds
    away = np.minimum(solution.x - lower, upper - solution.x) > problem.near * (upper - lower)
    for i, p in enumerate(problem.free):
        for j in range(i):
            correlation = solution.correlation[i, j]
            if abs(correlation) > CORRELATED:
                why = f"not identifiable one by one: correlation {correlation:.3f}; use them together"
                found.append(unidentified("correlated", [names[j], p.name], why))
        size = 1.0 if p.logarithmic else max(abs(float(solution.x[i])), problem.least_size)
        if not away[i]:
            found.append(unidentified("at-bound", [p.name], "not identifiable: the fit ends at its bound"))
        elif solution.half[i] > VAGUE * size:
            found.append(unidentified("vague", [p.name], f"not identifiable: {_shown(solution, i)}"))
    return found


def _shown(solution: Solution, k: int) -> str:
    p = solution.problem.free[k]
    low, high = map(p.text, solution.interval(k))
    if not solution.jacobian[:, k].any():
        return "it has no effect on the data"
    return f"{p.text(solution.values[p.name])}, but {low} to {high} fit as well"


def _too_few(solution: Solution, points: int) -> Iterator[Notice]:
    """Parameters without any effect, one by one, and the others together."""
    names, without = solution.problem.names, []
    for k, name in enumerate(names):
        if not solution.half[k] <= 1e100:
            without.append(name)
            if not solution.inner[k]:
                yield unidentified("at-bound", [name], "not identifiable: the fit ends at its bound")
                continue
            yield unidentified("no-effect", [name], f"not identifiable: {_shown(solution, k)}")
    if rest := [name for name in names if name not in without]:
        wanted = f"{len(names)} parameter{'s' if len(names) > 1 else ''}"
        why = f"not identifiable: {points} {solution.problem.counted} for {wanted}"
        yield unidentified("too-few", rest, why)


@dataclass(frozen=True)
class HeldOut:
    """Data when they were left out, by what was: errors [SI], readings, mean squares about their means."""

    parts: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]  # by name, each (n,)

    @property
    def errors(self) -> dict[str, np.ndarray]:
        """Of each part [SI]."""
        return {name: errors for name, (errors, _, _) in self.parts.items()}

    @property
    def rms(self) -> float:
        """Over all data."""
        return of_readings(*map(np.concatenate, zip(*self.parts.values(), strict=True)))

    def of(self, name: str) -> float:
        """RMS over one part."""
        return of_readings(*self.parts[name])


def of_readings(missed: np.ndarray, weight: np.ndarray, scatter: np.ndarray) -> float:
    """RMS error of readings, from those of their means and from how far they scatter about these."""
    return float(np.sqrt(np.sum(weight * (missed**2 + scatter)) / weight.sum()))


def unseen(fitted: Sequence[tuple[str, FitProblem, Mapping[str, float]]]) -> HeldOut:
    """The errors of data that no fit saw: (name, the data, values of a fit to others)."""
    return HeldOut({name: problem.missed(values) for name, problem, values in fitted})


def left_out(problem: FitProblem, masks: Mapping[str, np.ndarray], refit: Refit) -> HeldOut:
    """Errors of each part by a fit to the others."""
    return unseen([(n, problem.take(mask), refit(problem.take(~mask))) for n, mask in masks.items()])


def held_out(
    problem: FitProblem, kinds: Sequence[str], refit: Refit, report: Progress = lambda text: None
) -> dict[str, HeldOut]:
    """Errors of what is left out in turn, by kind, if there are two parts and enough data in the rest."""
    found = {}
    for kind in kinds:
        masks = problem.parts(kind)
        if masks and all(problem.take(~mask).telling > len(problem.free) for mask in masks.values()):
            report(f"leaving out one {kind} after another")
            found[kind] = left_out(problem, masks, refit)
    return found


def require_left_out(asked: Sequence[str], held: Mapping[str, HeldOut]) -> None:
    """Refuse a requested kind that cannot be left out."""
    for kind in asked:
        if kind not in held:
            allowed = ", ".join(["all", "none", *held])
            problem = "cannot be left out of these data"
            raise InputError(problem, field="hold_out", value=kind, allowed=allowed)


def held_out_json(held: Mapping[str, HeldOut], factor: float = 1.0) -> JsonDict:
    """The errors of what was left out, by kind: of all and of each part."""
    return {
        kind: {"rms": factor * each.rms} | {name: factor * each.of(name) for name in each.errors}
        for kind, each in held.items()
    }


def held_out_lines(held: Mapping[str, HeldOut], factor: float = 1.0, unit: str = "N·m") -> Iterator[str]:
    """A line on each kind that was left out."""
    for kind, each in held_out_json(held, factor).items():
        every = each.pop("rms")
        parts = ", ".join(f"{name}: {error:.2g}" for name, error in each.items())
        word = "predicted" if kind == "file" else f"{kind} left out in turn"
        yield f"{word}: {every:.3g} {unit} RMS ({parts})"
