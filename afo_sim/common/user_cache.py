"""Files in the user's cache folder, and those of the kind that the package brings: found whole or not at all.

What stands there is machine code that will run: a cache folder that anybody else may write to is passed over.
The package's own is as safe as its sources. And the checksum of the sources that machine code follows from.
"""

import contextlib
import functools
import hashlib
import os
import pathlib
import stat
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from afo_sim.common.errors import InputError
from afo_sim.common.notice import Notice
from afo_sim.common.open_types import Foreign
from afo_sim.common.versions import digest_of_sources
from afo_sim.common.writing import write_bytes

ROOMS = ("common", "physics", "native")  # whose code is compiled, or makes what is
_PACKAGE = pathlib.Path(__file__).resolve().parents[1]
# Of a wheel, or of a checkout, which has its project's file: elsewhere the folder above may be anybody's.
_OWN = _PACKAGE.parent if (_PACKAGE.parent / "pyproject.toml").is_file() else _PACKAGE
BROUGHT = (_PACKAGE / "machine_code", _OWN / "machine_code")


@functools.cache
def checksum(package: pathlib.Path = _PACKAGE, rooms: tuple[str, ...] = ROOMS) -> str | None:
    """SHA-256 of the rooms' files; None where they are not there to be read."""
    try:
        return digest_of_sources(package, rooms)
    except OSError:
        return None


checksum()  # now, with the import: a file that is edited later is not the code that runs

VARIABLE = "AFO_SIM_CACHE"  # environment: the folder, or "off"
_NEWEST = 8  # files of one kind that stay
_DIGEST = hashlib.sha256().digest_size
PATIENCE = 120.0  # that another process is given to compile [s]


def folder() -> pathlib.Path | None:
    """The folder, which need not exist; None where the cache is switched off or there is no home."""
    asked = os.environ.get(VARIABLE, "")
    if asked.strip().lower() == "off":
        return None
    with contextlib.suppress(RuntimeError):  # a user without a home folder
        return pathlib.Path(asked).expanduser() if asked else _of_the_system() / "afo_sim"
    return None


def _of_the_system() -> pathlib.Path:
    if sys.platform == "win32":
        asked, usual = os.environ.get("LOCALAPPDATA", ""), ("AppData", "Local")
    elif sys.platform == "darwin":
        asked, usual = "", ("Library", "Caches")
    else:
        asked, usual = os.environ.get("XDG_CACHE_HOME", ""), (".cache",)
    path = pathlib.Path(asked)
    return path if path.is_absolute() else pathlib.Path.home().joinpath(*usual)


def read(kind: str, key: str) -> bytes | None:
    """What `write` has stored; None where it is missing, unreadable or damaged."""
    path = _path(kind, key)
    if path is None or not _private(path.parent):
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # in use: it stays
    return _content(path, path.name)


def _content(path: pathlib.Path, name: str) -> bytes | None:
    """A file's content; None where it is not what was stored under a name."""
    try:
        stored = path.read_bytes()
    except OSError:
        return None
    return stored[_DIGEST:] if stored[:_DIGEST] == _digest(name, stored[_DIGEST:]) else None


def write(kind: str, key: str, content: bytes) -> None:
    """Store content for later processes; without a word where that is impossible."""
    path = _path(kind, key)
    if path is None or not _made(path.parent):
        return
    with contextlib.suppress(OSError, InputError):
        write_bytes(path, _digest(path.name, content) + content)
        for old in sorted(path.parent.glob(f"{kind}-*"), key=_age)[_NEWEST:]:
            old.unlink(missing_ok=True)


@contextmanager
def locked() -> Iterator[None]:
    """A block that one process at a time is in, of those that share the folder: one compiles for all."""
    place, lock = folder(), -1
    with contextlib.suppress(ImportError, OSError):
        if place is not None and _made(place):
            import fcntl

            lock = os.open(place, os.O_RDONLY)
            limit = time.monotonic() + PATIENCE
            while not _taken(fcntl, lock) and time.monotonic() < limit:
                time.sleep(0.05)
    try:
        yield
    finally:
        if lock >= 0:
            os.close(lock)


def _taken(fcntl: Foreign, lock: int) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _made(place: pathlib.Path) -> bool:
    """Whether the folder is there, perhaps since now, and is this user's alone."""
    with contextlib.suppress(OSError):
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        return _private(place)
    return False


def _private(place: pathlib.Path) -> bool:
    """Whether a folder is this user's, and nobody else may write to it; one that is not is warned of."""
    try:
        found = place.lstat()
    except OSError:
        return False
    if not hasattr(os, "getuid"):  # Windows, where the place of such folders is the user's alone
        return True
    others = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not others:
        return True
    _warn(place)
    return False


@functools.cache  # once in a process
def _warn(place: pathlib.Path) -> None:
    text = "the cache folder {subject} is not used, and code is compiled anew: it is a link, belongs to "
    text += "another user, or others may write to it; remove it, or name another one in {variable}"
    warnings.warn(Notice("cache-not-private", text, subject=str(place), variable=VARIABLE), stacklevel=2)


def _path(kind: str, key: str) -> pathlib.Path | None:
    place = folder()
    return place / f"{kind}-{key}" if place else None


def _digest(name: str, content: bytes) -> bytes:
    """Checksum of a content and of the name that it is stored under."""
    return hashlib.sha256(name.encode() + b"\n" + content).digest()


def _age(path: pathlib.Path) -> float:
    try:
        return -path.stat().st_mtime
    except FileNotFoundError:  # another process was faster
        return 0.0
