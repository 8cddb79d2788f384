"""Chunks computed by a Dask cluster: one on this machine, or one that is running somewhere."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from afo_sim.errors import InputError
from afo_sim.sweep import engine
from afo_sim.sweep.engine import Outcome

if TYPE_CHECKING:
    from afo_sim.sweep.store import Store

AHEAD = 3  # chunks that wait for each worker, so that none of them waits


def chunks(
    scenario: Mapping[str, Any], store: "Store", pending: list[int], workers: int, scheduler: str
) -> Iterator[tuple[int, list[Outcome]]]:
    """Chunks as workers return them, in no particular order.

    A worker that dies takes no row with it and doubles none: its chunk is computed again by another, and
    rows are written here alone.

    Parameters
    ----------
    scenario : what all cases begin with
    store : of the sweep
    pending : chunks to compute
    workers : processes to start on this machine, where there is no scheduler
    scheduler : address of a running one, or ""

    Raises
    ------
    InputError
        Dask is not installed, the scheduler cannot be reached, or a chunk kills worker after worker.
    """
    try:
        import distributed
    except ImportError:
        raise InputError(
            "this needs the library dask.distributed", allowed="after: pip install 'afo-sim[cluster]'"
        ) from None
    with ExitStack() as open_things:
        client = open_things.enter_context(_client(distributed, workers, scheduler))
        ahead = AHEAD * max(workers, len(client.scheduler_info()["workers"]), 1)
        waiting = iter(pending)
        running = distributed.as_completed()
        numbers = {}

        def submit() -> None:
            chunk = next(waiting, None)
            if chunk is not None:
                cases = [(number, store.cases.sets(number)) for number in store.numbers(chunk)]
                future = client.submit(compute, scenario, cases, pure=False)
                numbers[future.key] = chunk
                running.add(future)

        for _ in range(ahead):
            submit()
        lost = []
        for future in running:
            chunk = numbers.pop(future.key)
            submit()
            error = future.exception()
            if isinstance(error, distributed.KilledWorker):
                lost.append(chunk)
            elif error is not None:
                raise error
            else:
                yield chunk, future.result()
        if lost:
            raise InputError(
                f"chunks {', '.join(map(str, lost))} killed every worker that took them (out of memory?); "
                "all others are computed",
                field="--workers",
                allowed="the same command again, with fewer workers or a smaller chunk in the sweep file",
            )


def compute(scenario: Mapping[str, Any], cases: list[tuple[int, dict[str, Any]]]) -> list[Outcome]:
    """A chunk's outcomes in order, on whatever machine this is called."""
    found = dict(engine.outcomes(scenario, cases, threads=1, chunk=len(cases)))
    return [found[number] for number, _ in cases]


def _client(distributed: Any, workers: int, scheduler: str) -> Any:
    if scheduler:
        try:
            return distributed.Client(scheduler, timeout="20 s")
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be reached: {error}", field="--scheduler", value=scheduler) from None
    return distributed.Client(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address=None,
    )
