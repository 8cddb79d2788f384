"""Compiled functions as machine code: compiled when the package is built, or once and kept for the user.

Compiling takes seconds, and loading what was compiled takes milliseconds. The code runs on every processor of
its platform, and knows nothing of the process that compiled it; what it calls are symbols, which each process
resolves for itself. It is loaded into an engine of its own, so that its names cannot meet those of functions
that numba compiles later. Where one symbol is unknown, LLVM leaves all calls of an object file at address 0,
without a word: the symbols that the code needs stand beside it, and are looked up before.

Code is found by what it follows from: the sources, the platform, numba's settings, and what the caller adds.
Compilers are not among it: versions of Python, numba and LLVM compile the same numbers.
"""

import base64
import ctypes
import hashlib
import json
import os
import pathlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import llvmlite.binding as llvm

from afo_sim.common import user_cache


class Code(NamedTuple):
    """Machine code of one function."""

    symbol: str
    binary: bytes  # object file
    needs: tuple[str, ...]  # symbols outside it


Compiled = tuple[list[Code], bool]  # whether the code holds addresses that are good in this process alone
_WITHOUT_EFFECT = ("NUMBA_NUM_THREADS", "NUMBA_CACHE_DIR")  # on code


def functions(
    kind: str, prototype: Any, follows: Sequence[Any], compile_: Callable[[], Compiled]
) -> list[Any]:
    """C function pointers, shipped, from the cache or compiled now."""
    start()
    key = fingerprint(*follows)
    codes = _stored(kind, key)
    if not codes:
        with user_cache.locked():  # whoever has waited finds what the first has compiled
            codes = _stored(kind, key) or _compile(kind, key, compile_)
    return [_loaded(code, prototype) for code in codes]


def start() -> None:
    """Make LLVM ready for machine code, once or again."""
    with suppress(RuntimeError):  # LLVM that is ready by itself
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def start_numba() -> None:
    """Make the symbols of numba known, which compiled code may call."""
    from numba.core.registry import cpu_target  # large: not where the code is there already
    from numba.core.runtime import rtsys

    rtsys.initialize(cpu_target.target_context)


def address(library: ctypes.CDLL, function: str) -> int:
    """Address of a library's function."""
    return ctypes.cast(getattr(library, function), ctypes.c_void_p).value or 0


def fingerprint(*follows: Any) -> str | None:
    """SHA-256 of everything that machine code follows from; None where that is unknown."""
    if user_cache.checksum() is None:
        return None
    own = {name: value for name, value in os.environ.items() if name not in _WITHOUT_EFFECT}
    settings = sorted((name, value) for name, value in own.items() if name.startswith("NUMBA_"))
    with suppress(OSError):  # which numba reads in the current folder
        settings.append(("", pathlib.Path(".numba_config.yaml").read_bytes().hex()))
    target = llvm.get_process_triple().rstrip("0123456789.")  # macOS adds its version
    return hashlib.sha256(repr((user_cache.checksum(), target, follows, settings)).encode()).hexdigest()


def _stored(kind: str, key: str | None) -> list[Code]:
    """Code that is shipped or in the cache; none where it is missing, or cannot run in this process."""
    for read in (user_cache.shipped, user_cache.read):
        texts = json.loads((read(kind, key) if key else None) or b"[]")
        codes = [Code(symbol, base64.b64decode(text), tuple(needs)) for symbol, text, needs in texts]
        names = {name for code in codes for name in code.needs}
        if not all(map(_find, names)):
            start_numba()  # it brings symbols with it, such as those of Intel's mathematics
        if codes and all(map(llvm.address_of_symbol, names)):
            return codes
    return []


def _find(name: str) -> bool:
    """Whether a symbol is known; those of the C library and its mathematics are looked up in this process."""
    if not llvm.address_of_symbol(name):
        with suppress(AttributeError, OSError, TypeError):  # not there, or on Windows no library of all
            llvm.add_symbol(name, address(ctypes.CDLL(None), name))
    return bool(llvm.address_of_symbol(name))


def _compile(kind: str, key: str | None, compile_: Callable[[], Compiled]) -> list[Code]:
    """Compile, and store the code for later processes."""
    codes, of_this_process = compile_()
    if key and not of_this_process:
        texts = [(code.symbol, base64.b64encode(code.binary).decode(), code.needs) for code in codes]
        user_cache.write(kind, key, json.dumps(texts).encode())
    return codes


def _loaded(code: Code, prototype: Any) -> Any:
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.binary))
    engine.finalize_object()
    pointer = prototype(engine.get_function_address(code.symbol))
    pointer.engine = engine  # keeps the machine code alive
    return pointer
