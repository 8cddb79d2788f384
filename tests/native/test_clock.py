"""MuJoCo's clock is off while something rolls out, and back afterwards."""

import ctypes
import threading

import pytest

from afo_sim import native
from afo_sim.native import mujoco_library


def clock() -> int | None:
    return ctypes.c_void_p.in_dll(ctypes.CDLL(str(mujoco_library())), "mjcb_time").value


def test_clock_is_off_within_and_back_after() -> None:
    before = clock()
    assert before, "MuJoCo's bindings have a clock"
    with native.without_clock():
        assert clock() is None
        with native.without_clock():
            pass
        assert clock() is None
    assert clock() == before
    with pytest.raises(ZeroDivisionError), native.without_clock():
        _ = 1 / 0
    assert clock() == before


def test_two_threads_do_not_put_it_back_under_each_other() -> None:
    before, inside, leave = clock(), threading.Barrier(2), threading.Event()
    seen: list[int | None] = []

    def longer() -> None:
        with native.without_clock():
            inside.wait()
            leave.wait()
            seen.append(clock())

    thread = threading.Thread(target=longer)
    thread.start()
    with native.without_clock():
        inside.wait()
    seen.append(clock())
    leave.set()
    thread.join()
    assert seen == [None, None]
    assert clock() == before
