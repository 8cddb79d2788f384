"""The facts of a design over the ankle's angle: contraction, lengths, moment arm, torque."""

from typing import Any

import numpy as np

from afo_sim.model.design import Design
from afo_sim.model.path_facts import PathFacts
from afo_sim.model.path_words import pressure
from afo_sim.show.drawing_views import WHITE, colours
from afo_sim.show.style import GREY, ZERO, plain

BEYOND = "0.92"  # shade of angles outside the range of motion
HANGS = 0.16  # opacity of the shade where a muscle hangs through
ROOM = 0.08  # of an axis above and below what is within the range of motion
STYLES: tuple[Any, ...] = (":", "--", "-")  # without air, at half and at full pressure
WORDS = 0.13  # height of a line of words in the panel of contraction [-]
SMALL = 7.0  # size of words in panels


def draw_curves(axes: list[Any], design: Design) -> None:
    """Fill four panels, one under another."""
    named = colours(design)
    for axis, draw in zip(axes, (_contraction, _lengths, _arm, _torque), strict=True):
        _ground(axis, design.facts[0])
        for entry in design.facts:
            draw(axis, entry, named[entry.name])
        _scale(axis, design.facts[0])
    _limits(axes[0], design)
    leg = design.built.scenario.leg
    axes[-1].set_xlabel(
        f"{plain(leg.ankle, 20)} angle [deg], {leg.directions[0]} +; grey: beyond the range of motion",
        fontsize=SMALL + 0.5,
    )
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    bar = pressure(design.facts[0])
    for axis, text in zip(
        axes,
        (
            f"contraction [%]: path thin, {bar} thick, no air dotted, slack shaded",
            f"length [mm]: path thin; muscle + link + slack at {bar} thick, no air dotted",
            f"moment arm about the {plain(leg.ankle, 20)} [mm]",
            f"torque at rest [N·m]: {bar} thick, half of it dashed, no air dotted",
        ),
        strict=True,
    ):
        axis.set_title(text, loc="left", fontsize=SMALL, pad=2.5)


def _ground(axis: Any, entry: PathFacts) -> None:
    """Zero lines, and grey where the device is not built for."""
    first, last = np.degrees(entry.angles[[0, -1]])
    low, high = np.degrees(entry.range)
    for start, end in ((first, low), (high, last)):
        if end > start:
            axis.axvspan(start, end, color=BEYOND, lw=0.0, zorder=0)
    axis.axvline(0.0, color=ZERO, lw=0.5, zorder=1)
    axis.axhline(0.0, color=ZERO, lw=0.5, zorder=1)
    axis.set_xlim(first, last)
    axis.tick_params(labelsize=SMALL)


def _contraction(axis: Any, entry: PathFacts, colour: str) -> None:
    degrees = np.degrees(entry.angles)
    axis.plot(degrees, 100.0 * entry.path, color=colour, lw=0.7)
    axis.plot(degrees, 100.0 * entry.own[:, 0], color=colour, lw=1.0, ls=STYLES[0])
    axis.plot(degrees, 100.0 * entry.own[:, -1], color=colour, lw=1.6)
    for column, which in ((0, 0), (-1, 1)):
        for low, high in entry.slack[which]:
            within = (entry.angles >= low) & (entry.angles <= high)
            path, own = 100.0 * entry.path[within], 100.0 * entry.own[within, column]
            axis.fill_between(degrees[within], own, path, color=colour, alpha=HANGS, lw=0.0, zorder=0.5)
            for edge in (low, high):
                if entry.angles[0] < edge < entry.angles[-1]:
                    at = 100.0 * float(np.interp(edge, entry.angles, entry.path))
                    axis.plot(np.degrees(edge), at, "o", color=colour, ms=3.2, mec="white", mew=0.5, zorder=5)


def _limits(axis: Any, design: Design) -> None:
    """Lock and limits of each kind of muscle, where the axis shows them."""
    kinds = {entry.group.type.name: entry.group.type for entry in design.facts}
    levels = [
        level
        for kind in kinds.values()
        for level in (
            (100.0 * kind.limits.contraction_max, "cannot shorten further", kind.name, "-."),
            (100.0 * kind.limits.contraction_min, "stretch limit", kind.name, ":"),
            (100.0 * kind.braid.lock, "braid locks", kind.name, "-"),
        )
    ]
    heights = [level for level, *_ in levels]
    bottom, top = axis.get_ylim()
    low, high = min(bottom, *heights), max(top, *heights)
    words = WORDS * (high - low)
    axis.set_ylim(min(bottom, low - 1.2 * words), max(top, high + 1.2 * words))
    axis.axhspan(
        -100.0, 100.0 * min(kind.braid.lock for kind in kinds.values()), color=GREY, alpha=0.25, lw=0.0
    )
    taken: list[float] = []
    for height, word, name, style in levels:
        axis.axhline(height, color=GREY, lw=0.8, ls=style, zorder=2)
        below = word == "braid locks"
        middle = height + (-0.5 if below else 0.5) * words
        if any(abs(middle - other) < words for other in taken):
            continue
        taken.append(middle)
        of = f" ({plain(name, 16)})" if len(kinds) > 1 else ""
        look: dict[str, Any] = {"fontsize": SMALL, "color": "0.25", "va": "top" if below else "bottom"}
        axis.text(
            np.degrees(design.facts[0].angles[0]) + 0.5, height, f"{word}{of}", zorder=6, bbox=WHITE, **look
        )


def _lengths(axis: Any, entry: PathFacts, colour: str) -> None:
    degrees = np.degrees(entry.angles)
    axis.plot(degrees, 1e3 * entry.length, color=colour, lw=0.7)
    axis.plot(degrees, 1e3 * entry.chain_length[:, 0], color=colour, lw=1.0, ls=STYLES[0])
    axis.plot(degrees, 1e3 * entry.chain_length[:, -1], color=colour, lw=1.6)


def _arm(axis: Any, entry: PathFacts, colour: str) -> None:
    axis.plot(np.degrees(entry.angles), 1e3 * entry.arm, color=colour, lw=1.6)
    row = entry.at(0.0)
    axis.plot(0.0, 1e3 * entry.arm[row], "o", color=colour, ms=3.2, mec="white", mew=0.5, zorder=5)


def _torque(axis: Any, entry: PathFacts, colour: str) -> None:
    for column, style in enumerate(STYLES):
        width = 1.6 if column == len(STYLES) - 1 else 1.0
        axis.plot(np.degrees(entry.angles), entry.torque[:, column], color=colour, lw=width, ls=style)


def _scale(axis: Any, entry: PathFacts) -> None:
    """Show what is within the range of motion; what is stretched beyond it would dwarf that."""
    low, high = np.degrees(entry.range)
    values = [
        y for line in axis.lines if len(line.get_xdata()) > 2
        for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True) if low <= x <= high
    ]  # fmt: skip
    room = ROOM * max(max(values) - min(values), 1e-6)
    axis.set_ylim(min(values) - room, max(values) + room)
