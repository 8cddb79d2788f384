"""The command line in this process: the muscles are compiled once for all tests."""

import sys
from collections.abc import Callable

import pytest

from afo_sim import cli
from afo_sim.cli import error_handler

Call = Callable[..., tuple[int, str, str]]  # the fixture `call`


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """`afo-sim …`: (exit code, what it printed, what it complained)."""
    sys.argv = ["afo-sim", *map(str, arguments)]
    code = error_handler.run(cli.app)
    out, err = capsys.readouterr()
    return code, out, err
