"""A Rerun stream into a file, with the disk's refusals told."""

import errno
import pathlib
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rerun as rr

END = b"RRF2FOOT"  # stands in the last bytes of a complete file
SCARCE = 1 << 20  # free bytes below which a disk counts as full


@contextmanager
def saving(stream: rr.RecordingStream, path: pathlib.Path, blueprint: Any) -> Iterator[None]:
    """Write what is logged in the block to a file.

    Rerun writes in a thread of its own: a full disk stops that thread, and the end of the file is missing.
    """
    try:
        stream.save(path, default_blueprint=blueprint)
        yield
        stream.flush()
        stream.disconnect()
    except RuntimeError as error:
        if "writer thread" not in str(error):
            raise
    if not _complete(path):
        full = shutil.disk_usage(path.parent).free < SCARCE
        code = errno.ENOSPC if full else errno.EIO
        raise OSError(code, "Rerun could not write it to its end", str(path))


def _complete(path: pathlib.Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 64, 0))
        return END in file.read()
