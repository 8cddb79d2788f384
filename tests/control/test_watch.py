"""A controller's call is interrupted when it takes too long, and only then."""

import gc
import threading
import time
import weakref

import pytest

from afo_sim.control import TookTooLong, Watch

LIMIT = 0.15  # [s]


def endless(_: object) -> None:
    while True:
        pass


def stubborn(_: object) -> None:
    while True:
        try:
            while True:
                pass
        except Exception:
            continue


def test_endless_loops_are_interrupted_also_those_that_catch_exceptions() -> None:
    watch = Watch(LIMIT)
    for function in (endless, stubborn):
        start = time.monotonic()
        with pytest.raises(TookTooLong):
            watch.call(function, None)
        assert time.monotonic() - start >= LIMIT
    assert watch.call(lambda x: x + 1, 1) == 2  # and nothing arrives later
    assert sum(k for k in range(300_000)) == 44999850000


def test_a_call_that_waits_in_compiled_code_is_found_late() -> None:
    with pytest.raises(TookTooLong):
        Watch(LIMIT).call(lambda _: time.sleep(2.0 * LIMIT), None)


def test_another_thread_is_interrupted_and_this_one_is_not() -> None:
    found: list[BaseException] = []

    def other() -> None:
        try:
            Watch(LIMIT).call(endless, None)
        except TookTooLong as error:
            found.append(error)

    thread = threading.Thread(target=other)
    thread.start()
    thread.join(20.0)
    assert len(found) == 1 and not thread.is_alive()


def test_calls_in_time_give_their_results_and_what_they_raise() -> None:
    watch = Watch(30.0)
    assert [watch.call(lambda k: 2 * k, k) for k in range(5000)] == list(range(0, 10_000, 2))
    with pytest.raises(KeyError):
        watch.call(lambda _: {}["no"], None)
    with pytest.raises(KeyboardInterrupt):
        watch.call(_interrupted, None)


def _interrupted(_: object) -> None:
    raise KeyboardInterrupt


def test_many_watches_share_a_thread_and_are_forgotten() -> None:
    before = threading.active_count()
    watches = [Watch(30.0) for _ in range(200)]
    for watch in watches:
        watch.call(lambda _: None, None)
    assert threading.active_count() <= before + 1
    gone = weakref.ref(watches[0])
    del watches, watch
    deadline = time.monotonic() + 20.0
    while gone() is not None and time.monotonic() < deadline:
        gc.collect()
        time.sleep(0.02)
    assert gone() is None


def test_no_limit_is_none() -> None:
    assert Watch(float("inf")).call(lambda _: 3, None) == 3
