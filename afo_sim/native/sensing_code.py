"""The sensors' kernel from Python to machine code."""

from typing import Any

from numba import types

from afo_sim.common import Compiled, compiling
from afo_sim.physics import register_all, sense

DOUBLES = types.CPointer(types.float64)
SIGNATURE = types.float64(*6 * (DOUBLES,), *4 * (types.int64,), types.float64)


def compile_all() -> Compiled:
    """Machine code of the kernel; it raises nothing."""
    register_all()
    return compiling.compile_all([sense], SIGNATURE, _raised)


def _raised(builder: Any, arguments: Any) -> None:
    pass
