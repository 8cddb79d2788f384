"""Versions: what a result was computed with. The code's own version is a fingerprint of its rooms."""

import errno
import functools
import hashlib
import importlib.metadata
import itertools
import pathlib
import platform
from collections.abc import Iterable

CORE = ("common", "physics", "gait", "description", "native", "control", "metrics", "model", "simulation")
# The rooms that results depend on; who only fits, validates, shows or asks changes no row of a study.
COMPUTING = (*CORE, "study")
SOURCES = ("*.py", "*.c", "*.h", "*.json")
PACKAGE = pathlib.Path(__file__).resolve().parents[1]


@functools.cache
def code_fingerprint(package: pathlib.Path = PACKAGE) -> str:
    """SHA-256 of the sources of the rooms that compute."""
    return digest_of_sources(package, COMPUTING)


def digest_of_sources(package: pathlib.Path, rooms: Iterable[str]) -> str:
    """SHA-256 of the sources of rooms, in Python and C; OSError where there are none, or one is not read."""
    ends, found = itertools.product(rooms, SOURCES), hashlib.sha256()
    files = sorted(path for room, end in ends for path in (package / room).rglob(end))
    if not files:
        raise FileNotFoundError(errno.ENOENT, "no sources", str(package))
    for path in files:
        content = path.read_bytes()
        found.update(f"{path.relative_to(package).as_posix()} {len(content)}\n".encode() + content)
    return found.hexdigest()


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
