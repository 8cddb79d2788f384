"""The panels of muscles and what they hang on: own contraction beside the path's, cuff and plate."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.show.panels import group_curves, marked, mean_and_spread, shade_stance
from afo_sim.show.run_view import Over, RunView
from afo_sim.show.style import LINE_STYLES, MOUNTINGS, ZERO

PATH = {"lw": 0.7, "zorder": 2.5}  # a path beside a muscle's own line
SLACK = ":"  # line style of a muscle that pulls on nothing
NAMES = {"shank": "cuff", "foot": "plate"}  # of the anchors


def contractions(axis: Any, runs: Sequence[RunView], over: Over = "time") -> None:
    """Own contraction of each muscle of a run, dotted where it is slack; thin, that of its path.

    A path's contraction is that of a muscle on rigid cable, cuff and plate. Where a muscle is shorter, they
    give; where it is longer, its cable hangs slack. A group is drawn once where its muscles coincide.
    """
    run = runs[0]
    axis.axhline(0.0, color=ZERO, lw=0.6, zorder=1)
    for group in run.groups:
        colour = run.colours[group]
        for label, muscle, _ in group_curves(run, group, "contraction", "path_length"):
            x, own = run.curves(f"muscle/{muscle}/contraction", over)
            _, force = run.curves(f"muscle/{muscle}/force", over)
            look = {"color": colour, "zorder": 3, **marked(x, run.markers[group])}
            _own(axis, x, 100.0 * own, force.max(axis=0) <= 0.0, label, look)
            path = run.path_contraction(group, muscle, over)
            axis.plot(x, 100.0 * path.mean(axis=0), color=colour, **PATH)
    axis.plot([], [], color="0.4", ls=SLACK, label="slack")
    axis.plot([], [], color="0.4", lw=PATH["lw"], label="of its path")
    axis.set_ylabel("contraction\n[%]")
    if over == "time":
        shade_stance(axis, run)


def _own(
    axis: Any, x: np.ndarray, values: np.ndarray, slack: np.ndarray, label: str, look: dict[str, Any]
) -> None:
    """A muscle's curves, with a dotted mean where it is slack in every one of them."""
    if len(values) > 1:
        low, high = values.min(axis=0), values.max(axis=0)
        axis.fill_between(x, low, high, color=look["color"], alpha=0.25, lw=0.0, zorder=2)
    mean = values.mean(axis=0)
    if slack.all() or len(x) == 1:
        axis.plot(x, mean, ls=SLACK, label=label, **look)
        return
    reach = slack.copy()  # up to the first taut row, so that no gap is seen
    reach[1:] |= slack[:-1]
    reach[:-1] |= slack[1:]
    axis.plot(x, np.where(slack, np.nan, mean), label=label, **look)
    axis.plot(x, np.where(reach, mean, np.nan), color=look["color"], ls=SLACK, zorder=3)


def displacements(axis: Any, runs: Sequence[RunView], over: Over = "time") -> None:
    """How far the cuff and the plate of a run give along the pull of the muscles."""
    _mountings(axis, runs[0], over, "displacement", 1e3)
    axis.set_ylabel("mounting gives\n[mm]")


def pulls(axis: Any, runs: Sequence[RunView], over: Over = "time") -> None:
    """Pull of all muscles of a run on its cuff and on its plate."""
    _mountings(axis, runs[0], over, "force", 1.0)
    axis.set_ylabel("pull on the\nmounting [N]")


def _mountings(axis: Any, run: RunView, over: Over, quantity: str, factor: float) -> None:
    for anchor, style in zip(run.anchors, itertools.cycle(LINE_STYLES)):
        x, values = run.curves(f"cuff/{anchor}/{quantity}", over)
        mean_and_spread(axis, factor * values, MOUNTINGS[anchor], NAMES[anchor], x, style)
    if over == "time":
        shade_stance(axis, run)
