"""Compiled functions as machine code: a library that the package brings, or compiled once and kept.

Compiling takes seconds, and loading what was compiled takes milliseconds. The code runs on every processor of
its platform, and knows nothing of the process that compiled it; what it calls are symbols, which each process
resolves for itself. What was compiled for a user is loaded into an engine of its own: its names cannot meet
those of functions that numba compiles later. Where one symbol is unknown, LLVM leaves all calls of an
object file at address 0, without a word: the symbols that the code needs stand beside it, and are looked up
before.

Code is found by what it follows from: the sources, the platform, numba's settings, and what the caller adds.
Compilers are not among it: versions of Python, numba and LLVM compile the same numbers.
"""

import base64
import ctypes
import functools
import hashlib
import json
import os
import pathlib
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

from afo_sim.common import user_cache
from afo_sim.common.errors import InputError
from afo_sim.common.extras import MissingExtra, installed
from afo_sim.common.open_types import Foreign, JsonDict


class Code(NamedTuple):
    """Machine code of one function."""

    symbol: str
    binary: bytes  # object file
    needs: tuple[str, ...]  # symbols outside it


# Without effect on code that is made for any processor.
_WITHOUT_EFFECT = ("NUMBA_NUM_THREADS", "NUMBA_CACHE_DIR", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")


def symbol(kind: str, number: int) -> str:
    """The name of a kind's function."""
    return f"afo_sim_{kind}_{number}"


def functions(
    kind: str, prototype: Foreign, follows: Sequence[object], compile_: Callable[[], list[Code]],
    outside: Callable[[], Mapping[str, int]] = dict,
) -> list[Foreign]:  # fmt: skip
    """C function pointers, of the package's library, from the cache or compiled now.

    `outside` gives addresses of symbols that compiled code needs and no library of the process has.
    """
    key = fingerprint(*follows)
    if library := shipped(kind, key):
        return [prototype((symbol(kind, k), library)) for k in range(_brought()["kinds"][kind][1])]
    if not installed("numba"):
        raise MissingExtra("numba", "compile")
    start({**outside(), USER_KERNELS: ctypes.addressof(user_kernels())})
    codes = _kept(kind, key)
    if not codes:
        with user_cache.locked():  # whoever has waited finds what the first has compiled
            codes = _kept(kind, key) or _compile(kind, key, compile_)
    return [_loaded(code, prototype) for code in codes]


def shipped(kind: str, key: str | None) -> ctypes.CDLL | None:
    """The package's library where it has a kind's code of this key."""
    return library() if _brought()["kinds"].get(kind, [""])[0] == key else None


@functools.cache
def library() -> ctypes.CDLL | None:
    """The package's library; None where it is missing, or this process cannot load it."""
    with suppress(OSError, KeyError):
        return ctypes.CDLL(str(library_path()))
    return None


def library_path() -> pathlib.Path:
    """Where the package's library stands (KeyError where it is missing)."""
    return pathlib.Path(_brought()["folder"]) / LIBRARY


# A plugin of MuJoCo's is found by these endings.
LIBRARY = "afo_sim" + {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
CONTENT = "content.json"  # beside it: its digest; of each kind key and number of functions


@functools.cache
def _brought() -> JsonDict:
    """What the package's library holds; nothing where it is missing or damaged."""
    for folder in user_cache.BROUGHT:
        with suppress(OSError, ValueError, LookupError):
            content = json.loads((folder / CONTENT).read_text(encoding="utf-8"))
            if hashlib.sha256((folder / LIBRARY).read_bytes()).hexdigest() == content["sha256"]:
                return content | {"folder": folder}
    return {"kinds": {}}


def start(outside: Mapping[str, int] | None = None) -> None:
    """Make LLVM ready for machine code, once or again, and some symbols known to it."""
    import llvmlite.binding as llvm

    with suppress(RuntimeError):  # LLVM that is ready by itself
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name, address in (outside or {}).items():
        llvm.add_symbol(name, address)


def address(library: ctypes.CDLL, function: str) -> int:
    """Address of a library's function."""
    return ctypes.cast(getattr(library, function), ctypes.c_void_p).value or 0


def fingerprint(*follows: object) -> str | None:
    """SHA-256 of everything that machine code follows from; None where that is unknown."""
    if user_cache.checksum() is None:
        return None
    own = {name: value for name, value in os.environ.items() if name not in _WITHOUT_EFFECT}
    settings = sorted((name, value) for name, value in own.items() if name.startswith("NUMBA_"))
    target = f"{sys.platform}-{platform.machine()}"
    return hashlib.sha256(repr((user_cache.checksum(), target, follows, settings)).encode()).hexdigest()


USER_KERNELS = (
    "afo_sim_user_kernels"  # symbol of the table of what a user adds, by which compiled code finds it
)
MOST_USER_KERNELS = 512


def table_size() -> int:
    """Numbers of that table: native id, what the kernel gives, address of each, and a 0 behind the last."""
    return 3 * MOST_USER_KERNELS + 1


@functools.cache
def user_kernels() -> Foreign:
    """The table: the library's, where there is one."""
    kind, brought = ctypes.c_int64 * table_size(), library()
    with suppress(ValueError):
        return kind() if brought is None else kind.in_dll(brought, USER_KERNELS)
    return kind()


def add_user_kernel(number: int, gives: int, code: Code) -> None:
    """Load a kernel of a user's own, and enter its address."""
    table, pointer = user_kernels(), _loaded(code, ctypes.CFUNCTYPE(ctypes.c_double))
    k = next(k for k in range(0, len(table), 3) if not table[k])
    if k == len(table) - 1:
        problem, allowed = "are registered in this process already", "a new process"
        raise InputError(f"{MOST_USER_KERNELS} kernels {problem}", field="register", allowed=allowed)
    table[k + 1 : k + 3] = [gives, ctypes.cast(pointer, ctypes.c_void_p).value]
    table[k] = number  # last: another thread may be looking
    USER_CODES[number, gives] = code, pointer


USER_CODES: dict[
    tuple[int, int], tuple[Code, Foreign]
] = {}  # by native id and what it gives; the pointer keeps it


def _kept(kind: str, key: str | None) -> list[Code]:
    """Code that is in the cache; none where it is missing, or cannot run in this process."""
    import llvmlite.binding as llvm

    texts = json.loads((user_cache.read(kind, key) if key else None) or b"[]")
    codes = [Code(symbol, base64.b64decode(text), tuple(needs)) for symbol, text, needs in texts]
    names = {name for code in codes for name in code.needs}
    for name in names:
        if not llvm.address_of_symbol(name):
            with suppress(AttributeError, OSError, TypeError):  # not there, or on Windows no library of all
                llvm.add_symbol(name, address(ctypes.CDLL(None), name))
    return codes if all(map(llvm.address_of_symbol, names)) else []


def _compile(kind: str, key: str | None, compile_: Callable[[], list[Code]]) -> list[Code]:
    """Compile, and store the code for later processes."""
    codes = compile_()
    if key:
        texts = [(code.symbol, base64.b64encode(code.binary).decode(), code.needs) for code in codes]
        user_cache.write(kind, key, json.dumps(texts).encode())
    return codes


def _loaded(code: Code, prototype: Foreign) -> Foreign:
    import llvmlite.binding as llvm

    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.binary))
    engine.finalize_object()
    pointer = prototype(engine.get_function_address(code.symbol))
    pointer.engine = engine  # keeps the machine code alive
    return pointer
