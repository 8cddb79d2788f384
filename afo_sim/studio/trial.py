"""A gait trial that is dropped on the page: read as `gait import` does, with its picture and its doubts."""

import pathlib
from collections.abc import Sequence
from typing import Any

from afo_sim.gait import write
from afo_sim.gait_lab import import_gait, read_options, ten_lines, verdict
from afo_sim.show import draw_gait

_WHOSE = {"healthy": "a healthy walker's", "patient": "a patient's"}
WALKERS = tuple(_WHOSE)
NAME = "walk"


def imported(files: Sequence[pathlib.Path], walker: str, side: str, folder: pathlib.Path) -> dict[str, Any]:
    """A stride of a trial in a folder, and what is to be said of it.

    Parameters
    ----------
    files : of one trial
    walker : "healthy" or "patient"
    side : "right" or "left"
    folder : to which the gait CSV and its picture are written

    Returns
    -------
    `sets` of the scenario, `picture` by its name, `text`, `rows`, `checks` and `warnings`

    Raises
    ------
    InputError
        As `afo_sim.import_gait`.
    """
    found = import_gait(list(files), read_options({"walker": walker, "side": side}))
    number = 1 + len(list(folder.glob(f"{NAME}_*.csv")))  # an earlier one is gone back to by undoing
    path = folder / f"{NAME}_{number}.csv"
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
