"""Versions: what a result was computed with."""

import functools
import importlib.metadata
import platform


@functools.cache
def versions() -> dict[str, str]:
    """{package: version} of Python, this package and what it computes with."""
    packages = ("afo-sim", "mujoco", "numpy", "numba", "rerun-sdk")
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found
