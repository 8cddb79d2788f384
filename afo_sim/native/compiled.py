"""The callbacks as machine code, which calls MuJoCo's `mju_error` by a symbol of its own."""

import ctypes
import functools
import pathlib
from collections.abc import Callable
from typing import Any

import mujoco

from afo_sim.common import CallbackError, machine_code
from afo_sim.native.error_codes import MJU_ERROR
from afo_sim.native.struct_layout import PLACES, kinds, places

KIND = "callbacks"
_MJF_ACT = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_PLANAR = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, *[ctypes.c_int64] * 3)


@functools.cache
def callbacks() -> tuple[Any, Any]:
    """C function pointers for MuJoCo: act_bias, act_dyn."""
    bias, dyn = _functions(KIND, _MJF_ACT, lambda: _compiling().compile_callbacks())
    return bias, dyn


@functools.cache
def planar_steps() -> Any:
    """The steps of a planar walker as a C function (`planar.walk_on`)."""
    (steps,) = _functions("planar", _PLANAR, lambda: _compiling().compile_planar())
    return steps


def _functions(kind: str, prototype: Any, compile_: Callable[[], list[machine_code.Code]]) -> list[Any]:
    """C function pointers, which know where the installed MuJoCo's fields stand."""
    if (library := _shipped(kind)) is not None:
        ctypes.memmove(type(places()).in_dll(library, PLACES), places(), ctypes.sizeof(places()))
        library.afo_sim_look()
    return machine_code.functions(kind, prototype, follows(), compile_, _outside)


def _shipped(kind: str) -> ctypes.CDLL | None:
    """The package's library, if its code of a kind is of these sources; in another one the table differs."""
    return machine_code.shipped(kind, machine_code.fingerprint(*follows()))


def _outside() -> dict[str, int]:
    """Addresses of what code of the cache calls and reads."""
    mju_error = machine_code.address(ctypes.CDLL(str(mujoco_library())), "mju_error")
    return {MJU_ERROR: mju_error, PLACES: ctypes.addressof(places())}


def settle_plugin() -> bool:
    """Let the library's plugin put its callbacks in force while it has data; whether they are."""
    settle = _settle()
    return settle is not None and bool(settle(0))


@functools.cache
def _settle() -> Any:
    return getattr(_shipped(KIND), "afo_sim_settle", None)


def library_file() -> pathlib.Path:
    """The package's library, if it is of these sources (CallbackError where it is not)."""
    if _shipped(KIND) is None:
        raise CallbackError(
            "this installation has no library of its muscles, or one of other sources than are there now; "
            "pip install makes it (pip install -e . in a clone)"
        )
    return machine_code.library_path()


def follows() -> tuple[Any, ...]:
    """What the callbacks' code follows from beside sources, compilers and processor."""
    return tuple(kinds())


def _compiling() -> Any:
    import afo_sim.native.compiling as compiling  # which imports numba

    return compiling


@functools.cache
def mujoco_library() -> pathlib.Path:
    """The MuJoCo shared library that the bindings have loaded (CallbackError where there is none)."""
    folder = pathlib.Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for found in sorted(folder.glob(pattern)):
            return found
    raise CallbackError(f"no MuJoCo library is found in {folder}")
