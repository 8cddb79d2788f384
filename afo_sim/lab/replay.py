"""A measured log of a bench replayed in the stand's rig: through its valves, or under its pressure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from afo_sim import native
from afo_sim.common import GRAVITY, InputError, Notice, unknown
from afo_sim.description import Muscle, load
from afo_sim.lab.bench_log import BENCH, BenchLog, read_bench_log
from afo_sim.lab.identifiability import intervals
from afo_sim.lab.stand_plan import Kind, Laboratory, StandPlan, force_at
from afo_sim.lab.stand_rig import Rows, roll
from afo_sim.lab.stand_table import Comparison
from afo_sim.lab.stand_trial import COLUMNS, complete, limits_left
from afo_sim.physics import crossing

STEP = 5e-4  # of a replay [s]: a pulse of 10 ms has twenty
FLOW = ("conductance", "critical_ratio")
FITTED = (*FLOW, *(f"outlet_{name}" for name in FLOW), "tube_volume", "wall_conductance", "supply")
FITTED += ("free_contraction", "blocked_force")
REACH = 1e3  # factor about its start within which a number is searched
CARRIAGE = 1e-3  # what a spring draws beside half the muscle [kg]
QUIET = 5e-3  # of the span of pressure that a quiet sample changes by in 0.1 s
FIT_POINTS = 400  # of a channel that a fit compares
Laid = Mapping[str, Any] | None  # keys and values


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
        found = self.errors.items()
        return [[k, f"{e.rms:.4g} {COLUMNS[k][0]}", f"{100.0 * e.share:.3g}"] for k, e in found]

    @property
    def loops(self) -> dict[str, float]:
        """Width of the loop of force over pressure, measured and predicted [N]; see `loop_width`."""
        if "force" not in self.errors:
            return {}
        time, sides = self.log.time, {"measured": self.log.columns, "predicted": self.predicted}
        return {name: loop_width(time, each["pressure"], each["force"]) for name, each in sides.items()}


def replay(log: Any, muscle: Any = None, *, sets: Laid = None, bench: Laid = None) -> Replay:
    """Replay a log of a bench: through its valves where a supply is stated, else under the measured
    pressure."""
    read = read_bench_log(log).stated(bench or {})
    plan = _plan(read, _muscle(read, muscle, sets))
    whole = complete(plan, 0, roll(plan)[0])
    predicted = {name: np.interp(read.time, whole["time"], each) for name, each in whole.items()}
    given = {"time", "inlet", "outlet", *(["pressure"] if plan.valve is None else [])}
    given |= {"contraction", "length"} if plan.held else set()
    none = np.zeros(len(read.time), int)
    errors = {
        name: Comparison(name, none, read.time, measured, predicted[name], 0)
        for name, measured in read.columns.items()
        if name not in given
    }
    return Replay(read, plan, predicted, errors, tuple(limits_left(plan, (whole,))))


def _muscle(log: BenchLog, muscle: Any, sets: Laid) -> Any:
    """The muscle, with what the log says of it, and with what is laid over that."""
    names = ("total_length", "free_contraction", "blocked_force")
    given = {key: f"{log.bench[key]!r} {BENCH[key]}".strip() for key in names if key in log.bench}
    source = _needed(log, "muscle", "dmsp_10") if muscle is None else muscle
    source = source.model_dump(mode="json") if isinstance(source, Muscle) else source
    return load("muscle", source, given | dict(sets or {}))


def _needed(log: BenchLog, key: str, example: str) -> Any:
    if key not in log.bench:
        allowed = f'a header line "# {key}: {example}"'
        raise InputError("is not stated", file=log.file, field=key, allowed=allowed)
    return log.bench[key]


def shortened(log: BenchLog, muscle: Muscle) -> np.ndarray | None:
    """Contraction over a log [-], by its columns or else as stated; None where neither says it."""
    known = log.bench | log.columns
    kappa = known.get("contraction")
    if "length" in known:
        kappa = (muscle.total_length - known["length"]) / muscle.nominal_length
    return None if kappa is None else np.broadcast_to(kappa, log.time.shape)


def _plan(log: BenchLog, muscle: Muscle) -> ReplayPlan:
    bench, pressure = log.bench, log.columns["pressure"]
    inlet, outlet = _valves(log) if "supply" in bench else (None, None)
    first, top = max(float(pressure[0]), 0.0), bench.get("supply", float(pressure.max()))
    hung, spring = {"load", "spring"} & bench.keys(), bench.get("spring", 0.0)
    weight = GRAVITY * bench.get("load", CARRIAGE) if hung else math.nan

    def excess(kappa: float) -> float:
        return force_at(muscle, kappa, first) - weight - spring * kappa * muscle.nominal_length

    start: Any = crossing(excess, (), -0.5, 0.7, 52) if hung else shortened(log, muscle)
    if start is None:
        _needed(log, "length", "28 cm")
    laboratory = Laboratory(
        **{key: bench[key] for key in ("tube_volume", "wall_conductance") if key in bench}
    )
    ends = np.array([top]), np.array([[first, top]]), np.array([[np.min(start), np.max(start)]])
    step = bench.get("timestep", STEP)
    one = np.array([weight]), np.array([spring]), np.array([first])
    clock = step, math.ceil(log.time[-1] / step) * step, 1
    kind: Kind = "isometric" if inlet is None else "step"
    plan = kind, muscle, laboratory, *ends, *one
    return ReplayPlan(*plan, *clock, valve=inlet, outlet=outlet, log=log)


def _valves(log: BenchLog) -> tuple[native.CircuitValve, native.CircuitValve]:
    """Inlet and outlet: a shipped valve, or one without delays, with the flow that the bench states."""
    bench = log.bench
    if "valve" in bench:
        known = dict(load("valve", bench["valve"]).row)
    else:
        known = {"conductance": _needed(log, "conductance", "0.3 dm^3/(s*bar)"), "critical_ratio": 0.3}
    inlet = known | {name: bench[name] for name in FLOW if name in bench}
    outlet = inlet | {name: bench[f"outlet_{name}"] for name in FLOW if f"outlet_{name}" in bench}
    return native.CircuitValve(**inlet), native.CircuitValve(**outlet)


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


def fit_replay(
    logs: Sequence[Any],
    names: Sequence[str],
    channels: Sequence[str] = (),
    *,
    bench: Laid = None,
    **others: Any,
) -> tuple[dict[str, float], dict[str, float]]:
    """Fit numbers of bench and muscle to logs by least squares, one value for all of them."""
    for name in names:
        if name not in FITTED:
            raise unknown(name, FITTED, field="fit", problem="cannot be fitted to a log of a bench")
    read = [read_bench_log(log).stated(bench or {}) for log in logs]
    start = np.array([float(_needed(read[0], name, "a first estimate")) for name in names])

    def values(x: np.ndarray) -> dict[str, float]:
        return dict(zip(names, (start * np.exp(x - 1.0)).tolist(), strict=True))

    def residuals(x: np.ndarray) -> np.ndarray:
        parts = []
        for one in (replay(log, bench=values(x), **others) for log in read):
            for name in channels or one.errors:
                found = one.errors[name]
                every = max(len(found.x) // FIT_POINTS, 1)
                parts.append(found.error[::every] / max(float(np.abs(found.measured).max()), 1e-12))
        return np.concatenate(parts)

    highest = [0.9 / each if "ratio" in name else REACH for name, each in zip(names, start, strict=True)]
    bounds = 1.0 - math.log(REACH), 1.0 + np.log(highest)
    tolerances = {"diff_step": 0.01, "xtol": 1e-4, "ftol": 1e-5, "max_nfev": 40}
    best = least_squares(residuals, np.ones(len(names)), bounds=bounds, **tolerances)
    square = float(np.sum(best.fun**2))
    memory = min(max(float(np.sum(best.fun[1:] * best.fun[:-1])) / max(square, 1e-300), 0.0), 0.999)
    freedom = max(len(best.fun) * (1.0 - memory) / (1.0 + memory) - len(names), 1.0)
    half, _ = intervals(best.jac, square / freedom, freedom)
    return values(best.x), dict(zip(names, np.exp(np.minimum(half, 99.0)).tolist(), strict=True))
