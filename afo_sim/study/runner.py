"""A sweep from its plan to its results: what is left to do, done by threads or by a cluster."""

import pathlib
import shutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace

from afo_sim.common import InputError, JsonDict, JsonMapping
from afo_sim.metrics import COMPARED, REPORTED, reference_metrics, walkers_metrics
from afo_sim.simulation import Asked
from afo_sim.study import engine
from afo_sim.study.design import Cases, cases_of
from afo_sim.study.engine import OK
from afo_sim.study.folder import Changed, fingerprint
from afo_sim.study.pool import pool
from afo_sim.study.results import STEPS, Results, read
from afo_sim.study.store import SWEEP, Store
from afo_sim.study.sweep_plan import Plan, check_metric
from afo_sim.study.time_step import check_sample

Part = tuple[int, int]  # (k, n): the k-th of n parts
WHOLE: Part = (1, 1)

_ROW_BYTES = 500.0  # of a row's words; a number takes 8
_CHUNK_BYTES = 7e3  # of what a file says of its columns
_MOST_WORDS = 16  # whose metrics are asked for before the first case is run


@dataclass(frozen=True)
class Workload:
    """Work of a sweep or a part: cases, those that are done, seconds for the rest, bytes on disk."""

    cases: int
    done: int
    dropped: int
    seconds: float
    bytes: float


@dataclass(frozen=True)
class SweepProgress:
    """Of a sweep or a part: cases in all, done, done by this run, and failed by this run."""

    cases: int
    done: int
    new: int
    failed: int


def open_store(plan: Plan, cases: Cases, folder: pathlib.Path, changed: Changed = "refuse") -> Store:
    """The store of a sweep: a new one, or one to be continued."""
    now = fingerprint(SWEEP.name, plan.canonical())

    def first(scenario: JsonDict) -> JsonDict:
        metrics, seconds = _tried(scenario, plan, cases)
        return {"metrics": metrics, "seconds_per_case": seconds, "chunk": plan.chunk}

    manifest = SWEEP.open(folder, changed, plan, now, first, cases=len(cases))
    mixed = bool(manifest.get("mixed"))
    return Store(folder, cases, manifest["metrics"], manifest["chunk"], now["sweep"], mixed)


def sweep(plan: Plan, folder: pathlib.Path, *, threads: int = 0) -> Results:
    """Compute a whole sweep, or what is left of it."""
    run(open_store(plan, cases_of(plan), folder), threads=threads)
    return read(folder)


def estimate(store: Store, workers: int, part: Part = WHOLE) -> Workload:
    """The work that is left, by the time that the first cases took."""
    count, rest = _cases(store, _of_part(range(store.jobs.count), part)), left(store, part)
    each = float(SWEEP.read(store.folder)["seconds_per_case"])
    return Workload(count, count - rest, store.cases.dropped, rest * each / workers, _bytes(store, count))


def run(
    store: Store, *, threads: int = 1, workers: int = 0, scheduler: str = "", part: Part = WHOLE,
    report: Callable[[SweepProgress], None] | None = None,
) -> SweepProgress:  # fmt: skip
    """Compute what is left of a sweep; after an interruption the next call continues."""
    plan = store.cases.plan
    asked = Asked(frozenset(plan.metrics) or None, walkers=plan.walkers)
    pending = _of_part(store.pending(), part)
    count = _cases(store, _of_part(range(store.jobs.count), part))
    state = SweepProgress(count, count - left(store, part), 0, 0)
    if pending:
        chunks = store.pending()  # and, beside them until they are taken away, the results
        needed = _bytes(store, _cases(store, chunks) + len(store.cases)) + _CHUNK_BYTES * len(chunks)
        free = shutil.disk_usage(store.folder).free
        if needed > free:
            problem = f"the results need about {needed / 1e9:.2g} GB, the disk has {free / 1e9:.2g} GB left"
            allowed = "a folder with more room, or fewer cases"
            raise InputError(problem, field="out", value=str(store.folder), allowed=allowed)
        scenario = SWEEP.read(store.folder)["scenario"]
        # nor computed by another process since
        due = (k for k in pending if not (store.finished or SWEEP.part(store.folder, k).is_file()))
        with (
            pool(threads, workers, scheduler) as who,
            closing(who.outcomes(scenario, store.jobs, due, asked)) as done,
        ):
            for chunk, outcomes in done:
                if store.finished:  # another process has gathered the results
                    break
                store.write(chunk, outcomes)
                failed = sum(outcome.status != OK for outcome in outcomes)
                new = len(outcomes)
                state = SweepProgress(count, state.done + new, state.new + new, state.failed + failed)
                if report is not None:
                    report(state)
    if not store.finished and not store.pending():
        store.finish()
    if store.finished:
        if not (plan.walkers or (store.folder / STEPS).exists()):  # nor where it was stopped before
            with pool(threads, workers) as who:
                check_sample(read(store.folder), SWEEP.read(store.folder)["scenario"], asked, who)
        store.tidy()
    return replace(state, done=count - left(store, part))


def left(store: Store, part: Part = WHOLE) -> int:
    """Cases that are not computed."""
    return _cases(store, _of_part(store.pending(), part))


def _of_part(chunks: Iterable[int], part: Part) -> list[int]:
    return [chunk for chunk in chunks if chunk % part[1] == part[0] - 1]


def _cases(store: Store, chunks: Iterable[int]) -> int:
    return sum(len(store.jobs.numbers(chunk)) for chunk in chunks)


def _bytes(store: Store, cases: int) -> float:
    return cases * (8.0 * (len(store.metrics) + len(store.cases.values)) + _ROW_BYTES)


def _tried(scenario: JsonMapping, plan: Plan, cases: Cases) -> tuple[dict[str, str], float]:
    """The metrics that cases have, with their units, and what one case takes [s]."""
    last = len(cases) - 1
    words = [cases.values[p.name] for p in plan.parameters if p.words]
    first = [int((column == word).argmax()) for column in words for word in dict.fromkeys(column)]
    telling = dict.fromkeys([0, last // 2, last, *first[:_MOST_WORDS]])
    units, beside, seconds = probe(scenario, [plan.set, *map(cases.sets, telling)], plan)
    if not units:
        problem = "no tried case has any metric: is the run shorter than two strides?"
        raise InputError(problem, file=plan.file, field="set.duration")
    known = units | beside
    for name in plan.metrics:
        check_metric(plan.file, "metrics", name, known)
    return {name: known[name] for name in plan.metrics or units}, seconds


def probe(
    scenario: JsonMapping, sets: Sequence[Mapping[str, object]], plan: Plan
) -> tuple[dict[str, str], dict[str, str], float]:
    """Cases tried before a study begins: {metric: unit}, the same of comparisons, what one case takes [s]."""
    asked, sets = Asked(walkers=plan.walkers), sets[-1:] if plan.walkers else sets  # of which each is slow
    # compiles what only the first run compiles
    next(engine.outcomes(scenario, [(0, sets[0])], 1, 1, asked))
    begun = time.perf_counter()
    by_number = dict(engine.outcomes(scenario, enumerate(sets), 1, len(sets), asked))
    found = [by_number[number] for number in range(len(sets))]
    seconds = (time.perf_counter() - begun) / len(sets)
    if all(outcome.status != OK for outcome in found):
        reason = next(outcome.reason for outcome in reversed(found))
        raise InputError(f"no tried case runs: {reason}", file=plan.file)
    units = {name: metric.unit for outcome in found for name, metric in outcome.metrics.items()}
    compares = scenario.get("reference") is not None or any("reference" in one for one in sets)
    rows = REPORTED[reference_metrics] if compares and COMPARED in units else []
    rows = REPORTED[walkers_metrics] if plan.walkers else rows
    return units, {row.name: row.unit for row in rows}, seconds
