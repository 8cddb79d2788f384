"""The process of the command line: its signals, its standard streams, its last message.

The first signal stops the command as an error would: unfinished files are removed. A second one ends the
process at once, and so does one that comes when the command is over.
"""

import contextlib
import io
import os
import signal
import sys
import threading
from types import FrameType
from typing import NoReturn

_STOPPED, _BUG = 128, 70  # exit codes: by a signal, and its number; a fault of this program


def main() -> NoReturn:
    """Run a command as this process's program, to its end; `afo-sim --help` lists the exit codes."""
    Program().run()


# Python would remember of a plain KeyboardInterrupt that it has passed an `exec`, and end by SIGINT.
class Stopped(KeyboardInterrupt):
    """A signal has come."""


class Program:
    """One run of the command line in a process of its own."""

    def __init__(self) -> None:
        self.received: list[int] = []
        self.finished = False

    def run(self) -> NoReturn:
        """Run the command of `sys.argv`, and exit."""
        try:
            sys.excepthook = lambda kind, error, trace: os._exit(self._final_message(error))
            sys.unraisablehook = self._swallowed
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup wants it
                    signal.signal(number, self._stop)
            _open_streams()
            if "video" not in sys.argv:  # MuJoCo would start a Python to look for what opens windows
                os.environ.setdefault("MUJOCO_GL", "disable")
            from afo_sim.cli import error_handler
            from afo_sim.cli.commands import app

            code = error_handler.run(app, self.received)
        except BaseException as error:  # of an import, or of the report on another error
            code = self._final_message(error)
        self.finished = True
        sys.exit(_STOPPED + self.received[0] if self.received and code else code)

    def _stop(self, number: int, _: FrameType | None) -> None:
        self.received.append(number)
        if self.finished or len(self.received) > 1:
            os._exit(self._final_message(Stopped()))
        raise Stopped

    def _swallowed(self, unraisable: "sys.UnraisableHookArgs") -> None:
        """Send a signal again that came in a destructor or a callback, where nothing can be raised."""
        if isinstance(unraisable.exc_value, Stopped) and self.received:
            threading.Timer(0.01, signal.raise_signal, [self.received.pop()]).start()
        else:
            sys.__unraisablehook__(unraisable)

    def _final_message(self, error: BaseException) -> int:
        words = "stopped" if self.received else f"this is a bug in afo-sim ({type(error).__name__})"
        if not self.finished:
            self.finished = True
            with contextlib.suppress(OSError):
                os.write(2, f"afo-sim: {words}\n".encode())
        return _STOPPED + self.received[0] if self.received else _BUG


def _open_streams() -> None:
    """Print what an encoding has not with backslashes, and not into later files if closed (`>&-`)."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
