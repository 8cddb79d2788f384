"""A measured log of a bench replayed in the stand's rig: through its valves, or under its pressure."""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.optimize import OptimizeResult
from scipy.stats import t

from afo_sim import native
from afo_sim.common import GRAVITY, Given, InputError, Mixed, Notice, SimulationError, TableLike, unknown
from afo_sim.description import Muscle, load
from afo_sim.lab.bench_log import BENCH, HOLD, TIMES, VALVE, BenchLog, read_bench_log
from afo_sim.lab.identifiability import Believed, memory, refused
from afo_sim.lab.solution import FitParameter, FitProblem, Solution, believed, verdict
from afo_sim.lab.stand_plan import Kind, Laboratory, StandPlan, force_at
from afo_sim.lab.stand_rig import Rows, roll
from afo_sim.lab.stand_table import Comparison
from afo_sim.lab.stand_trial import COLUMNS, complete, limits_left
from afo_sim.physics import crossing

STEP = 5e-4  # of a replay [s]: a pulse of 10 ms has twenty
FIT_STEP = 2e-3  # of a fit's replays [s]: valves switch within a step
FEWEST = 3  # logs whose errors, log by log, widen intervals
CARRIAGE = 1e-3  # what a spring draws beside half the muscle [kg]
QUIET = 5e-3  # of the span of pressure that a quiet sample changes by in 0.1 s
FIT_POINTS = 4000  # of a channel that a fit compares
# of a fit's slopes: 1 % of a setting, or a fifty-hundredth of its range where that begins at zero
DIFFERENCE = 0.01
# What can be fitted: the physical range that a search keeps to [SI], and the unit for people's eyes.
_DELAY, _FLOW, _RATIO = (0.0, 0.06, "ms"), (1e-10, 1e-7, "dm^3/(s*bar)"), (0.0, 0.6, "")
FITTED: dict[str, tuple[float, float, str]] = {
    **{f"{way}{key}": _DELAY for way in ("", "outlet_") for key in ("lag", *TIMES)},
    **{f"{way}threshold": (0.02, 0.9, "") for way in ("", "outlet_")},
    "outlet_hold_decay": _DELAY,
    "outlet_hold_pressure": (1e5, 1e7, "bar"),
    **{f"{way}conductance": _FLOW for way in ("", "outlet_")},
    **{f"{way}critical_ratio": _RATIO for way in ("", "outlet_")},
    "leak_conductance": (1e-14, 1e-9, "dm^3/(s*bar)"),
    "tube_volume": (1e-7, 2e-4, "ml"),
    "gauge_volume": (1e-7, 1e-4, "ml"),
    "line_bore": (1e-3, 0.012, "mm"),
    "line_length": (0.2, 10.0, "m"),
    "wall_conductance": (1e-3, 5.0, "W/K"),
    "wall_conductance_by_flow": (0.0, 2000.0, "J/(kg*K)"),
    "supply": (5e4, 1.2e6, "bar"),
    "start": (-2.0, 2.0, "ms"),
    "free_contraction": (0.02, 0.4, "%"),
    "blocked_force": (1.0, 1e4, "N"),
    "end_loss": (0.0, 0.06, "mm"),
    "mounting_offset": (-0.02, 0.02, "mm"),
    "mounting_stiffness": (1e4, 1e9, "N/mm"),
    "dead_band": (0.0, 1e5, "bar"),
}
Laid = Mapping[str, object] | None  # keys and values


@dataclass(frozen=True, kw_only=True)
class ReplayPlan(StandPlan):
    """A plan that follows a log; with a valve the second pressure is the supply's."""

    log: BenchLog

    def wave(self, time: np.ndarray) -> np.ndarray:
        """Share of the way from the least to the greatest contraction."""
        (low, high), held = self.contraction[0], shortened(self.log, self.muscle)
        if held is None or high == low:
            return np.zeros_like(time)
        return np.asarray((np.interp(time, self.log.time, held) - low) / (high - low))

    def supply(self, curve: int, time: np.ndarray) -> np.ndarray:
        """The supply's gauge pressure, or of a regulator the measured one [Pa]."""
        if self.valve is not None:
            return np.full(len(time), self.pressure[curve, 1])
        return np.asarray(np.interp(time, self.log.time, self.log.columns["pressure"]))

    def coils(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The log's coils; a regulator is always open."""
        return super().coils(time) if self.valve is None else self.log.coils(time, self.timestep)


@dataclass(frozen=True, eq=False)
class Replay:
    """A log, and what the simulated bench gives at its times."""

    log: BenchLog
    plan: ReplayPlan
    predicted: Rows
    errors: dict[str, Comparison]
    warnings: tuple[Notice, ...]

    @property
    def rows(self) -> list[list[str]]:
        """Of each channel its name, RMS error and that over the largest measurement [%], to print."""
        fed = {k: ", fed" if k in self.log.fed else "" for k in self.errors}
        return [
            [k + fed[k], f"{e.rms:.4g} {COLUMNS[k][0]}", f"{100.0 * e.share:.3g}"]
            for k, e in self.errors.items()
        ]

    @property
    def loops(self) -> dict[str, float]:
        """Width of the loop of force over pressure, measured and predicted [N]; see `loop_width`."""
        if "force" not in self.errors:
            return {}
        time, sides = self.log.time, {"measured": self.log.columns, "predicted": self.predicted}
        return {name: loop_width(time, each["pressure"], each["force"]) for name, each in sides.items()}


def replay(log: TableLike, muscle: Given = None, *, sets: Laid = None, bench: Laid = None) -> Replay:
    """Replay a log through its valves where a supply is stated, else under the measured pressure."""
    read = read_bench_log(log).stated(bench or {})
    plan = _plan(read, muscle_of(read, muscle, sets))
    whole = complete(plan, 0, roll(plan)[0])
    predicted = {name: np.interp(read.time, whole["time"], each) for name, each in whole.items()}
    return Replay(read, plan, predicted, _compared(plan, predicted), tuple(limits_left(plan, (whole,))))


def _compared(plan: ReplayPlan, predicted: Rows) -> dict[str, Comparison]:
    given = {"time", "inlet", "outlet", *(["pressure"] if plan.valve is None else [])}
    given |= {"contraction", "length"} if plan.held else set()
    time, measured = plan.log.time, plan.log.columns.items()
    alike = np.zeros(len(time), int), time
    return {k: Comparison(k, *alike, y, predicted[k], 0) for k, y in measured if k not in given}


def muscle_of(log: BenchLog, muscle: Given = None, sets: Laid = None) -> Muscle:
    """The muscle with the log's facts and further changes."""
    bench = log.bench
    names = ("total_length", "free_contraction", "blocked_force")
    given = {key: f"{bench[key]!r} {BENCH[key]}".strip() for key in names if key in bench}
    if "law" in bench:
        given["law"] = bench["law"]
    if "dead_band" in bench:
        band = f"{bench['dead_band']!r} Pa"
        given |= {"friction": "maxwell_slip", "frictions.maxwell_slip.dead_band": band}
    source = _needed(log, "muscle", "dmsp_10") if muscle is None else muscle
    source = source.model_dump(mode="json") if isinstance(source, Muscle) else source
    found: Muscle = load("muscle", source, given | dict(sets or {}))
    left = 1.0 - bench.get("end_loss", 0.0) / found.piece.nominal_length  # the bench's muscle has no end
    return found.with_values(force_factor=left * found.force_factor)


def _needed(log: BenchLog, key: str, example: str) -> Mixed:
    if key not in log.bench:
        allowed = f'a header line "# {key}: {example}"'
        raise InputError("is not stated", file=log.file, field=key, allowed=allowed)
    return log.bench[key]


def shortened(log: BenchLog, muscle: Muscle) -> np.ndarray | None:
    """Contraction over a log [-], from its columns or as stated; None if neither has it."""
    known = log.bench | log.columns
    kappa = known.get("contraction")
    if "length" in known:
        shorter = muscle.total_length - known["length"] - log.bench.get("mounting_offset", 0.0)
        kappa = shorter / muscle.nominal_length
    return None if kappa is None else np.broadcast_to(kappa, log.time.shape)


def _plan(log: BenchLog, muscle: Muscle) -> ReplayPlan:
    bench, pressure = log.bench, log.columns["pressure"]
    inlet, outlet = _valves(log) if "supply" in bench else (None, None)
    if inlet and not ({"inlet", "outlet"} & log.columns.keys() or "period" in bench):
        allowed = "a column inlet or outlet, or a period; without a supply the measured pressure drives it"
        raise InputError("no valve is commanded to open", file=log.file, field="supply", allowed=allowed)
    first, top = log.first_pressure, bench.get("supply", float(pressure.max()))
    hung, spring = {"load", "spring"} & bench.keys(), bench.get("spring", 0.0)
    weight = GRAVITY * bench.get("load", CARRIAGE) if hung else math.nan

    def excess(kappa: float) -> float:
        return force_at(muscle, kappa, first) - weight - spring * kappa * muscle.nominal_length

    start: Mixed = crossing(excess, (), -0.5, 0.7, 52) if hung else shortened(log, muscle)
    if start is None:
        _needed(log, "length", "28 cm")
    surroundings = {each.name for each in fields(Laboratory)} - {"supply", "valve", "timestep"}
    laboratory = Laboratory(**{key: bench[key] for key in surroundings & bench.keys()})
    ends = np.array([top]), np.array([[first, top]]), np.array([[np.min(start), np.max(start)]])
    step = bench.get("timestep", STEP)
    one = np.array([weight]), np.array([spring]), np.array([first])
    clock = step, math.ceil(log.time[-1] / step) * step, 1
    kind: Kind = "isometric" if inlet is None else "step"
    plan = kind, muscle, laboratory, *ends, *one
    return ReplayPlan(*plan, *clock, valve=inlet, outlet=outlet, log=log)


def _valves(log: BenchLog) -> tuple[native.CircuitValve, native.CircuitValve]:
    """Inlet and outlet: a shipped valve, or one with the flow and the delays that the bench states."""
    bench = log.bench
    if "valve" in bench:
        valve = load("valve", bench["valve"])
        if valve.three_way:
            problem, allowed = "is a 3/2 valve", "a 2/2 valve, or conductances of inlet and outlet"
            raise InputError(problem, file=log.file, field="valve", value=bench["valve"], allowed=allowed)
        known = dict(valve.row)
    else:
        known = {"conductance": _needed(log, "conductance", "0.3 dm^3/(s*bar)"), "critical_ratio": 0.3}
    inlet = known | {name: bench[name] for name in VALVE if name in bench}
    own = {name: bench[f"outlet_{name}"] for name in (*VALVE, *HOLD) if f"outlet_{name}" in bench}
    return native.CircuitValve(**inlet), native.CircuitValve(**(inlet | own))


def loop_width(time: np.ndarray, pressure: np.ndarray, force: np.ndarray) -> float:
    """Median force while pressure falls less that while it rises, over the middle half of its span [N]."""
    top, low, span = int(np.argmax(pressure)), pressure.min(), np.ptp(pressure)
    rate = np.abs(np.interp(time + 0.05, time, pressure) - np.interp(time - 0.05, time, pressure))
    ways = []
    for way in (slice(0, top + 1), slice(top, None)):
        p, f, quiet = pressure[way], force[way], rate[way] <= max(np.median(rate[way]), QUIET * span)
        order = np.argsort(p[quiet], kind="stable")
        ways.append((p[quiet][order], f[quiet][order]))
    (up, rising), (down, falling) = ways
    inside = (np.abs(down - low - 0.5 * span) < 0.25 * span) & (down >= up[0]) & (down <= up[-1])
    gaps = falling[inside] - np.interp(down[inside], up, rising)
    return float(np.median(gaps)) if len(gaps) else math.nan


def greatest(logs: Sequence[BenchLog]) -> dict[tuple[Mixed, str], float]:
    """Greatest measured value by muscle and channel, by which errors are divided."""
    found: dict[tuple[Mixed, str], float] = {}
    for log in logs:
        for name, values in log.columns.items():
            key = log.muscle_key, name
            found[key] = max(found.get(key, 1e-12), float(np.abs(values).max()))
    return found


@dataclass(frozen=True, eq=False)
class ReplayProblem(FitProblem):
    """Settings of bench and muscle, one value for all logs, and the channels that they are fitted to."""

    logs: tuple[BenchLog, ...]
    free: tuple[FitParameter, ...]
    starts: Mapping[str, float]
    channels: tuple[str, ...] = ()
    sets: Laid = None
    inside = 0.01  # a search that begins at a bound hardly leaves it

    @property
    def options(self) -> Mapping[str, object]:
        """Of scipy's least_squares."""
        return {"jac": self.slopes, "xtol": 1e-4, "ftol": 1e-4, "max_nfev": 30}

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        """Errors over the largest measurement of that muscle, log by log."""
        sizes = greatest(self.logs)

        def of(log: BenchLog) -> Iterator[np.ndarray]:
            read = log.stated(self.values(x))
            plan = _plan(read, muscle_of(read, sets=self.sets))
            rows = roll(plan)[0]
            rows["length"] = plan.muscle.nominal_length * (1.0 - rows["contraction"])
            found = _compared(plan, {key: np.interp(read.time, rows["time"], y) for key, y in rows.items()})
            for name in self.channels or found:
                one, every = found[name], max(len(read.time) // FIT_POINTS, 1)
                yield one.error[::every] / sizes[log.muscle_key, name]

        with ThreadPoolExecutor(2) as threads:
            return list(threads.map(lambda log: np.concatenate([*of(log)]), self.logs))

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """All errors, log after log; infinite where the bench cannot be stepped with these settings."""
        try:
            return np.concatenate(self.errors(x))
        except (InputError, SimulationError):
            if np.array_equal(x, self.at(self.starts)):
                raise
            return np.full(len(self.residuals(self.at(self.starts))), np.inf)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Differences over `DIFFERENCE`, away from the nearer bound, or else the other way."""
        here, (lower, upper), columns = self.residuals(x), self.bounds, []
        for step in np.diag(np.where(x - lower < upper - x, DIFFERENCE, -DIFFERENCE)):
            ways = ((self.residuals(x + way) - here) / way.sum() for way in (step, -step))
            columns.append(next((each for each in ways if np.isfinite(each).all()), np.zeros_like(here)))
        return np.column_stack(columns)

    def memory(self, best: OptimizeResult) -> float:
        """Correlation of neighbouring errors [-]."""
        return memory(self.errors(best.x), float(np.sum(best.fun**2)))


@dataclass(frozen=True, eq=False)
class ReplayFit(Believed):
    """Settings that were fitted to logs [SI], with reasons for those that a log does not determine."""

    solution: Solution
    verdict: tuple[Notice, ...]

    @property
    def values(self) -> dict[str, float]:
        """Of the settings [SI]."""
        return self.solution.values

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """95 % intervals [SI]; None where they are refused."""
        lacking, names = refused(self.verdict), self.solution.problem.names
        return {n: None if n in lacking else self.solution.interval(k) for k, n in enumerate(names)}

    @property
    def lines(self) -> list[str]:
        """Each setting with its interval or the reason for none, to print."""
        found = []
        for p in self.solution.problem.free:
            ends, value = self.intervals[p.name], p.text(self.values[p.name])
            told = f"95 % {p.text(ends[0])} to {p.text(ends[1])}" if ends else self.reason(p.name)
            found.append(f"{p.name} = {value} ({told})")
        return found


def fit_replay(
    logs: Sequence[TableLike], names: Sequence[str], channels: Sequence[str] = (), *, bench: Laid = None,
    sets: Laid = None,
) -> ReplayFit:  # fmt: skip
    """Fit settings of bench and muscle to logs, one value for all, within each setting's physical range."""
    for name in names:
        if name not in FITTED:
            raise unknown(name, FITTED, field="free", problem="cannot be fitted to a log of a bench")
    if not (names and logs):
        raise InputError("needs a log and a setting", field="free", allowed=", ".join(FITTED))
    read = [read_bench_log(log).stated(bench or {}) for log in logs]
    read = [log if "timestep" in log.bench else log.stated({"timestep": FIT_STEP}) for log in read]
    predicted = replay(read[0], sets=sets).errors
    for channel in [*channels, *([] if predicted else ["pressure"])]:
        if channel not in predicted:
            told = "is not predicted of this log"
            raise unknown(channel, predicted, file=read[0].file, field="channels", problem=told)
    free, start = [], {}
    for name in names:
        low, high, shown = FITTED[name]
        logarithmic = low > 0.0
        middle = math.sqrt(low * high) if logarithmic else 0.0
        inlets: float = read[0].bench.get(name.removeprefix("outlet_"), middle)
        start[name] = min(max(float(read[0].bench.get(name, inlets)), low), high)
        size = start[name] if logarithmic else 0.02 * (high - low)
        ends = (low, high, low, high)
        free.append(FitParameter(name, BENCH[name] or "", shown, *ends, size, logarithmic=logarithmic))
    problem = ReplayProblem(tuple(read), tuple(free), start, tuple(channels), sets)
    solution = believed(problem, problem.search(problem.at(start)))
    until = np.cumsum([len(each) for each in problem.errors(solution.x)])
    solution = replace(solution, half=np.maximum(solution.half, _half_by_log(solution, until)))
    return ReplayFit(solution, tuple(verdict(solution)))


def _half_by_log(solution: Solution, ends: np.ndarray) -> np.ndarray:
    """Half the 95 % intervals where errors hang together in a log: Liang & Zeger 1986, Biometrika 73:13."""
    jacobian, half, logs = solution.jacobian[:, solution.inner], np.zeros(len(solution.x)), len(ends)
    if logs < FEWEST:
        return half
    rows = zip(np.split(jacobian, ends[:-1]), np.split(solution.residuals, ends[:-1]), strict=True)
    scores = np.array([slopes.T @ errors for slopes, errors in rows])
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    square = np.diag(bread @ scores.T @ scores @ bread) * logs / (logs - 1)
    half[solution.inner] = t.ppf(0.975, logs - 1) * np.sqrt(square)
    return half
