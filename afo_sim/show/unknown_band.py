"""The band of a curve over what is not known, behind the curve."""

from typing import Any

import numpy as np

from afo_sim.show.run_view import PERCENT, PHASE, RunView

STUDY = "uncertainty"
LABEL = "5–95 % of what is not known"
DASHES = (0, (1.5, 1.5))


def unknown_band(axis: Any, run: RunView, column: str, scale: float = 1.0, colour: str | None = None) -> None:
    """5 to 95 % of a column over the gait cycle, light, with dotted edges; nothing where none were drawn."""
    study = run.recording.studies.get(STUDY) or {}
    curves = study.get("curves", {}).get(column)
    if curves is None:
        return
    low, _, high = (np.interp(PHASE, study["phase"], scale * np.array(quantile)) for quantile in curves)
    paint = run.colour if colour is None else colour
    axis.fill_between(PERCENT, low, high, color=paint, alpha=0.1, lw=0.0, zorder=1.5, label=LABEL)
    for edge in (low, high):
        axis.plot(PERCENT, edge, color=paint, lw=0.7, ls=DASHES, zorder=1.6)
