"""The callbacks as machine code, which calls MuJoCo's `mju_error` by a symbol of its own."""

import ctypes
import functools
import pathlib
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
    bias, dyn = machine_code.functions(KIND, _MJF_ACT, follows(), _compile, _outside)
    _tell_library()
    return bias, dyn


@functools.cache
def planar_steps() -> Any:
    """The steps of a planar walker as a C function (`planar.walk_on`)."""
    (steps,) = machine_code.functions("planar", _PLANAR, follows(), _compile_planar, _outside)
    _tell_library()
    return steps


def _outside() -> dict[str, int]:
    """Addresses of what code of the cache calls and reads."""
    mju_error = machine_code.address(ctypes.CDLL(str(mujoco_library())), "mju_error")
    return {MJU_ERROR: mju_error, PLACES: ctypes.addressof(places())}


@functools.cache
def _tell_library() -> None:
    """Tell the package's library where the installed MuJoCo's fields stand."""
    if (library := machine_code.library()) is not None:
        ctypes.memmove(type(places()).in_dll(library, PLACES), places(), ctypes.sizeof(places()))


def settle_plugin() -> bool:
    """Let the library's plugin put its callbacks in force while it has data; whether they are."""
    settle = getattr(machine_code.library(), "afo_sim_settle", None)
    return settle is not None and bool(settle(0))


def library_file() -> pathlib.Path:
    """The package's library, if it is of these sources (CallbackError where it is not)."""
    key = machine_code.fingerprint(*follows())
    if key is None or machine_code.shipped(KIND, key) is None:
        raise CallbackError(
            "this installation has no library of its muscles, or one of other sources than are there now; "
            "pip install makes it (pip install -e . in a clone)"
        )
    return machine_code.library_path()


def follows() -> tuple[Any, ...]:
    """What the callbacks' code follows from beside sources, compilers and processor."""
    return tuple(kinds())


def _compile() -> list[machine_code.Code]:
    import afo_sim.native.compiling as compiling  # which imports numba

    return compiling.compile_callbacks()


def _compile_planar() -> list[machine_code.Code]:
    import afo_sim.native.compiling as compiling

    return compiling.compile_planar()


@functools.cache
def mujoco_library() -> pathlib.Path:
    """The MuJoCo shared library that the bindings have loaded (CallbackError where there is none)."""
    folder = pathlib.Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for found in sorted(folder.glob(pattern)):
            return found
    raise CallbackError(f"no MuJoCo library is found in {folder}")
