"""Parameters of one law from a measured characteristic, and how well the data determine them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import OptimizeResult
from scipy.stats import t

from afo_sim.common import Notice
from afo_sim.description import FitCovariance, Provenance, key_of
from afo_sim.lab import solution as least
from afo_sim.lab.identifiability import Believed, intervals, memory, refused, rms, unidentified
from afo_sim.lab.law_problem import LawProblem, agreed_slack, errors
from afo_sim.lab.measured import Measured
from afo_sim.lab.solution import POINTS_PER_PARAMETER, HeldOut, Progress, Solution, believed, unseen, verdict

STARTS = 12
ENOUGH = 3  # starts that end at the same place; with fewer there may be a better one
CHANCE = 2.0  # standard errors 1/√n of a correlation: beyond them neighbouring errors are alike


@dataclass(frozen=True)
class LawFit(Believed):
    """Parameters of a law, and how far they can be believed. SI."""

    solution: Solution  # where the search ended
    agreeing_starts: int  # that ended there, too
    starts: int  # of the search
    verdict: tuple[Notice, ...]  # parameters that the data do not identify, and why
    held_out: Mapping[str, HeldOut] = field(default_factory=dict)  # errors [N or m] of points not seen
    covariance: FitCovariance | None = None  # of what is identified; None of one parameter or none

    @property
    def problem(self) -> LawProblem:
        """What was fitted to what."""
        return self.solution.problem

    @property
    def values(self) -> dict[str, float]:
        """The fitted values."""
        return self.solution.values

    @cached_property
    def written(self) -> dict[str, float]:
        """The fitted values with four digits, or as many as leave the printed errors as they are."""
        for digits in range(4, 17):
            found = {name: float(f"{value:.{digits}g}") for name, value in self.values.items()}
            missed = errors(self.problem, found, self.problem.data)
            if all(
                f"{a:.3g}" == f"{b:.3g}" for a, b in zip(_told(missed), _told(self.residuals), strict=True)
            ):
                return found
        return self.values

    @property
    def half_width(self) -> dict[str, float]:
        """Half the 95 % interval of each; infinite where it is refused."""
        lacking = refused(self.verdict)
        return {
            p.name: math.inf if p.name in lacking else float(half * p.size)
            for p, half in zip(self.problem.free, self.solution.half, strict=True)
        }

    @cached_property
    def residuals(self) -> np.ndarray:
        """Prediction less measurement, point by point [N or m]."""
        return errors(self.problem, self.values, self.problem.data)

    @property
    def telling(self) -> int:
        """Readings but those of a slack muscle that the law calls slack, too: they identify nothing."""
        silent = agreed_slack(self.problem, self.values, self.problem.data).sum()
        return len(self.residuals) - int(silent)

    @property
    def rms(self) -> float:
        """Of the residuals [N or m]."""
        return rms(self.residuals)

    @property
    def spread(self) -> float:
        """Standard deviation of the residuals [N or m], corrected for the number of parameters."""
        freedom = self.telling - len(self.values)
        return float(np.sqrt(np.sum(self.residuals**2) / freedom)) if freedom > 0 else np.inf

    @property
    def worst(self) -> float:
        """The largest residual [N or m]."""
        return float(np.abs(self.residuals).max())


def _told(residuals: np.ndarray) -> tuple[float, ...]:
    """What is printed of residuals: their RMS and the largest [N or m]."""
    return rms(residuals), float(np.abs(residuals).max())


def fit_law(problem: LawProblem, *, seed: int = 0, starts: int = STARTS) -> LawFit:
    """Fit a law from several starts."""
    ends = [problem.search(x) for x in problem.starts(starts, seed)]
    if starts >= ENOUGH and _agreeing(ends) < ENOUGH:
        ends += [problem.search(x) for x in problem.starts(3 * starts, seed + 1)]
    best, agreeing = min(ends, key=lambda end: end.cost), _agreeing(ends)
    if problem.loss != "linear":  # what is an outlier, the residuals of the first search tell
        first = problem.residuals(best.x)
        outlying = max(1.4826 * float(np.median(np.abs(first - np.median(first)))), 1e-9)
        problem = replace(problem, outlying=outlying)
        best = problem.search(problem.at(problem.values(best.x)))
    solution = believed(problem, best)
    lines, covariance = verdict(solution), None
    if starts >= ENOUGH and agreeing < ENOUGH:
        few = f"only {agreeing} of {len(ends)} starts end here; there may be a better fit"
        lines.append(unidentified("few-starts-agree", problem.names, f"not identifiable: {few}"))
    elif solution.independent >= POINTS_PER_PARAMETER * len(problem.free):
        covariance = _covariance(solution)
    return LawFit(solution, agreeing, len(ends), tuple(lines), covariance=covariance)


def _agreeing(ends: Sequence[OptimizeResult]) -> int:
    best = min(end.cost for end in ends)
    return sum(bool(end.cost <= best * 1.001 + 1e-300 and end.status > 0) for end in ends)


def held_out(
    fit: LawFit, test: Sequence[Measured] = (), report: Progress = lambda text: None, *, groups: bool = True
) -> LawFit:
    """Errors on points that the fit did not see: curves, pressures, loads, muscles, other files."""
    problem, values = fit.problem, fit.values

    def refit(rest: LawProblem) -> dict[str, float]:
        return rest.values(rest.best([rest.at(values), *rest.starts(3, 1)]).x)

    kinds = [*problem.kinds] if groups else []
    found = least.held_out(problem, kinds, refit, lambda text: report(f"{problem.law.name}: {text}"))
    if test:
        found["file"] = unseen([(d.name, replace(problem, data=(d,)), values) for d in test])
    return replace(fit, held_out=found)


def _covariance(solution: Solution) -> FitCovariance | None:
    """Covariance of the parameters that the data identify together, C = s² (JᵀJ)⁻¹."""
    free = solution.problem.free
    size, span = (np.array(x) for x in zip(*((p.size, p.upper - p.lower) for p in free), strict=True))
    jacobian = np.where(solution.inner, solution.jacobian, 0.0) / size
    kept = [k for k in range(len(free)) if jacobian[:, k].any()]
    while kept:
        half, correlation = intervals(jacobian[:, kept], solution.variance, solution.freedom)
        errors = half / t.ppf(0.975, solution.freedom)
        share = errors * math.sqrt(12.0) / span[kept]
        if np.all(share < 1.0):
            break
        del kept[int(np.argmax(share))]
    if not kept or not np.all(errors > 0.0):  # points without any scatter
        return None
    problem, law = solution.problem, solution.problem.law.name
    names = [problem.names[k] for k in kept]
    files = ", ".join(data.file.name for data in problem.data)
    how = f"{law} fitted to {files}, linearised about the fitted values"
    how += "" if problem.loss == "linear" else f", loss {problem.loss}"
    scale = understated(problem, solution.residuals)
    how += "; neighbouring errors of a curve are alike, as the scale says" if scale > 1.0 else ""
    sources = {"standard_errors": Provenance(kind="fitted", source=how)}
    if held := [name for name in problem.names if name not in names]:
        why = f"without {', '.join(held)}: not identified, or at a bound, and held at the fitted value"
        sources["parameters"] = Provenance(kind="fitted", source=why)
    symmetric = np.clip(0.5 * (correlation + correlation.T), -1.0, 1.0)
    np.fill_diagonal(symmetric, 1.0)
    table = {
        "provenance": sources,
        "law": law,
        "parameters": [key_of(law, name) for name in names],
        "standard_errors": errors.tolist(),
        "scale": scale,
        "correlation": symmetric.tolist(),
        "freedom": int(solution.freedom),
    }
    return FitCovariance.model_validate(table, context={"si": True})


def alike(problem: LawProblem, residuals: np.ndarray) -> float:
    """Correlation of neighbouring errors along the curves, in the order of the data [-]."""
    own = np.split(residuals, np.cumsum([len(d) for d in problem.data])[:-1])
    curves: list[np.ndarray] = []
    for d, part in zip(problem.data, own, strict=True):
        curves += [part[d.curve == curve] for curve in np.unique(d.curve)]
    return memory(curves, float(np.sum(residuals**2)))


def understated(problem: LawProblem, residuals: np.ndarray) -> float:
    """How many times too small standard errors are that count each point, where neighbours err alike [-]."""
    rho = alike(problem, residuals)
    beyond_chance = rho > CHANCE / math.sqrt(len(residuals))
    return round(math.sqrt((1.0 + rho) / (1.0 - rho)), 1) if beyond_chance else 1.0


def doubt(problem: LawProblem, residuals: np.ndarray) -> str:
    """The sentence on neighbouring errors that are alike beyond chance; "" where they are not."""
    factor, rho = understated(problem, residuals), alike(problem, residuals)
    if factor == 1.0:
        return ""
    text = f"neighbouring errors of a curve are alike (correlation {rho:.2f}), so intervals and standard "
    text += f"errors, which count each point, are about {factor:.1f} times too small; "
    return f"{text}the muscle's draws account for it"
