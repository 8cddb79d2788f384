"""A sweep from its plan to its results: what is left to do, done by threads or by a cluster."""

import os
import pathlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Literal

from afo_sim.errors import InputError
from afo_sim.reader import expand
from afo_sim.sweep import cluster, engine
from afo_sim.sweep.design import Cases
from afo_sim.sweep.engine import OK, Outcome
from afo_sim.sweep.plan import Plan
from afo_sim.sweep.store import Store, clear, fingerprint, read_manifest, write_manifest
from afo_sim.writing import check_writable

Changed = Literal["refuse", "restart", "continue"]
Done = Iterator[tuple[int, list[Outcome]]]  # chunks as they are computed

ROW_BYTES = 250.0  # of a row's words; a number takes 8


@dataclass(frozen=True)
class Estimate:
    """What a sweep will take: cases, of which are computed; seconds for the rest; bytes on disk."""

    cases: int
    done: int
    dropped: int
    seconds: float
    bytes: float


@dataclass(frozen=True)
class Progress:
    """Cases in all, done, done by this run, and failed by this run."""

    cases: int
    done: int
    new: int
    failed: int


def open_store(plan: Plan, cases: Cases, folder: pathlib.Path, changed: Changed = "refuse") -> Store:
    """The store of a sweep: a new one, or one to be continued.

    Parameters
    ----------
    plan, cases : of the sweep
    folder : made if need be
    changed : what to do where the folder holds another sweep, or results of other code: "refuse";
        "restart", which throws them away; "continue", which lets both stand side by side (the sweep's
        cases must still be the same)

    Raises
    ------
    InputError
        The folder holds another sweep or something else, cannot be written to, or no case runs.
    """
    check_writable(folder)
    now = fingerprint(plan)
    if folder.is_dir() and any(folder.iterdir()):
        told = read_manifest(folder)
        _compare(folder, told.get("fingerprint", {}), now, changed)
        if changed != "restart":
            if told.get("fingerprint") != now:
                write_manifest(folder, told | {"fingerprint": now, "mixed": True})
            return Store(folder, cases, told["metrics"], told["chunk"])
        clear(folder)
    scenario = expand("scenario", plan.scenario)
    metrics, seconds = _probe(scenario, plan, cases)
    told = {
        "fingerprint": now,
        "scenario": scenario,
        "sweep_file": str(plan.file),
        "cases": len(cases),
        "chunk": plan.chunk,
        "metrics": metrics,
        "seconds_per_case": seconds,
    }
    write_manifest(folder, told)
    return Store(folder, cases, metrics, plan.chunk)


def estimate(store: Store, hands: int) -> Estimate:
    """What is left to do, by the time that the first cases took.

    Parameters
    ----------
    hands : threads or workers that share the work
    """
    left = sum(len(store.numbers(chunk)) for chunk in store.pending())
    each = float(read_manifest(store.folder)["seconds_per_case"])
    row = 8.0 * (len(store.metrics) + len(store.cases.names)) + ROW_BYTES
    count = len(store.cases)
    return Estimate(count, count - left, store.cases.dropped, left * each / hands, count * row)


def run(
    store: Store,
    *,
    threads: int = 1,
    workers: int = 0,
    scheduler: str = "",
    part: tuple[int, int] = (1, 1),
    report: Callable[[Progress], None] | None = None,
) -> Progress:
    """Compute what is left of a sweep; killed at any time, the next call goes on from there.

    Parameters
    ----------
    store : of the sweep
    threads : in this process, unless there are workers or a scheduler
    workers : processes of a Dask cluster made for this, on this machine
    scheduler : address of a running Dask cluster
    part : (k, n) does the k-th of n parts only, for a job array; who comes last gathers the results
    report : told after every chunk

    Raises
    ------
    InputError
        The disk is full, the cluster cannot be reached, or its workers die over and over.
    """
    pending = [chunk for chunk in store.pending() if chunk % part[1] == part[0] - 1]
    left = sum(len(store.numbers(chunk)) for chunk in store.pending())
    count = len(store.cases)
    state = Progress(count, count - left, 0, 0)
    if pending:
        scenario = read_manifest(store.folder)["scenario"]
        done: Any = (
            cluster.chunks(scenario, store, pending, workers, scheduler)
            if workers or scheduler
            else _chunks(scenario, store, pending, threads)
        )
        with closing(done):
            for chunk, outcomes in done:
                store.write(chunk, outcomes)
                failed = sum(outcome.status != OK for outcome in outcomes)
                new = len(outcomes)
                state = Progress(count, state.done + new, state.new + new, state.failed + failed)
                if report is not None:
                    report(state)
    if not store.finished and not store.pending():
        store.finish()
    return state


def processors() -> int:
    """That this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def _chunks(scenario: Mapping[str, Any], store: Store, pending: list[int], threads: int) -> Done:
    """Chunks computed in this process, each as soon as its last case is."""
    numbers = (number for chunk in pending for number in store.numbers(chunk))
    cases = ((number, store.cases.sets(number)) for number in numbers)
    found: dict[int, dict[int, Outcome]] = {}
    for number, outcome in engine.outcomes(scenario, cases, threads, store.chunk):
        chunk = number // store.chunk
        rows = found.setdefault(chunk, {})
        rows[number] = outcome
        if len(rows) == len(store.numbers(chunk)):
            yield chunk, [rows[number] for number in store.numbers(chunk)]
            del found[chunk]


def _probe(scenario: Mapping[str, Any], plan: Plan, cases: Cases) -> tuple[dict[str, str], float]:
    """The metrics that cases have, with their units, and what one case takes [s]."""
    last = len(cases) - 1
    sets = [plan.set, *(cases.sets(k) for k in dict.fromkeys((0, last // 2, last)))]
    found: list[Outcome] = []
    next(engine.outcomes(scenario, [(0, sets[0])]))  # compiles what only the first run compiles
    begun = time.perf_counter()
    found = [outcome for _, outcome in engine.outcomes(scenario, enumerate(sets))]
    seconds = (time.perf_counter() - begun) / len(sets)
    if all(outcome.status != OK for outcome in found):
        reason = next(outcome.reason for outcome in reversed(found))
        raise InputError(f"no case that was tried runs: {reason}", file=plan.file)
    units = {name: metric.unit for outcome in found for name, metric in outcome.metrics.items()}
    for name in plan.metrics:
        if name not in units:
            problem = "is no metric of this scenario"
            allowed = ", ".join(sorted(units))
            raise InputError(problem, file=plan.file, field="metrics", value=name, allowed=allowed)
    return {name: units[name] for name in plan.metrics or units}, seconds


def _compare(
    folder: pathlib.Path, before: Mapping[str, Any], now: Mapping[str, Any], changed: Changed
) -> None:
    """Refuse what must not be mixed, unless told."""
    if before == now or changed == "restart":
        return
    if before.get("sweep") != now["sweep"]:
        raise InputError(
            "the folder holds another sweep, or this one before it was changed",
            field="--out",
            value=str(folder),
            allowed="another folder, or --if-changed restart, which throws its results away",
        )
    if changed == "refuse":
        what = [
            f"{name} {before.get('versions', {}).get(name)} → {version}"
            for name, version in now["versions"].items()
            if before.get("versions", {}).get(name) != version
        ]
        raise InputError(
            "the folder's results were computed by other code" + (f" ({', '.join(what)})" if what else ""),
            field="--out",
            value=str(folder),
            allowed="--if-changed restart, which throws them away, or --if-changed continue, which mixes",
        )
