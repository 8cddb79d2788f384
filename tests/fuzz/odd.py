"""What is no file on a disk under a name where a command takes one, of every option of every command."""

import contextlib
import os
import pathlib
import shlex
import shutil
import socket
from collections.abc import Iterator, Mapping
from typing import Any

LINKS = {
    "zero": "/dev/zero", "random": "/dev/urandom", "full": "/dev/full", "terminal": "/dev/tty",
    "input": "/dev/stdin", "processes": "/proc/self/pagemap", "messages": "/proc/kmsg", "none": "nowhere",
    "loop": "loop", "self": "/proc/self/fd/0",
}  # fmt: skip
KINDS = ("pipe", "folder", "socket", *LINKS)
SUFFIXES = ("", ".toml", ".csv", ".xml", ".urdf", ".c3d", ".osim", ".json", ".parquet", ".py")


def make(folder: pathlib.Path) -> None:
    """One of each kind and ending; a command may have replaced some."""
    shutil.rmtree(folder / "odd", ignore_errors=True)
    (folder / "odd").mkdir(parents=True)
    for suffix in SUFFIXES:
        for name, target in LINKS.items():
            (folder / "odd" / f"{name}{suffix}").symlink_to(f"{target}{suffix if name == 'loop' else ''}")
        os.mkfifo(folder / "odd" / f"pipe{suffix}")
        (folder / "odd" / f"folder{suffix}").mkdir()
        with contextlib.chdir(folder / "odd"), socket.socket(socket.AF_UNIX) as bound:
            bound.bind(f"socket{suffix}")  # its path may not be long


def lines(commands: Mapping[str, str]) -> Iterator[tuple[str, list[str]]]:
    """Command lines with `{}` in the place of one argument or option that takes a text: (command, words)."""
    from typer.main import get_command

    from afo_sim.cli import app

    for name, told in commands.items():
        leaf: Any = get_command(app)
        for word in name.split():
            leaf = leaf.commands[word]
        words = shlex.split(told)
        context = leaf.make_context(name, list(words), resilient_parsing=True)
        for parameter in leaf.params:
            if any(kind in repr(parameter.type_descriptor.annotation) for kind in ("str", "Path")):
                yield name, [*name.split(), *_with(parameter, words, context.params.get(parameter.name))]


def _with(parameter: Any, words: list[str], value: object) -> list[str]:
    if parameter.param_type_name == "option":
        return [*words, parameter.opts[-1], *["{}"] * max(parameter.nargs, 1)]
    given = [str(each) for each in (value if isinstance(value, list | tuple) else [value])]
    found = [word for word in words if word in given]
    return ["{}" if word in found else word for word in words] if found else [*words, "{}"]
