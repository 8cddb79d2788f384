"""Cases of a sweep side by side: descriptions in, one outcome each out, in little memory.

Cases that differ only in numbers share a roll-out of `mujoco.batch`; each runs on its own compiled model
and is, to the last bit, what it is alone. A case that cannot be built or becomes unstable is an outcome
with its reason. With two threads or more, cases are built while others are rolled out.
"""

import math
import pathlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.description.reader import load
from afo_sim.metrics.metric import Metric
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built, build
from afo_sim.model.periodic import two_strides, why_walked
from afo_sim.simulation.examine import EVERYTHING, Asked, examine
from afo_sim.simulation.rollout import Rollout, Workspace, row_width
from afo_sim.simulation.settle import Settled, settle
from afo_sim.simulation.settled_run import settled_metrics, unsettled_warning
from afo_sim.simulation.simulate import simulate, simulate_together
from afo_sim.study.memory import keep_flat

OK, UNSTABLE, INFEASIBLE, BROKEN = "ok", "unstable", "infeasible", "error"
BATCH_BYTES = 1.2e8  # of recorded rows, in all roll-outs that exist at a time
AHEAD = 1  # batches more than threads, so that none of these waits for the next to be built


@dataclass(frozen=True)
class Outcome:
    """The end of a case: "ok", "unstable", "infeasible" or "error", the reason, metrics, warnings."""

    status: str
    reason: str
    metrics: dict[str, Metric]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Prepared:
    """A case that is ready to run."""

    number: int
    built: Built
    control: np.ndarray
    solved: bool = False  # two strides, of which the settled one is solved for

    @property
    def layout(self) -> tuple[Any, ...]:
        """The parts that cases must have in common to share a roll-out."""
        sizes = self.built.model._sizes.tobytes()  # all of them: some are in no attribute of their own
        return (self.built.scenario.callback, self.solved, len(self.control), sizes)


class Jobs(Protocol):
    """Numbered cases, cut into chunks of `chunk` cases."""

    @property
    def chunk(self) -> int: ...

    def numbers(self, chunk: int) -> range:
        """The cases of a chunk."""
        ...

    def sets(self, number: int) -> dict[str, Any]:
        """The overrides of a case by dotted key."""
        ...


Numbered = tuple[int, Outcome]
Rolled = Rollout | Settled
Batched = list[Prepared] | Numbered


def outcomes(
    scenario: Mapping[str, Any] | str,
    cases: Iterable[tuple[int, Mapping[str, Any]]],
    threads: int = 1,
    chunk: int = 32,
    asked: Asked = EVERYTHING,
) -> Iterator[Numbered]:
    """Run cases.

    Parameters
    ----------
    scenario : what all cases begin with, as `reader.load` takes it
    cases : number and overrides of each
    threads : that roll out, beside the one that calls; below two that one does it
    chunk : cases after which all that were begun are brought to their end
    asked : metrics and warnings of each

    Yields
    ------
    (number, Outcome), the numbers of a chunk in no particular order
    """
    keep_flat()
    batches = _batches(scenario, cases, chunk, BATCH_BYTES / (1 if threads < 2 else threads + AHEAD))
    with native.installed():
        yield from _in_turn(batches, asked) if threads < 2 else _side_by_side(batches, threads, asked)


def _in_turn(batches: Iterable[Batched], asked: Asked) -> Iterator[Numbered]:
    workspace = Workspace({})
    for batch in batches:
        if isinstance(batch, tuple):
            yield batch
        else:
            yield from _finish(batch, _roll(batch, workspace), asked)


def _side_by_side(batches: Iterable[Batched], threads: int, asked: Asked) -> Iterator[Numbered]:
    """Each thread rolls a batch out of its own; this one builds cases and looks at what they have done."""
    running: dict[Future[list[Rolled]], tuple[list[Prepared], Workspace]] = {}
    free = [Workspace({}) for _ in range(threads + AHEAD)]

    def collected(how_many: str) -> Iterator[Numbered]:
        for ended in wait(running, return_when=how_many).done:
            batch, workspace = running.pop(ended)
            yield from _finish(batch, ended.result(), asked)
            free.append(workspace)

    with ThreadPoolExecutor(threads) as pool:
        for batch in batches:
            if isinstance(batch, tuple):
                yield batch
            elif _in_python(batch):  # its callbacks would be those of all threads
                yield from collected(ALL_COMPLETED)
                yield from _finish(batch, _roll(batch, free[0]), asked)
            else:
                if not free:
                    yield from collected(FIRST_COMPLETED)
                workspace = free.pop()
                running[pool.submit(_roll, batch, workspace)] = batch, workspace
        while running:
            yield from collected(FIRST_COMPLETED)


def prepare(scenario: Mapping[str, Any] | str, number: int, sets: Mapping[str, Any]) -> Prepared | Outcome:
    """Read and compile a case, or say why that cannot be."""
    try:
        description = load("scenario", scenario, sets)
        solved = description.walking and not why_walked(description)
        built = build(two_strides(description) if solved else description)
        return Prepared(number, built, schedule.controls(built), solved)
    except Exception as error:  # one case's trouble is not the others'
        return _failed(error)


def _batches(
    scenario: Mapping[str, Any] | str,
    cases: Iterable[tuple[int, Mapping[str, Any]]],
    chunk: int,
    most_bytes: float,
) -> Iterator[Batched]:
    """Cases of one layout, as many as fit; number and outcome of those that cannot run."""
    groups: dict[tuple[Any, ...], list[Prepared]] = {}
    room: dict[tuple[Any, ...], int] = {}
    for count, (number, sets) in enumerate(cases, start=1):
        case = prepare(scenario, number, sets)
        if isinstance(case, Outcome):
            yield number, case
        else:
            layout = case.layout
            if layout not in room:
                # a search for a stride keeps two strides beside the result's two
                row = 8.0 * row_width(case.built.model) * (2.0 if case.solved else 1.0)
                room[layout] = max(int(most_bytes / (row * len(case.control))), 1)
            groups.setdefault(layout, []).append(case)
            if len(groups[layout]) == room[layout]:
                yield groups.pop(layout)
        if count % chunk == 0:
            yield from groups.values()
            groups = {}
    yield from groups.values()


def _in_python(batch: Sequence[Prepared]) -> bool:
    """True where `mujoco.batch` would refuse the batch."""
    return batch[0].built.scenario.callback == "python"


def _roll(batch: Sequence[Prepared], workspace: Workspace) -> list[Rolled]:
    builts, controls = [case.built for case in batch], [case.control for case in batch]
    if batch[0].solved:
        mode: native.Mode = "python" if _in_python(batch) else "native"
        return list(settle(builts, controls, mode=mode, workspace=workspace))
    if _in_python(batch):
        return [_roll_alone(case) for case in batch]
    return list(simulate_together(builts, controls, workspace))


def _roll_alone(case: Prepared) -> Rollout:
    try:
        return simulate(case.built, case.control)
    except Exception as error:
        return Rollout({}, case.control[:0], error)


def _finish(batch: Sequence[Prepared], rolled: Sequence[Rolled], asked: Asked) -> Iterator[Numbered]:
    for case, each in zip(batch, rolled, strict=True):
        yield case.number, _outcome(case, each, asked)


def _outcome(case: Prepared, rolled: Rolled, asked: Asked) -> Outcome:
    settled = rolled if isinstance(rolled, Settled) else None
    rollout = rolled.rollout if isinstance(rolled, Settled) else rolled
    if rollout.failure is not None:
        return _failed(rollout.failure)
    try:
        _, found = examine(case.built, rollout, transient=False, solved=settled is not None, asked=asked)
    except Exception as error:
        return _failed(error)
    totals, warnings = found.totals, found.warnings
    if settled is not None:
        totals, warnings = totals | settled_metrics(settled), (*unsettled_warning(settled), *warnings)
    return Outcome(
        OK, "", {name: _finite(m) for name, m in totals.items()}, (*case.built.warnings, *warnings)
    )


def _finite(metric: Metric) -> Metric:
    """The same; NaN where the value is not finite, so that rows hold one kind of NaN."""
    return metric if math.isfinite(metric.value) else Metric(math.nan, metric.unit)


def _gone(file: object) -> bool:
    """True where a file that was there when the sweep was read is there no more."""
    return isinstance(file, pathlib.Path) and not file.exists()


def _failed(error: Exception) -> Outcome:
    """The outcome that an error is; but what befalls the machine is no case's own, and stops the sweep."""
    if isinstance(error, (MemoryError, OSError)) or (isinstance(error, InputError) and _gone(error.file)):
        raise error
    if isinstance(error, SimulationError):
        return Outcome(UNSTABLE, str(error), {})
    if isinstance(error, InputError):
        return Outcome(INFEASIBLE, str(error), {})
    return Outcome(BROKEN, f"{type(error).__name__}: {error}", {})
