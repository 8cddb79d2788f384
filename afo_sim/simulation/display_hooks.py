"""Registration of the pictures of recordings, and of their files for other programs.

The rooms above register them here: a computed result does not know how it is shown.
"""

import os
import pathlib
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

Recording = Any  # of `recording`, which asks this module to be shown


class Show(Protocol):
    """Pictures of recordings."""

    def write(self, recording: Recording, path: pathlib.Path, rate: float | None = None) -> object:
        """Write a Rerun recording, at `rate` samples a second [Hz]; the run's own by default."""
        ...

    def open(self, paths: Sequence[pathlib.Path]) -> object:
        """Open Rerun recordings in the viewer."""
        ...

    def html(self, recording: Recording) -> str:
        """A recording as a notebook shows it."""
        ...

    def both(self, legs: Any, path: pathlib.Path) -> object:
        """Write a picture of two legs on one supply."""
        ...

    def export(
        self,
        recording: Recording,
        out: str | os.PathLike[str],
        to: str | None,
        rate: float | None,
        columns: Iterable[str],
        force: bool,
    ) -> tuple[pathlib.Path, ...]:
        """Write a recording for another program: the files."""
        ...


_shows: list[Show] = []


def show_with(show: Show) -> None:
    """Register `show` as the pictures of recordings from now on."""
    _shows[:] = [show]


def shown() -> Show:
    """The registered pictures of recordings.

    Raises
    ------
    RuntimeError
        None is registered; the package registers its own when it is imported.
    """
    if not _shows:
        raise RuntimeError("nothing is there to show a recording; call show_with first")
    return _shows[0]
