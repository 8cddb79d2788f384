"""All commands. Heavy imports wait for their command."""

from afo_sim.cli.common import app, gait_app
from afo_sim.cli.error_handler import grouped

# each registers its commands with the app
# ruff: isort: off
from afo_sim.cli import run as _run  # noqa: F401
from afo_sim.cli import walk as _walk  # noqa: F401
from afo_sim.cli import analyses as _analyses  # noqa: F401
from afo_sim.cli import electronics as _electronics  # noqa: F401
from afo_sim.cli import look as _look  # noqa: F401
from afo_sim.cli import studio as _studio  # noqa: F401
from afo_sim.cli import lab_tests as _lab_tests  # noqa: F401
from afo_sim.cli import gait as _gait  # noqa: F401
from afo_sim.cli import sweep as _sweep  # noqa: F401
from afo_sim.cli import descriptions as _descriptions  # noqa: F401
from afo_sim.cli import leg as _leg  # noqa: F401

# ruff: isort: on

GROUPS = {  # as --help shows them
    "Simulate": ("run", "walk", "both", "compare", "torque-map"),
    "Look": ("view", "figure", "report", "draw", "video", "studio", "check-run", "recover"),
    "Your own": ("new", "check", "keys", "list", "gait", "leg", "attach", "refit"),
    "Study": ("sweep", "optimise", "size", "replay"),
    "Evidence": ("paper", "validate", "credibility", "stand", "fit", "calibrate"),
    "Out": ("export", "electronics"),
}
app.info.cls = grouped(GROUPS)

__all__ = ["app", "gait_app"]
