"""Laws and frictions of a user's own: compiled alone, and called by their addresses.

The code over all shipped kernels was compiled before, and stays what it is: where it meets a native id that
it does not know, it looks for the id in a table of addresses.
"""

import math
import re
import sys
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

from afo_sim.common import Doubles, InputError, identity_of, optional
from afo_sim.physics.jitable import OVERLOADS, marked, register_all, register_jitable
from afo_sim.physics.law import Entry
from afo_sim.physics.registry import items

E = TypeVar("E", bound=Entry)
FORCE, SLOPES, OF_MOTION, OF_DEAD_BAND, RATES = range(5)  # what a kernel gives
FIRST_USER_ID = 1 << 48  # of the native ids; each follows from what its kernel does
KERNELS: dict[tuple[int, int], Callable[..., float]] = {}  # by native id and what they give


class Body(NamedTuple):
    """The text of a function of numbers x, y, z, of the row u[c], the memory act[a] and of `out`."""

    kernel: Callable[..., Any]
    text: str  # calls `kernel`


def numbers() -> Doubles:
    """Room for what a kernel gives beside its first number."""
    return [math.nan] * 2


def user_kernel(
    model: float, gives: int, x: float, y: float, z: float, u: Doubles, c: int, act: Doubles, a: int,
    out: Doubles,
) -> float:  # fmt: skip
    """First number of a kernel of a user's own, the others to `out`; not a number where there is none."""
    kernel = KERNELS.get((int(model), gives)) if math.isfinite(model) else None
    return math.nan if kernel is None else kernel(x, y, z, u, c, act, a, out)


def has_kernel(model: float, gives: int) -> bool:
    """Whether there is such a kernel of a user's own."""
    return math.isfinite(model) and (int(model), gives) in KERNELS


def _overload() -> None:
    """Tell numba what the functions above are in compiled code."""
    from numba import types
    from numba.extending import overload

    from afo_sim.common import compiling

    @register_jitable
    def address(model, gives):  # type: ignore[no-untyped-def]  # numba compares signatures with these below
        table, k = compiling.user_kernels(), 0
        while table[k] != 0:
            if float(table[k]) == model and table[k + 1] == gives:
                return table[k + 2]
            k += 3
        return 0

    def called(model, gives, x, y, z, u, c, act, a, out):  # type: ignore[no-untyped-def]  # as above
        at = address(model, gives)
        return compiling.call_kernel(at, x, y, z, u, c, act, a, out) if at else math.nan

    @overload(user_kernel)
    def _(model, gives, x, y, z, u, c, act, a, out):  # type: ignore[no-untyped-def]  # as above
        nobody = not isinstance(u, types.CPointer)  # steps with arrays
        return (lambda model, gives, x, y, z, u, c, act, a, out: math.nan) if nobody else called

    overload(has_kernel)(lambda model, gives: lambda model, gives: address(model, gives) != 0)
    overload(numbers, inline="always")(lambda: lambda: compiling.two_numbers())


OVERLOADS.append(_overload)


@register_jitable
def user_slopes(
    law: float, contraction: float, pressure: float, u: Sequence[float], c: int
) -> tuple[float, float, float]:
    """Force of a law of a user's own [N], and its slopes by κ [N] and p [N/Pa]."""
    out = numbers()
    out[0] = out[1] = math.nan
    force = user_kernel(law, SLOPES, contraction, pressure, 0.0, u, c, u, 0, out)
    return force, out[0], out[1]


@register_jitable
def user_friction(
    model: float, gives: int, x: float, y: float, z: float, act: Doubles, a: int, u: Sequence[float], c: int
) -> tuple[float, float]:
    """Friction of a user's own [N], and its derivative by what moves."""
    out = numbers()
    out[0] = math.nan
    force = user_kernel(model, gives, x, y, z, u, c, act, a, out)
    return force, out[0]


def law_bodies(kernel: Callable[..., Any], slopes: Callable[..., Any], count: int) -> dict[int, Body]:
    """What a law of so many coefficients gives."""
    call = f"kernel(x, y, {', '.join(items('u', 'c', count))})"
    return {
        FORCE: Body(kernel, f"return {call}"),
        SLOPES: Body(slopes, f"force, out[0], out[1] = {call}; return force"),
    }


def friction_bodies(friction: Any, count: int) -> dict[int, Body]:
    """What a friction of so many coefficients gives, and how fast its memory changes."""
    moves, own = ("x", "y", "z") if friction.unit == "N" else ("x", "y"), items("u", "c", count)
    states = items("act", "a", friction.n_state)
    gives, call = OF_MOTION if friction.unit == "N" else OF_DEAD_BAND, ", ".join((*moves, *states, *own))
    found = {gives: Body(friction.kernel, f"force, out[0] = kernel({call}); return force")}
    if friction.rate_kernel is not None:
        rates = f"kernel({call}, z)"
        several = f"{', '.join(items('out', 'a', friction.n_state))} = {rates}; return 0.0"
        text = f"return {rates}" if friction.n_state == 1 else several
        found[RATES] = Body(friction.rate_kernel, text)
    return found


def add(entry: E, table: dict[str, E], bodies: Mapping[int, Body]) -> None:
    """Add a law or a friction of a user's own to a registry; InputError where it cannot be compiled."""
    if not entry.name.isidentifier():
        problem, allowed = "is not a valid name", "letters, digits and _, as in my_law_2026"
        raise InputError(problem, field=type(entry).__name__, value=entry.name, allowed=allowed)
    if entry.name in table and table[entry.name].native_id < FIRST_USER_ID:
        problem, allowed = "is the name of a shipped one", "another name"
        raise InputError(problem, field=type(entry).__name__, value=entry.name, allowed=allowed)
    number = FIRST_USER_ID + int(identity_of(entry)[:11], 16)
    if (number, min(bodies)) not in KERNELS:
        functions = [_function(body) for body in bodies.values()]
        _compile(entry, number, dict(zip(bodies, functions, strict=True)))
    if entry.name in table and table[entry.name].native_id != number:
        _forget()
    table[entry.name] = replace(entry, native_id=number)


def _forget() -> None:
    """Clear what the package's functions keep by descriptions, which name a law and do not hold it."""
    values = [
        v for name, m in [*sys.modules.items()] if name.startswith("afo_sim.") for v in vars(m).values()
    ]
    for value in values:
        if hasattr(value, "cache_parameters") and value.cache_parameters()["maxsize"] is not None:
            value.cache_clear()


def _function(body: Body) -> Callable[..., float]:
    space: dict[str, Any] = {"kernel": _marked(body.kernel)}
    exec(f"def function(x, y, z, u, c, act, a, out):\n    {body.text}\n", space)
    made: Callable[..., float] = space["function"]
    return made


def anew(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of a function: numba keeps what it has compiled, with the numbers that it read from outside."""
    if not isinstance(kernel, types.FunctionType) or hasattr(kernel, "slopes"):
        return kernel
    own = kernel.__code__, kernel.__globals__, kernel.__name__, kernel.__defaults__, kernel.__closure__
    return types.FunctionType(*own)


def _marked(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel, and the functions beside it that it calls, as compiled code may call them."""
    if not (isinstance(kernel, types.FunctionType) and marked(kernel)):
        return kernel
    for name in kernel.__code__.co_names:
        called = kernel.__globals__.get(name)
        if isinstance(called, types.FunctionType) and called.__module__ == kernel.__module__:
            _marked(called)
    return kernel


def _compile(entry: Entry, number: int, functions: Mapping[int, Callable[..., float]]) -> None:
    """Compile functions, and put their addresses into the table."""
    optional("numba")
    from numba.core.errors import NumbaError, UnsupportedBytecodeError

    from afo_sim.common import compiling, machine_code

    register_all()
    try:
        codes = compiling.compile_all(
            f"user_{number}", [*functions.values()], compiling.user_signature(), lambda *arguments: math.nan
        )
    except (NumbaError, UnsupportedBytecodeError) as error:
        reasons = re.findall(
            r"^ *((?:Unknown|Untyped|No impl|Invalid|Cannot|Unsupp|Use of).*)", str(error), re.M
        )
        place = re.search(r"([^/\\ ]+\.py) ?\((\d+)\)", str(error))
        where = f" ({place[1]}:{place[2]})" if place else ""
        problem = f"cannot be compiled: {(reasons or ['numba refuses it'])[-1]}{where}"
        allowed = "what numba compiles: numbers, math.*, functions of such"
        raise InputError(problem, field=type(entry).__name__, value=entry.name, allowed=allowed) from error
    needs = [need for code in codes for need in code.needs if need.startswith(("Py", "numba_gil"))]
    if needs:
        problem, allowed = f"calls Python ({needs[0]})", "numbers alone; no print"
        raise InputError(problem, field=type(entry).__name__, value=entry.name, allowed=allowed)
    for (gives, function), code in zip(functions.items(), codes, strict=True):
        machine_code.add_user_kernel(number, gives, code)
        KERNELS[number, gives] = function
