"""Runs code in a process where rooms and libraries of extras cannot be imported."""

import os
import pathlib
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterable

from test_walls import ROOMS as HOUSE

from afo_sim.common import EXTRAS
from afo_sim.common.versions import CORE

ROOT = pathlib.Path(__file__).parents[2]
ROOMS = tuple(room for room in HOUSE if room not in (*CORE, "cli"))  # of the extras
BLOCKER = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name in BLOCKED or name.startswith(tuple(f"{one}." for one in BLOCKED)):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Blocker())
"""


def without(rooms: Iterable[str], packages: Iterable[str], code: str) -> str:
    """What the code prints where rooms of this package and libraries are absent.

    It must end well; a room or library that it loads in spite of the wall would show as its own failure.
    """
    blocked = {f"afo_sim.{room}" for room in rooms} | set(packages)
    text = f"BLOCKED = {sorted(blocked)!r}\n{BLOCKER}\n{textwrap.dedent(code)}"
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", text],
            capture_output=True,
            text=True,
            cwd=folder,
            timeout=250,
            env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
        )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def packages_of(extras: Iterable[str]) -> set[str]:
    """The libraries of some extras, as they are imported."""
    return {package for extra in extras for package in EXTRAS[extra]}
