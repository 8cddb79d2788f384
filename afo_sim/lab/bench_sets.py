"""Recordings of benches compared with predictions. The rules, written before any result:

error     RMS of prediction less measurement over the greatest value measured on that muscle [%]
halves    settings are fitted to the logs that are shown; the others, or each log's second half, are held out
fed       an input that derives from the predicted channel: its error is shown, and is no prediction's
verdict   agrees where the error held out is within its limit and not above the simpler model's, else
          disagrees; or fed
simpler   the same halves by a model without physics: a time constant for each valve, force linear in pressure
          and contraction

A folder of logs is described by its `bench.toml`; of recordings that are known here the package has one.
"""

import fnmatch
import functools
import itertools
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import BaseModel
from pydantic import Field as Option
from scipy.optimize import least_squares
from scipy.stats import t

from afo_sim.common import InputError, assets, unknown
from afo_sim.lab.arm_joint import joints
from afo_sim.lab.bench_log import BenchLog, read_bench_log
from afo_sim.lab.identifiability import rms
from afo_sim.lab.ledger import LEVELS, VERDICTS, LedgerRow, read_checked
from afo_sim.lab.replay import fit_replay, greatest, muscle_of, replay, shortened

SECOND, LATER = "every second log", "second half of each log"  # that are held out; or a pattern of names
HEADER = ("bench", "predicted", "as given", "shown", "held out", "simpler", "limit", "verdict")
EXAMPLE = '[[predict]] with what = "pulses", fit = ["conductance"], limits = { pressure = 3 }'
Part = tuple[BenchLog, np.ndarray]  # a log, and its rows that are judged
Predict = Callable[[BenchLog], Mapping[str, np.ndarray]]


class Prediction(BaseModel, frozen=True, extra="forbid"):
    """What is predicted of some logs: settings given, settings fitted, errors that are allowed [%]."""

    what: str
    logs: str = "*.csv"
    held_out: str = SECOND
    given: dict[str, str] = {}
    fit: tuple[str, ...] = ()
    fit_to: tuple[str, ...] = ()
    limits: dict[str, Annotated[float, Option(gt=0.0, allow_inf_nan=False)]] = Option(min_length=1)


class Bench(BaseModel, frozen=True, extra="forbid"):
    """A folder of logs: where they come from, and what is predicted of them."""

    description: str = ""
    source: str = ""
    predict: tuple[Prediction, ...] = Option(min_length=1)


@dataclass(frozen=True)
class BenchRow:
    """Errors of one channel [%]."""

    bench: str
    what: str
    channel: str
    limit: float
    as_given: float  # of the half held out with the given settings
    shown: float
    held_out: tuple[float, float, float]  # best, of all, and worst log
    simpler: float  # of the half held out by the simpler model
    fed: bool
    fitted: tuple[str, ...]
    logs: dict[str, dict[str, float]]  # of each log by its half
    source: str = ""
    unit: str = "%"

    @property
    def verdict(self) -> str:
        """One of VERDICTS, or fed, by the module's rule."""
        found = self.held_out[1]
        return "fed" if self.fed else VERDICTS[int(not found <= self.limit or found > self.simpler)]

    @property
    def lines(self) -> Iterator[str]:
        """Which log belongs to which half, and what was fitted, to print."""
        for half, errors in self.logs.items():
            yield f"{self.bench}, {self.what}: {half}: {', '.join(errors)}"
        yield from (f"{self.bench}, {self.what}: {line}" for line in self.fitted)

    @property
    def cells(self) -> list[str]:
        """Its cells under HEADER."""
        low, middle, high = self.held_out
        span = f" ({low:.2g} to {high:.2g})" if low < high else ""
        numbers = f"{self.as_given:.3g}", f"{self.shown:.3g}", f"{middle:.3g}{span}"
        ends = f"{self.simpler:.3g}", f"{self.limit:g}", self.verdict
        return [self.bench, f"{self.what} {self.channel} [{self.unit}]", *numbers, *ends]


def bench(data: pathlib.Path, report: Callable[[int, int], None] | None = None) -> Iterator[BenchRow]:
    """Rows of each folder of logs in `data`, or of itself; InputError where it has none."""
    folders = [each for each in (data, *sorted(data.glob("*/"))) if any(each.glob("*.csv"))]
    if not folders:
        raise InputError("has no logs", field="--data", value=str(data), allowed="folders of CSV files")
    known = [(folder, one) for folder in folders for one in read_bench(folder).predict]
    for done, (folder, one) in enumerate(known):
        if report is not None:
            report(done, len(known))
        yield from _rows(folder, one)


def absent() -> str:
    """Which recordings are known, where none are given."""
    files = sorted((assets.folder("models") / "benches").glob("*.toml"))
    known = [f"{file.stem}: {assets.read_toml(file)['source']}" for file in files]
    return "\n".join(["give --data FOLDER of logs; known here:", *known])


def read_bench(folder: pathlib.Path) -> Bench:
    """The description of a folder of logs: its own, or the package's."""
    own, shipped = folder / "bench.toml", assets.folder("models") / "benches" / f"{folder.name}.toml"
    file = own if own.is_file() else shipped
    if not file.is_file():
        raise InputError("has no description", file=own, allowed=f"{EXAMPLE}; see docs/stand.md")
    return read_checked(Bench, file, Prediction)


def _rows(folder: pathlib.Path, one: Prediction) -> Iterator[BenchRow]:
    if not one.logs or one.logs.startswith("/") or not (files := sorted(folder.glob(one.logs))):
        raise InputError("finds no log", file=folder, field="logs", value=one.logs, allowed="*.csv")
    logs = [read_bench_log(file) for file in files]
    if "angle" in one.limits:
        yield from _joints(folder, one, logs)
        return
    for log, channel in itertools.product(logs, one.limits):
        known = log.columns.keys() - (set() if "supply" in log.stated(one.given).bench else {"pressure"})
        if channel not in known - {"time", "inlet", "outlet"}:
            problem = "is not measured in this log, or drives it"
            raise unknown(channel, known, file=log.file, field="limits", problem=problem)
    sizes, fitted, errors = greatest(logs), list[str](), dict[tuple[str, ...], float]()
    for halves in _halves(logs, one.held_out):
        seen = []
        for log, rows in halves["shown"]:
            seen.append(replace(log, columns={key: each[rows] for key, each in log.columns.items()}))
        values: dict[str, float] = {}
        if one.fit:
            fit = fit_replay(seen, one.fit, one.fit_to or [*one.limits][:1], bench=one.given)
            values, fitted = fit.values, [*fitted, *fit.lines]
        predictors: dict[str, Predict] = {
            "as given": functools.partial(_replayed, bench=one.given),
            "fitted": functools.partial(_replayed, bench={**one.given, **values}),
            "simpler": simple_model(seen, one.given),
        }
        for half, parts in halves.items():
            for (log, rows), (kind, predict) in itertools.product(parts, predictors.items()):
                predicted = predict(log)
                for channel in one.limits:
                    missed = predicted.get(channel, np.nan) - log.columns[channel]
                    share = 100.0 * rms(missed[rows]) / sizes[log.muscle_key, channel]
                    errors[channel, half, kind, str(log.file.relative_to(folder).with_suffix(""))] = share
    for channel, limit in one.limits.items():

        def of(half: str, kind: str, channel: str = channel) -> dict[str, float]:
            return {key[3]: x for key, x in errors.items() if key[:3] == (channel, half, kind)}

        kinds = ("held out", "as given"), ("shown", "fitted"), ("held out", "fitted"), ("held out", "simpler")
        as_given, shown, held, simpler = (np.array([*of(*kind).values()]) for kind in kinds)
        low, high, source = float(held.min()), float(held.max()), logs[0].bench.get("source", "")
        found = rms(as_given), rms(shown), (low, rms(held), high), rms(simpler)
        fed = any(channel in log.fed for log in logs)
        each = {half: of(half, "fitted") for half in ("shown", "held out")}
        yield BenchRow(folder.name, one.what, channel, limit, *found, fed, tuple(fitted), each, source)


def _joints(folder: pathlib.Path, one: Prediction, logs: Sequence[BenchLog]) -> Iterator[BenchRow]:
    """Of each joint; what is given is that the angle stays, the simpler model is linear."""
    if one.fit or one.given or len(one.limits) > 1:
        raise InputError("goes without fit, given and other limits", file=folder, field="angle")
    for joint in joints(logs):
        stem, held, source = joint.log.file.stem, (joint.held,) * 3, joint.log.bench.get("source", "")
        told = "as given: the angle stays; simpler: a linear model of start and pressures every 0.1 s"
        errors = one.limits["angle"], joint.stays, joint.fitted, held, joint.linear
        halves = {"every second episode": {stem: joint.fitted}, "the others": {stem: joint.held}}
        rest = "angle" in joint.log.fed, (told, joint.text), halves, source, "% of its spread"
        yield BenchRow(folder.name, f"{one.what} {stem}", "angle", *errors, *rest)


def _replayed(log: BenchLog, bench: Mapping[str, object]) -> Mapping[str, np.ndarray]:
    return replay(log, bench=bench).predicted


def _halves(logs: list[BenchLog], held_out: str) -> Iterator[dict[str, list[Part]]]:
    """Logs that are shown and held out, with the rows that count; each log's halves one after the other."""
    if held_out == LATER:
        for log in logs:
            early = np.arange(len(log.time)) < len(log.time) // 2
            yield {"shown": [(log, early)], "held out": [(log, ~early)]}
        return
    halves: dict[str, list[Part]] = {"shown": [], "held out": []}
    for k, log in enumerate(logs):
        out = k % 2 == 1 if held_out == SECOND else fnmatch.fnmatch(log.file.name, held_out)
        halves["held out" if out else "shown"].append((log, np.ones(len(log.time), bool)))
    if not all(halves.values()):
        names = ", ".join(log.file.name for log in logs)
        allowed = f"{SECOND}, {LATER}, or a pattern that leaves some of {names}"
        raise InputError("leaves no half", field="held_out", value=held_out, allowed=allowed)
    yield halves


def simple_model(seen: Sequence[BenchLog], given: Mapping[str, str]) -> Predict:
    """Time constants of valves and leak, force linear in pressure and contraction; no physics."""
    step = 2e-3

    def pressure(log: BenchLog, x: np.ndarray) -> np.ndarray:
        log = log.stated(given)
        if "supply" not in log.bench:
            return log.columns["pressure"]
        time = np.arange(0.0, max(log.time[-1], step) + step, step)
        inlet, outlet = (step * coil for coil in log.coils(time[:-1], step))
        found = [log.first_pressure]
        filled, kept = 1.0 - np.exp(-inlet * x[1]), np.exp(-outlet * x[2] - step * x[3])
        for share, left in zip(filled, kept, strict=True):
            found.append(left * (found[-1] + share * (x[0] - found[-1])))
        return np.interp(log.time, time, found)

    def terms(log: BenchLog, gauge: np.ndarray) -> np.ndarray:
        read = log.stated(given)
        held = shortened(read, muscle_of(read))
        free = np.zeros_like(gauge) if held is None else held
        return np.column_stack([np.ones_like(gauge), gauge, free, gauge * free])

    top = max(1.0, *(float(log.columns["pressure"].max()) for log in seen))
    start = np.array([top, 1.0, 1.0, 1e-2])
    if any("supply" in log.stated(given).bench for log in seen):

        def missed(x: np.ndarray) -> np.ndarray:
            return np.concatenate([(pressure(log, x) - log.columns["pressure"])[::10] / top for log in seen])

        start = least_squares(missed, start, x_scale=start, bounds=(0.0, np.inf)).x
    slopes = np.zeros(4)
    if forces := [log for log in seen if "force" in log.columns]:
        rows = np.concatenate([terms(log, log.columns["pressure"]) for log in forces])
        measured = np.concatenate([log.columns["force"] for log in forces])
        slopes = np.linalg.lstsq(rows, measured, rcond=None)[0]

    def predict(log: BenchLog) -> dict[str, np.ndarray]:
        gauge = pressure(log, start)
        return {"pressure": gauge, "force": np.maximum(terms(log, gauge) @ slopes, 0.0)}

    return predict


def loops(data: pathlib.Path) -> Iterator[LedgerRow]:
    """Widths of loops under the measured pressure, of muscles held at one share of their free contraction."""
    found = dict[tuple[str, float], list[dict[str, float]]]()
    for file in sorted(data.glob("**/*.csv")):
        log = read_bench_log(file)
        told = {"length", "total_length", "free_contraction"} <= log.bench.keys() and not log.fed
        if told and "force" in log.columns:
            share = (1.0 - log.bench["length"] / log.bench["total_length"]) / log.bench["free_contraction"]
            if np.isfinite(list((widths := replay(log).loops).values())).all():
                found.setdefault((file.parent.name, round(share, 2)), []).append(widths)
    for (device, share), each in found.items():
        width, none = (np.array([one[side] for one in each]) for side in ("measured", "predicted"))
        n = len(each)
        error = round(t.ppf(0.95, n - 1) * width.std(ddof=1) / n**0.5, 2) if n > 2 else None
        text, band = f"loop at {share:.0%} of free contraction", (*np.quantile(none, LEVELS),)
        yield LedgerRow(device, text, "N", band, round(width.mean(), 2), error)
