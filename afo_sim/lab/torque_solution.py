"""The fit of a torque problem, and alternative fits: without each parameter, to each group, over two."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, t

from afo_sim.lab import solution as least
from afo_sim.lab.torque_problem import TorqueProblem, errors

ROUNDS = 4  # in which two channels' sizes of error are found
KINDS = ("group", "angle", "pressure")
FOLDS = 3  # with fewer no parameter is doubted
GRID = 33  # values of each of the two
HALVES = 2.0  # of their 95 % intervals to either side


def solve(problem: TorqueProblem, start: np.ndarray | None = None) -> least.Solution:
    """The least squares of a problem; two channels are each in units of their own error."""
    both = np.isfinite(problem.column("cuff")).any()
    problem = replace(problem, spread=dict.fromkeys(problem.spread, 1.0))
    if both:
        problem = problem.scaled({c: problem.column(c) for c in problem.spread})
    best = problem.best(problem.starts() if start is None else [start])
    for _ in range(ROUNDS if both else 0):
        problem = problem.scaled(errors(problem, problem.values(best.x)))
        best = problem.search(best.x)
    return least.believed(problem, best)


def from_start(start: np.ndarray) -> least.Refit:
    """A fit to some of the readings, as `held_out` asks for it."""
    return lambda rest: solve(rest, start).values


@dataclass(frozen=True)
class Alternative:
    """The fit without one parameter, which is held where it does nothing."""

    dropped: str  # name of that parameter
    values: dict[str, float]  # of the others [SI]
    rms: float  # of what was left out [N·m]
    beaten: bool  # this fit predicts it as well


def alternatives(
    solution: least.Solution, held: dict[str, least.HeldOut], report: least.Progress = lambda text: None
) -> tuple[str, tuple[Alternative, ...]]:
    """Fits without each parameter that has a neutral value, and the kind of held-out part."""
    problem = solution.problem
    kind = next((k for k in KINDS if k in held and len(held[k].errors) >= FOLDS), "")
    seen = np.isfinite(problem.column("cuff")).any()  # torques alone are judged
    dropped = [p for p in problem.free if p.neutral is not None and not (seen and p.name == "cuff_stiffness")]
    if not kind or not dropped or len(problem.free) < 2:
        return kind, ()
    masks, with_it = problem.parts(kind), held[kind]
    result = []
    for parameter in dropped:
        report(f"fitting without {parameter.name}")
        assert parameter.neutral is not None
        free = tuple(p for p in problem.free if p is not parameter)
        less = replace(problem, free=free, fixed={**problem.fixed, parameter.name: parameter.neutral})
        own = solve(less)
        without_it = least.left_out(less, masks, from_start(own.x))
        ratio = [2.0 * np.log((without_it.of(n) + 1e-12) / (with_it.of(n) + 1e-12)) for n in masks]
        # the one-standard-error rule of Breiman, Friedman, Olshen & Stone 1984, in logarithms
        told = float(np.mean(ratio)) > float(np.std(ratio, ddof=1)) / np.sqrt(len(ratio))
        result.append(Alternative(parameter.name, own.values, without_it.rms, not told))
    return kind, tuple(result)


@dataclass(frozen=True)
class Apart:
    """Groups fitted one by one: values [SI] by group, and by parameter the chance that they are one value."""

    values: dict[str, dict[str, float]]
    x: np.ndarray
    chance: dict[str, float]


def apart(solution: least.Solution, report: least.Progress = lambda text: None) -> Apart | None:
    """Fits to each group alone, and whether they contradict each other; None of too few or small ones."""
    problem, values, x, h = solution.problem, {}, [], []
    if len(problem.groups) < 2:
        return None
    for k, group in enumerate(problem.groups):
        own = problem.take(problem.of_group == k)
        if len(own) < 3 * len(problem.free):
            return None
        report(f"fitting group {group.readings.group} alone")
        fitted = solve(own)
        values[group.readings.group] = fitted.values
        x.append(fitted.x)
        h.append(np.where(np.isfinite(fitted.half), fitted.half / t.ppf(0.975, fitted.freedom), 1e3))
    at, error = np.array(x), np.maximum(np.array(h), 1e-12)
    weight = 1.0 / error**2
    mean = np.sum(weight * at, axis=0) / weight.sum(axis=0)
    q = np.sum(weight * (at - mean) ** 2, axis=0)
    chance = {p.name: float(chi2.sf(v, len(at) - 1)) for p, v in zip(problem.free, q, strict=True)}
    return Apart(values, at, chance)


def mean_square(solution: least.Solution) -> float:
    """Of the torque errors of the settings, without the scatter within them [N²·m²]."""
    missed = errors(solution.problem, solution.values)["torque"]
    return float(np.average(missed**2, weights=solution.problem.column("weight")))


def root_mean_square(solution: least.Solution) -> float:
    """Of the torque errors [N·m], every reading alike."""
    scatter = np.average(solution.problem.column("scatter"), weights=solution.problem.column("weight"))
    return float(np.sqrt(mean_square(solution) + scatter))


@dataclass(frozen=True, eq=False)
class Profile:
    """RMS of the torque errors [N·m] (n, m) over values [SI] of two parameters."""

    parameters: tuple[least.FitParameter, least.FitParameter]
    first: np.ndarray
    second: np.ndarray
    rms: np.ndarray


def profile(solution: least.Solution) -> Profile | None:
    """Over the first two parameters, the others held where the fit ended; None where there is one only."""
    free = solution.problem.free
    if len(free) < 2:
        return None
    lower, upper = solution.problem.bounds
    axes = []
    for k in range(2):
        reach = 1.6 if free[k].logarithmic else max(1.5 * abs(solution.x[k]), 1.0)
        half = min(max(HALVES * float(solution.half[k]), 1e-3), reach)  # which may be infinite
        low, high = max(solution.x[k] - half, lower[k]), min(solution.x[k] + half, upper[k])
        axes.append(np.linspace(low, high, GRID))
    values = [np.array([p.value(x) for x in axis]) for p, axis in zip(free[:2], axes, strict=True)]
    problem, found = solution.problem, np.empty((GRID, GRID))
    weight, scatter = problem.column("weight"), problem.column("scatter")
    at = solution.values
    for i, a in enumerate(values[0]):
        for j, b in enumerate(values[1]):
            missed = errors(problem, at | {free[0].name: float(a), free[1].name: float(b)})["torque"]
            found[i, j] = least.of_readings(missed, weight, scatter)
    return Profile((free[0], free[1]), values[0], values[1], found)
