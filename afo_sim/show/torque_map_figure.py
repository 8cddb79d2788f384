"""Figure of needed and available torque: orthosis torque over ankle angle, one curve per pressure."""

import functools
import pathlib

import numpy as np

from afo_sim.description import JOINTS
from afo_sim.metrics import SIDES
from afo_sim.model import TorqueMap, person_of
from afo_sim.show import style as theme
from afo_sim.show.panels import marked
from afo_sim.show.style import Axes, Figure
from afo_sim.simulation import TorqueMaps

_PANEL = (4.4, 3.8)  # [inch]


def draw(found: TorqueMaps, stem: pathlib.Path) -> list[pathlib.Path]:
    """Draw the curves of every chamber, with the paths of what the walk's phases need to its side."""
    width, height = _PANEL
    return theme.write_pair(stem, (width * len(found.maps), height), functools.partial(fill, found=found))


def fill(figure: Figure, found: TorqueMaps) -> None:
    """A panel for each chamber."""
    scenario = found.scenario
    title = f"{scenario.orthosis.name} on {scenario.leg.name}: static torque"
    patient = "" if scenario.patient is None else f" ({scenario.patient.name})"
    title += f"; needed by {person_of(scenario).body_mass:g} kg{patient}" if found.needs else ""
    axes = figure.subplots(1, len(found.maps), squeeze=False)[0]
    for axis, own in zip(axes, found.maps, strict=True):
        colours = theme.on_scale(np.linspace(0.0, 1.0, len(own.pressures)))
        for column, pressure in enumerate(own.pressures):
            label = f"{pressure * 1e-5:g} bar"
            look = {
                "color": colours[column],
                **marked(own.angles, theme.MARKERS[column % len(theme.MARKERS)]),
            }
            axis.plot(np.degrees(own.angles), own.torque[:, column], label=label, **look)
        needs = [need for chambers, need, _ in found.lacking if own.chamber in chambers and need.peak]
        for need, colour, style in zip(
            needs, (theme.GREEN, theme.VIOLET, theme.BLUE), theme.RUN_STYLES, strict=False
        ):
            torque, label = SIDES[need.side] * need.torque, f"{need.phase}: {need.peak:.3g} N·m needed"
            axis.plot(np.degrees(need.angle), torque, color=colour, ls=style, lw=2.2, zorder=3.0, label=label)
        _shade_stretch(axis, own, [SIDES[need.side] * need.torque for need in needs])
        axis.axhline(0.0, color=theme.ZERO, lw=0.8)
        positive = JOINTS[own.joint].directions[0]
        axis.set_xlabel(f"{own.joint} angle [deg], {positive} +")
        axis.set_ylabel(f"orthosis torque [N·m]\n{positive} +")
        axis.set_title(f"{theme.plain(own.chamber)} chamber alone", loc="left")
        # below all bands and curves
        below = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.2), "ncols": 2}
        axis.legend(title="gauge pressure, needs", title_fontsize=8.0, alignment="left", **below)
    figure.suptitle(theme.plain(title, None), x=0.01, ha="left", fontsize=9.0)


def _shade_stretch(axis: Axes, found: TorqueMap, paths: list[np.ndarray]) -> None:
    """Grey where the braid is stretched at every pressure, and keep the scale to the rest and the needs."""
    free = found.contraction.max(axis=1) >= 0.0
    if free.all() or not free.any():
        return
    degrees = np.degrees(found.angles)
    for edge, inside in ((degrees[0], degrees[free].min()), (degrees[-1], degrees[free].max())):
        if edge != inside:
            axis.axvspan(edge, inside, color="0.85", lw=0, label="braid stretched")
    reach = np.concatenate([found.torque[free].ravel(), *paths])
    room = 0.08 * max(np.ptp(reach), 1.0)
    axis.set_ylim(min(reach.min(), 0.0) - room, max(reach.max(), 0.0) + room)
