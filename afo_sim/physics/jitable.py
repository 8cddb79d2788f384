"""The mark of functions that compiled code may call, and machine code of what calls them over arrays.

A third of a second goes into importing numba, which learns of marked functions when something is compiled.
Who reads a description, or runs machine code that is there already, needs none of it: to Python a marked
function is what it was.
"""

import ctypes
import functools
import math
from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

_unregistered: list[tuple[Callable[..., Any], dict[str, Any]]] = []  # functions, options
_marked: set[Callable[..., Any]] = set()
OVERLOADS: list[Callable[[], None]] = []  # tell numba of functions that are others in compiled code
KERNELS: list[Callable[[], list[Callable[..., float]]]] = []  # load machine code, as far as modules are there


def register_jitable(function: F | None = None, **options: Any) -> Any:
    """Mark a function as one that compiled code may call, as `numba.extending.register_jitable` does.

    Parameters
    ----------
    function : stays what it is
    options : of numba's decorator, for example inline="always"
    """
    if function is None:
        return lambda function: register_jitable(function, **options)
    _unregistered.append((function, options))
    _marked.add(function)
    return function


def marked(function: Callable[..., Any]) -> bool:
    """Mark a function; whether it was not before."""
    new = function not in _marked
    if new:
        register_jitable(function)
    return new


def register_all() -> None:
    """Register all marked functions with numba; whoever compiles one that calls them does this before."""
    from numba.extending import register_jitable as register

    while OVERLOADS:
        OVERLOADS.pop()()
    while _unregistered:
        function, options = _unregistered.pop(0)
        # without the wrapper in C that each would get, which nothing calls: an eighth of the time to compile
        register(no_cfunc_wrapper=True, no_cpython_wrapper=True, **options)(function)


def kernels(
    kind: str, *functions: Callable[..., float], rooms: tuple[str, ...] = ()
) -> Callable[[], list[Callable[..., float]]]:
    """What loads `compiled_functions`, which follow from the sources of more rooms; among `KERNELS`."""
    from afo_sim.common import user_cache  # now, with the import: a file edited later is not what runs

    follows = (user_cache.checksum(rooms=rooms),) if rooms else ()
    KERNELS.append(functools.partial(compiled_functions, kind, *functions, follows=follows))
    return KERNELS[-1]


@functools.cache
def compiled_functions(
    kind: str, *functions: Callable[..., float], follows: tuple[Any, ...] = ()
) -> list[Callable[..., float]]:
    """Functions of arrays and numbers as C functions, compiled once and kept; they raise nothing.

    Parameters
    ----------
    kind : under which the machine code is kept
    functions : annotated alike: Any for addresses of doubles, float, int
    follows : what the code follows from, beside the sources of the rooms below
    """
    from afo_sim.common import machine_code  # LLVM: for code over arrays alone

    known = {Any: ctypes.c_void_p, float: ctypes.c_double, int: ctypes.c_int64}
    *arguments, result = (known[each] for each in functions[0].__annotations__.values())
    prototype = ctypes.CFUNCTYPE(result, *arguments)
    return machine_code.functions(kind, prototype, follows, lambda: code_of(kind, *functions))


def code_of(kind: str, *functions: Callable[..., float]) -> Any:
    """Machine code of functions of a kind, as `compiled_functions` takes them."""
    from numba import types  # large: only to compile

    from afo_sim.common import compiling

    known = {Any: types.CPointer(types.float64), float: types.float64, int: types.int64}
    register_all()
    *arguments, result = (known[each] for each in functions[0].__annotations__.values())
    return compiling.compile_all(kind, functions, result(*arguments), lambda *arguments: math.nan)
