"""Parameters of one law from a measured characteristic, with what the data can and cannot tell about them.

Least squares from several starts; 95 % intervals from the linearised model; a verdict that names the
parameters that the data do not tell apart; errors on points that the fit did not see.
"""

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import qmc, t

from afo_sim.common import Notice
from afo_sim.description import FitCovariance, Provenance, key_of
from afo_sim.lab.identifiability import (
    AT_BOUND,
    POINTS_PER_PARAMETER,
    Estimate,
    intervals,
    refused,
    rms,
    unidentified,
    verdict,
)
from afo_sim.lab.law_problem import (
    LawProblem,
    Loss,
    agreed_slack,
    errors,
    measurements,
    pressure_levels,
    take,
    telling,
)
from afo_sim.lab.measured import Measured

Progress = Callable[[str], None]
STARTS = 12
ENOUGH = 3  # starts that end at the same place; with fewer there may be a better one
OUTLYING = 0.01  # residual, over the data's range, from which a robust loss first doubts a point
CHANCE = 2.0  # standard errors 1/√n of a correlation: beyond them neighbouring errors are alike


@dataclass(frozen=True)
class LawFit:
    """Parameters of a law, and how far they can be believed. SI."""

    problem: LawProblem
    values: dict[str, float]
    half_width: dict[str, float]
    correlation: np.ndarray
    residuals: np.ndarray
    agreeing_starts: int
    starts: int
    verdict: tuple[Notice, ...]
    silent: int = 0
    held_out: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    covariance: FitCovariance | None = None

    @property
    def rms(self) -> float:
        """Of the residuals [N or m]."""
        return rms(self.residuals)

    @property
    def spread(self) -> float:
        """Standard deviation of the residuals [N or m], which counts the parameters against the law."""
        freedom = len(self.residuals) - self.silent - len(self.values)
        return float(np.sqrt(np.sum(self.residuals**2) / freedom)) if freedom > 0 else np.inf

    def held_out_rms(self, kind: str) -> float:
        """RMS over all points that were left out in turn, by pressure, load, curve, muscle or file."""
        return rms(np.concatenate(list(self.held_out[kind].values())))

    @property
    def worst(self) -> float:
        """The largest residual [N or m]."""
        return float(np.abs(self.residuals).max())

    @property
    def identifiable(self) -> bool:
        """True where the data identify every parameter."""
        return not self.verdict


def fit_law(problem: LawProblem, *, seed: int = 0, starts: int = STARTS) -> LawFit:
    """Fit a law from several starts."""
    found = _search(problem, problem.data, _starts(problem, starts, seed))
    if starts >= ENOUGH and _agreeing(found) < ENOUGH:
        found += _search(problem, problem.data, _starts(problem, 3 * starts, seed + 1))
    best = min(found, key=lambda f: f.cost)
    scale, outlying = _scales(problem), OUTLYING
    if problem.loss != "linear":  # what is an outlier, the residuals of the first search tell
        size = float(np.ptp(measurements(problem.data))) or 1.0
        first = errors(problem, dict(zip(problem.free, best.x * scale, strict=True)), problem.data) / size
        outlying = max(1.4826 * float(np.median(np.abs(first - np.median(first)))), 1e-9)
        best = _search(problem, problem.data, np.array([best.x * scale]), outlying)[0]
    values = dict(zip(problem.free, best.x * scale, strict=True))
    residuals = errors(problem, values, problem.data)
    half, correlation, verdict, covariance = _believe(problem, best, outlying)
    agreeing = _agreeing(found)
    if starts >= ENOUGH and agreeing < ENOUGH:
        few = f"only {agreeing} of {len(found)} starts end here, there may be a better fit"
        verdict.append(unidentified("few-starts-agree", problem.free, f"not identifiable: {few}"))
        half, covariance = dict.fromkeys(half, np.inf), None
    silent = int(agreed_slack(problem, values, problem.data).sum())
    return LawFit(
        problem,
        values,
        half,
        correlation,
        residuals,
        agreeing,
        len(found),
        tuple(verdict),
        silent,
        covariance=covariance,
    )


def _agreeing(found: Sequence[OptimizeResult]) -> int:
    """The number of starts that end where the best does, having settled."""
    best = min(f.cost for f in found)
    return sum(bool(f.cost <= best * 1.001 + 1e-300 and f.status > 0) for f in found)


def _scales(problem: LawProblem) -> np.ndarray:
    """The size of each free parameter, so that the search sees numbers near one."""
    return np.array([max(map(abs, problem.describe(n).start)) or 1.0 for n in problem.free])


def _bounds(problem: LawProblem) -> tuple[np.ndarray, np.ndarray]:
    described = [problem.describe(name) for name in problem.free]
    lower, upper = np.array([p.lower for p in described]), np.array([p.upper for p in described])
    if "end_length" in problem.free:
        shortest = min(d.facts["total_length"] for d in problem.data)
        upper[problem.free.index("end_length")] = 0.8 * shortest
    return lower, upper


def _starts(problem: LawProblem, count: int, seed: int) -> np.ndarray:
    described = [problem.describe(name) for name in problem.free]
    low, high = np.array([p.start for p in described]).T
    return low + (high - low) * qmc.LatinHypercube(len(described), seed=seed).random(count)


def _search(
    problem: LawProblem, data: Sequence[Measured], starts: np.ndarray, outlying: float = OUTLYING
) -> list[OptimizeResult]:
    """The optimiser's results from each start."""
    scale, (lower, upper) = _scales(problem), _bounds(problem)
    size = float(np.ptp(measurements(data))) or 1.0

    def residuals(z: np.ndarray) -> np.ndarray:
        return errors(problem, dict(zip(problem.free, z * scale, strict=True)), data) / size

    starts = np.clip(starts, lower, upper) / scale
    return [_least_squares(residuals, z, problem, problem.loss, outlying, 300) for z in starts]


def _least_squares(
    residuals: Callable[[np.ndarray], np.ndarray],
    z: np.ndarray,
    problem: LawProblem,
    loss: Loss,
    outlying: float,
    evaluations: int,
) -> OptimizeResult:
    scale, (lower, upper) = _scales(problem), _bounds(problem)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return least_squares(
            residuals,
            z,
            jac="3-point",
            bounds=(lower / scale, upper / scale),
            x_scale="jac",
            loss=loss,
            f_scale=outlying,
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-12,
            max_nfev=evaluations,
        )


def _believe(
    problem: LawProblem, best: OptimizeResult, outlying: float
) -> tuple[dict[str, float], np.ndarray, list[Notice], FitCovariance | None]:
    """95 % half-widths, correlations, what the data cannot identify, and the covariance of what they do."""
    scale = _scales(problem)
    values = best.x * scale
    lower, upper = _bounds(problem)
    size = float(np.ptp(measurements(problem.data))) or 1.0

    def residuals(z: np.ndarray) -> np.ndarray:
        return errors(problem, dict(zip(problem.free, z * scale, strict=True)), problem.data) / size

    # the search's own Jacobian is weighted by the loss; the interval's is not
    jacobian = _least_squares(residuals, best.x, problem, "linear", OUTLYING, 1).jac
    heard = ~agreed_slack(problem, dict(zip(problem.free, values, strict=True)), problem.data)
    jacobian = jacobian[heard]
    n, k = jacobian.shape
    inner = np.minimum(values - lower, upper - values) > AT_BOUND * (upper - lower)
    variance = _variance(residuals(best.x)[heard], problem.loss, outlying, n - int(inner.sum()))
    half, correlation = np.full(k, np.inf), np.eye(k)
    if inner.any():  # a parameter at its bound is held, for the others
        half[inner], correlation[np.ix_(inner, inner)] = intervals(
            jacobian[:, inner], variance, n - int(inner.sum())
        )
    half = half * scale
    shown = [f"{value:.4g} ± {width:.3g}" for value, width in zip(values, half, strict=True)]
    found = Estimate(problem.free, values, half, np.abs(values), lower, upper, shown)
    lines = list(verdict(found, correlation, n))
    widths = dict(zip(problem.free, half.tolist(), strict=True))
    covariance = None
    if n >= POINTS_PER_PARAMETER * k:
        told = np.where(inner, jacobian, 0.0) / scale
        covariance = _joint(problem, told, residuals(best.x), variance, n - int(inner.sum()), upper - lower)
    believed = {name: np.inf if name in refused(lines) else width for name, width in widths.items()}
    return believed, correlation, lines, covariance


def _variance(residuals: np.ndarray, loss: Loss, outlying: float, freedom: int) -> float:
    """Variance of a residual that goes with the unweighted Jacobian."""
    z = (residuals / outlying) ** 2
    first, second = {
        "linear": (np.ones_like(z), np.zeros_like(z)),
        "soft_l1": ((1.0 + z) ** -0.5, -0.5 * (1.0 + z) ** -1.5),
        "huber": (
            np.where(z > 1.0, z, 1.0) ** -0.5,
            np.where(z > 1.0, -0.5 * np.where(z > 1.0, z, 1.0) ** -1.5, 0.0),
        ),
        "cauchy": (1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2),
    }[loss]
    influence = first * residuals
    slope = float(np.mean(first + 2.0 * z * second))
    return float(np.sum(influence**2)) / freedom / slope**2


def held_out(
    result: LawFit, test: Sequence[Measured] = (), report: Progress | None = None, *, groups: bool = True
) -> LawFit:
    """Errors on points that the fit did not see: curves, pressures, loads, muscles, other files."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for kind, members in _groups(result.problem) if groups else ():
        if report is not None:
            report(f"{result.problem.law.name}: leaving out one {kind} after another")
        missed = {label: _leave_out(result, masks) for label, masks in members}
        if all(m is not None for m in missed.values()):
            found[kind] = {label: m for label, m in missed.items() if m is not None}
    if test:
        found["file"] = {other.name: errors(result.problem, result.values, [other]) for other in test}
    return replace(result, held_out=found)


def _groups(problem: LawProblem) -> Iterator[tuple[str, list[tuple[str, list[np.ndarray]]]]]:
    """Groups of points that can be left out: by kind, each group's name and its masks, one per data set."""
    data = problem.data
    by_kind = {"pressure": pressure_levels(data)}
    if any(d.curve.dtype.kind != "f" for d in data):
        by_kind["curve"] = [d.curve for d in data]
    if problem.loaded:
        by_kind["load"] = [np.round(d.force, 2) for d in data]
    if len(data) > 1:
        by_kind["muscle"] = [np.full(len(d), d.name) for d in data]
    units = {"pressure": " bar", "load": " N"}
    for kind, labels in by_kind.items():
        groups = np.unique(np.concatenate(labels))
        if len(groups) > 1:
            yield (kind, [(f"{g}{units.get(kind, '')}", [label == g for label in labels]) for g in groups])


def _leave_out(result: LawFit, masks: Sequence[np.ndarray]) -> np.ndarray | None:
    """Errors on a group when the law is fitted to the rest; None when the rest does not suffice."""
    problem = result.problem
    rest = [take(d, ~m) for d, m in zip(problem.data, masks, strict=True)]
    seen = [d for d in rest if len(d)]
    left = [take(d, m) for d, m in zip(problem.data, masks, strict=True) if m.any()]
    if telling(seen) <= len(problem.free):
        return None
    whole = np.array([result.values[name] for name in problem.free])
    starts = np.vstack([whole, _starts(problem, 3, 1)])
    best = min(_search(problem, seen, starts), key=lambda f: f.cost)
    return errors(problem, dict(zip(problem.free, best.x * _scales(problem), strict=True)), left)


def _joint(
    problem: LawProblem,
    jacobian: np.ndarray,
    residuals: np.ndarray,
    variance: float,
    freedom: int,
    span: np.ndarray,
) -> FitCovariance | None:
    """Covariance of the parameters that the data identify together, C = s² (JᵀJ)⁻¹."""
    kept = [k for k in range(len(problem.free)) if jacobian[:, k].any()]
    while kept:
        half, correlation = intervals(jacobian[:, kept], variance, freedom)
        errors = half / t.ppf(0.975, freedom)
        share = errors * math.sqrt(12.0) / span[kept]
        if np.all(share < 1.0):
            return _described(problem, kept, errors, correlation, freedom, doubt(problem, residuals))
        del kept[int(np.argmax(share))]
    return None


def _described(
    problem: LawProblem,
    kept: Sequence[int],
    errors: np.ndarray,
    correlation: np.ndarray,
    freedom: int,
    doubtful: str,
) -> FitCovariance | None:
    if not np.all(errors > 0.0):  # points without any scatter
        return None
    names = [problem.free[k] for k in kept]
    held = [name for name in problem.free if name not in names]
    files = ", ".join(data.file.name for data in problem.data)
    how = f"{problem.law.name} fitted to {files}, linearised about the fitted values"
    how += "" if problem.loss == "linear" else f", loss {problem.loss}"
    how += f"; {doubtful}" if doubtful else ""
    sources = {"standard_errors": Provenance(kind="fitted", source=how)}
    if held:
        why = f"without {', '.join(held)}: not identified, or at a bound, and held at the fitted value"
        sources["parameters"] = Provenance(kind="fitted", source=why)
    symmetric = np.clip(0.5 * (correlation + correlation.T), -1.0, 1.0)
    np.fill_diagonal(symmetric, 1.0)
    return FitCovariance.model_validate(
        {
            "provenance": sources,
            "law": problem.law.name,
            "parameters": [key_of(problem.law.name, name) for name in names],
            "standard_errors": errors.tolist(),
            "correlation": symmetric.tolist(),
            "freedom": freedom,
        },
        context={"si": True},
    )


def memory(problem: LawProblem, residuals: np.ndarray) -> float:
    """Correlation of neighbouring errors along the curves, in the order of the data [-]."""
    products, start = 0.0, 0
    for data in problem.data:
        own = residuals[start : start + len(data)]
        start += len(data)
        for curve in np.unique(data.curve):
            along = own[data.curve == curve]
            products += float(np.sum(along[1:] * along[:-1]))
    square = float(np.sum(residuals**2))
    return products / square if square else 0.0


def doubt(problem: LawProblem, residuals: np.ndarray) -> str:
    """The sentence on neighbouring errors that are alike beyond chance; "" where they are not."""
    rho = memory(problem, residuals)
    if rho <= CHANCE / math.sqrt(len(residuals)):
        return ""
    factor = math.sqrt((1.0 + rho) / (1.0 - rho))
    return (
        f"neighbouring errors of a curve are alike (correlation {rho:.2f}), so intervals and standard "
        f"errors, which count each point, are about {factor:.1f} times too small"
    )
