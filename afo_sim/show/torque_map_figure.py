"""Torque necessary against torque available, drawn: orthosis torque over ankle angle, a curve a pressure."""

import pathlib
from typing import Any

import numpy as np

from afo_sim.description import JOINTS
from afo_sim.model import NEEDS, TorqueMap
from afo_sim.show.panels import marked
from afo_sim.show.style import COLOURS, MARKERS, ZERO, ink, new_figure, on_scale, plain

_PANEL = (4.4, 3.4)  # [inch]


def draw(maps: list[TorqueMap], path: pathlib.Path, title: str) -> None:
    """Draw the curves of every chamber, with the needs of swing and loading response."""
    with new_figure(path, (_PANEL[0] * len(maps), _PANEL[1])) as figure:
        axes = figure.subplots(1, len(maps), squeeze=False)[0]
        for axis, found in zip(axes, maps, strict=True):
            colours = on_scale(np.linspace(0.0, 1.0, len(found.pressures)))
            for column, pressure in enumerate(found.pressures):
                label = f"{pressure * 1e-5:g} bar"
                look = {"color": colours[column], **marked(found.angles, MARKERS[column % len(MARKERS)])}
                axis.plot(np.degrees(found.angles), found.torque[:, column], label=label, **look)
            if found.joint == "ankle" and found.torque.max() > -found.torque.min():
                for (phase, (low, high)), shade in zip(NEEDS.items(), (COLOURS[2], COLOURS[0]), strict=True):
                    axis.axhspan(low, high, color=shade, alpha=0.25, lw=0.0)
                    text, place = (
                        f"{phase} needs {low:g}–{high:g} N·m ",
                        (float(np.degrees(found.angles[-1])), high),
                    )
                    axis.text(*place, text, ha="right", va="bottom", color=ink(shade), fontsize=8.0)
            _shade_stretch(axis, found)
            axis.axhline(0.0, color=ZERO, lw=0.8)
            positive = JOINTS[found.joint].directions[0]
            axis.set_xlabel(f"{found.joint} angle [deg], {positive} +")
            axis.set_ylabel(f"orthosis torque [N·m], {positive} +")
            axis.set_title(f"{plain(found.chamber)} chamber alone", loc="left")
            # below all bands and curves
            below = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.2), "ncols": 4}
            axis.legend(title="gauge pressure", title_fontsize=8.0, alignment="left", **below)
        figure.suptitle(plain(title, None), x=0.01, ha="left", fontsize=9.0)


def _shade_stretch(axis: Any, found: TorqueMap) -> None:
    """Grey where the braid is stretched at every pressure, and keep the scale to where it is not."""
    free = found.contraction.max(axis=1) >= 0.0
    if free.all() or not free.any():
        return
    degrees = np.degrees(found.angles)
    for edge, inside in ((degrees[0], degrees[free].min()), (degrees[-1], degrees[free].max())):
        if edge != inside:
            axis.axvspan(edge, inside, color="0.85", lw=0, label="braid stretched")
    reach = found.torque[free]
    room = 0.08 * max(np.ptp(reach), 1.0)
    axis.set_ylim(min(reach.min(), 0.0) - room, max(reach.max(), 0.0) + room)
