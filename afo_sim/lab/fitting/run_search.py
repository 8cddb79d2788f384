"""Least squares over whole runs, by finite differences that bridge the small jumps of a run."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common.errors import InputError, SimulationError
from afo_sim.lab.fitting.identifiability import rms
from afo_sim.lab.fitting.run_problem import RunProblem, differences, run_at

Progress = Callable[[str], None]
# Of the finite differences, in searched numbers. A foot that sticks a time step later is a small jump of the
# run: the first bridges it as a rule, the second where the search has not settled.
STEPS = (0.02, 0.08)
LINEAR = 5.0  # times as far where the number is no logarithm, and a run nearly linear in it
CLEAR, LONGEST = (
    10.0,
    5.0,
)  # in units of the noise, how far the last differences go; times the second, at most
ROUGH = 0.3  # where they differ by more than this share from shorter ones, a run changes by jumps
SETTLED = 0.1  # share of what noise alone would explain that a further step may still explain
AT_BOUND = 1e-4  # share of the searched range
MOST_RUNS = 40  # beside those of the finite differences


class RunSearch:
    """Least squares over runs; counts them, and remembers what a search cannot return."""

    def __init__(self, problem: RunProblem, report: Progress):
        self.problem, self.report, self.runs, self.step = problem, report, 0, STEPS[0]
        self.reach = np.array([1.0 if p.kind.logarithmic else LINEAR for p in problem.parameters])
        kinds = [p.kind for p in problem.parameters]
        self.lower = np.array([p.search(k.lower) for p, k in zip(problem.parameters, kinds, strict=True)])
        self.upper = np.array([p.search(k.upper) for p, k in zip(problem.parameters, kinds, strict=True)])

    def values(self, x: np.ndarray) -> dict[str, float]:
        return {p.name: p.value(float(z)) for p, z in zip(self.problem.parameters, x, strict=True)}

    def errors(self, x: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """All channels' differences in units of their noise; infinite where there is no such run."""
        problem = self.problem
        self.runs += 1
        try:
            found = differences(problem, self.values(x), run_at(problem, self.values(x)))
        except (InputError, SimulationError):  # too fast for the time step, for example
            return np.full(int(mask.sum()) * len(problem.log.channels), np.inf)
        parts = [found[title][mask] / problem.noise[title] for title in found]
        self.report(f"run {self.runs}: {rms(np.concatenate(parts)):.4g} × noise")
        return np.concatenate(parts)

    def jacobian(self, x: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Central differences; one-sided at a bound, and where there is no run on one side."""
        columns = []
        for k in range(len(x)):
            ends = []
            for way in (-1.0, 1.0):
                end = x.copy()
                end[k] = np.clip(x[k] + way * self.step * self.reach[k], self.lower[k], self.upper[k])
                errors = self.errors(end, mask)
                if not np.isfinite(errors).all():
                    end, errors = x, self.errors(x, mask)
                ends.append((end[k], errors))
            (low, below), (high, above) = ends
            columns.append((above - below) / (high - low) if high > low else np.zeros_like(below))
        return np.stack(columns, axis=1)

    def solve(self, x: np.ndarray, mask: np.ndarray) -> Any:
        """scipy's result, from a search that has settled if it could."""
        for self.step in STEPS:
            best = least_squares(
                lambda z: self.errors(z, mask),
                np.clip(x, self.lower, self.upper),
                jac=lambda z: self.jacobian(z, mask),
                bounds=(self.lower, self.upper),
                ftol=1e-7,
                xtol=1e-6,
                gtol=1e-12,
                max_nfev=MOST_RUNS,
            )
            if self.settled(best):
                break
            x = best.x
        return best

    def sound_jacobian(self, x: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """With steps that change the run by much more than its jumps do; and which columns differ from
        those of shorter steps."""
        usual = self.reach
        self.step = STEPS[1]
        short = self.jacobian(x, mask)
        wanted = CLEAR / np.maximum(np.linalg.norm(short, axis=0), 1e-9) / self.step
        self.reach = np.clip(wanted, usual, LONGEST * usual)
        long = self.jacobian(x, mask)
        self.reach = usual
        sizes = np.linalg.norm([short, long], axis=1).max(axis=0)
        return long, np.linalg.norm(long - short, axis=0) > ROUGH * sizes

    def settled(self, best: Any) -> bool:
        """True where a further step would explain next to nothing; at a bound there is none to take."""
        away = np.minimum(best.x - self.lower, self.upper - best.x) > AT_BOUND * (self.upper - self.lower)
        if not away.any():
            return True
        jacobian = best.jac[:, away]
        step = np.linalg.lstsq(jacobian, best.fun, rcond=1e-10)[0]
        explained = float(np.sum((jacobian @ step) ** 2))
        return explained <= SETTLED * int(away.sum()) * float(np.mean(best.fun**2))
