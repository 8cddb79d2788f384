"""The panel of what a controller tells and its switches read, over time."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.control.controller import TOLD
from afo_sim.show.panels import shade_stance
from afo_sim.show.run_view import RunView
from afo_sim.show.style import COLOURS, LINE_STYLES, plain
from afo_sim.simulation.columns import SENSOR
from afo_sim.simulation.recording import Recording

PLAIN = tuple(f"controller/{name}" for name, (unit, _) in TOLD.items() if unit == "")


def told(recording: Recording) -> list[str]:
    """Columns of a controller, and of sensors, that are plain numbers."""
    sensors = [
        name for name in recording.columns if name.startswith(SENSOR) and recording.describe(name)[0] == ""
    ]
    return [name for name in PLAIN if name in recording.columns] + sensors


def electronics(axis: Any, runs: Sequence[RunView]) -> None:
    """What the electronics of a run tell in plain numbers: state, phase, output, activation, switches."""
    run = runs[0]
    styles = itertools.cycle(zip(COLOURS, itertools.cycle(LINE_STYLES)))
    for name, (colour, style) in zip(told(run.recording), styles, strict=False):
        values = run.recording[name]
        if np.isfinite(values).any():
            label = plain(name.removeprefix("controller/"))
            axis.step(
                run.recording["time"], values, where="post", color=colour, ls=style, lw=0.9, label=label
            )
    axis.set_ylabel("electronics\n[1]")
    shade_stance(axis, run)
