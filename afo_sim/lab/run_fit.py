"""Dynamic parameters of a scenario from a builder's log, through the simulator, with what the log identifies.

`mujoco.sysid` does not serve: its parameters modify an MjSpec while a muscle's stand in `actuator_user`, its
intervals take one noise for all sensors and white errors and refuse nothing, and it needs ten packages.
"""

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult

from afo_sim.common import Given, InputError, JsonDict, Notice, Shown, SimulationError, TableLike
from afo_sim.description import Scenario, load
from afo_sim.lab.identifiability import Believed, memory, refused, rms, unidentified
from afo_sim.lab.run_problem import HELD_OUT, RunProblem, differences, pose, run_at, sets_of
from afo_sim.lab.solution import FitParameter, FitProblem, Progress, believed, verdict
from afo_sim.simulation import Recording, kept

MISFIT = 1.15  # times the noise: above it, and above what chance does to so few samples, something is missing
CHANCE = 3.0  # standard deviations
CAUSES = {
    "pressure": "a leak, a valve's conductance or delay, the supply's pressure, a tube's volume, heat",
    **dict.fromkeys(("mass", "mass_flow"), "a leak, a valve's conductance or delay"),
    **dict.fromkeys(("angle", "velocity"), "friction, inertia, a moment arm, the tissue's stiffness"),
    "force": "the muscle's law or friction, a moment arm, the load cell's zero",
    "contraction": "a link's length or stiffness, a moment arm",
    **dict.fromkeys(("coil", "opening"), "the timer's times, a valve's delay"),
}
OTHERWISE = "a part that the scenario does not have"
# Of the finite differences, in searched numbers. A foot that sticks a time step later is a small jump of the
# run: the first bridges it as a rule, the second where the search has not settled.
STEPS = (0.02, 0.08)
LINEAR = 5.0  # times as far where the number is no logarithm, and a run nearly linear in it
CLEAR, LONGEST = 10.0, 5.0  # in units of the noise, how far the last differences go; times that, at most
ROUGH = 0.3  # where they differ by more than this share from shorter ones, a run changes by jumps
SETTLED = 0.1  # share of what noise alone would explain that a further step may still explain
MOST_RUNS = 40  # beside those of the finite differences


@dataclass(frozen=True)
class Errors:
    """RMS errors of one channel [SI], with the start values and with the fitted ones."""

    noise: float  # of the channel, as the log states or shows it
    samples: int  # that were fitted to
    before: float  # with the start values
    after: float  # with the fitted values
    samples_held_out: int = 0  # the following are of the part held out
    before_held_out: float | None = None  # with the start values
    held_out: float | None = None  # with the values fitted to the rest

    @classmethod
    def of(
        cls, noise: float, first: np.ndarray, last: np.ndarray, unseen: np.ndarray | None, rest: np.ndarray
    ) -> "Errors":
        """From differences over the log; the `unseen` are of a fit without the `rest`."""
        parts = () if unseen is None else (int(rest.sum()), rms(first[rest]), rms(unseen[rest]))
        return cls(noise, len(first), rms(first), rms(last), *parts)

    @property
    def chi_squared(self) -> float:
        """Mean square error after the fit, in units of the noise: 1 where nothing but noise is left."""
        return (self.after / self.noise) ** 2

    @property
    def chi_squared_held_out(self) -> float | None:
        """The same over the part held out."""
        return None if self.held_out is None else (self.held_out / self.noise) ** 2


@dataclass(frozen=True, repr=False)
class FitRun(Believed, Shown):
    """Dynamic parameters from a log, and how far they can be believed. SI.

    problem : what was fitted to what
    values : fitted, by parameter [SI]
    interval : of 95 %, by parameter [SI]; None where it is refused
    correlation : of the parameters [-] (n, n)
    verdict : parameters that the log does not identify, and why
    before : run with the start values
    after : run with the fitted values
    forecast : values fitted to the first part of the log, and the run with them; None where none is held out
    memory : correlation of neighbouring errors, by which intervals are widened
    misfit : of the errors, in units of the noise
    runs : simulations that it took
    converged : the search ended by itself
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
        each = [f"{p.name} = {self.value_text(p)} ({self.belief(p)})" for p in self.problem.free]
        fitted = ", ".join(each) or "nothing fitted"
        return f"<FitRun to {self.problem.log.file.name}: {fitted}; errors {self.misfit:.3g} times the noise>"

    def value_text(self, parameter: FitParameter) -> str:
        """A fitted value in the unit for people's eyes."""
        return f"{parameter.number(self.values[parameter.name]):.4g} {parameter.shown}"

    @functools.cached_property
    def errors(self) -> dict[str, Errors]:
        """Each channel's errors [SI]."""
        problem = self.problem
        first, last = differences(problem, {}, self.before), differences(problem, self.values, self.after)
        unseen = {} if self.forecast is None else differences(problem, *self.forecast)
        noise, rest = problem.noise, ~problem.seen
        return {t: Errors.of(noise[t], first[t], last[t], unseen.get(t), rest) for t in first}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Channels that the fitted run does not explain, and the run's own warnings."""
        columns = {channel.title: channel.columns[0] for channel in self.problem.log.channels}
        lacking = tuple(doubts(self.errors, columns)) if self.values else ()
        return (*lacking, *self.after.warnings)

    @property
    def sets(self) -> JsonDict:
        """Dotted keys and values that lay the fitted parameters over the scenario, each with its source."""
        found: JsonDict = {}
        for parameter in self.problem.free:
            source = f"fitted to {self.problem.log.file.name}; {self.belief(parameter)}"
            found |= sets_of(parameter, self.values[parameter.name], source)
        return found

    @property
    def scenario(self) -> Scenario:
        """The scenario with the fitted values, ready to run."""
        fitted: Scenario = load("scenario", self.problem.scenario, self.sets)
        return fitted.with_values(name=f"{fitted.name or 'scenario'}-fitted")

    def belief(self, parameter: FitParameter) -> str:
        """A parameter's interval, or why it has none, in words."""
        ends = self.interval[parameter.name]
        if ends is None:
            return f"no interval: {self.reason(parameter.name)}"
        low, high = map(parameter.number, ends)
        return f"95 % interval {low:.4g} to {high:.4g} {parameter.shown}"


def fit_run(
    scenario: Given, log: TableLike, names: Sequence[str] = (), *, sets: Mapping[str, object] | None = None,
    noise: Mapping[str, object] | None = None, hold_out: float = HELD_OUT,
    report: Progress = lambda text: None,
) -> FitRun:  # fmt: skip
    """Fit parameters of a scenario to a log, as `fit`; a second fit to its first part predicts the rest."""
    problem = pose(scenario, log, names, sets=sets, noise=noise, hold_out=hold_out)
    before, search = run_at(problem, problem.starts), RunSearch(problem, report)
    if not problem.free:  # the log over the run
        missed, none = search.scaled({}, before), np.zeros((0, 0))
        held = (search.alike(missed), rms(missed), 1, True)
        return FitRun(problem, {}, {}, none, (), before, before, None, *held)
    start = np.array([p.coordinate(p.low or p.size) if p.keys else 0.0 for p in problem.free])
    forecast = None
    if problem.hold_out:
        search.mask = problem.seen
        start = search.search(start).x
        forecast = search.values(start), run_at(problem, search.values(start))
        search.mask = np.ones_like(problem.seen)
    solution = believed(search, search.search(start))
    after, lines = run_at(problem, solution.values), verdict(solution)
    for name in (n for n in search.names if n in search.rough - refused(lines)):
        lines.append(unidentified("jumps", [name], "not identifiable: the run changes with it by jumps"))
    lacking = refused(lines)
    ends = {n: None if n in lacking else solution.interval(k) for k, n in enumerate(search.names)}
    held = (solution.memory, rms(solution.residuals), search.runs, solution.settled)
    runs = (tuple(lines), before, after, forecast)
    return FitRun(problem, solution.values, ends, solution.correlation, *runs, *held)


class RunSearch(FitProblem):
    """Least squares over runs; counts them, and remembers what a search cannot return."""

    def __init__(self, problem: RunProblem, report: Progress):
        self.problem, self.report, self.runs, self.step = problem, report, 0, STEPS[0]
        self.free, self.mask = problem.free, np.ones(len(problem.log.time), dtype=bool)
        self.reach = np.array([1.0 if p.logarithmic else LINEAR for p in problem.free])
        self.rough: set[str] = set()

    @property
    def options(self) -> Mapping[str, object]:
        """Of scipy's least_squares."""
        return {"jac": self.slopes, "ftol": 1e-7, "xtol": 1e-6, "gtol": 1e-12, "max_nfev": MOST_RUNS}

    def scaled(self, values: Mapping[str, float], run: Recording) -> np.ndarray:
        """All channels' differences in units of their noise, one after the other."""
        found, noise = differences(self.problem, values, run), self.problem.noise
        return np.concatenate([found[title][self.mask] / noise[title] for title in found])

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Differences in units of the noise; infinite where there is no such run."""
        self.runs += 1
        found = kept(lambda: (self.problem, x, self.mask), lambda: self._run(self.values(x)))
        if np.isfinite(found).all():
            self.report(f"run {self.runs}: {rms(found):.4g} × noise")
        return found

    def _run(self, values: Mapping[str, float]) -> np.ndarray:
        try:
            return self.scaled(values, run_at(self.problem, values))
        except (InputError, SimulationError):  # too fast for the time step, for example
            return np.full(int(self.mask.sum()) * len(self.problem.log.channels), np.inf)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Central differences; one-sided at a bound, and where there is no run on one side."""
        columns, (lower, upper) = [], self.bounds
        for k in range(len(x)):
            ends = []
            for way in (-1.0, 1.0):
                end = x.copy()
                end[k] = np.clip(x[k] + way * self.step * self.reach[k], lower[k], upper[k])
                errors = self.residuals(end)
                if not np.isfinite(errors).all():
                    end, errors = x, self.residuals(x)
                ends.append((end[k], errors))
            (low, below), (high, above) = ends
            columns.append((above - below) / (high - low) if high > low else np.zeros_like(below))
        return np.stack(columns, axis=1)

    def search(self, x: np.ndarray) -> OptimizeResult:
        """Where a search ends that has settled if it could."""
        for self.step in STEPS:
            best = super().search(x)
            if self.settled(best):
                break
            x = best.x
        return best

    def jacobian(self, best: OptimizeResult) -> tuple[np.ndarray, np.ndarray]:
        """With steps that change the run by much more than its jumps do; rough where shorter ones differ."""
        usual, self.step = self.reach, STEPS[1]
        short = self.slopes(best.x)
        wanted = CLEAR / np.maximum(np.linalg.norm(short, axis=0), 1e-9) / self.step
        self.reach = np.clip(wanted, usual, LONGEST * usual)
        long = self.slopes(best.x)
        self.reach = usual
        sizes = np.linalg.norm([short, long], axis=1).max(axis=0)
        jumps = np.linalg.norm(long - short, axis=0) > ROUGH * sizes
        self.rough = {name for name, jump in zip(self.names, jumps, strict=True) if jump}
        return long, np.ones(len(long), dtype=bool)

    def held(self, best: OptimizeResult) -> np.ndarray:
        """None: a run at a bound is still informative on the others."""
        return np.zeros(len(self.free), dtype=bool)

    def alike(self, errors: np.ndarray) -> float:
        """Correlation of neighbouring errors over all channels [-]."""
        by_channel = errors.reshape(len(self.problem.log.channels), -1)
        return memory([by_channel], float(np.sum(by_channel**2)))

    def memory(self, best: OptimizeResult) -> float:
        """Correlation of neighbouring errors [-]."""
        return self.alike(best.fun)

    def settled(self, best: OptimizeResult) -> bool:
        """True where a further step would explain next to nothing; at a bound there is none to take."""
        away = ~super().held(best)
        if not away.any():
            return True
        jacobian = best.jac[:, away]
        step = np.linalg.lstsq(jacobian, best.fun, rcond=1e-10)[0]
        explained = float(np.sum((jacobian @ step) ** 2))
        return explained <= SETTLED * int(away.sum()) * float(np.mean(best.fun**2))


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
            text = "{subject}: its errors are {ratios}; the scenario lacks something ({causes}); "
            text += "the fitted values compensate for it and may be wrong by more than their intervals"
            yield Notice("misfit", text, subject=title, ratios=" and ".join(ratios), causes=causes)


def _limit(samples: int) -> float:
    """Mean square in units of the noise above which it is more than noise."""
    return MISFIT**2 * (1.0 + CHANCE * math.sqrt(2.0 / max(samples, 1)))
