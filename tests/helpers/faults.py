"""A disk that refuses, or a process that is killed, at its n-th change: old or new, never half."""

import contextlib
import errno
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from afo_sim.common import writing

CHANGES = ("os.mkdir", "os.rename", "os.link", "os.truncate")
REMOVALS = ("os.remove", "os.rmdir")
PROGRAM = """
import pathlib, sys, faults
from afo_sim import cli
at, folder, *line = sys.argv[1:]
sys.argv = ["afo-sim", *line]
with faults.DISK.acting(pathlib.Path(folder), int(at), faults.kill, removals=True):
    cli.main()
"""
MOMENTS = """
import atexit, json, os, pathlib, sys, threading, time
from afo_sim.cli import main
times, number, at, delay, *line = sys.argv[1:]
passed = []
def see(event, details):
    passed.append(time.monotonic())
    if len(passed) == int(at):
        go = lambda: os.kill(os.getpid(), int(number))
        threading.Timer(float(delay), go).start() if float(delay) else go()
atexit.register(lambda: pathlib.Path(times).write_text(json.dumps(passed)))
sys.addaudithook(see)
sys.argv = ["afo-sim", *line]
main()
"""
Contents = dict[str, bytes]


class Disk:
    """Counts the changes of files below a folder, and does something at one of them."""

    def __init__(self) -> None:
        self.folder, self.count, self.at, self.act = "", 0, 0, lambda: None
        self.events: tuple[str, ...] = CHANGES
        sys.addaudithook(self._see)

    def _see(self, event: str, details: tuple[object, ...]) -> None:
        if not self.folder or event not in (*self.events, "open"):
            return
        path, *rest = details
        if event == "open" and not (isinstance(rest[1], int) and rest[1] & (os.O_WRONLY | os.O_RDWR)):
            return
        if isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith(self.folder):
            self.count += 1
            if self.count == self.at:
                self.act()

    @contextmanager
    def acting(
        self, folder: pathlib.Path, at: int, act: Callable[[], None], *, removals: bool = False
    ) -> Iterator[None]:
        """Act at the change number `at` below a folder; removals are changes too where told."""
        self.events = (*CHANGES, *REMOVALS) if removals else CHANGES
        self.folder, self.count, self.at, self.act = str(folder), 0, at, act
        try:
            yield
        finally:
            self.folder = ""


DISK = Disk()


def refuse(number: int = errno.ENOSPC) -> None:
    """Do as a full disk does, or as the system does for another reason."""
    raise OSError(number, os.strerror(number))


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
            with DISK.acting(folder, at, kill, removals=True):
                work()
            code = 0
        os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def silent() -> None:
    """Print nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


def in_program(line: list[str], at: int, folder: pathlib.Path) -> int:
    """`afo-sim LINE` in a new process that is killed at the change number `at`; its status."""
    command = [sys.executable, "-c", PROGRAM, str(at), str(folder), *line]
    return subprocess.run(command, env=_environment(), capture_output=True, timeout=120).returncode


def _environment() -> dict[str, str]:
    """Without MuJoCo's window library, which asks for its version in a process of its own."""
    here = pathlib.Path(__file__).parent
    return os.environ | {
        "PYTHONPATH": os.pathsep.join([str(here.parents[1]), str(here)]),
        "MUJOCO_GL": "disable",
    }


def at_moment(
    line: list[str], times: pathlib.Path, number: int = 0, at: int = 0, delay: float = 0.0
) -> tuple[int, str]:
    """`afo-sim LINE` in a new process that a signal reaches `delay` seconds after its event number `at`.

    Events are those of Python's audit: imports, files, compilations. Returned are status and complaints; the
    times of the events [s] of a process that was not stopped stand in a file.
    """
    command = [sys.executable, "-c", MOMENTS, str(times), str(number), str(at), str(delay), *line]
    with subprocess.Popen(
        command,
        env=_environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    ) as process:
        complaint = process.communicate(timeout=120)[1]
    until = time.monotonic() + 5.0
    with contextlib.suppress(ProcessLookupError):  # no child of it lives on
        while time.monotonic() < until:
            os.killpg(process.pid, 0)
        raise AssertionError(f"a child of {line} lives on")
    return process.returncode, complaint


def settle(folder: pathlib.Path) -> None:
    """Complete what a killed process has left complete, as every reader and writer of a group does."""
    for place in (folder, *(path for path in folder.rglob("*") if path.is_dir())):
        if place.is_dir() and not place.name.startswith("."):
            writing.settle(place)
