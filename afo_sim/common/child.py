"""Child processes under supervision, and the environment of any: nothing of the current folder is run."""

import importlib
import os
import pathlib
import pickle
import platform
import queue
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import IO

from afo_sim.common.errors import AfoSimError
from afo_sim.common.open_types import Function, Mixed

SAFE = "PYTHONSAFEPATH"  # environment: Python leaves the current folder out of the places of its modules
# an empty entry is the current folder
_LISTS = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH")
_PACKAGE = pathlib.Path(__file__).resolve().parents[1] / "__init__.py"
_START = f"""
import importlib.util as u, sys
found = u.spec_from_file_location("afo_sim", {str(_PACKAGE)!r})
sys.modules["afo_sim"] = u.module_from_spec(found)
found.loader.exec_module(sys.modules["afo_sim"])
from afo_sim.common.child import _serve
_serve()
"""  # of this package, wherever another one of its name lies
# For code of others, where the system has such limits: memory and file [B], open files, memory dumps
LIMITS = {"AS": 2 << 30, "FSIZE": 256 << 20, "NOFILE": 64, "CORE": 0}
ALONE = LIMITS | {"NPROC": 0}  # it starts no process or thread either, and sends no signal
_HINTS = {"SIGKILL": " (out of memory?)", "SIGSYS": " (it may start no process and send no signal)"}
_DEATH_SIGNAL, _FILTER, _NO_PRIVILEGES = 1, 22, 38  # options of Linux's prctl
# {processor: its mark, and its calls fork, vfork, clone, clone3, kill}
_CALLS = {"x86_64": (0xC000003E, 57, 58, 56, 435, 62), "aarch64": (0xC00000B7, 220, 435, 129)}


class ChildEnded(AfoSimError):
    """A child has ended, or was ended since it did not answer; the words say how, as a predicate."""


class Child:
    """A Python process of this package that is sent messages, and sends some; it ends when this one does.

    serves : "module:function", called there with a function to receive a message and one to send one
    limits : LIMITS or ALONE, which bind it; what it prints then goes nowhere
    """

    process: subprocess.Popen[bytes]

    def __init__(self, serves: str, limits: Mapping[str, int] | None = None) -> None:
        self._arrived: queue.SimpleQueue[Mixed] = queue.SimpleQueue()
        # Linux ends a child with the thread that has started it: this one lives as long.
        threading.Thread(target=self._live, args=(limits is not None,), daemon=True).start()
        if (error := self._arrived.get()) is not None:
            raise error
        self.send((serves, limits))

    def _live(self, quiet: bool) -> None:
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-c", _START],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL if quiet else None,
                env=child_environment(),
                start_new_session=True,  # Ctrl-C is this process's to answer
            )
        except OSError as error:
            return self._arrived.put(error)
        self._arrived.put(None)
        with suppress(OSError), self.process:  # what was not sent cannot be
            closed = _listen(self.process.stdout, self._arrived)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(1.0)
            code = self.process.returncode
            self._kill()  # what it has started, too
        if code is None:
            how = "has closed its files" if closed else "has sent what is no answer"
        elif code >= 0:
            how = f"ended itself (exit code {code})"
        else:
            name = next((each.name for each in signal.Signals if each == -code), f"signal {-code}")
            how = f"was stopped by {name}{_HINTS.get(name, '')}"
        self._arrived.put(ChildEnded(how))

    def _kill(self) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, 9) if hasattr(os, "killpg") else self.process.kill()

    def send(self, message: Mixed) -> None:
        """Send a message; where the child has ended, `receive` says so."""
        content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        with suppress(OSError, ValueError):  # its file is closed, too, once it has ended
            _write(self.process.stdin, content)

    def receive(self, seconds: float | None = None) -> Mixed:
        """The next message; ChildEnded where it has ended, or sends none for so long: it is ended then."""
        try:
            found = self._arrived.get(timeout=seconds)
        except queue.Empty:
            self.close()
            raise ChildEnded(f"gave no answer within {seconds:g} s") from None
        if isinstance(found, ChildEnded):
            self._arrived.put(found)  # for who asks again
            raise found
        return found

    def close(self) -> None:
        """End it, and all that it has started, at once."""
        if self.process.poll() is None:
            self._kill()
        self.process.wait()


def _listen(stream: IO[bytes] | None, arrived: queue.SimpleQueue[Mixed]) -> bool:
    """Take messages to the end; whether that is an end, and not what is no message."""
    assert stream is not None
    try:
        while True:
            arrived.put(pickle.load(stream))
    except Exception as error:  # whatever pickle raises of what somebody else has written
        return isinstance(error, EOFError)


def _write(stream: IO[bytes] | None, content: bytes) -> None:
    assert stream is not None
    stream.write(content)
    stream.flush()


def _serve() -> None:
    """The whole life of a child."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    takes, sends = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what anybody prints is no message
    arrived: queue.SimpleQueue[Mixed] = queue.SimpleQueue()

    parent = os.getppid()

    def listen() -> None:
        _listen(takes, arrived)
        time.sleep(0.1)  # a parent that ends closes its files first
        if hasattr(os, "killpg") and os.getppid() != parent:  # nobody else ends what this one has started
            os.killpg(0, 9)
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    _prctl(_DEATH_SIGNAL, 9)  # also where this thread is in an endless loop in C
    serves, limits = arrived.get()
    module, function = serves.split(":")
    serve: Function = getattr(importlib.import_module(module), function)
    _bind(limits or {})
    serve(arrived.get, lambda message: _write(sends, pickle.dumps(message, pickle.HIGHEST_PROTOCOL)))


def _bind(limits: Mapping[str, int]) -> None:
    """Set limits of this process and of what it starts."""
    with suppress(ImportError):  # Windows
        import resource

        for name, most in limits.items():
            with suppress(ValueError, OSError):  # macOS has not all of them
                resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (most, most))
    calls = _CALLS.get(platform.machine())
    if "NPROC" in limits and calls:  # of which root has no limit
        import ctypes

        steps = [(0x20, 0, 0, 4), (0x15, 0, len(calls), calls[0]), (0x20, 0, 0, 0)]  # is it this processor?
        steps += [(0x15, len(calls) - k, 0, call) for k, call in enumerate(calls[1:], 1)]
        steps += [(6, 0, 0, 0x7FFF0000), (6, 0, 0, 0x80000000)]  # it may; it ends the process
        code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in steps))
        _prctl(_NO_PRIVILEGES, 1)
        _prctl(_FILTER, 2, struct.pack("HP", len(steps), ctypes.addressof(code)))


def _prctl(option: int, *values: int | bytes) -> None:
    """Set what only Linux's processes have."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(option, *values, *[0] * (4 - len(values)))


def complaint(command: Sequence[str], folder: pathlib.Path, seconds: float = 60.0) -> str:
    """What a compiler under LIMITS complains of, or nothing; `folder` is for its temporary files."""
    child = Child(f"{__name__}:_run", LIMITS)
    try:
        child.send((list(command), {"LC_ALL": "C", "TMPDIR": str(folder)}))
        return str(child.receive(seconds))
    except ChildEnded as error:
        return f"it {error}"
    finally:
        child.close()


def _run(receive: Function, send: Function) -> None:
    """Run a program that is asked for, and send what it complains of."""
    _prctl(_DEATH_SIGNAL, 0)  # who listens to the parent ends the program, too
    command, own = receive()
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, env=os.environ | own)
    said = done.stderr.decode(errors="replace").splitlines() or [f"it says nothing ({done.returncode})"]
    send(next((text for text in said if "error" in text), said[-1])[:1000] if done.returncode else "")


def child_environment(own: Mapping[str, str] | None = None) -> dict[str, str]:
    """This process's environment for a child, without the current folder in any list of places."""
    found = {name: value for name, value in os.environ.items() if name != "PYTHONSTARTUP"}
    for name in found.keys() & set(_LISTS):
        places = [pathlib.Path(place) for place in found[name].split(os.pathsep)]
        elsewhere = [p for p in places if p.is_absolute() and p.resolve() != pathlib.Path.cwd()]
        found[name] = os.pathsep.join(map(str, elsewhere))
    return {name: value for name, value in found.items() if value} | {SAFE: "1"} | dict(own or {})


@contextmanager
def safe_children() -> Iterator[None]:
    """A block in which libraries start Python without the current folder among the places of its modules."""
    before = os.environ.get(SAFE)
    os.environ[SAFE] = "1"
    try:
        yield
    finally:
        os.environ.pop(SAFE)
        if before is not None:
            os.environ[SAFE] = before
