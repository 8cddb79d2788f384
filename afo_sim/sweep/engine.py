"""Cases of a sweep side by side: descriptions in, one outcome each out, in little memory.

Cases that differ only in numbers share a roll-out of `mujoco.batch`; each runs on its own compiled model
and is, to the last bit, what it is alone. A case that cannot be built or becomes unstable is an outcome
with its reason. With two threads or more, the next cases are built while the last ones are rolled out.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np

from afo_sim import native, schedule
from afo_sim.errors import InputError, SimulationError
from afo_sim.metrics import Metric
from afo_sim.model import Built, build
from afo_sim.reader import load
from afo_sim.recording import examine
from afo_sim.simulate import Rollout, Workspace, row_width, simulate, simulate_together
from afo_sim.sweep.memory import keep_flat

OK, UNSTABLE, INFEASIBLE, BROKEN = "ok", "unstable", "infeasible", "error"
BATCH_BYTES = 1.2e8  # of recorded rows in one roll-out; three of them exist at a time


@dataclass(frozen=True)
class Outcome:
    """What became of a case: "ok", "unstable", "infeasible" or "error", the reason, and its metrics."""

    status: str
    reason: str
    metrics: dict[str, Metric]


@dataclass(frozen=True, eq=False)
class Prepared:
    """A case that is ready to run."""

    number: int
    built: Built
    control: np.ndarray

    @property
    def layout(self) -> tuple[Any, ...]:
        """What cases must have in common to share a roll-out."""
        model = self.built.model
        sizes = tuple(getattr(model, name) for name in _size_names())
        return (self.built.scenario.callback, len(self.control), *sizes)


@cache
def _size_names() -> list[str]:
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    return [n for n in dir(empty) if n.startswith("n") and isinstance(getattr(empty, n), int)]


def outcomes(
    scenario: Mapping[str, Any] | str,
    cases: Iterable[tuple[int, Mapping[str, Any]]],
    threads: int = 1,
    chunk: int = 32,
) -> Iterator[tuple[int, Outcome]]:
    """Run cases.

    Parameters
    ----------
    scenario : what all cases begin with, as `reader.load` takes it
    cases : number and overrides of each
    threads : that roll out; from two on, building overlaps with rolling out
    chunk : cases after which all that were begun are brought to their end

    Yields
    ------
    (number, Outcome), the numbers of a chunk in no particular order
    """
    keep_flat()
    here, there = Workspace({}), Workspace({})  # one is read while the other is recorded into
    with native.installed():
        if threads < 2:
            for batch in _batches(scenario, cases, chunk):
                if isinstance(batch, tuple):
                    yield batch
                else:
                    yield from _finish(batch, _roll(batch, 1, here))
            return
        with ThreadPoolExecutor(1) as pool:
            running: tuple[list[Prepared], Future[list[Rollout]]] | None = None
            for batch in _batches(scenario, cases, chunk):
                if isinstance(batch, tuple):
                    yield batch
                    continue
                begun = pool.submit(_roll, batch, threads, here)
                here, there = there, here
                if running:
                    yield from _finish(running[0], running[1].result())
                running = batch, begun
            if running:
                yield from _finish(running[0], running[1].result())


def prepare(scenario: Mapping[str, Any] | str, number: int, sets: Mapping[str, Any]) -> Prepared | Outcome:
    """Read and compile a case, or say why that cannot be."""
    try:
        built = build(load("scenario", scenario, sets))
        return Prepared(number, built, schedule.controls(built))
    except Exception as error:  # one case's trouble is not the others'
        return _failed(error)


def _batches(
    scenario: Mapping[str, Any] | str, cases: Iterable[tuple[int, Mapping[str, Any]]], chunk: int
) -> Iterator[list[Prepared] | tuple[int, Outcome]]:
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
                row = 8.0 * row_width(case.built.model)
                room[layout] = max(int(BATCH_BYTES / (row * len(case.control))), 1)
            groups.setdefault(layout, []).append(case)
            if len(groups[layout]) == room[layout]:
                yield groups.pop(layout)
        if count % chunk == 0:
            yield from groups.values()
            groups = {}
    yield from groups.values()


def _roll(batch: Sequence[Prepared], threads: int, workspace: Workspace) -> list[Rollout]:
    if batch[0].built.scenario.callback == "python":  # which `mujoco.batch` refuses
        return [_roll_alone(case) for case in batch]
    builts, controls = [case.built for case in batch], [case.control for case in batch]
    return simulate_together(builts, controls, threads, workspace)


def _roll_alone(case: Prepared) -> Rollout:
    try:
        return simulate(case.built, case.control)
    except Exception as error:
        return Rollout({}, error, 0.0)


def _finish(batch: Sequence[Prepared], rollouts: Sequence[Rollout]) -> Iterator[tuple[int, Outcome]]:
    for case, rollout in zip(batch, rollouts, strict=True):
        yield case.number, _outcome(case, rollout)


def _outcome(case: Prepared, rollout: Rollout) -> Outcome:
    if rollout.failure is not None:
        return _failed(rollout.failure)
    try:
        _, found = examine(case.built, case.control, rollout, transient=False)
    except Exception as error:
        return _failed(error)
    told = {name: metric for name, metric in found.totals.items() if math.isfinite(metric.value)}
    return Outcome(OK, "", told)


def _failed(error: Exception) -> Outcome:
    """The outcome that an error is; but what befalls the machine is no case's own, and stops the sweep."""
    if isinstance(error, MemoryError):
        raise error
    if isinstance(error, SimulationError):
        return Outcome(UNSTABLE, str(error), {})
    if isinstance(error, InputError):
        return Outcome(INFEASIBLE, str(error), {})
    return Outcome(BROKEN, f"{type(error).__name__}: {error}", {})
