"""Files that appear whole or not at all."""

import errno
import os
import pathlib
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from afo_sim.common.errors import InputError


@contextmanager
def replacing(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A temporary path beside `path` that takes its place when the block ends well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        raise InputError(
            "is a folder, and a file of that name is to be written", field="--out", value=str(path)
        )
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    temporary = pathlib.Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def check_writable(folder: pathlib.Path, field: str = "--out") -> None:
    """Say so if an output folder cannot be made or written to; nothing is left behind."""
    try:
        existing = folder.absolute()
        while not existing.exists():
            existing = existing.parent
        with tempfile.TemporaryDirectory(prefix=".", dir=existing):
            pass
    except OSError as error:
        raise InputError(
            f"cannot be written to: {error.strerror or error}", field=field, value=str(folder)
        ) from None


@contextmanager
def disk(folder: pathlib.Path, again: str) -> Iterator[None]:
    """What the disk refuses, in words.

    Parameters
    ----------
    folder : that is written to
    again : what can be done once there is room

    Raises
    ------
    InputError
        The disk is full, or the folder cannot be written to.
    """
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        problem = "the disk is full" if full else f"cannot be written to: {error.strerror or error}"
        raise InputError(problem, field="--out", value=str(folder), allowed=again) from None


@contextmanager
def keeping(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """As `replacing`, and on the disk, not only on its way there: a machine that loses power keeps it."""
    with replacing(path) as temporary:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
