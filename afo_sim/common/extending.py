"""What a user adds to the package without changing it: laws, frictions, metrics, columns, parts, formats.

Each room says what it takes, and how. What is added has a digest of its own, so that a study knows which law
it was computed with, and goes to other processes by value: they need not find the user's files.
"""

import functools
import hashlib
import importlib
import importlib.metadata
import importlib.util
import os
import pathlib
import sys
import traceback
import types
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import TypeVar

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Function, Mixed

T = TypeVar("T")
GROUP = "afo_sim"  # of entry points: each names an object that `register` takes, or a module with some
TAKEN: dict[type, Callable[[Mixed], object] | str] = {}  # kinds of objects, and what adds one
ADDED: list[Mixed] = []  # in their order
_ASKED: set[str] = set()  # groups of entry points that were looked for
_TAKEN = "what load, column, controller, metric, Law, Friction or Format gives, or a Python file with some"


def takes(kind: type[T], add: Callable[[T], object] | str) -> None:
    """Say that a room takes objects of a kind by `add`, or by that of a module; InputError of a wrong one."""
    TAKEN[kind] = add


def register(*things: Mixed) -> None:
    """Add your own laws, frictions, metrics, columns, parts or export formats.

    An earlier object of the same name is replaced, so a notebook cell can run again.

    Parameters
    ----------
    things : results of `Law`, `Friction`, `metric`, `column`, `Format` or `load`; or a module, or the path of
        a Python file that defines some at its top level

    Raises
    ------
    InputError
        One is of another kind, is invalid, or has the name of a shipped one.

    Examples
    --------
    >>> register(load("valve", "mh1", {"name": "my_valve", "conductance": "0.3 l/(s*bar)"}))
    >>> load("valve", "my_valve").name
    'my_valve'
    """
    before = list(ADDED)
    for thing in things:
        if isinstance(thing, str | os.PathLike):
            thing = _module(pathlib.Path(thing))  # which may register by itself
        if isinstance(thing, types.ModuleType):
            found = [each for each in vars(thing).values() if _adds(each)]
            if not found and before == ADDED:
                file = pathlib.Path(getattr(thing, "__file__", None) or thing.__name__).name
                raise InputError("has nothing to register", field="extension", value=file, allowed=_TAKEN)
            try:
                register(*found)
            except Exception as error:  # of the user's code
                if not isinstance(error, InputError):
                    error.add_note(f"in {getattr(thing, '__file__', thing.__name__)}")
                raise
        elif (add := _adds(thing)) is None:
            raise InputError("cannot be registered", field="register", value=thing, allowed=_TAKEN)
        else:
            add(thing)
            names = [*map(_called, ADDED)]
            at = names.index(_called(thing)) if _called(thing) in names else len(ADDED)
            ADDED[at : at + 1] = [thing]  # in its place: one may read another that stands before it


def _called(thing: Mixed) -> str:
    """Kind and name of what is added."""
    return f"{type(thing).__name__} {getattr(thing, 'name', thing)}"


def _adds(thing: Mixed) -> Callable[[Mixed], object] | None:
    add = next((add for kind, add in TAKEN.items() if isinstance(thing, kind)), None)
    return importlib.import_module(add).add if isinstance(add, str) else add


def _module(file: pathlib.Path) -> types.ModuleType:
    """A user's file as a module, which pickles by value."""
    import cloudpickle

    name = f"_extension_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if not file.is_file() or spec is None or spec.loader is None:
        allowed = f"such as mine.py; in Python {_TAKEN}"
        raise InputError("is no Python file", field="extension", value=str(file), allowed=allowed)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # of the user's code
        traced = traceback.extract_tb(error.__traceback__)
        lines = [each.lineno for each in traced if each.filename == spec.origin]
        at = f"{file}:{getattr(error, 'lineno', None) or [0, *lines][-1]}"
        if isinstance(error, SystemExit):  # which would end the program
            raise InputError("ends Python", file=at) from error
        if isinstance(error, InputError) and error.file is None:
            raise error.replaced(file=at) from error
        error.add_note(f"in {at}")
        raise
    cloudpickle.register_pickle_by_value(module)
    return module


def register_installed() -> None:
    """Add what installed packages offer by entry points, once; what fails is a warning."""
    if _ASKED:
        return
    _ASKED.add(GROUP)  # before they are loaded, since they may ask for this package's names
    import importlib.metadata

    for point in importlib.metadata.entry_points(group=GROUP):
        try:
            register(point.load())
        except (Exception, SystemExit) as error:  # of another package's code
            warnings.warn(
                f"the extension {point.value} is left out: {type(error).__name__}: {error}", stacklevel=2
            )


def packed() -> bytes:
    """What was added, for another process; nothing where nothing was."""
    if not ADDED:
        return b""
    import cloudpickle

    # each with what adds it, whose module is then imported there
    try:
        things = cloudpickle.dumps([(_adds(each), each) for each in ADDED])
    except Exception as error:  # whatever a user's object raises
        problem = f"does not go to another process: {error}"
        names = ", ".join(map(_called, ADDED))
        raise InputError(problem, field="register", value=names, allowed="threads = 1") from error
    found: bytes = cloudpickle.dumps(([*map(os.path.abspath, sys.path)], things))
    return found


@functools.lru_cache(maxsize=1)
def take(packed: bytes) -> None:
    """Add what another process has packed."""
    if packed:
        import pickle

        path, things = pickle.loads(packed)
        sys.path += [place for place in path if place not in sys.path]
        register(*(thing for _, thing in pickle.loads(things)))


def place_of(error: BaseException, function: Function) -> str:
    """FILE:LINE at which a user's function failed; where it has no lines of its own, its name."""
    code = getattr(function, "__code__", None)
    frames = traceback.extract_tb(error.__traceback__)
    lines = [each.lineno for each in frames if code is not None and each.filename == code.co_filename]
    return repr(function) if code is None else f"{code.co_filename}:{(lines or [code.co_firstlineno])[-1]}"


def identities() -> dict[str, str]:
    """{kind and name: digest} of what was added, for whoever resumes what was computed with it."""
    return {_called(each): identity_of(each) for each in ADDED}


def identity_of(thing: Mixed) -> str:
    """SHA-256 of what an object does: of its code, and of the functions and values that this uses."""
    return hashlib.sha256("\n".join(_texts(thing, set())).encode()).hexdigest()


def _texts(thing: Mixed, seen: set[int]) -> Iterator[str]:
    """Texts that an object follows from, without names of files and numbers of lines."""
    thing = getattr(thing, "py_func", thing)  # of what numba has compiled
    if id(thing) in seen:
        return
    parts: list[Mixed] = [type(thing).__name__]
    if isinstance(thing, types.FunctionType):
        seen.add(id(thing))
        own = thing.__globals__
        used = [own[name] for name in _names(thing.__code__) if name in own]
        used = [each for each in used if getattr(each, "__module__", thing.__module__) == thing.__module__]
        cells = [cell.cell_contents for cell in thing.__closure__ or ()]
        parts = [thing.__code__, thing.__defaults__, thing.__kwdefaults__, *cells, vars(thing), *used]
    elif isinstance(thing, types.CodeType):
        parts = [thing.co_code.hex(), thing.co_names, thing.co_varnames, *thing.co_consts]
    elif isinstance(thing, Mapping):
        parts += [part for item in thing.items() for part in item]
    elif isinstance(thing, tuple | list):
        parts += thing
    elif isinstance(thing, set | frozenset):  # whose order is another in each process
        parts += sorted(map(repr, thing))
    elif isinstance(thing, type | types.ModuleType):
        seen.add(id(thing))
        parts.append(thing.__name__)
        if isinstance(thing, type) and _is_users(thing.__module__):
            of_a_file = "__module__", "__firstlineno__", "__dict__", "__weakref__", "__doc__"
            parts += [value for name, value in vars(thing).items() if name not in of_a_file]
            parts += thing.__bases__
    elif isinstance(thing, staticmethod | classmethod | property | functools.partial):
        names = "__func__", "fget", "fset", "func", "args", "keywords"
        parts += [getattr(thing, name) for name in names if hasattr(thing, name)]
    elif hasattr(thing, "tobytes"):  # numpy's, of which repr leaves digits out
        parts += [str(getattr(thing, "shape", "")), thing.tobytes().hex()]
    elif is_dataclass(thing):
        parts += [getattr(thing, each.name) for each in fields(thing)]
    elif hasattr(thing, "__dict__"):
        seen.add(id(thing))
        parts += [type(thing), vars(thing)]
    else:
        yield repr(thing)
        return
    for part in parts:
        yield from _texts(part, seen)


def _is_users(module: str) -> bool:
    """Whether a module is a user's own, and of no library."""
    top = module.partition(".")[0]
    file = getattr(sys.modules.get(module), "__file__", "") or ""
    return top not in {"afo_sim", *sys.stdlib_module_names} - {"__main__"} and "site-packages" not in file


def _names(code: types.CodeType) -> Iterator[str]:
    """Names outside it that a code uses, with those of the functions within it."""
    yield from code.co_names
    for within in code.co_consts:
        if isinstance(within, types.CodeType):
            yield from _names(within)
