"""Files, and groups of files, that appear whole or not at all; text and JSON.

One file is written under a hidden name beside its place, flushed to the disk, and renamed. A group is
written into a hidden folder. A folder that is new appears by one rename. In a folder that exists, the
rename of the hidden folder from `.new-…` to `.ready-…` decides: before it a killed process leaves the
old group, after it the files move one by one, and whoever opens the folder next (`settle`) moves the
rest. Hidden names of dead processes are removed at the next writing into the same folder.
"""

import contextlib
import errno
import functools
import json
import math
import os
import pathlib
import platform
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Json

NEW, READY = "new", "ready"  # marks of a hidden name: being written, complete but not yet in place
_GONE = ".gone"  # file in a complete group: names of the old group that the new one lacks
_FULL = (errno.ENOSPC, errno.EDQUOT)
_REASONS = {
    **dict.fromkeys(_FULL, "the disk is full"),
    errno.EFBIG: "the file grows beyond what the system allows",
    errno.EACCES: "you have no permission to write here",
    errno.EPERM: "you have no permission to write here",
    errno.EROFS: "it is on a read-only disk",
    errno.ELOOP: "its symbolic links run in a circle",
    errno.ENOTDIR: "a part of its path is a file, not a folder",
}


@contextmanager
def replacing(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A temporary path beside `path` that takes its place when the block ends well."""
    with _in_words(path), keeping(path) as temporary:
        yield temporary


@contextmanager
def keeping(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """As `replacing`, with the system's own OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        raise InputError("is a folder, and a file of that name is to be written", file=path)
    _remove_leftovers(path.parent.absolute())
    temporary = path.with_name(_hidden(path.name, NEW))
    # not tempfile, whose files only their owner may read: the umask decides here as for any other file
    os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    try:
        yield temporary
        _flush(temporary)
        temporary.replace(path)
        _flush_names(path.parent)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def together(folder: pathlib.Path, group: Iterable[str] = (), again: str = "") -> Iterator[pathlib.Path]:
    """A scratch folder whose files take their places in `folder` together when the block ends well."""
    with _in_words(folder, again):
        folder.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(folder.parent.absolute())
        settle(folder)
        beside = not folder.exists()
        if not beside:
            _remove_leftovers(folder.absolute())
        scratch = folder.with_name(_hidden(folder.name, NEW)) if beside else folder / _hidden("", NEW)
        scratch.mkdir()
        try:
            yield scratch
            for file in _files(scratch):
                _flush(file)
            for inner in (scratch, *(path for path in scratch.rglob("*") if path.is_dir())):
                _flush_names(inner)
            if beside:
                try:
                    scratch = scratch.rename(folder)
                except OSError:
                    if not folder.is_dir():  # which another process has made meanwhile
                        raise
                    scratch = scratch.rename(folder / _hidden("", NEW))
                _flush_names(folder.parent)
            if scratch != folder:
                _move_in(scratch, folder, group)
        except InputError as error:
            if isinstance(error.file, pathlib.Path) and error.file.is_relative_to(scratch):
                error = error.replaced(file=folder / error.file.relative_to(scratch))
            raise error from None
        finally:
            if scratch != folder:
                shutil.rmtree(scratch, ignore_errors=True)


def settle(folder: pathlib.Path) -> None:
    """Complete a group whose writer was killed while its files moved to their places."""
    with _in_words(folder):
        for ready in sorted(folder.glob(f".{READY}-*")) if folder.is_dir() else ():
            _take_places(ready, folder)


def _move_in(scratch: pathlib.Path, folder: pathlib.Path, group: Iterable[str]) -> None:
    """Move a complete group into an existing folder; the first rename decides."""
    files = {file.relative_to(scratch).as_posix() for file in _files(scratch)}
    for name in files:
        if (folder / name).is_dir():
            raise InputError("is a folder, and a file of that name is to be written", file=folder / name)
    (scratch / _GONE).write_text(json.dumps(sorted(set(group) - files)), encoding="utf-8")
    _flush(scratch / _GONE)
    settle(folder)
    ready = scratch.rename(folder / _hidden("", READY))
    _flush_names(folder)
    _take_places(ready, folder)


def _take_places(ready: pathlib.Path, folder: pathlib.Path) -> None:
    """Move the files of a complete group; another process may do the same at the same time."""
    with contextlib.suppress(FileNotFoundError):
        gone = json.loads((ready / _GONE).read_text(encoding="utf-8"))
        for file in (files := _files(ready)):
            if file.name != _GONE:
                place = folder / file.relative_to(ready)
                place.parent.mkdir(parents=True, exist_ok=True)
                with contextlib.suppress(FileNotFoundError):
                    file.replace(place)
        for name in gone:
            place = folder / name
            place.unlink(missing_ok=True)
            if place.parent != folder:
                with contextlib.suppress(OSError):  # another file is there
                    place.parent.rmdir()
        for changed in {folder, *((folder / file.relative_to(ready)).parent for file in files)}:
            _flush_names(changed)
    shutil.rmtree(ready, ignore_errors=True)


def _files(folder: pathlib.Path) -> list[pathlib.Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _flush(file: pathlib.Path) -> None:
    """Wait until the disk holds a file: a rename may reach it before the content does."""
    with file.open("rb") as opened:
        os.fsync(opened.fileno())


def _flush_names(folder: pathlib.Path) -> None:
    """Wait until the disk holds a folder's names, of which a rename is one; not every system can."""
    with contextlib.suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def _hidden(name: str, mark: str) -> str:
    """A hidden name that says which process writes: .NAME.new-HOST-PID-RANDOM."""
    host = "".join(letter for letter in platform.node() if letter.isalnum())[:16] or "host"
    return f".{name[:40]}{'.' if name else ''}{mark}-{host}-{os.getpid()}-{secrets.token_hex(4)}"


@functools.cache  # once in a process: a folder of many chunks is long to list
def _remove_leftovers(folder: pathlib.Path) -> None:
    """Remove what processes of this machine that are no longer alive left unfinished in a folder."""
    host = _hidden("", NEW).split("-")[1]
    for path in folder.glob(f".*{NEW}-{host}-*") if folder.is_dir() else ():
        number = path.name.split("-")[-2]
        if number.isdigit() and not _alive(int(number)):
            with contextlib.suppress(OSError):
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except OSError as error:
        return not isinstance(error, ProcessLookupError)
    return True


def write_text(path: pathlib.Path, text: str) -> None:
    """Write a text as UTF-8; errors as `replacing`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_bytes(path: pathlib.Path, content: bytes) -> None:
    """Write a content; errors as `replacing`."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def json_text(value: object) -> str:
    """Plain data as JSON; a number that is not finite is null, which JSON has."""
    text = json.dumps(_json_numbers(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return text.encode(errors="backslashreplace").decode()


def _json_numbers(value: Json) -> Json:
    if isinstance(value, dict):
        return {key: _json_numbers(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_json_numbers(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def check_encoding(path: str) -> None:
    """Refuse a path, or another text, that cannot be given to other programs or to the system."""
    try:
        path.encode()
        os.fsencode(path)
    except UnicodeEncodeError as error:
        allowed = "characters of UTF-8, and a locale that has them, such as C.UTF-8"
        raise InputError(reason(error), value=path, allowed=allowed) from None


def check_writable(folder: pathlib.Path, field: str = "out") -> None:
    """Refuse an output folder that cannot be made or written to; nothing is left behind."""
    check_encoding(str(folder))
    try:
        existing = folder.absolute()
        while not existing.exists() and not existing.is_symlink():
            existing = existing.parent
        probe = existing / _hidden("", NEW)
        probe.mkdir()
        probe.rmdir()
    except OSError as error:
        raise InputError(f"cannot be written to: {reason(error)}", field=field, value=str(folder)) from None


@contextmanager
def disk(folder: pathlib.Path, again: str) -> Iterator[None]:
    """The system's refusals as InputError."""
    try:
        yield
    except OSError as error:
        problem = reason(error) if error.errno in _FULL else f"cannot be written to: {reason(error)}"
        raise InputError(problem, field="out", value=str(folder), allowed=again) from None


def reason(error: OSError | UnicodeEncodeError) -> str:
    """A system's error as a short sentence."""
    if isinstance(error, UnicodeEncodeError):
        return f"{error.object[error.start : error.end]!r} is not a character of {error.encoding}"
    return _REASONS.get(error.errno or 0) or error.strerror or str(error)


@contextmanager
def _in_words(path: pathlib.Path, again: str = "") -> Iterator[None]:
    try:
        yield
    except (OSError, UnicodeEncodeError) as error:
        raise InputError(f"cannot be written: {reason(error)}", file=path, allowed=again) from None
