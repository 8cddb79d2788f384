"""Torques that a fit did not see: a group, a pressure or a range of angles left out in turn."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.lab.fitting.torque_problem import Group, TorqueProblem, errors
from afo_sim.lab.fitting.torque_search import Solution, levels, solve, values_of, without

KINDS = ("group", "angle", "pressure")
BLOCKS = 5  # of angles
FOLDS = 3  # with fewer no parameter is doubted

Progress = Callable[[str], None]


@dataclass(frozen=True)
class HeldOut:
    """Torque errors [N·m] of settings when they were left out, by what was left out.

    `weight` are their readings, `scatter` the mean square [N²·m²] of these about their mean.
    """

    errors: dict[str, np.ndarray]
    weight: dict[str, np.ndarray]
    scatter: dict[str, np.ndarray]

    @property
    def rms(self) -> float:
        """Over all readings [N·m]."""
        joined = (np.concatenate([*each.values()]) for each in (self.errors, self.weight, self.scatter))
        return of_readings(*joined)

    def of(self, name: str) -> float:
        """RMS over the readings of one part [N·m]."""
        return of_readings(self.errors[name], self.weight[name], self.scatter[name])


def of_readings(missed: np.ndarray, weight: np.ndarray, scatter: np.ndarray) -> float:
    """RMS error of readings, from those of their means and from how far they scatter about these."""
    return float(np.sqrt(np.sum(weight * (missed**2 + scatter)) / weight.sum()))


def _held(fitted: Solution, parts: dict[str, Sequence[Group]]) -> HeldOut:
    """The errors of parts that a fit did not see."""
    missed = {name: errors(fitted.problem, fitted.values, groups)["torque"] for name, groups in parts.items()}
    weight, scatter = (
        {n: np.concatenate([getattr(g.readings, key) for g in groups]) for n, groups in parts.items()}
        for key in ("weight", "scatter")
    )
    return HeldOut(missed, weight, scatter)


def parts(problem: TorqueProblem, kind: str) -> dict[str, np.ndarray]:
    """Which readings are left out together, by a name for people; none where that cannot be done."""
    found = {name: mask for name, mask in _parts(problem, kind) if mask.any()}
    return found if len(found) > 1 else {}


def _parts(problem: TorqueProblem, kind: str) -> Iterator[tuple[str, np.ndarray]]:
    if kind == "group":
        for k, group in enumerate(problem.groups):
            yield group.readings.group, problem.of_group == k
    elif kind == "pressure":
        level, pressure = levels(problem), problem.column("pressure") * 1e-5
        for k in np.unique(level):
            yield f"{pressure[level == k].mean():.3g} bar", level == k
    else:
        degrees = np.round(np.degrees(problem.column("angle")), 1)
        different = np.unique(degrees)
        for block in np.array_split(different, min(BLOCKS, len(different))):
            mask = (degrees >= block[0]) & (degrees <= block[-1])
            yield f"{block[0]:g} to {block[-1]:g} deg" if len(block) > 1 else f"{block[0]:g} deg", mask


def held_out(
    solution: Solution, kinds: Sequence[str], report: Progress = lambda text: None
) -> dict[str, HeldOut]:
    """Errors of what is left out in turn, by kind; a kind of which there are no two parts is missing."""
    found = {}
    for kind in kinds:
        masks = parts(solution.problem, kind)
        if masks and _enough(solution.problem, masks):
            report(f"leaving out one {kind} after another")
            found[kind] = leave_out(solution.problem, masks, solution.x)
    return found


def leave_out(
    problem: TorqueProblem, masks: dict[str, np.ndarray], start: np.ndarray | None = None
) -> HeldOut:
    """Errors of each part by a fit to the others."""
    found = [
        _held(solve(problem.take(~mask), start), {name: problem.take(mask).groups})
        for name, mask in masks.items()
    ]
    return _joined(found)


def _joined(found: Sequence[HeldOut]) -> HeldOut:
    joined: list[dict[str, np.ndarray]] = [{}, {}, {}]
    for each in found:
        for whole, part in zip(joined, (each.errors, each.weight, each.scatter), strict=True):
            whole |= part
    return HeldOut(*joined)


def _enough(problem: TorqueProblem, masks: dict[str, np.ndarray]) -> bool:
    """Whether every rest has more readings than parameters."""
    return all(int((~mask).sum()) > len(problem.free) for mask in masks.values())


def predicted(solution: Solution, groups: Sequence[Group]) -> HeldOut:
    """Errors of further files, which no fit saw."""
    return _held(solution, {f"{g.readings.file.name} {g.readings.group}": [g] for g in groups})


@dataclass(frozen=True)
class Alternative:
    """The fit without one parameter, which is held where it does nothing.

    `values` are those of the others [SI], `rms` is of what was left out [N·m], `beaten` whether this fit
    predicts it as well.
    """

    dropped: str
    values: dict[str, float]
    rms: float
    beaten: bool


def alternatives(
    solution: Solution, found: dict[str, HeldOut], report: Progress = lambda text: None
) -> tuple[str, tuple[Alternative, ...]]:
    """Fits without each parameter that has a neutral value, and the kind of part by which they were judged.

    A parameter is told if what was left out is predicted better with it: the mean over the parts of the
    logarithm of the ratio of the squared errors, without over with, is above its standard error.

    Source
    ------
    The one-standard-error rule of Breiman, Friedman, Olshen & Stone 1984, in logarithms, so that a part with
    large errors does not decide alone.
    """
    problem = solution.problem
    kind = next((k for k in KINDS if k in found and len(found[k].errors) >= FOLDS), "")
    seen = (
        {"cuff_stiffness"} if np.isfinite(problem.column("cuff")).any() else set()
    )  # torques alone are judged
    few = len(problem.free) < 2
    dropped = [p for p in problem.free if p.neutral is not None and p.name not in seen and not few]
    if not kind or not dropped:
        return kind, ()
    masks, with_it = parts(problem, kind), found[kind]
    result = []
    for parameter in dropped:
        report(f"fitting without {parameter.name}")
        less = without(problem, parameter)
        own = solve(less)
        without_it = leave_out(less, masks, own.x)
        ratio = [2.0 * np.log((without_it.of(n) + 1e-12) / (with_it.of(n) + 1e-12)) for n in masks]
        error = float(np.std(ratio, ddof=1)) / np.sqrt(len(ratio))
        told = float(np.mean(ratio)) > error
        result.append(Alternative(parameter.name, own.values, without_it.rms, not told))
    return kind, tuple(result)


@dataclass(frozen=True)
class Apart:
    """Groups fitted one by one: values [SI] by group, and by parameter the chance that they are one value."""

    values: dict[str, dict[str, float]]
    x: np.ndarray
    chance: dict[str, float]


def apart(solution: Solution, report: Progress = lambda text: None) -> Apart | None:
    """Fits to each group alone, and whether they contradict each other; None where they are too few or small.

    Cochran's test: Σ (x − x̄)²/h² over the groups against χ², with h the standard error of each and x̄ the mean
    weighted by 1/h².
    """
    from scipy.stats import chi2, t

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


def root_mean_square(solution: Solution) -> float:
    """Of the torque errors [N·m], every reading alike."""
    problem = solution.problem
    found = errors(problem, values_of(problem.free, solution.x))["torque"]
    return of_readings(found, problem.column("weight"), problem.column("scatter"))
