"""Functions that are optimised with their callers alone can still be called by whatever is compiled later."""

import math

import pytest
from numba import njit, types
from numba.core import compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from afo_sim.common.compiling import CalledLibrary, only_called
from afo_sim.physics import register_all, register_jitable


def test_a_function_compiled_later_calls_them() -> None:
    @register_jitable
    def low(x: float) -> float:
        return math.exp(-x) + x**3  # numba keeps its own function for the power

    @register_jitable
    def high(x: float) -> float:
        return low(x) - low(2.0 * x)

    register_all()
    context = cpu_target.target_context
    flags = compiler.Flags()
    cpu_target.options.parse_as_flags(flags, {"nopython": True, "no_cpython_wrapper": True})
    with global_compiler_lock, only_called(context):
        found = compiler.compile_extra(
            cpu_target.typing_context,
            context,
            lambda x: high(x),
            args=(types.float64,),
            return_type=types.float64,
            flags=flags,
            locals={},
        )
    assert isinstance(found.library, CalledLibrary)
    assert njit(lambda x: high(x) + low(x))(0.3) == pytest.approx(high(0.3) + low(0.3), rel=1e-14)
    assert njit(lambda x: x**3)(0.3) == pytest.approx(0.027, rel=1e-14)


def test_numba_is_itself_again_after_an_error() -> None:
    context = cpu_target.target_context
    own = context.codegen()
    with pytest.raises(ValueError, match="within"), only_called(context):
        assert context.codegen() is not own
        raise ValueError("within")
    assert context.codegen() is own
