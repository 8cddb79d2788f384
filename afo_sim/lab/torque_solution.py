"""Least squares of a torque fit: how far each parameter can be off, and what the fit says of unseen torques.

Readings of one setting are one point, of the weight of its readings. What is left over is taken about these
points, not about the readings: ten copies of a reading tell no more than one. Errors of neighbouring angles
hang together where the model is wrong; then there are fewer independent ones, n (1 − ρ)/(1 + ρ), but one at
least for each curve over the angle. A group, a pressure or a range of angles is left out in turn; `profile`
is the error over two of the parameters.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from afo_sim.lab.identifiability import intervals, rms
from afo_sim.lab.torque_problem import CHANNELS, Group, TorqueParameter, TorqueProblem, errors

Progress = Callable[[str], None]
ROUNDS = 4  # in which two channels' sizes of error are found
ROUND_OFF = 1e-6  # of its size, below which a value is nothing
AT_BOUND = 1e-4  # share of a parameter's range that counts as being at its bound
KINDS = ("group", "angle", "pressure")
BLOCKS = 5  # of angles
FOLDS = 3  # with fewer no parameter is doubted
GRID = 33  # values of each of the two
HALVES = 2.0  # of their 95 % intervals to either side


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a search ended. `x` are coordinates, `half` half their 95 % intervals, `size` what these are held
    against; `spread` is the size of an error by channel; `memory` the correlation of neighbouring errors [-];
    `independent` how many errors there seem to be, `freedom` these less parameters; `settled` says whether
    the search came to its end.
    """

    problem: TorqueProblem
    x: np.ndarray
    half: np.ndarray
    correlation: np.ndarray
    spread: dict[str, float]
    memory: float
    independent: float
    freedom: float
    settled: bool

    @property
    def values(self) -> dict[str, float]:
        """Of the parameters [SI]; what is nothing but round-off is 0."""
        x = np.where(np.abs(self.x) < ROUND_OFF, 0.0, self.x)
        return _values_of(self.problem.free, np.where([p.logarithmic for p in self.problem.free], self.x, x))


def _values_of(free: Sequence[TorqueParameter], x: np.ndarray) -> dict[str, float]:
    """Values [SI] of coordinates."""
    return {p.name: p.value(float(c)) for p, c in zip(free, x, strict=True)}


def solve(problem: TorqueProblem, start: np.ndarray | None = None) -> Solution:
    """The least squares of a problem."""
    spread = {"torque": 1.0, "cuff": 1.0}
    starts = [start] if start is not None else _starts(problem.free)
    both = np.isfinite(problem.column("cuff")).any()
    if both:
        spread = {c: _size(problem.column(c)) for c in CHANNELS}
    found = [_search(problem, x, spread) for x in starts]
    best = min(found, key=lambda f: f.cost)
    for _ in range(ROUNDS if both else 0):  # each channel in units of its own error
        spread = _spread(problem, best.x, spread)
        best = _search(problem, best.x, spread)
    return _believed(problem, best, spread)


def _size(values: np.ndarray) -> float:
    return max(rms(values[np.isfinite(values)]), 1e-9)


def _starts(free: Sequence[TorqueParameter]) -> list[np.ndarray]:
    """A low and a high usual value of every parameter, in all combinations of up to four of them."""
    ends = [sorted({p.coordinate(p.low), p.coordinate(p.high)}) for p in free]
    some = [values if k < 4 else values[:1] for k, values in enumerate(ends)]
    return [np.array(x) for x in itertools.product(*some)]


def bounds(free: Sequence[TorqueParameter]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates."""
    lower = np.array([p.coordinate(p.lower) for p in free])
    upper = np.array([p.coordinate(p.upper) for p in free])
    return lower, upper


def _residuals(problem: TorqueProblem, x: np.ndarray, spread: dict[str, float]) -> np.ndarray:
    """Errors of all channels in units of their sizes, each of the weight of its readings."""
    found, weight = errors(problem, _values_of(problem.free, x)), np.sqrt(problem.column("weight"))
    parts = []
    for channel in CHANNELS:
        part = weight * found[channel] / spread[channel]
        parts.append(part[np.isfinite(problem.column(channel))])
    return np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)


def _search(problem: TorqueProblem, x: np.ndarray, spread: dict[str, float]) -> OptimizeResult:
    lower, upper = bounds(problem.free)
    inside = np.clip(x, lower + 1e-6 * (upper - lower), upper - 1e-6 * (upper - lower))
    return least_squares(
        lambda z: _residuals(problem, z, spread),
        inside,
        jac="3-point",
        bounds=(lower, upper),
        x_scale="jac",
        ftol=1e-11,
        xtol=1e-11,
        gtol=1e-11,
        max_nfev=200,
    )


def _spread(problem: TorqueProblem, x: np.ndarray, spread: dict[str, float]) -> dict[str, float]:
    found = errors(problem, _values_of(problem.free, x))
    return {c: max(_size(found[c][np.isfinite(problem.column(c))]), 1e-6 * spread[c], 1e-9) for c in CHANNELS}


def _believed(problem: TorqueProblem, best: OptimizeResult, spread: dict[str, float]) -> Solution:
    """With intervals; a parameter at its bound is held for the others, and has none."""
    lower, upper = bounds(problem.free)
    k, n = len(best.x), len(best.fun)
    inner = np.minimum(best.x - lower, upper - best.x) > AT_BOUND * (upper - lower)
    rho = min(max(memory(problem, best.x), 0.0), 0.95)
    curves = len(set(zip(problem.of_group.tolist(), levels(problem).tolist(), strict=True)))
    independent = max(n * (1.0 - rho) / (1.0 + rho), float(curves))
    freedom = max(independent - int(inner.sum()), 1.0)
    half, correlation = np.full(k, np.inf), np.eye(k)
    if inner.any() and n > k:
        variance = float(np.sum(best.fun**2)) / freedom
        half[inner], correlation[np.ix_(inner, inner)] = intervals(best.jac[:, inner], variance, freedom)
    return Solution(problem, best.x, half, correlation, spread, rho, independent, freedom, best.status > 0)


def memory(problem: TorqueProblem, x: np.ndarray) -> float:
    """Correlation of the torque errors of neighbouring angles, within a group and a pressure [-]."""
    found = errors(problem, _values_of(problem.free, x))["torque"]
    level, angle, group = levels(problem), problem.column("angle"), problem.of_group
    order = np.lexsort((angle, level, group))
    e, same = found[order], np.ones(max(len(order) - 1, 0), dtype=bool)
    for key in (level, group):
        same &= key[order][1:] == key[order][:-1]
    square, pairs = float(np.sum(e**2)), int(same.sum())
    if square == 0.0 or pairs < 5:
        return 0.0
    return float(np.sum((e[1:] * e[:-1])[same]) / pairs / (square / len(e)))


def levels(problem: TorqueProblem) -> np.ndarray:
    """The number of the pressure level of each reading; pressures nearer than 2 % of their span are one."""
    pressure = problem.column("pressure")
    ordered = np.sort(pressure)
    gap = max(0.02 * float(np.ptp(ordered)), 5e3)
    edges = ordered[np.flatnonzero(np.diff(ordered, prepend=-np.inf) > gap)]
    if len(edges) > 12 or (len(edges) == 1 and np.ptp(ordered) > 1e5):  # swept: blocks of as many readings
        edges = np.unique(ordered[np.linspace(0, len(ordered), 5, endpoint=False).astype(int)])
    return np.searchsorted(edges, pressure, side="right") - 1


def without(problem: TorqueProblem, parameter: TorqueParameter) -> TorqueProblem:
    """The problem of a device that has no such thing: the parameter is held where it does nothing."""
    assert parameter.neutral is not None
    free = tuple(p for p in problem.free if p.name != parameter.name)
    return replace(problem, free=free, held={**problem.held, parameter.name: parameter.neutral})


@dataclass(frozen=True)
class HeldOut:
    """Torque errors [N·m] of settings when they were left out, by what was left out."""

    errors: dict[str, np.ndarray]
    weight: dict[str, np.ndarray]
    scatter: dict[str, np.ndarray]

    @property
    def rms(self) -> float:
        """Over all readings [N·m]."""
        joined = (np.concatenate([*each.values()]) for each in (self.errors, self.weight, self.scatter))
        return _of_readings(*joined)

    def of(self, name: str) -> float:
        """RMS over the readings of one part [N·m]."""
        return _of_readings(self.errors[name], self.weight[name], self.scatter[name])


def _of_readings(missed: np.ndarray, weight: np.ndarray, scatter: np.ndarray) -> float:
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
            found[kind] = _leave_out(solution.problem, masks, solution.x)
    return found


def _leave_out(
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
    """The fit without one parameter, which is held where it does nothing."""

    dropped: str
    values: dict[str, float]
    rms: float
    beaten: bool


def alternatives(
    solution: Solution, found: dict[str, HeldOut], report: Progress = lambda text: None
) -> tuple[str, tuple[Alternative, ...]]:
    """Fits without each parameter that has a neutral value, and the kind of part by which they were judged.

    Source: The one-standard-error rule of Breiman, Friedman, Olshen & Stone 1984, in logarithms, so that
    a part with large errors does not decide alone.
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
        without_it = _leave_out(less, masks, own.x)
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
    """Fits to each group alone, and whether they contradict each other; None where they are too few or
    small."""
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


def mean_square(solution: Solution) -> float:
    """Of the torque errors of the settings, without the scatter within them [N²·m²]."""
    missed = errors(solution.problem, solution.values)["torque"]
    return float(np.average(missed**2, weights=solution.problem.column("weight")))


def root_mean_square(solution: Solution) -> float:
    """Of the torque errors [N·m], every reading alike."""
    scatter = np.average(solution.problem.column("scatter"), weights=solution.problem.column("weight"))
    return float(np.sqrt(mean_square(solution) + scatter))


@dataclass(frozen=True, eq=False)
class Profile:
    """RMS of the torque errors [N·m] (n, m) over values [SI] of two parameters."""

    parameters: tuple[TorqueParameter, TorqueParameter]
    first: np.ndarray
    second: np.ndarray
    rms: np.ndarray


def profile(solution: Solution) -> Profile | None:
    """Over the first two parameters, the others held where the fit ended; None where there is one only."""
    free = solution.problem.free
    if len(free) < 2:
        return None
    lower, upper = bounds(free)
    axes = []
    for k in range(2):
        reach = 1.6 if free[k].logarithmic else max(1.5 * abs(solution.x[k]), 1.0)
        half = (
            min(max(HALVES * float(solution.half[k]), 1e-3), reach)
            if np.isfinite(solution.half[k])
            else reach
        )
        low, high = max(solution.x[k] - half, lower[k]), min(solution.x[k] + half, upper[k])
        axes.append(np.linspace(low, high, GRID))
    values = [np.array([p.value(x) for x in axis]) for p, axis in zip(free[:2], axes, strict=True)]
    problem, found = solution.problem, np.empty((GRID, GRID))
    weight, scatter = problem.column("weight"), problem.column("scatter")
    at = solution.values
    for i, a in enumerate(values[0]):
        for j, b in enumerate(values[1]):
            missed = errors(problem, at | {free[0].name: float(a), free[1].name: float(b)})["torque"]
            found[i, j] = _of_readings(missed, weight, scatter)
    return Profile((free[0], free[1]), values[0], values[1], found)
