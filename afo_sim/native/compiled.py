"""The callbacks as machine code, which calls MuJoCo's `mju_error` by a symbol of its own."""

import ctypes
import functools
import pathlib
from typing import Any

import llvmlite.binding as llvm
import mujoco

from afo_sim.common import CallbackError, machine_code
from afo_sim.native.error_codes import MJU_ERROR
from afo_sim.native.struct_layout import PLACES, kinds, places

KIND = "callbacks"
_MJF_ACT = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)


def callbacks() -> tuple[Any, Any]:
    """C function pointers for MuJoCo: act_bias, act_dyn."""
    machine_code.start()
    mju_error = machine_code.address(ctypes.CDLL(str(mujoco_library())), "mju_error")
    llvm.add_symbol(MJU_ERROR, mju_error)
    llvm.add_symbol(PLACES, ctypes.addressof(places()))
    bias, dyn = machine_code.functions(KIND, _MJF_ACT, follows(), _compile)
    return bias, dyn


def follows() -> tuple[Any, ...]:
    """What the callbacks' code follows from beside sources, compilers and processor."""
    return tuple(kinds())


def _compile() -> machine_code.Compiled:
    import afo_sim.native.compiling as compiling  # which imports numba

    return compiling.compile_all()


@functools.cache
def mujoco_library() -> pathlib.Path:
    """The MuJoCo shared library that the bindings have loaded (CallbackError where there is none)."""
    folder = pathlib.Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for found in sorted(folder.glob(pattern)):
            return found
    raise CallbackError(f"no MuJoCo library is found in {folder}")
