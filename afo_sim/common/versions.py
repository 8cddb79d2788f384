"""Versions: what a result was computed with. The code's own version is a fingerprint of its rooms."""

import functools
import hashlib
import importlib.metadata
import pathlib
import platform
import types

CORE = ("common", "physics", "gait", "description", "native", "control", "metrics", "model", "simulation")
# The rooms that results depend on; who only fits, validates, shows or asks changes no row of a study.
COMPUTING = (*CORE, "study")
PACKAGE = pathlib.Path(__file__).resolve().parents[1]


@functools.cache
def code_fingerprint(package: pathlib.Path = PACKAGE) -> str:
    """SHA-256 of the bytecode of the rooms that compute: no comments, docstrings, asserts, line numbers.

    Parameters
    ----------
    package : folder of `afo_sim`
    """
    found = hashlib.sha256()
    for room in COMPUTING:
        for path in sorted((package / room).rglob("*.py")):
            code = compile(path.read_bytes(), "", "exec", dont_inherit=True, optimize=2)
            found.update(f"{path.relative_to(package).as_posix()}\n{_run(code)}\n".encode())
    return found.hexdigest()


def _run(value: object) -> object:
    """Of a piece of bytecode all but its lines, as text that is the same in each process."""
    if isinstance(value, frozenset):  # in an order of this process
        return sorted(map(repr, value))
    if not isinstance(value, types.CodeType):
        return repr(value)
    names = value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars
    counts = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount, value.co_flags
    return value.co_name, *names, *counts, value.co_code, value.co_exceptiontable, *map(_run, value.co_consts)


@functools.cache
def versions(
    packages: tuple[str, ...] = ("afo-sim", "mujoco", "numpy", "numba", "rerun-sdk"),
) -> dict[str, str]:
    """{package: version} of Python, this package and what it computes with."""
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found
