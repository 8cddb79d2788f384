"""What a child process is given, so that it takes no program and no module from the current folder."""

import os
import pathlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

SAFE = "PYTHONSAFEPATH"  # environment: Python leaves the current folder out of the places of its modules
# an empty entry is the current folder
_LISTS = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH")


def child_environment(own: Mapping[str, str] | None = None) -> dict[str, str]:
    """This process's environment for a child, without the current folder in any list of places."""
    found = {name: value for name, value in os.environ.items() if name != "PYTHONSTARTUP"}
    for name in found.keys() & set(_LISTS):
        places = [pathlib.Path(place) for place in found[name].split(os.pathsep)]
        elsewhere = [p for p in places if p.is_absolute() and p.resolve() != pathlib.Path.cwd()]
        found[name] = os.pathsep.join(map(str, elsewhere))
    return {name: value for name, value in found.items() if value} | {SAFE: "1"} | dict(own or {})


@contextmanager
def safe_children() -> Iterator[None]:
    """A block in which libraries start Python without the current folder among the places of its modules."""
    before = os.environ.get(SAFE)
    os.environ[SAFE] = "1"
    try:
        yield
    finally:
        os.environ.pop(SAFE)
        if before is not None:
            os.environ[SAFE] = before
