"""A limit on the time that a controller may take for a command."""

import ctypes
import threading
import time
import weakref
from collections.abc import Callable
from typing import TypeVar

A = TypeVar("A")
R = TypeVar("R")
INTERVAL = 0.05  # between two looks at the clock [s]


class TookTooLong(BaseException):
    """Raised inside a call that takes too long; no Exception, so that `except Exception` lets it pass."""


class Watch:
    """Calls functions, and interrupts one that takes longer than a limit."""

    def __init__(self, limit: float):
        self.limit = limit
        self._lock = threading.Lock()
        self._since: float | None = None  # the start of the present call, on the monotonic clock
        self._caller = 0

    def call(self, function: Callable[[A], R], argument: A) -> R:
        """The function's result; TookTooLong where it takes too long, or what the function raises."""
        _LOOKER.watch(self)
        start = time.monotonic()
        try:
            with self._lock:
                self._since, self._caller = start, threading.get_ident()
            try:
                found = function(argument)
            finally:
                self._end()
        except TookTooLong:
            self._end()
            raise TookTooLong from None
        if time.monotonic() - start > self.limit:
            raise TookTooLong
        return found

    def _end(self) -> None:
        """The call is over: nothing interrupts this thread any more, and nothing that was sent arrives."""
        with self._lock:
            self._since = None
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._caller), None)

    def look(self) -> None:
        """Interrupt the present call if it is late; then again after a further limit, should it go on."""
        with self._lock:
            if self._since is None or time.monotonic() - self._since <= self.limit:
                return
            self._since = time.monotonic()
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(self._caller), ctypes.py_object(TookTooLong)
            )


class _Looker:
    """The thread that looks at the clock, and the calls that it looks at; begun with the first call."""

    def __init__(self) -> None:
        self.watches: weakref.WeakSet[Watch] = weakref.WeakSet()
        self.lock = threading.Lock()
        self.thread: threading.Thread | None = None

    def watch(self, watch: Watch) -> None:
        """Look at the calls of a Watch from now on; a process that was forked begins a thread of its own."""
        if watch in self.watches and self.thread is not None and self.thread.is_alive():
            return
        with self.lock:
            self.watches.add(watch)
            if self.thread is None or not self.thread.is_alive():
                self.thread = threading.Thread(target=self.look, name="controllers' time limit", daemon=True)
                self.thread.start()

    def look(self) -> None:
        """Interrupt late calls, forever."""
        while True:
            time.sleep(INTERVAL)
            with self.lock:
                watches = list(self.watches)
            for watch in watches:
                watch.look()
            del watches


_LOOKER = _Looker()
