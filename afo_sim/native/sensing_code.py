"""The sensors' kernel from Python to machine code."""

from typing import Any

from numba import types

from afo_sim.common import compiling
from afo_sim.common.machine_code import Compiled
from afo_sim.physics.jitable import register_all
from afo_sim.physics.sensing import sense

DOUBLES = types.CPointer(types.float64)
SIGNATURE = types.float64(*6 * (DOUBLES,), *4 * (types.int64,), types.float64)


def compile_all() -> Compiled:
    """Machine code of the kernel; it raises nothing."""
    register_all()
    return compiling.compile_all([sense], SIGNATURE, _raised)


def _raised(builder: Any, arguments: Any) -> None:
    pass
