"""Rows of others' recordings, as logs of `afo-sim stand replay`. The rules, written before any result:

error    RMS of prediction less measurement over the muscle's greatest measured value, as band of the best
         file, all files, the worst file; agrees where that of all is within its limit, else disagrees
fitted   on every second file, the error of the others; to each file alone where its length is not known
loop     muscles held at one share of their free contraction: mean, 90 % interval, the ledger's verdict
"""

import pathlib
from collections.abc import Iterator

import numpy as np

from afo_sim.common import InputError
from afo_sim.lab.bench_log import BenchLog, read_bench_log
from afo_sim.lab.identifiability import rms
from afo_sim.lab.ledger import LEVELS, LedgerRow
from afo_sim.lab.replay import fit_replay, replay

Numbers = dict[str, float]
VALVE = {"conductance": 2e-9, "critical_ratio": 0.3}  # [SI]: assumed of valves that nobody names
# Folder → what is predicted, limit of each channel's error [%], what is assumed of the bench, what is fitted.
BENCH: dict[str, list[tuple[str, Numbers, Numbers, str]]] = {
    "aarl_festo10_isometric": [
        ("static", {"force": 4.0}, {}, "blocked_force"),
        ("pulses,", {"pressure": 2.0, "force": 3.0}, VALVE | {"supply": 6.2e5}, "conductance"),
    ],
    "aarl_festo20_fill_leak": [("fills,", {"pressure": 1.5}, VALVE, "conductance")],
    "pamy_acrkn": [],
}
FIRST = {"blocked_force": 400.0}  # where a fit begins [N]
ABSENT = "not in this package; give --data FOLDER of logs"


def bench(data: pathlib.Path | None = None) -> list[LedgerRow]:
    """Rows of each set of `BENCH`, where `data` has a folder of its logs; InputError where it has none."""
    logs = {n: [read_bench_log(f) for f in sorted(data.glob(f"{n}/*.csv"))] if data else [] for n in BENCH}
    if data and not any(logs.values()):
        allowed = f"what scripts/bench_logs.py writes: folders of logs, {', '.join(BENCH)}"
        raise InputError("has no logs of the recordings", field="--data", value=str(data), allowed=allowed)
    found: list[LedgerRow] = []
    for name, each in BENCH.items():
        rows = [row for one in each if logs[name] for row in _rows(logs[name], *one)]
        found += [*rows, *_loops(logs[name])] or [LedgerRow(name, "recordings", source=ABSENT)]
    return found


def _rows(logs: list[BenchLog], what: str, limits: Numbers, given: Numbers, name: str) -> Iterator[LedgerRow]:
    """Errors with nothing fitted, and with one number fitted."""
    alone = len(logs) < 2 or "length" not in logs[0].bench
    groups = [([log], [log]) for log in logs] if alone else [(logs[::2], logs[1::2])]
    fits = [(fit_replay(seen, [name], [*limits][:1], bench=FIRST | given)[0], rest) for seen, rest in groups]
    fitted = [(given | values, log) for values, rest in fits for log in rest]
    device, source = logs[0].file.parent.name, logs[0].bench.get("source", "")
    source += f"; assumed: {', '.join(given) or 'nothing'}"
    for text, settings in (("nothing", [(given, log) for log in logs]), (name, fitted)):
        runs = [replay(log, bench=bench) for bench, log in settings]
        for channel, limit in limits.items():
            full = [(log.bench.get("total_length"), log.columns[channel].max()) for log in logs]
            sizes = [max(x for of, x in full if of == run.log.bench.get("total_length")) for run in runs]
            errors = 100.0 * np.array([run.errors[channel].rms for run in runs]) / sizes
            band = errors.min(), rms(errors), errors.max()
            quantity = f"{what} {channel}, {text} fitted, limit {limit:g}"
            yield LedgerRow(device, quantity, "%", band, source=source, limit=limit)


def _loops(logs: list[BenchLog]) -> Iterator[LedgerRow]:
    """Widths of loops under the measured pressure."""
    loops = dict[float, list[Numbers]]()
    for log in logs:
        if {"length", "total_length", "free_contraction"} <= log.bench.keys():
            share = (1.0 - log.bench["length"] / log.bench["total_length"]) / log.bench["free_contraction"]
            if np.isfinite(list((widths := replay(log).loops).values())).all():
                loops.setdefault(round(share, 2), []).append(widths)
    for share, each in loops.items():
        width, none = (np.array([one[side] for one in each]) for side in ("measured", "predicted"))
        error = round(2.92 * width.std(ddof=1) / 3.0**0.5, 2) if len(each) == 3 else None  # Student's t
        text, band = f"loop at {share:.0%} of free contraction", (*np.quantile(none, LEVELS),)
        device, source = logs[0].file.parent.name, logs[0].bench.get("source", "")
        yield LedgerRow(device, text, "N", band, round(width.mean(), 2), error, source)
