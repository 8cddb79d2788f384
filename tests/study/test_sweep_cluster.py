"""Sweeps on a Dask cluster of this machine: the same rows, also when a worker is killed."""

import os
import pathlib
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from installed import needs
from sweep_runs import SEATED, SWEEP, assert_same, exact, opened, swept, table, written

from afo_sim.common import InputError
from afo_sim.description import expand
from afo_sim.study import engine, folder, runner
from afo_sim.study.pool import compute, pool, unprotected

# warnings of a cluster that is torn down; processes that start, wait and die
pytestmark = [needs("distributed"), pytest.mark.filterwarnings("ignore"), pytest.mark.slow]


OPTIONS = {"threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": None}


@pytest.fixture
def two_workers() -> Iterator[Any]:
    import distributed

    with distributed.LocalCluster(n_workers=2, processes=True, **OPTIONS) as local:
        yield local


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clients that give a scheduler up after a second."""
    import distributed

    real = distributed.Client
    monkeypatch.setattr(
        distributed, "Client", lambda address, **options: real(address, **options | {"timeout": "1 s"})
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return swept(tmp_path_factory.mktemp("whole"))


def test_local_workers_give_the_same_rows(whole: Any, tmp_path: pathlib.Path) -> None:
    assert_same(whole, swept(tmp_path, workers=2))


@pytest.mark.parametrize(
    "address", ["tcp://10.0.0.7:8786", "10.0.0.7:8786", "ws://lab:1", "tcp://[2001:db8::1]:8786"]
)
def test_a_scheduler_without_keys_is_warned_of(address: str) -> None:
    with (
        pytest.warns(UserWarning, match="has no TLS: whoever reaches that scheduler can run code as you"),
        pool(scheduler=address),
    ):
        pass


@pytest.mark.parametrize(
    "address", ["tls://10.0.0.7:8786", "tcp://127.0.0.1:8786", "localhost:8786", "tcp://[::1]:8786"]
)
def test_a_scheduler_with_keys_or_here_is_not(address: str) -> None:
    assert unprotected(address) is None


def test_a_killed_worker_loses_and_doubles_no_row(
    whole: Any, tmp_path: pathlib.Path, two_workers: Any
) -> None:
    import distributed

    sweep = opened(written(tmp_path, SWEEP, chunk=1), tmp_path / "out")
    with distributed.Client(two_workers) as client:
        pids = list(client.run(os.getpid).values())
    killed = []

    def kill_one(state: runner.SweepProgress) -> None:
        if state.new == 3:
            os.kill(pids[0], signal.SIGKILL)
            killed.append(state.done)

    state = runner.run(sweep, scheduler=two_workers.scheduler_address, report=kill_one)
    assert killed == [3]
    assert (state.new, state.done) == (14, 14)
    assert_same(whole, table(tmp_path / "out"))
    with distributed.Client(two_workers) as client:
        assert pids[0] not in client.run(os.getpid).values()


def test_a_chunk_that_ends_its_workers_is_named_with_the_last_of_them(
    tmp_path: pathlib.Path, two_workers: Any
) -> None:
    """Here the first that ends; the others' chunks are computed."""
    import distributed

    sweep = opened(written(tmp_path, SWEEP, chunk=1), tmp_path / "out")
    two_workers.scheduler.allowed_failures = 0
    addresses = [worker.address for worker in two_workers.scheduler.workers.values()]
    with distributed.Client(two_workers) as client:
        pids = list(client.run(os.getpid).values())

    def kill_one(state: runner.SweepProgress) -> None:
        if state.new == 3:
            os.kill(pids[0], signal.SIGKILL)

    with pytest.raises(InputError) as told:
        runner.run(sweep, scheduler=two_workers.scheduler_address, report=kill_one)
    assert any(address in str(told.value) for address in addresses)
    assert all(f" {chunk} (" in str(told.value) for chunk in sweep.pending()) and sweep.pending()
    runner.run(sweep)
    assert table(tmp_path / "out")["case"].to_pylist() == list(range(14))


def test_workers_that_come_late_are_waited_for_and_used(tmp_path: pathlib.Path) -> None:
    import distributed

    with distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp://", **OPTIONS) as local:
        late = threading.Timer(1.0, local.scale, [2])
        late.start()
        rows = swept(tmp_path, SEATED, chunk=1, scheduler=local.scheduler_address)
        late.join()
    assert rows["status"].to_pylist() == ["ok"] * 12


def test_a_worker_of_many_threads_takes_one_chunk_at_a_time() -> None:
    scenario = expand("scenario", "seated")
    sets = [{"duration": "0.3 s", "supply.pressure": f"{2.0 + 0.01 * k!r} bar"} for k in range(32)]
    chunks = [[(k, sets[k]) for k in range(first, first + 4)] for first in range(0, 32, 4)]
    alone = [[outcome for _, outcome in sorted(engine.outcomes(scenario, chunk))] for chunk in chunks]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(lambda chunk: compute(scenario, chunk), chunks))
    for found, expected in zip(together, alone, strict=True):
        assert [exact(outcome) for outcome in found] == [exact(outcome) for outcome in expected]


def test_a_worker_with_other_code_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [(0, {"duration": "0.3 s"})]
    other = folder.program() | {"versions": folder.program()["versions"] | {"mujoco": "3.0"}}
    with pytest.raises(InputError, match=r"other code.*mujoco .*, not 3\.0"):
        compute(expand("scenario", "seated"), cases, other)
    with pytest.raises(InputError, match="other code than this process: of afo-sim"):
        compute(expand("scenario", "seated"), cases, folder.program() | {"code": "0"})


@pytest.mark.usefixtures("impatient")
def test_a_scheduler_that_is_not_there(tmp_path: pathlib.Path) -> None:
    sweep = opened(written(tmp_path, SEATED), tmp_path / "out")
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match="cannot be reached"):
            runner.run(sweep, scheduler=address)


@pytest.mark.usefixtures("impatient")
def test_a_scheduler_that_goes_away_is_said_and_the_sweep_goes_on(whole: Any, tmp_path: pathlib.Path) -> None:
    import distributed

    sweep = opened(written(tmp_path, SWEEP, chunk=1), tmp_path / "out")
    local = distributed.LocalCluster(n_workers=1, processes=True, **OPTIONS)

    def close(state: runner.SweepProgress) -> None:
        if state.new == 3:
            local.close()
            time.sleep(0.1)

    with pytest.raises(InputError, match="same command again"):
        runner.run(sweep, scheduler=local.scheduler_address, report=close)
    assert not sweep.finished and len(sweep.pending()) <= 23
    runner.run(sweep)
    assert_same(whole, table(tmp_path / "out"))
