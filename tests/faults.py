"""A disk that refuses, or a process that is killed, at its n-th change: old or new, never half."""

import contextlib
import errno
import os
import pathlib
import resource
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from afo_sim.common import writing

CHANGES = ("os.mkdir", "os.rename", "os.link", "os.truncate")
Contents = dict[str, bytes]


class Disk:
    """Counts the changes of files below a folder, and does something at one of them."""

    def __init__(self) -> None:
        self.folder, self.count, self.at, self.act = "", 0, 0, lambda: None
        sys.addaudithook(self._see)

    def _see(self, event: str, details: tuple[object, ...]) -> None:
        if not self.folder or event not in (*CHANGES, "open"):
            return
        path, *rest = details
        if event == "open" and not (isinstance(rest[1], int) and rest[1] & (os.O_WRONLY | os.O_RDWR)):
            return
        if isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith(self.folder):
            self.count += 1
            if self.count == self.at:
                self.act()

    @contextmanager
    def acting(self, folder: pathlib.Path, at: int, act: Callable[[], None]) -> Iterator[None]:
        """Act at the change number `at` below a folder."""
        self.folder, self.count, self.at, self.act = str(folder), 0, at, act
        try:
            yield
        finally:
            self.folder = ""


DISK = Disk()


def refuse() -> None:
    """Do as a full disk does."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def kill() -> None:
    """End this process without a word."""
    os.kill(os.getpid(), signal.SIGKILL)


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Refuse every write beyond `size` bytes, also in compiled libraries."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def contents(folder: pathlib.Path) -> Contents:
    """{name: bytes} of what a person sees below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    seen = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
    return {name: data for name, data in seen.items() if not any(p.startswith(".") for p in name.split("/"))}


def hidden(folder: pathlib.Path) -> list[str]:
    """Names that a person does not see."""
    return sorted(path.name for path in folder.rglob(".*"))


def in_child(work: Callable[[], object], at: int, folder: pathlib.Path, limit: int = 60) -> int:
    """Do work in a forked process that is killed at the change number `at`; its status.

    The process has a minute: where a thread of a library does not outlive the fork, the alarm ends it.
    """
    child = os.fork()
    if child == 0:
        code = 1
        with contextlib.suppress(BaseException):
            signal.alarm(limit)
            with DISK.acting(folder, at, kill):
                work()
            code = 0
        os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def settle(folder: pathlib.Path) -> None:
    """Complete what a killed process has left complete, as every reader and writer of a group does."""
    for place in (folder, *(path for path in folder.rglob("*") if path.is_dir())):
        if place.is_dir() and not place.name.startswith("."):
            writing.settle(place)
