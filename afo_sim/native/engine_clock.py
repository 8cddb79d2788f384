"""MuJoCo's own clock, off while steps are counted in millions.

MuJoCo's Python bindings give the library a clock, `mjcb_time`, which every step reads many times for its
timers. The bindings' own setter does not take it off. The library exports the pointer; while it is null
no step reads a clock.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from afo_sim.native.compiled import mujoco_library


class _Stopped:
    """How many blocks want the clock off, and the clock that the last of them puts back."""

    lock = threading.Lock()
    blocks = 0
    clock: int | None = None


@contextmanager
def without_clock() -> Iterator[None]:
    """Take MuJoCo's clock off for a block, in all threads; the last block that ends puts it back."""
    try:
        pointer = ctypes.c_void_p.in_dll(ctypes.CDLL(str(mujoco_library())), "mjcb_time")
    except (OSError, ValueError):
        yield
        return
    with _Stopped.lock:
        if _Stopped.blocks == 0:
            _Stopped.clock = pointer.value
            pointer.value = None
        _Stopped.blocks += 1
    try:
        yield
    finally:
        with _Stopped.lock:
            _Stopped.blocks -= 1
            if _Stopped.blocks == 0:
                pointer.value = _Stopped.clock
