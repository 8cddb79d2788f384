"""Cases of a sweep side by side: descriptions in, one outcome each out, in little memory.

Cases that differ only in numbers share a roll-out of `mujoco.batch`; each runs on its own compiled model
and is, to the last bit, what it is alone. A case that cannot be built or becomes unstable is an outcome
with its reason. With two threads or more, cases are built while others are rolled out.
"""

import ctypes
import dataclasses
import functools
import gc
import math
import pathlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from afo_sim import native
from afo_sim.common import ControllerError, InputError, JsonMapping, Notice, SimulationError
from afo_sim.description import Base, load
from afo_sim.metrics import Metric, failures, reference_metrics, undefined
from afo_sim.metrics.strides import strides
from afo_sim.model import Built, fills, start_up, steps_of_stride, stride_files_stay, two_strides, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import (
    EVERYTHING,
    Asked,
    Policy,
    References,
    Rollout,
    Settled,
    Workspace,
    described_policy,
    first_strides,
    not_compared,
    row_width,
    settled_metrics,
    simulate_together,
    unsettled_warning,
)
from afo_sim.simulation.examine import examine, until_near
from afo_sim.simulation.settle import settle
from afo_sim.simulation.simulate import simulate
from afo_sim.study.walkers import responding

_M_MMAP_THRESHOLD = -3  # malloc.h of glibc
_LARGE = 1 << 20  # bytes
OK, UNSTABLE, INFEASIBLE, BROKEN = "ok", "unstable", "infeasible", "error"
UNSETTLED = "stride-unsettled"  # code of the warning that no stride was found that repeats
_BATCH_BYTES = 1.2e8  # of recorded rows, in all roll-outs that exist at a time
CYCLE = np.linspace(0.0, 1.0, 201)  # phases of a stride's curves
_AHEAD = 1  # batches more than threads, so that none of these waits for the next to be built


@functools.cache
def _keep_flat() -> None:
    """Let the collector leave alone what is there, and glibc give large blocks back when they are freed."""
    gc.freeze()
    if sys.platform == "linux":
        with suppress(AttributeError, OSError):  # another C library
            ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE)


@dataclass(frozen=True)
class Outcome:
    """The end of a case: "ok", "unstable", "infeasible" or "error", the reason, metrics, warnings."""

    status: str
    reason: str
    metrics: dict[str, Metric]
    warnings: tuple[str, ...] = ()
    curves: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A case that is ready to run."""

    number: int
    built: Built
    control: np.ndarray
    solved: bool = False
    first: "Prepared | None" = None
    policy: Policy | None = None

    @property
    def layout(self) -> tuple[object, ...]:
        """The parts that cases must have in common to share a roll-out."""
        sizes = self.built.model._sizes.tobytes()  # all of them: some are in no attribute of their own
        period = None if self.policy is None else self.policy.period
        return (self.built.scenario.callback, self.solved, len(self.control), self.first_steps, period, sizes)

    @property
    def first_steps(self) -> int:
        """Steps walked from the start, in addition to the search for the settled stride."""
        return 0 if self.first is None else len(self.first.control)


@dataclass(frozen=True, eq=False)
class Rolled:
    """A case that has run: its rows; of a settled stride how it was found, and the strides from the start."""

    rollout: Rollout
    settled: Settled | None = None
    first: Rollout | None = None


@dataclass(frozen=True)
class Jobs:
    """So many numbered cases in chunks of `chunk`; `sets` gives a case's overrides by dotted key."""

    cases: int
    chunk: int
    sets: Callable[[int], JsonMapping]

    @property
    def count(self) -> int:
        """Of chunks."""
        return -(-self.cases // self.chunk)

    def numbers(self, chunk: int) -> range:
        """The cases of a chunk."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.cases))


Numbered = tuple[int, Outcome]
Batched = list[Prepared] | Numbered


def outcomes(
    scenario: JsonMapping | str, cases: Iterable[tuple[int, JsonMapping]], threads: int = 1,
    chunk: int = 32, asked: Asked = EVERYTHING, references: References | None = None,
) -> Iterator[Numbered]:  # fmt: skip
    """Run cases."""
    if asked.walkers is not None:
        for number, sets in cases:
            try:
                outcome = Outcome(OK, "", *responding(scenario, sets, asked.walkers, threads))
            except Exception as error:  # one case's trouble is not the others'
                outcome = _failed(error)
            yield number, outcome
        return
    _keep_flat()
    most_bytes = _BATCH_BYTES / (1 if threads < 2 else threads + _AHEAD)
    batches = _batches(scenario, cases, chunk, most_bytes, asked.first_strides)
    references = References() if references is None else references
    with native.installed():
        if threads > 1:
            yield from _side_by_side(batches, threads, asked, references)
            return
        workspace = Workspace({})
        for batch in batches:
            if isinstance(batch, tuple):
                yield batch
            else:
                yield from _finish(batch, _roll(batch, workspace), asked, references)


def _side_by_side(
    batches: Iterable[Batched], threads: int, asked: Asked, references: References
) -> Iterator[Numbered]:
    """Each thread rolls a batch out of its own; this one builds cases and looks at what they have done."""
    running: dict[Future[list[Rolled]], tuple[list[Prepared], Workspace]] = {}
    free = [Workspace({}) for _ in range(threads + _AHEAD)]

    def collected(how_many: str) -> Iterator[Numbered]:
        for ended in wait(running, return_when=how_many).done:
            batch, workspace = running.pop(ended)
            yield from _finish(batch, ended.result(), asked, references)
            free.append(workspace)

    with ThreadPoolExecutor(threads) as pool:
        for batch in batches:
            if isinstance(batch, tuple):
                yield batch
            elif _in_python(batch):  # its callbacks would be those of all threads
                yield from collected(ALL_COMPLETED)
                yield from _finish(batch, _roll(batch, free[0]), asked, references)
            else:
                if not free:
                    yield from collected(FIRST_COMPLETED)
                workspace = free.pop()
                running[pool.submit(_roll, batch, workspace)] = batch, workspace
        while running:
            yield from collected(FIRST_COMPLETED)


def prepare(
    scenario: JsonMapping | str | Base, number: int, sets: Mapping[str, object], first_strides: int = 0
) -> Prepared | Outcome:
    """Read and compile a case, or return why that fails."""
    try:
        description = load("scenario", scenario, sets)
        with stride_files_stay():
            solved = description.walking and not why_walked(description)
            built = build(two_strides(description) if solved else description)
            first = None
            if solved and first_strides and description.gait is not None:  # no more than a run alone has
                begun, n = build(start_up(description)), steps_of_stride(description)
                end = -round(description.gait.start_phase * n) % n + first_strides * n
                first = Prepared(number, begun, schedule.controls(begun)[:end])
        return Prepared(number, built, schedule.controls(built), solved, first, described_policy(built))
    except Exception as error:  # one case's trouble is not the others'
        return _failed(error)


def _batches(
    scenario: JsonMapping | str | Base, cases: Iterable[tuple[int, JsonMapping]], chunk: int,
    most_bytes: float, first_strides: int,
) -> Iterator[Batched]:  # fmt: skip
    """Cases of one layout, as many as fit; number and outcome of those that cannot run."""
    with suppress(InputError):  # else every case says it
        scenario = Base.of("scenario", scenario)
    groups: dict[tuple[object, ...], list[Prepared]] = {}
    room: dict[tuple[object, ...], int] = {}
    for count, (number, sets) in enumerate(cases, start=1):
        case = prepare(scenario, number, sets, first_strides)
        if isinstance(case, Outcome):
            yield number, case
        else:
            layout = case.layout
            if layout not in room:
                # a search for a stride keeps two strides beside the result's two
                row = 8.0 * row_width(case.built.model) * (2.0 if case.solved else 1.0)
                room[layout] = max(int(most_bytes / (row * (len(case.control) + case.first_steps))), 1)
            groups.setdefault(layout, []).append(case)
            if len(groups[layout]) == room[layout]:
                yield groups.pop(layout)
        if count % chunk == 0:
            yield from groups.values()
            groups = {}
    yield from groups.values()


def _in_python(batch: Sequence[Prepared]) -> bool:
    return batch[0].built.scenario.callback == "python"


def _roll(batch: Sequence[Prepared], workspace: Workspace) -> list[Rolled]:
    builts, controls = [case.built for case in batch], [case.control for case in batch]
    if batch[0].solved:
        mode: native.Mode = "python" if _in_python(batch) else "native"
        settled = settle(builts, controls, mode=mode, workspace=workspace)
        pairs = [(case.first, each.rollout) for case, each in zip(batch, settled, strict=True) if case.first]
        first = [
            dataclasses.replace(one, policy=until_near(one.built, one.control, near)) for one, near in pairs
        ]
        walked = _walk(first, workspace) if first else [None] * len(batch)
        return [Rolled(each.rollout, each, before) for each, before in zip(settled, walked, strict=True)]
    return [Rolled(rollout) for rollout in _walk(batch, workspace)]


def _walk(batch: Sequence[Prepared], workspace: Workspace) -> list[Rollout]:
    """Roll-outs from the start; rows of a search for settled strides in the same memory stay."""
    if _in_python(batch):
        return [_roll_alone(case) for case in batch]
    builts, controls, policies = zip(*((c.built, c.control, c.policy) for c in batch), strict=True)
    return simulate_together(builts, controls, workspace, policies=policies)


def _roll_alone(case: Prepared) -> Rollout:
    try:
        return simulate(case.built, case.policy or case.control, n_step=len(case.control))
    except Exception as error:  # of a user's controller: the other cases go on
        return Rollout({}, case.control[:0], error)


def _finish(
    batch: Sequence[Prepared], rolled: Sequence[Rolled], asked: Asked, references: References
) -> Iterator[Numbered]:
    for case, each in zip(batch, rolled, strict=True):
        yield case.number, _outcome(case, each, asked, references)
    for case in batch:  # an outcome holds none of its models
        for one in (case, case.first):
            if one is not None:
                one.built.spare.append(one.built.model)


def _outcome(case: Prepared, rolled: Rolled, asked: Asked, references: References) -> Outcome:
    for rollout in (rolled.first, rolled.rollout):  # in the order in which a run comes to them
        if rollout is not None and rollout.failure is not None:
            return _failed(rollout.failure)
    try:
        with failures() as failed:
            totals, warnings, curves = _results(case, rolled, asked)
        if asked.reference and case.built.scenario.reference is not None:
            other = references.of(case.built.scenario)
            totals = totals | reference_metrics(totals, other.metrics)
            warnings = (*warnings, *not_compared(case.built.scenario, other))
    except Exception as error:  # of a user's metric: the other cases go on
        return _failed(error)
    scenario = case.built.scenario
    if scenario.walking and totals:  # what is asked of the first strides has a column in every row
        totals = undefined(asked.metrics, bool(scenario.orthosis.chamber), fills(scenario)) | totals
    one_nan = {  # rows hold one kind of what is not finite
        name: metric if math.isfinite(metric.value) else Metric(math.nan, metric.unit)
        for name, metric in totals.items()
    }
    return Outcome(OK, "", one_nan, (*case.built.warnings, *warnings, *failed.values()), curves)


def _results(
    case: Prepared, rolled: Rolled, asked: Asked
) -> tuple[dict[str, Metric], tuple[str, ...], dict[str, np.ndarray]]:
    """Metrics, warnings and curves of a case that has run."""
    settled = rolled.settled
    columns, found = examine(case.built, rolled.rollout, transient=False, solved=case.solved, asked=asked)
    curves = _curves(case.built, columns, asked.curves)
    if settled is None:
        return found.totals, found.warnings, curves
    told = unsettled_warning(settled)
    if not settled.found:  # which is recognised by its code
        told = tuple(Notice(UNSETTLED, "{text}", text=text) for text in told)
    totals, warnings = found.totals | settled_metrics(settled), (*told, *found.warnings)
    if case.first is None or rolled.first is None:
        return totals, warnings, curves
    first, left_out = first_strides(case.first.built, rolled.first, None, found.totals, asked, rolled.rollout)
    return totals | first, (*warnings, *left_out), curves


def _curves(built: Built, columns: Mapping[str, np.ndarray], wanted: Sequence[str]) -> dict[str, np.ndarray]:
    if not wanted or built.walk is None:
        return {}
    whole = strides(columns, built.scenario.timestep, built.body_mass)[-1:]
    return {name: last.at(name, CYCLE) for last in whole for name in wanted if name in columns}


def _failed(error: Exception) -> Outcome:
    """The outcome that an error is; but what befalls the machine is no case's own, and stops the sweep."""
    file = error.file if isinstance(error, InputError) else None
    gone = isinstance(file, pathlib.Path) and not file.exists()  # it was there when the sweep was read
    if gone or isinstance(error, (MemoryError, OSError)):
        raise error
    for kind, status in ((ControllerError, BROKEN), (SimulationError, UNSTABLE), (InputError, INFEASIBLE)):
        if isinstance(error, kind):
            return Outcome(status, str(error), {})
    return Outcome(BROKEN, f"{type(error).__name__}: {error}", {})
