"""The mark of functions that compiled code may call; numba learns of them when something is compiled.

A third of a second goes into importing numba. Who reads a description, or runs machine code that is there
already, needs none of it: to Python a marked function is what it was.
"""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

_unregistered: list[tuple[Callable[..., Any], dict[str, Any]]] = []  # functions, options


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
    return function


def register_all() -> None:
    """Register all marked functions with numba; whoever compiles one that calls them does this before."""
    from numba.extending import register_jitable as register

    while _unregistered:
        function, options = _unregistered.pop(0)
        # without the wrapper in C that each would get, which nothing calls: an eighth of the time to compile
        register(no_cfunc_wrapper=True, **options)(function)
