"""Files that people bring, whole in memory: regular ones, of a size that their kind can have."""

import functools
import operator
import os
import pathlib
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

from afo_sim.common.errors import InputError
from afo_sim.common.writing import reason

LARGEST_DATA = 2**29  # of a file of measurements or of a shape [bytes]: half a gigabyte
LARGEST_DESCRIPTION = 2**20  # of what people write by hand [bytes]: a hundred times the largest shipped
# a pipe opens at once, and Windows, which has none of these but the last, keeps the bytes as they are
_FLAGS = ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY")


def read_bytes(path: str | os.PathLike[str], most: int = LARGEST_DATA) -> bytes:
    """A file's content."""
    with _in_words(path), open(path, "rb", opener=_opened) as stream:
        content = stream.read(most + 1)  # not its stated size, which a file of the system lacks
    if len(content) > most:
        raise InputError("is too large", file=path, allowed=f"up to {most / 2**20:g} MiB")
    return content


def check_regular(path: pathlib.Path, most: int = LARGEST_DATA) -> None:
    """Refuse what another program is to read, and would read without end; errors as `read_bytes`."""
    with _in_words(path), open(path, "rb", opener=_opened) as stream:
        size = os.fstat(stream.fileno()).st_size
    if size > most:
        raise InputError("is too large", file=path, allowed=f"up to {most / 2**20:g} MiB")


def read_foreign(path: str | os.PathLike[str], most: int = LARGEST_DATA) -> str:
    """A text of another program: UTF-8, UTF-16 with its mark, or Latin-1, with its own line ends."""
    raw = read_bytes(path, most)
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = raw.decode("utf-16", errors="replace")
    else:
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("latin-1")
    if "\0" in text:
        raise InputError("cannot be read: it is not a text file", file=path)
    return text


@contextmanager
def _in_words(path: str | os.PathLike[str]) -> Iterator[None]:
    """The system's refusals as InputError."""
    try:
        yield
    except FileNotFoundError:
        raise InputError("cannot be read: there is no such file", file=path) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    except ValueError:  # a name that no system has, as one with a zero in it
        raise InputError("cannot be read: it is not a valid name of a file", file=path) from None


def _opened(path: str, flags: int) -> int:
    """Open a regular file; what else there is under a name may never end, or wait for somebody."""
    found = os.open(path, functools.reduce(operator.or_, (getattr(os, name, 0) for name in _FLAGS), flags))
    if stat.S_ISREG(os.fstat(found).st_mode):
        return found
    os.close(found)
    kind = "folder" if pathlib.Path(path).is_dir() else "pipe or a device"
    raise InputError(f"cannot be read: it is a {kind}", file=path, allowed="a file on a disk")


def read_text(path: str | os.PathLike[str], most: int = LARGEST_DATA) -> str:
    """A file's text, with line feeds as its only line ends."""
    try:
        text = read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem = f"cannot be read: byte {error.start} is not UTF-8"
        raise InputError(problem, file=path, allowed="a text in UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def unpack(data: bytes, most: int) -> bytes:
    """Unpack what `zlib.compress` has made."""
    unpacker = zlib.decompressobj()
    found = unpacker.decompress(data, most + 1)
    if len(found) > most or not unpacker.eof:
        raise ValueError(f"its compressed data are cut short, or unpack to more than {most} bytes")
    return found
