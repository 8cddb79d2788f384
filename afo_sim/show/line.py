"""A line of a panel, with the spread of the strides around it."""

from typing import Any

import numpy as np

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
