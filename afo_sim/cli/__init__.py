"""The command line: reads options, calls the library, prints. Heavy imports wait for their command."""

import sys

from afo_sim.cli import error_handler
from afo_sim.cli.apps import app, gait_app

# each hangs its commands on the app, in the order in which --help shows them
# ruff: isort: off
from afo_sim.cli import run as _run  # noqa: F401
from afo_sim.cli import both as _both  # noqa: F401
from afo_sim.cli import bode as _bode  # noqa: F401
from afo_sim.cli import size as _size  # noqa: F401
from afo_sim.cli import electronics as _electronics  # noqa: F401
from afo_sim.cli import look as _look  # noqa: F401
from afo_sim.cli import draw as _draw  # noqa: F401
from afo_sim.cli import export as _export  # noqa: F401
from afo_sim.cli import stand as _stand  # noqa: F401
from afo_sim.cli import fits as _fits  # noqa: F401
from afo_sim.cli import gait as _gait  # noqa: F401
from afo_sim.cli import leg as _leg  # noqa: F401
from afo_sim.cli import sweep as _sweep  # noqa: F401
from afo_sim.cli import optimise as _optimise  # noqa: F401
from afo_sim.cli import lists as _lists  # noqa: F401
from afo_sim.cli import new as _new  # noqa: F401
from afo_sim.cli import refit as _refit  # noqa: F401
from afo_sim.cli import attach as _attach  # noqa: F401

# ruff: isort: on

__all__ = ["app", "gait_app", "main"]


def main() -> None:
    """Run a command; errors end in one message and an exit code, which `afo-sim --help` lists."""
    sys.exit(error_handler.run(app))
