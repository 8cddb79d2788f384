"""The sensors' kernel as machine code, compiled once and kept."""

import ctypes
from typing import Any

from afo_sim.physics import compiled_functions, sense

_ARGUMENTS = (*6 * (ctypes.c_void_p,), *4 * (ctypes.c_int64,), ctypes.c_double)


def compiled_sense() -> Any:
    """`physics.sensing.sense` as a C function: addresses of six arrays, four whole numbers, the time step."""
    return compiled_functions("sensing", _ARGUMENTS, sense)[0]
