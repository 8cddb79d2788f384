"""Least squares of a torque fit, and how far each parameter can be off.

Readings of one setting are one point, of the weight of its readings. What is left over is taken about these
points, not about the readings: ten copies of a reading tell no more than one. Errors of neighbouring angles
hang together where the model is wrong; then there are fewer independent ones, n (1 − ρ)/(1 + ρ), but one at
least for each curve over the angle.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from afo_sim.lab.fitting.identifiability import intervals, rms
from afo_sim.lab.fitting.torque_parameter import TorqueParameter
from afo_sim.lab.fitting.torque_problem import CHANNELS, TorqueProblem, errors

ROUNDS = 4  # in which two channels' sizes of error are found
AT_BOUND = 1e-4  # share of a parameter's range that counts as being at its bound


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
        """Of the parameters [SI]."""
        return values_of(self.problem.free, self.x)


def values_of(free: Sequence[TorqueParameter], x: np.ndarray) -> dict[str, float]:
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
    found, weight = errors(problem, values_of(problem.free, x)), np.sqrt(problem.column("weight"))
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
    found = errors(problem, values_of(problem.free, x))
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
    found = errors(problem, values_of(problem.free, x))["torque"]
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
