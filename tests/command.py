"""The command line in this process: the muscles are compiled once for all tests."""

import sys

import pytest

from afo_sim import cli


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """`afo-sim …`: (exit code, what it printed, what it complained)."""
    sys.argv = ["afo-sim", *map(str, arguments)]
    try:
        cli.main()
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    out, err = capsys.readouterr()
    return code, out, err
