"""How compiled code finds and calls kernels of a user's own; imports numba."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from numba import types
from numba.extending import overload, register_jitable

from afo_sim.common import Code, compiling
from afo_sim.physics import jitable, user_kernels

_NUMBERS = types.CPointer(types.float64)
SIGNATURE = types.float64(*[types.float64] * 3, _NUMBERS, types.int64, _NUMBERS, types.int64, _NUMBERS)


@register_jitable
def _address(model: float, gives: int) -> int:
    """Address of a kernel; 0 where there is none."""
    table, k = compiling.user_kernels(), 0
    while table[k] != 0:
        if float(table[k]) == model and table[k + 1] == gives:
            return table[k + 2]
        k += 3
    return 0


@overload(user_kernels.user_kernel)
def _user_kernel(  # numba compares both signatures
    model: Any, gives: Any, x: Any, y: Any, z: Any, u: Any, c: Any, act: Any, a: Any, out: Any
) -> Any:  # fmt: skip
    if not isinstance(u, types.CPointer):  # an array: of nobody who steps

        def none(
            model: Any, gives: Any, x: Any, y: Any, z: Any, u: Any, c: Any, act: Any, a: Any, out: Any
        ) -> Any:  # fmt: skip
            return math.nan

        return none

    def call(
        model: Any, gives: Any, x: Any, y: Any, z: Any, u: Any, c: Any, act: Any, a: Any, out: Any
    ) -> Any:  # fmt: skip
        address = _address(model, gives)
        return compiling.call_kernel(address, x, y, z, u, c, act, a, out) if address else math.nan

    return call


@overload(user_kernels.has_kernel)
def _has_kernel(model: Any, gives: Any) -> Any:
    def found(model: Any, gives: Any) -> Any:
        return _address(model, gives) != 0

    return found


@overload(user_kernels.numbers, inline="always")
def _numbers() -> Any:
    return lambda: compiling.two_numbers()


def code_of(number: int, functions: Sequence[Callable[..., float]]) -> list[Code]:
    """Machine code of functions of `user_kernels`."""
    jitable.register_all()
    return compiling.compile_all(f"user_{number}", functions, SIGNATURE, lambda *arguments: math.nan)
