"""The callbacks held for the life of an object: installed by the first holder, restored after the last."""

import weakref
from types import TracebackType
from typing import NoReturn, Self

from afo_sim.common.errors import CallbackError
from afo_sim.native.install import CALLBACKS, Mode


class Closing:
    """What is closed at the end of a `with` block."""

    def close(self) -> None:
        """Give back what is held; a second call does nothing."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Hold(Closing):
    """One holder of the callbacks; `close` gives them back, and garbage collection or the end of Python too.

    MuJoCo has one pair of callbacks in a process. Any number of holders, and blocks of `installed`, share it
    and may end in any order: the first installs, the last restores what was there before.

    Parameters
    ----------
    mode : "native" (compiled) or "python" (the same kernels, uncompiled); one for all who hold at a time

    Raises
    ------
    CallbackError
        Another program's callback is installed, or this package's are held in the other mode.
    """

    def __init__(self, mode: Mode = "native"):
        holder = object()
        CALLBACKS.take(holder, mode)
        self._end = weakref.finalize(self, CALLBACKS.give, holder)

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self._end()

    @property
    def closed(self) -> bool:
        """Whether they have been given back."""
        return not self._end.alive

    def check(self) -> None:
        """Refuse to go on where muscles would be limp; it costs three microseconds.

        Raises
        ------
        CallbackError
            This holder is closed, or somebody has replaced a callback.
        """
        if not self._end.alive:
            raise CallbackError("is closed: the muscle callbacks were given back, and muscles would be limp")
        CALLBACKS.check()

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Hold is neither copied nor pickled: whoever needs the callbacks opens another")
