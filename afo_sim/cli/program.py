"""The process of the command line: its signals, its standard streams, its last words.

The first signal stops the command as an error would: unfinished files are removed. A second one ends the
process at once, and so does one that comes when the command is over. What a process leaves unfinished has a
hidden name, which the next one removes.
"""

import contextlib
import io
import os
import signal
import sys
import threading
from types import FrameType
from typing import Any, NoReturn

_STOPPED, _BUG = 128, 70  # exit codes: by a signal, and its number; a fault of this program


def main() -> NoReturn:
    """Run a command as this process's program, to its end; `afo-sim --help` lists the exit codes."""
    Program().run()


# Of KeyboardInterrupt itself Python would keep in mind that it has passed an `exec`, and end by SIGINT.
class Stopped(KeyboardInterrupt):
    """A signal has come."""


class Program:
    """One run of the command line in a process of its own.

    came : signals, in their order
    over : whether the exit code is known
    """

    def __init__(self) -> None:
        self.came: list[int] = []
        self.over = False

    def run(self) -> NoReturn:
        """Run the command of `sys.argv`, and exit."""
        try:
            self._mind_signals()
            _open_streams()
            from afo_sim.cli import error_handler
            from afo_sim.cli.commands import app

            code = error_handler.run(app, self.came)
        except BaseException as error:  # of an import, or of the report on another error
            code = self._last_words(error)
        self.over = True
        sys.exit(_STOPPED + self.came[0] if self.came and code else code)

    def _mind_signals(self) -> None:
        sys.excepthook = lambda kind, error, trace: os._exit(self._last_words(error))
        sys.unraisablehook = self._swallowed
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup wants it
                signal.signal(number, self._stop)

    def _stop(self, number: int, _: FrameType | None) -> None:
        self.came.append(number)
        if self.over or len(self.came) > 1:
            os._exit(self._last_words(Stopped()))
        raise Stopped

    def _swallowed(self, unraisable: Any) -> None:
        """Send a signal again that came in a destructor or a callback, where nothing can be raised."""
        if isinstance(unraisable.exc_value, Stopped) and self.came:
            threading.Timer(0.01, signal.raise_signal, [self.came.pop()]).start()
        else:
            sys.__unraisablehook__(unraisable)

    def _last_words(self, error: BaseException) -> int:
        """Say why it ends by what cannot fail, once; the exit code."""
        words = "stopped" if self.came else f"this is a bug in afo-sim ({type(error).__name__})"
        if not self.over:
            self.over = True
            with contextlib.suppress(OSError):
                os.write(2, f"afo-sim: {words}\n".encode())
        return _STOPPED + self.came[0] if self.came else _BUG


def _open_streams() -> None:
    """Print what an encoding has not with backslashes, and nowhere where a stream is closed, as by `>&-`.

    A file that is opened later would else become the closed stream, and libraries would print into it.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
