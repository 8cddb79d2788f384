"""The sensors' kernel as machine code, compiled once and kept."""

import ctypes
import functools
from typing import Any

from afo_sim.common import machine_code

KIND = "sensing"
_SENSE = ctypes.CFUNCTYPE(ctypes.c_double, *6 * (ctypes.c_void_p,), *4 * (ctypes.c_int64,), ctypes.c_double)


@functools.cache
def compiled_sense() -> Any:
    """`physics.sensing.sense` as a C function: addresses of six arrays, four whole numbers, the time step."""
    return machine_code.functions(KIND, _SENSE, (KIND,), _compile)[0]


def _compile() -> machine_code.Compiled:
    import afo_sim.native.sensing_code as sensing_code  # which imports numba

    return sensing_code.compile_all()
