"""The figure of a sizing: each limit's margin over the candidates, what keeps it shaded."""

import pathlib

import numpy as np

from afo_sim.metrics import UNITS
from afo_sim.show.panels import legend
from afo_sim.show.style import BLUE, GREEN, GREY, RED, Axes, new_figure, plain
from afo_sim.study import Candidate, Requirement, Sizing

_WIDTH, _HEAD, _PANEL = 6.4, 1.8, 1.6  # [inch]
_NAME = 16  # letters of a name


def draw_size(sizing: Sizing, path: pathlib.Path) -> None:
    """Draw the margins of all candidates that were run: pressures over their size, others in its order."""
    numbers = sizing.kind == "pressure"
    places = {each.name: 1e-5 * each.size if numbers else float(k) for k, each in enumerate(sizing.ran)}
    with new_figure(path, (_WIDTH, _HEAD + _PANEL * max(len(sizing.requirements), 1))) as figure:
        panels = np.atleast_1d(figure.subplots(max(len(sizing.requirements), 1), 1, sharex=True))
        for axis, requirement in zip(panels, sizing.requirements, strict=False):
            _panel(axis, requirement, sizing.ran, places, sizing.best)
        if numbers:
            panels[-1].set_xlabel("supply pressure [bar]")
        else:
            names = [plain(name, _NAME) for name in places]
            panels[-1].set_xticks(list(places.values()), names, rotation=90, fontsize=7.5)
        figure.suptitle(plain(sizing.answer.partition(":")[0], 95), x=0.01, ha="left", fontsize=9.0)
        legend(figure, panels)


def _panel(
    axis: Axes, limit: Requirement, ran: list[Candidate], places: dict[str, float], best: Candidate | None
) -> None:
    margins = {each.name: each.margin(limit) for each in ran if np.isfinite(each.margin(limit))}
    axis.plot([places[name] for name in margins], list(margins.values()), color=GREY, lw=0.8, zorder=1)
    for meets, colour, marker, label in (
        (True, GREEN, "o", "meets all limits"),
        (False, RED, "x", "does not"),
    ):
        own = [each.name for each in ran if each.meets == meets and each.name in margins]
        if own:
            at = [places[name] for name in own], [margins[name] for name in own]
            axis.plot(*at, marker, color=colour, ms=5.0, label=label, zorder=3)
    if best is not None:
        axis.axvline(places[best.name], color=BLUE, lw=1.0, zorder=2, label=f"choice: {plain(best.name)}")
    low, high = min(0.0, *margins.values(), 0.0), max(0.0, *margins.values(), 0.0)
    room = 0.08 * (high - low or 1.0)
    axis.axhspan(0.0, high + room, color=GREEN, alpha=0.10, lw=0.0, zorder=0)
    axis.axhline(0.0, color=GREY, lw=0.7, zorder=1)
    axis.margins(x=0.03)
    axis.set_ylim(low - room, high + room)
    unit = UNITS.get(limit.unit, limit.unit)
    axis.set_ylabel(f"margin [{unit}]" if unit else "margin")
    axis.set_title(plain(f"{limit.label} {limit.wanted}", 70), loc="left")
