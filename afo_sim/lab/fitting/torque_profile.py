"""The error of a torque fit over two of its parameters, the others held."""

from dataclasses import dataclass

import numpy as np

from afo_sim.lab.fitting.torque_held_out import of_readings
from afo_sim.lab.fitting.torque_parameter import TorqueParameter
from afo_sim.lab.fitting.torque_problem import errors
from afo_sim.lab.fitting.torque_search import Solution, bounds

GRID = 33  # values of each of the two
HALVES = 2.0  # of their 95 % intervals to either side


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
            found[i, j] = of_readings(missed, weight, scatter)
    return Profile((free[0], free[1]), values[0], values[1], found)
