"""Dynamic parameters of a scenario from a builder's log, through the simulator, with what the log identifies.

Least squares over whole runs, each channel in units of its noise; 95 % intervals widened where the errors
hang together in time; a verdict that refuses what the log does not identify; errors on a part not seen; each
channel judged by itself.

`mujoco.sysid` does not serve: its parameters modify an MjSpec while a muscle's stand in `actuator_user`, its
intervals take one noise for all sensors and white errors and refuse nothing, and it needs an extra of ten
packages round the same least squares.
"""

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common import InputError, Notice, Shown, SimulationError
from afo_sim.description import Scenario, load
from afo_sim.lab.identifiability import Estimate, intervals, refusal_of, refused, rms, unidentified, verdict
from afo_sim.lab.run_problem import HELD_OUT, RunParameter, RunProblem, differences, pose, run_at
from afo_sim.simulation import Recording

Progress = Callable[[str], None]
MISFIT = 1.15  # times the noise: above it, and above what chance does to so few samples, something is missing
CHANCE = 3.0  # standard deviations
CAUSES = {
    "pressure": "a leak, a valve's conductance or delay, the supply's pressure, a tube's volume, heat",
    "mass": "a leak, a valve's conductance or delay",
    "mass_flow": "a leak, a valve's conductance or delay",
    "angle": "friction, inertia, a moment arm, the tissue's stiffness",
    "velocity": "friction, inertia, a moment arm, the tissue's stiffness",
    "force": "the muscle's law or friction, a moment arm, the load cell's zero",
    "contraction": "a link's length or stiffness, a moment arm",
    "coil": "the timer's times, a valve's delay",
    "opening": "the timer's times, a valve's delay",
}
OTHERWISE = "a part that the scenario does not have"
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
COUNTED = "independent errors (they hang together in time)"
Differences = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Errors:
    """RMS errors of one channel [SI]: over the whole log, with the start values and with the fitted ones;
    over the part held out, with the start values and with those fitted to the rest.
    """

    noise: float
    samples: int
    before: float
    after: float
    samples_held_out: int = 0
    before_held_out: float | None = None
    held_out: float | None = None

    @property
    def chi_squared(self) -> float:
        """Mean square error after the fit, in units of the noise: 1 where nothing but noise is left."""
        return (self.after / self.noise) ** 2

    @property
    def chi_squared_held_out(self) -> float | None:
        """The same over the part held out."""
        return None if self.held_out is None else (self.held_out / self.noise) ** 2


@dataclass(frozen=True, repr=False)
class FitRun(Shown):
    """Dynamic parameters from a log, and how far they can be believed. SI.

    `interval` is of 95 %, None where it is refused; `verdict` says why. `memory` is the correlation of
    neighbouring errors, by which the intervals are widened; `misfit` the errors' size in units of the noise.
    `forecast` is the fit to the part of the log that was seen when the rest was held out: values and run.
    """

    problem: RunProblem
    values: dict[str, float]
    interval: dict[str, tuple[float, float] | None]
    correlation: np.ndarray
    verdict: tuple[Notice, ...]
    before: Recording
    after: Recording
    forecast: tuple[dict[str, float], Recording] | None
    memory: float
    misfit: float
    runs: int
    converged: bool

    def __repr__(self) -> str:
        """One line: the fitted values with their intervals, and the errors."""
        each = [f"{p.name} = {self._value_text(p)}" for p in self.problem.parameters]
        fitted = ", ".join(each) or "nothing fitted"
        return f"<FitRun to {self.problem.log.file.name}: {fitted}; errors {self.misfit:.3g} times the noise>"

    def _value_text(self, parameter: RunParameter) -> str:
        value = f"{parameter.shown(self.values[parameter.name]):.4g} {parameter.kind.shown}"
        return f"{value} ({self.belief(parameter)})"

    @property
    def identifiable(self) -> bool:
        """True where the log identifies every parameter."""
        return not self.verdict

    @functools.cached_property
    def errors(self) -> dict[str, Errors]:
        """Each channel's errors [SI]."""
        problem = self.problem
        unseen = None if self.forecast is None else differences(problem, *self.forecast)
        first = differences(problem, {}, self.before)
        last = differences(problem, self.values, self.after)
        return channel_errors(problem.noise, first, last, unseen, ~problem.seen)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Channels that the fitted run does not explain, and the run's own warnings."""
        columns = {channel.title: channel.columns[0] for channel in self.problem.log.channels}
        lacking = tuple(doubts(self.errors, columns)) if self.values else ()
        return (*lacking, *self.after.warnings)

    @property
    def sets(self) -> dict[str, Any]:
        """Dotted keys and values that lay the fitted parameters over the scenario, each with its source."""
        found: dict[str, Any] = {}
        for parameter in self.problem.parameters:
            source = f"fitted to {self.problem.log.file.name}; {self.belief(parameter)}"
            found |= parameter.sets(self.values[parameter.name], source)
        return found

    @property
    def scenario(self) -> Scenario:
        """The scenario with the fitted values, ready to run."""
        fitted: Scenario = load("scenario", self.problem.scenario, self.sets)
        return fitted.with_values(name=f"{fitted.name or 'scenario'}-fitted")

    def belief(self, parameter: RunParameter) -> str:
        """A parameter's interval, or why it has none, in words."""
        ends = self.interval[parameter.name]
        if ends is None:
            return f"no interval: {self.reason(parameter.name)}"
        low, high = map(parameter.shown, ends)
        return f"95 % interval {low:.4g} to {high:.4g} {parameter.kind.shown}"

    def reason(self, name: str) -> str:
        """The reason why a parameter's interval is refused; "" where it is not."""
        notice = refusal_of(self.verdict, name)
        if notice is None:
            return ""
        others = ", ".join(other for other in notice.data["names"] if other != name)
        reason: str = notice.data["reason"].removeprefix("not identifiable: ")
        return f"{reason} (with {others})" if others else reason


def fit_run(
    scenario: Any,
    log: Any,
    names: Sequence[str] = (),
    *,
    sets: Mapping[str, Any] | None = None,
    noise: Mapping[str, Any] | None = None,
    hold_out: float = HELD_OUT,
    report: Progress = lambda text: None,
) -> FitRun:
    """Fit dynamic parameters of a scenario to a log; a second fit to its first part predicts the rest.

    Parameters
    ----------
    scenario : a shipped name, a path, or a description
    log : path to a CSV, {title with unit: array}, or a pandas DataFrame of such titles
    names : parameters, of `run_parameter.KINDS`; without any the log is only laid over the run
    sets : dotted keys and values laid over the scenario
    noise : by channel, for example {"angle": "0.5 deg"}; estimated from the log by default
    hold_out : share of the log's time, from its end, that is held out once; 0 for none
    report : called with each run

    Returns
    -------
    FitRun

    Raises
    ------
    InputError
        Scenario, log, noise, share or a name is wrong, or the model cannot be built with the start values.
    SimulationError
        The run with the start values becomes unstable.

    Examples
    --------
    >>> bench = run("seated", {"duration": "1.5 s", "leg.friction": "0.3 N*m"})
    >>> log = {"time [s]": bench["time"][::20], "angle [rad]": bench["ankle/angle"][::20]}
    >>> found = fit_run("seated", log, ["friction"], noise={"angle": "0.1 deg"}, hold_out=0.0)
    >>> round(found.values["friction"], 2)  # [N·m]
    0.3
    """
    return _solve(pose(scenario, log, names, sets=sets, noise=noise, hold_out=hold_out), report)


def _solve(problem: RunProblem, report: Progress = lambda text: None) -> FitRun:
    """The fit of a posed problem, see `fit_run`."""
    before = run_at(problem, problem.starts)
    search = RunSearch(problem, report)
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


def _overlay(problem: RunProblem, run: Recording) -> FitRun:
    """Nothing fitted: the log over the run."""
    found = differences(problem, {}, run)
    scaled = np.concatenate([found[title] / problem.noise[title] for title in found])
    nothing = np.zeros((0, 0))
    return FitRun(
        problem, {}, {}, nothing, (), run, run, None, _memory(problem, scaled), rms(scaled), 1, True
    )


def _memory(problem: RunProblem, errors: np.ndarray) -> float:
    """Correlation of neighbouring errors over all channels [-]."""
    by_channel = errors.reshape(len(problem.log.channels), -1)
    square = float(np.sum(by_channel**2))
    return float(np.sum(by_channel[:, 1:] * by_channel[:, :-1])) / square if square else 0.0


def _believe(
    problem: RunProblem, search: "RunSearch", best: Any
) -> tuple[dict[str, tuple[float, float] | None], np.ndarray, tuple[Notice, ...], float, float]:
    """95 % intervals, correlations, what the log cannot identify, memory and size of the errors."""
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
    lines += [
        unidentified("jumps", [name], "not identifiable: the run changes with it by jumps") for name in jumps
    ]
    if not search.settled(best):
        lines.insert(0, unidentified("unsettled", names, "the search did not settle"))
    kept = {name: None if name in refused(lines) else ends[name] for name in names}
    return kept, correlation, tuple(lines), memory, rms(best.fun)


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


def channel_errors(
    noise: Mapping[str, float],
    first: Differences,
    last: Differences,
    unseen: Differences | None,
    rest: np.ndarray,
) -> dict[str, Errors]:
    """Each channel's errors."""
    found = {}
    for title in first:
        whole = (noise[title], len(first[title]), rms(first[title]), rms(last[title]))
        if unseen is None:
            found[title] = Errors(*whole)
        else:
            parts = rms(first[title][rest]), rms(unseen[title][rest])
            found[title] = Errors(*whole, int(rest.sum()), *parts)
    return found


def doubts(errors: Mapping[str, Errors], columns: Mapping[str, str]) -> Iterator[Notice]:
    """A notice on each channel whose errors are more than noise, in the log or where it was held out."""
    for title, found in errors.items():
        ratios = []
        if found.chi_squared > _limit(found.samples):
            ratios.append(f"{math.sqrt(found.chi_squared):.2g} times its noise after the fit")
        held_out = found.chi_squared_held_out
        if held_out is not None and held_out > _limit(found.samples_held_out):
            ratios.append(f"{math.sqrt(held_out):.2g} times where it was held out")
        if ratios:
            causes = CAUSES.get(columns[title].rpartition("/")[2].partition("_in")[0], OTHERWISE)
            text = (
                "{subject}: its errors are {ratios}; the scenario lacks something: {causes}; "
                "the fitted values make up for it and may be wrong by more than their intervals"
            )
            yield Notice("misfit", text, subject=title, ratios=" and ".join(ratios), causes=causes)


def _limit(samples: int) -> float:
    """Mean square in units of the noise above which it is more than noise."""
    return MISFIT**2 * (1.0 + CHANCE * math.sqrt(2.0 / max(samples, 1)))
