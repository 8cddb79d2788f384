"""A trial that somebody has dropped on the page: one stride of it, and what is to be said of it."""

import pathlib
from collections.abc import Sequence

from afo_sim.common import AfoSimError, Function, JsonDict
from afo_sim.gait import write
from afo_sim.gait_lab import import_gait, read_options, ten_lines, verdict
from afo_sim.show import draw_gait

_WHOSE = {"healthy": "a healthy walker's", "patient": "a patient's"}


def serve(receive: Function, send: Function) -> None:
    """The life of the process that reads one trial."""
    try:
        send(imported(*receive()))
    except (AfoSimError, OSError) as error:
        send(error)


def imported(files: Sequence[pathlib.Path], walker: str, side: str, folder: pathlib.Path) -> JsonDict:
    """A stride of a trial in a folder, and what is to be said of it."""
    found = import_gait(list(files), read_options({"walker": walker, "side": side}))
    number = 1 + len(list(folder.glob("walk_*.csv")))  # an earlier one is gone back to by undoing
    path = folder / f"walk_{number}.csv"
    write(path, found.cycle)
    draw_gait(found.cycle, path.with_suffix(".png"), found)
    return {
        "sets": {
            "description": f"{_WHOSE[walker]} own recorded walk, with the device",
            "gait.cycle": str(path),
            **dict.fromkeys(("gait.walker", "patient.body_mass", "patient.body_height")),
        },
        "picture": path.with_suffix(".png").name,
        "text": verdict(found),
        "rows": [list(row) for row in ten_lines(found)],
        "checks": [[check.fault, check.found, check.limit, check.verdict] for check in found.checks],
        "warnings": [str(warning) for warning in found.warnings],
    }
