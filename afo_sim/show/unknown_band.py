"""The band of a curve over what is not known, behind the curve."""

from typing import Any

import numpy as np

from afo_sim.show.run_view import PERCENT, PHASE, RunView

EVERY = 0.13  # of the axis' diagonal, from marker to marker


def mean_and_spread(
    axis: Any,
    values: np.ndarray,
    colour: str,
    label: str | None,
    x: np.ndarray,
    style: Any = "-",
    marker: str | None = None,
) -> None:
    """Mean of the strides as a line, lowest to highest as a band; one row is a line.

    Units: x (n,).
    """
    if len(values) > 1:
        low, high = values.min(axis=0), values.max(axis=0)
        axis.fill_between(x, low, high, color=colour, alpha=0.25, lw=0.0, zorder=2)
    axis.plot(x, values.mean(axis=0), color=colour, ls=style, label=label, zorder=3, **marked(x, marker))


def marked(x: np.ndarray, marker: str | None) -> dict[str, Any]:
    """Markers of a line at every EVERY of the axis' width; a dot for a single row."""
    if len(x) == 1:
        return {"marker": "."}
    return {"marker": marker, "markevery": EVERY, "ms": 3.2} if marker else {}


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
