"""Entries that stand one kind a file: found in a package's modules, checked, and dispatched by native id.

Compiled code knows a kernel by a number alone, and numba can only branch over kernels that it sees in a
function's text. So the text is written here from the entries: one `if` per native id, in the order of the
ids. It compiles to what the same chain written by hand does.
"""

import importlib
import inspect
import linecache
import math
import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Entry

E = TypeVar("E", bound=Entry)


def collect(package: str, kind: type[E], *, besides: Iterable[str] = ()) -> dict[str, E]:
    """Entries of a kind at the top level of a package's modules, by name.

    Parameters
    ----------
    package : full name of the package
    kind : class of the entries
    besides : modules of the package that hold no entry

    Returns
    -------
    {name: entry}, in the order of the native ids, and of the files where several share one

    Raises
    ------
    ValueError
        A module without an entry, or a name or native id that is given twice.
    """
    folder = importlib.import_module(package).__path__
    found: list[tuple[str, E]] = []
    for module in sorted(info.name for info in pkgutil.iter_modules(folder)):
        if module in besides:
            continue
        values = vars(importlib.import_module(f"{package}.{module}")).values()
        here = [value for value in values if isinstance(value, kind)]
        if not here:
            raise ValueError(f"{package}.{module} holds no {kind.__name__} at its top level")
        known = {id(entry) for _, entry in found}
        found += [(f"{package}.{module}", entry) for entry in here if id(entry) not in known]
    found.sort(key=lambda item: item[1].native_id)
    _check_unique(found)
    return {entry.name: entry for _, entry in found}


def _check_unique(found: Sequence[tuple[str, Entry]]) -> None:
    """Refuse a name or a native id that is given twice (ValueError); entries of one kernel share its id."""
    by_name: dict[str, str] = {}
    by_id: dict[int, tuple[str, Entry]] = {}
    for module, entry in found:
        if entry.name in by_name:
            raise ValueError(f"the name {entry.name!r} is given twice: in {by_name[entry.name]} and {module}")
        by_name[entry.name] = module
        first, other = by_id.setdefault(entry.native_id, (module, entry))
        if other.kernel is not entry.kernel:
            raise ValueError(
                f"the native id {entry.native_id} is given twice: to {other.name!r} in {first} and to "
                f"{entry.name!r} in {module}; {1 + max(e.native_id for _, e in found)} is free"
            )


def check_coefficients(entry: Entry, arguments: int, most: int) -> int:
    """Number of coefficients of an entry, tried on a braid with the parameters' typical values.

    Parameters
    ----------
    entry : law or friction
    arguments : of the kernel beside the coefficients
    most : slots that an actuator's row has for them

    Raises
    ------
    ValueError
        More coefficients than slots, or another number than the kernel takes.
    """
    number = getattr(entry, "count", 0) or len(entry.typical)
    if number > most:
        raise ValueError(f"{entry.name!r} has {number} coefficients; an actuator's row has {most} slots")
    try:
        inspect.signature(getattr(entry.kernel, "slopes", entry.kernel)).bind(*[0.0] * (arguments + number))
    except TypeError as error:
        problem = f"{entry.name!r} has {number} coefficients, which its kernel does not take"
        raise ValueError(f"{problem}: {error}") from None
    return number


@dataclass(frozen=True)
class Branch:
    """Lines that a dispatcher runs for one native id; `{kernel}` in them is the kernel."""

    native_id: int
    kernel: Callable[..., Any]
    lines: tuple[str, ...]


def items(array: str, first: str, number: int) -> list[str]:
    """Texts "array[first]", "array[first + 1]", … of so many consecutive items."""
    return [f"{array}[{first} + {k}]" if k else f"{array}[{first}]" for k in range(number)]


def dispatcher(
    name: str, arguments: Sequence[str], branches: Iterable[Branch], *, otherwise: str = "math.nan",
    description: str = "", names: Mapping[str, Any] | None = None,
) -> Callable[..., Any]:  # fmt: skip
    """A function that branches over native ids, callable from Python and from compiled code.

    Parameters
    ----------
    name, description : of the function
    arguments : their names; the first is the native id, as a float
    branches : one for each native id; more of the same id are passed over
    otherwise : expression of the value for any other id
    names : what it calls
    """
    chain = {branch.native_id: branch for branch in sorted(branches, key=lambda b: b.native_id)}
    space: dict[str, Any] = {"math": math, **(names or {})}
    lines = [f"def {name}({', '.join(arguments)}):", f"    {description!r}"]
    for native_id, branch in chain.items():
        kernel = f"kernel_{native_id}"
        space[kernel] = branch.kernel
        lines.append(f"    if {arguments[0]} == {float(native_id)!r}:")
        lines += [f"        {line.format(kernel=kernel)}" for line in branch.lines]
    lines.append(f"    return {otherwise}")
    text, file = "\n".join(lines) + "\n", f"<{name} over native ids>"
    linecache.cache[file] = (len(text), None, text.splitlines(True), file)  # tracebacks show the lines
    exec(compile(text, file, "exec"), space)
    return register_jitable(space[name])
