"""Covariance of a static fit: which parameters it holds, and whether its points hang together."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import t

from afo_sim.description.covariance import FitCovariance, key_of
from afo_sim.description.quantity import Provenance
from afo_sim.lab.fitting.identifiability import intervals
from afo_sim.lab.fitting.law_problem import LawProblem

CHANCE = 2.0  # standard errors 1/√n of a correlation: beyond them neighbouring errors are alike


def joint(
    problem: LawProblem,
    jacobian: np.ndarray,
    residuals: np.ndarray,
    variance: float,
    freedom: int,
    span: np.ndarray,
) -> FitCovariance | None:
    """Covariance of the parameters that the data tell together, C = s² (JᵀJ)⁻¹.

    A parameter whose standard error exceeds that of any number between its bounds, span/√12, is told by the
    bounds and not by the data. It stays at its fitted value, and the others' covariance is the one with it
    held. The vaguest goes first: of two parameters that only their sum is known of, one stays.

    Units: jacobian (n, k), freedom [-], span [SI] (k,).
    """
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
        why = f"without {', '.join(held)}: not told by the data, or at a bound, and held at the fitted value"
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
    """Correlation of neighbouring errors along the curves, in the order of the data [-].

    ρ = Σ e_i e_(i+1) / Σ e² over neighbours of one curve. Errors of the law, and a loop of filling and
    venting, make it positive: standard errors that count each point are then too small, by about
    √((1 + ρ)/(1 − ρ)).
    """
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
