"""The folder that a command writes to, its own until it ends, and the parts that a killed one left in it."""

import contextlib
import functools
import io
import os
import pathlib
import pickle
import platform
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import is_dataclass
from typing import TypeVar

from afo_sim import common
from afo_sim.common import Foreign, InputError, Mixed, write_bytes
from afo_sim.common.versions import PACKAGE, digest_of_sources, versions

PARTS = ".afo-sim"  # folder in the output folder; in it one for each command, in that a file for each part
_KNOWN = "afo_sim[.a-z0-9_]* [A-Z][A-Za-z]*|numpy[.a-z_]* (_frombuffer|_reconstruct|dtype|ndarray|scalar)"
_BITS = ("NUMBA_", "OPENBLAS_", "OMP_", "MKL_")  # settings by which last bits differ
_taken: dict[pathlib.Path, Callable[[], pathlib.Path] | None] = {}  # folders, and where in them parts are
_release = contextlib.ExitStack()
T = TypeVar("T")


class _Reader(pickle.Unpickler):
    """Makes arrays and this package's own classes, and nothing else: the file may be somebody else's."""

    def find_class(self, module: str, name: str) -> Foreign:
        found = super().find_class(module, name) if re.fullmatch(_KNOWN, f"{module} {name}") else None
        if not re.match(r"afo_sim\.(?!common\.child)|numpy", str(getattr(found, "__module__", ""))):
            raise pickle.UnpicklingError(f"{module}.{name} is in no part")
        return found


def _mark(what: Mixed) -> str:
    """A digest of something, and of the files that it names."""

    def files(node: Mixed) -> Iterator[str]:
        with contextlib.suppress(OSError, ValueError):  # of a text that no file can be called
            if isinstance(node, str) and pathlib.Path(node).is_file():
                yield common.file_digest(pathlib.Path(node))
        within = vars(node) if is_dataclass(node) else node
        within = list(within.values()) if isinstance(within, dict) else within
        for each in within if isinstance(within, list | tuple) else ():
            yield from files(each)

    return common.identity_of((what, [*files(what)]))[:32]


def occupy(folder: pathlib.Path, of: Mixed = None) -> str:
    """Take a folder for the command `of` alone, or beside others without it; a sentence on parts there."""
    common.check_writable(folder)
    place = folder.absolute()
    if place in _taken:
        return ""
    for made in [each for each in (place, *place.parents) if not each.exists()][::-1]:
        made.mkdir(exist_ok=True)
        _release.enter_context(contextlib.suppress(OSError))  # where it holds something
        _release.callback(made.rmdir)
    try:
        import fcntl

        _release.callback(os.close, descriptor := os.open(place, os.O_RDONLY))
        fcntl.flock(descriptor, (fcntl.LOCK_EX if of else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError("another afo-sim writes into it", field="out", value=str(folder)) from None
    except (ImportError, OSError):  # Windows, some disks on a network
        pass

    @functools.cache
    def parts() -> pathlib.Path:  # found when needed: a quick run has none
        code = digest_of_sources(PACKAGE, ("",)), versions(("mujoco", "numpy", "numba", "scipy", "cma"))
        bits = [platform.machine(), *sorted(each for each in os.environ.items() if each[0].startswith(_BITS))]
        return place / PARTS / _mark((of, code, bits, common.identities()))

    _taken[place] = parts if of else None
    if not (of and (place / PARTS).exists()):
        return ""
    if count := len([*parts().glob("[!.]*")]):
        return f"goes on: {count} parts are there already"
    # of hours, perhaps: whoever mistyped an option gets them back by the command as it was
    return "begins anew; parts of another command or version stay until this one ends"


@contextlib.contextmanager
def released() -> Iterator[None]:
    """Give back what is taken within the block; its parts stay where it ends by an error."""
    ended = True
    try:
        yield
    except BaseException as error:  # also Ctrl-C; whoever exits with a code has come to an end
        ended = isinstance(error, SystemExit) or type(error).__name__ == "Exit"
        raise
    finally:
        for place in _taken if ended else ():
            shutil.rmtree(place / PARTS, ignore_errors=True)
        _taken.clear()
        _release.close()


def kept_each(
    what: Sequence[Mixed], compute: Callable[[list[int]], Iterable[tuple[int, T]]], of: Mixed = None
) -> Iterator[tuple[int, T]]:
    """Numbered parts; each follows from its `what`, all from `of`: those there, then the computed rest."""
    parts = next(filter(None, _taken.values()), None)
    whole = _mark(of) if parts else ""
    files = {k: parts() / _mark((whole, each)) for k, each in enumerate(what)} if parts else {}
    rest = []
    for number in range(len(what)):
        with contextlib.suppress(OSError, KeyError, pickle.UnpicklingError):
            content = files[number].read_bytes()
            if common.digest(content[32:]).encode() == content[:32]:
                yield number, _Reader(io.BytesIO(content[32:])).load()
                continue
        rest.append(number)
    for number, value in compute(rest):
        if parts:
            content = pickle.dumps(value)
            write_bytes(files[number], common.digest(content).encode() + content)
        yield number, value


def kept(what: Callable[[], Mixed], compute: Callable[[], T]) -> T:
    """A part that follows from `what`: as it is there, or computed and written."""
    return next(kept_each([what() if _taken else None], lambda rest: ((k, compute()) for k in rest)))[1]
