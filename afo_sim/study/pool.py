"""Simulation of a study's cases by threads and processes of this machine, or by a Dask cluster."""

import ipaddress
import os
import threading
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from afo_sim.common import Foreign, InputError, JsonMapping, Notice, optional, packed, take
from afo_sim.description import Scenario
from afo_sim.simulation import EVERYTHING, Asked, kept_each
from afo_sim.study import engine
from afo_sim.study.engine import Jobs, Outcome
from afo_sim.study.folder import program
from afo_sim.study.processes import PATIENCE, Processes

_AHEAD = 3  # chunks that wait for each worker, so that none of them waits
_FEW = 8  # cases a batch where they are few, so that all threads and the progress have something to do

# The muscle callbacks are the process's, so a worker of many threads takes one chunk at a time, with all of
# them.
_one_chunk = threading.Lock()
Report = Callable[[int, int, str], None]  # called with (done, in all, what)


def _computed(
    distributed: Foreign, client: Foreign, scenario: JsonMapping, jobs: Jobs, waiting: Iterator[int],
    asked: Asked,
) -> Iterator[tuple[int, list[Outcome]]]:  # fmt: skip
    running = distributed.as_completed()
    numbers: dict[str, int] = {}
    mine, added = program(), packed()

    def submit() -> None:
        """Keep every worker busy, however many have come or gone."""
        ahead = _AHEAD * max(len(client.nthreads()), 1)
        while len(numbers) < ahead and (chunk := next(waiting, None)) is not None:
            cases = [(number, jobs.sets(number)) for number in jobs.numbers(chunk)]
            future = client.submit(compute, scenario, cases, mine, asked, added, pure=False)
            numbers[future.key] = chunk
            running.add(future)

    submit()
    lost = []
    for future in running:
        chunk = numbers.pop(future.key)
        error = future.exception()
        if isinstance(error, distributed.KilledWorker):
            lost.append(f"{chunk} ({error.allowed_failures + 1} workers, last {error.last_worker.address})")
        elif error is not None:
            raise error if isinstance(error, InputError) else _broken(error)
        else:
            yield chunk, future.result()
        submit()
    if lost:
        text = f"all workers ended that had chunk {', '.join(lost)}; their logs say why; others are computed"
        allowed = "the same command with more memory for each worker, or a smaller chunk (in another folder)"
        raise InputError(text, field="scheduler", allowed=allowed)


def compute(
    scenario: JsonMapping,
    cases: list[tuple[int, JsonMapping]],
    wanted: JsonMapping | None = None,
    asked: Asked = EVERYTHING,
    added: bytes = b"",
) -> list[Outcome]:
    """A chunk's outcomes in order, on whatever machine this is called."""
    take(added)
    here = program()
    if wanted is not None and here != wanted:
        each = [f"{name} {here['versions'].get(name)}, not {v}" for name, v in wanted["versions"].items()
                if here["versions"].get(name) != v]  # fmt: skip
        raise InputError(f"a worker runs other code than this process: {', '.join(each) or 'of afo-sim'}")
    from distributed import get_worker

    try:
        threads = int(get_worker().state.nthreads)
    except ValueError:  # in no worker
        threads = 1
    with _one_chunk:
        found = dict(engine.outcomes(scenario, cases, threads, len(cases), asked))
    return [found[number] for number, _ in cases]


def _broken(error: BaseException) -> InputError:
    problem = f"a chunk could not be computed: {type(error).__name__}: {error}"
    return InputError(problem, allowed="run the same command again; computed cases are kept")


def unprotected(scheduler: str) -> Notice | None:
    """What to know before code and data go to a scheduler at an address of another machine without TLS."""
    protocol, _, rest = scheduler.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    with suppress(ValueError):  # a name
        host = "localhost" if ipaddress.ip_address(host).is_loopback else host
    if protocol in ("tls", "wss", "inproc") or host == "localhost":
        return None
    text = "{subject} has no TLS: whoever reaches that scheduler can run code as you, here and on its workers"
    return Notice("scheduler-without-tls", text, subject=scheduler)


@dataclass(frozen=True)
class Pool:
    """Threads of this process and further processes, or the Dask cluster at an address."""

    threads: int = 1
    scheduler: str = ""
    beside: Processes = field(default_factory=lambda: Processes(0))

    def outcomes(
        self, scenario: JsonMapping, jobs: Jobs, due: Iterable[int], asked: Asked = EVERYTHING
    ) -> Generator[tuple[int, list[Outcome]], None, None]:
        """(chunk, its outcomes), in no particular order; identical on every worker."""
        if self.scheduler:
            distributed = optional("distributed")
            try:
                try:
                    client = distributed.Client(self.scheduler, timeout="20 s")
                except (OSError, TypeError, ValueError) as error:  # TypeError: no keys are configured
                    problem = f"cannot be reached: {error}"
                    raise InputError(problem, field="scheduler", value=self.scheduler) from None
                with client:
                    yield from _computed(distributed, client, scenario, jobs, iter(due), asked)
            except (OSError, TimeoutError, CancelledError) as error:  # scheduler or network is gone
                raise _broken(error) from None
            return
        cases = ((number, jobs.sets(number)) for chunk in due for number in jobs.numbers(chunk))
        found: dict[int, dict[int, Outcome]] = {}
        for number, outcome in self.beside.outcomes(scenario, cases, self.threads, jobs.chunk, asked):
            chunk = number // jobs.chunk
            rows = found.setdefault(chunk, {})
            rows[number] = outcome
            if len(rows) == len(jobs.numbers(chunk)):
                yield chunk, [rows[number] for number in jobs.numbers(chunk)]
                del found[chunk]

    def in_order(
        self, scenario: Scenario, cases: Sequence[JsonMapping], asked: Asked, doing: str,
        report: Report | None,
    ) -> list[Outcome]:  # fmt: skip
        """The outcomes of a few cases, in their order."""
        described = scenario.resolved()
        found: dict[int, Outcome] = {}

        def ran(rest: list[int]) -> Iterator[engine.Numbered]:
            numbered = [(number, cases[number]) for number in rest]
            return self.beside.outcomes(described, numbered, self.threads, _FEW, asked)

        for number, outcome in kept_each(cases, ran, of=(described, asked)):
            found[number] = outcome
            if report is not None:
                report(len(found), len(cases), doing)
        return [found[number] for number in range(len(cases))]


@contextmanager
def pool(threads: int = 0, workers: int = 0, scheduler: str = "") -> Iterator[Pool]:
    """Threads and processes of this machine, or the Dask cluster at an address."""
    if scheduler and (notice := unprotected(scheduler)):
        warnings.warn(notice, stacklevel=3)
    count = workers or threads or processors()
    with Processes(0 if scheduler else count - 1, 0.0 if workers else PATIENCE) as beside:
        yield Pool(count, scheduler, beside)


def processors() -> int:
    """That this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
