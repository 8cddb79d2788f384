"""A builder's log → dynamic parameters of a scenario, through the simulator, with what the log can tell.

Least squares over whole runs, each channel in units of its noise; 95 % intervals widened where the errors
hang together in time; a verdict that refuses what the log does not tell; errors on a part not seen.

`mujoco.sysid` does not serve: its parameters modify an MjSpec while a muscle's stand in `actuator_user`, its
intervals take one noise for all sensors and white errors and refuse nothing, and it needs an extra of ten
packages round the same least squares.
"""

import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common.errors import InputError, SimulationError
from afo_sim.description.reader import load
from afo_sim.fitting.identifiability import Estimate, intervals, refused, verdict
from afo_sim.fitting.law_fit import rms
from afo_sim.fitting.log import Log, read_log, read_noise
from afo_sim.fitting.run_parameter import Parameter, find_parameters
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.simulate import simulate

Progress = Callable[[str], None]
Values = Mapping[str, float]
SEEN = 0.7  # of the log's time, when a part is held out
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


@dataclass(frozen=True)
class Problem:
    """What is fitted to what: a scenario as plain data, its free parameters, the log and its noise [SI]."""

    scenario: dict[str, Any]
    parameters: tuple[Parameter, ...]
    log: Log
    noise: dict[str, float]
    hold_out: float

    @property
    def starts(self) -> dict[str, float]:
        """What each parameter is before the fit [SI]."""
        return {p.name: p.start for p in self.parameters}

    @property
    def seen(self) -> np.ndarray:
        """Which samples the held-out error is fitted on."""
        first, last = self.log.time[[0, -1]]
        return self.log.time <= last - self.hold_out * (last - first)

    def with_values(self, values: Values) -> dict[str, Any]:
        """Dotted keys that give the scenario other values."""
        source = f"fitted to {self.log.file.name}"
        return {k: v for p in self.parameters for k, v in p.sets(values[p.name], source).items()}


@dataclass(frozen=True)
class Errors:
    """RMS errors of one channel [SI]: with the start values and the fitted ones, over the whole log; then
    over the part held out, with the start values and with those fitted to the rest."""

    before: float
    after: float
    before_held_out: float | None = None
    held_out: float | None = None


@dataclass(frozen=True)
class FitRun:
    """Dynamic parameters from a log, and how far they can be believed. SI.

    `interval` is of 95 %, None where it is refused; `verdict` says why. `memory` is the correlation of
    neighbouring errors, by which the intervals are widened; `misfit` the errors' size in units of the noise.
    `forecast` is the fit to the part of the log that was seen when the rest was held out: values and run.
    """

    problem: Problem
    values: dict[str, float]
    interval: dict[str, tuple[float, float] | None]
    correlation: np.ndarray
    verdict: tuple[str, ...]
    before: Recording
    after: Recording
    forecast: tuple[dict[str, float], Recording] | None
    memory: float
    misfit: float
    runs: int
    converged: bool

    @property
    def identifiable(self) -> bool:
        """Whether the log tells every parameter."""
        return not self.verdict

    @property
    def errors(self) -> dict[str, Errors]:
        """Each channel's errors [SI]."""
        problem = self.problem
        first = differences(problem, {}, self.before)
        last = differences(problem, self.values, self.after)
        if self.forecast is None:
            return {title: Errors(rms(first[title]), rms(last[title])) for title in first}
        rest, unseen = ~problem.seen, differences(problem, *self.forecast)
        return {
            title: Errors(
                rms(first[title]), rms(last[title]), rms(first[title][rest]), rms(unseen[title][rest])
            )
            for title in first
        }

    def reason(self, name: str) -> str:
        """Why a parameter's interval is refused; "" where it is not."""
        for line in self.verdict:
            names, _, reason = line.partition(": ")
            if name in names.split(", "):
                others = [other for other in names.split(", ") if other != name]
                return reason.removeprefix("not identifiable: ") + (
                    f" (with {', '.join(others)})" if others else ""
                )
        return ""


def pose(
    source: Any,
    file: pathlib.Path,
    names: Sequence[str] = (),
    *,
    sets: Mapping[str, Any] | None = None,
    noise: Mapping[str, Any] | None = None,
    hold_out: float = 1.0 - SEEN,
) -> Problem:
    """Read a log against a scenario, and find what is to be fitted.

    Parameters
    ----------
    source : the scenario, as `load` takes it
    file : the log
    names : parameters, of `dynamic_parameter.KINDS`
    sets : dotted keys and values laid over the scenario
    noise : by channel, for example {"angle": "0.5 deg"}; estimated from the log by default
    hold_out : share of the log's time, from its end, that is held out once; 0 for none

    Raises
    ------
    InputError
        Scenario, log, noise, share or a name is wrong, or the log has fewer samples than parameters.
    """
    if not 0.0 <= hold_out <= 0.9:
        raise InputError("is out of range", field="--hold-out", value=hold_out, allowed="0 to 0.9")
    scenario = load("scenario", source, sets)
    log = read_log(file, scenario)
    parameters = find_parameters(names, scenario)
    problem = Problem(scenario.resolved(), parameters, log, read_noise(log, dict(noise or {})), hold_out)
    samples = int(problem.seen.sum()) * len(log.channels)
    if samples <= len(names):
        raise InputError(
            f"holds {samples} samples outside its held-out part for {len(names)} parameters",
            file=file,
            allowed="more samples than parameters",
        )
    return problem


def run_at(problem: Problem, values: Values) -> Recording:
    """The run with other values, at every step, as far as the log goes.

    Raises
    ------
    InputError
        The model cannot be built with these values.
    SimulationError
        The run becomes unstable.
    """
    scenario = load("scenario", problem.scenario, problem.with_values(values))
    slack = max([p.kind.upper for p in problem.parameters if not p.keys], default=0.0)
    end = problem.log.time[-1] + slack + scenario.timestep
    scenario = scenario.with_values(
        duration=end if slack else min(end, scenario.duration), record_rate=1.0 / scenario.timestep
    )
    built = build(scenario)
    control = schedule.controls(built)
    rollout = simulate(built, control)
    if rollout.failure is not None:
        raise rollout.failure
    return make_recording(built, rollout)


def differences(problem: Problem, values: Values, recording: Recording) -> dict[str, np.ndarray]:
    """Run less log at the log's times, by channel [SI]."""
    time = problem.log.time - values.get("time_offset", 0.0)
    return {c.title: c.simulated(recording, time) - c.values for c in problem.log.channels}


class _Search:
    """Least squares over runs; counts them, and remembers what a search cannot return."""

    def __init__(self, problem: Problem, report: Progress):
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
        """Whether a further step would explain next to nothing; at a bound there is none to take."""
        away = np.minimum(best.x - self.lower, self.upper - best.x) > AT_BOUND * (self.upper - self.lower)
        if not away.any():
            return True
        jacobian = best.jac[:, away]
        step = np.linalg.lstsq(jacobian, best.fun, rcond=1e-10)[0]
        explained = float(np.sum((jacobian @ step) ** 2))
        return explained <= SETTLED * int(away.sum()) * float(np.mean(best.fun**2))


def fit_run(problem: Problem, report: Progress = lambda text: None) -> FitRun:
    """Fit the parameters to the whole log, and once to its first part to tell the error on the rest.

    Parameters
    ----------
    problem : from `pose`; without parameters the log is only laid over the run
    report : called with each run

    Returns
    -------
    FitRun

    Raises
    ------
    InputError
        The model cannot be built with the start values.
    SimulationError
        The run with the start values becomes unstable.
    """
    before = run_at(problem, problem.starts)
    search = _Search(problem, report)
    every = np.ones(len(problem.log.time), dtype=bool)
    start = np.array([p.search(p.start or p.kind.typical) if p.keys else 0.0 for p in problem.parameters])
    if not len(start):
        return _overlay(problem, before)
    forecast = None
    if problem.hold_out:
        start = search.solve(start, problem.seen).x
        forecast = search.values(start), run_at(problem, search.values(start))
    best = search.solve(start, every)
    values = search.values(best.x)
    after = run_at(problem, values)
    interval, correlation, lines, memory, misfit = _believe(problem, search, best)
    return FitRun(
        problem,
        values,
        interval,
        correlation,
        lines,
        before,
        after,
        forecast,
        memory,
        misfit,
        search.runs,
        search.settled(best),
    )


def _overlay(problem: Problem, run: Recording) -> FitRun:
    """Nothing fitted: the log over the run."""
    found = differences(problem, {}, run)
    scaled = np.concatenate([found[title] / problem.noise[title] for title in found])
    nothing = np.zeros((0, 0))
    return FitRun(
        problem, {}, {}, nothing, (), run, run, None, _memory(problem, scaled), rms(scaled), 1, True
    )


def _memory(problem: Problem, errors: np.ndarray) -> float:
    """Correlation of neighbouring errors over all channels [-]."""
    by_channel = errors.reshape(len(problem.log.channels), -1)
    square = float(np.sum(by_channel**2))
    return float(np.sum(by_channel[:, 1:] * by_channel[:, :-1])) / square if square else 0.0


COUNTED = "independent errors (they hang together in time)"


def _believe(
    problem: Problem, search: _Search, best: Any
) -> tuple[dict[str, tuple[float, float] | None], np.ndarray, tuple[str, ...], float, float]:
    """95 % intervals, correlations, what the log cannot tell, memory and size of the errors.

    Errors that hang together are fewer than they seem: n (1 − ρ)/(1 + ρ) independent ones.
    """
    parameters, n = problem.parameters, len(best.fun)
    memory = _memory(problem, best.fun)
    rho = min(max(memory, 0.0), 0.999)
    independent = n * (1.0 - rho) / (1.0 + rho)
    freedom = max(independent - len(parameters), 1.0)
    jacobian, rough = search.sound_jacobian(best.x, np.ones(len(problem.log.time), dtype=bool))
    half, correlation = intervals(jacobian, float(np.sum(best.fun**2)) / freedom, freedom)
    names, ends, shown, size = [], {}, [], []
    for p, x, h, column in zip(parameters, best.x, half, jacobian.T, strict=True):
        names.append(p.name)
        ends[p.name] = low, high = p.value(x - h), p.value(x + h)
        size.append(1.0 if p.kind.logarithmic else max(abs(x), 1.0))
        text = (
            f"{p.shown(p.value(x)):.3g} {p.kind.shown}, and as well {p.shown(low):.2g} to {p.shown(high):.2g}"
        )
        shown.append(text if column.any() else "it has no effect on what was logged")
    found = Estimate(
        names, best.x, half, np.array(size), search.lower, search.upper, shown, AT_BOUND, COUNTED
    )
    lines = list(verdict(found, correlation, int(independent)))
    jumps = [name for name, jump in zip(names, rough, strict=True) if jump and name not in refused(lines)]
    lines += [f"{name}: not identifiable: the run changes with it by jumps" for name in jumps]
    if not search.settled(best):
        lines.insert(0, f"{', '.join(names)}: the search did not settle")
    kept = {name: None if name in refused(lines) else ends[name] for name in names}
    return kept, correlation, tuple(lines), memory, rms(best.fun)
