"""A gait cycle on one page, for a look before it is used."""

import functools
import itertools
import pathlib
from typing import Any

import numpy as np

from afo_sim.gait import norm as gait_norm
from afo_sim.gait.checks import closing_errors, stance
from afo_sim.gait.cycle import FLAT, GaitCycle
from afo_sim.gait.readers.importing import Imported
from afo_sim.show.style import COLOURS, NORM, ZERO, paragraph, plain, write_figure

POSES = 21  # of the leg in a stride
FOOT = (-0.06, 0.19)  # heel and toe from the ankle, for the drawing only [m]
SHANK = 0.38  # drawn [m]
FORCE = 0.35  # drawn length of one body weight [m]
DORSAL, PLANTAR, GREY = COLOURS[0], COLOURS[1], "0.6"


def draw_gait(cycle: GaitCycle, path: pathlib.Path, imported: Imported | None = None) -> None:
    """Draw a gait cycle: the leg with the ground's force, angles with the norm, force, moment.

    Parameters
    ----------
    cycle : to draw
    path : file to write, whole or not at all; its suffix, one of `style.FORMATS`, is the format
    imported : where the cycle was cut from; adds the plates over time with contacts and strides

    Raises
    ------
    InputError
        The suffix is no format.
    """
    height = 9.0 if imported is None else 10.8
    write_figure(path, (7.1, height), functools.partial(_page, cycle=cycle, imported=imported))


def _page(figure: Any, cycle: GaitCycle, imported: Imported | None) -> None:
    ratios = [1.5, 1.0, 1.0, 1.0]
    rows = [["leg", "leg"], ["shank", "ankle"], ["knee", "moment"], ["force", "pressure"]]
    if imported is not None:
        rows.insert(0, ["plates", "plates"])
        ratios.insert(0, 0.8)
    axes: dict[str, Any] = figure.subplot_mosaic(rows, height_ratios=ratios)
    if imported is not None:
        _plates(axes["plates"], imported)
    _leg(axes["leg"], cycle)
    _angles(axes, cycle)
    _moment(axes["moment"], cycle)
    _force(axes["force"], cycle)
    _pressure(axes["pressure"], cycle)
    figure.suptitle(_title(cycle), x=0.01, ha="left", fontsize=9.0)


def _title(cycle: GaitCycle) -> str:
    facts = f"{cycle.side} leg, {cycle.body_mass:g} kg, {cycle.walking_speed:.2f} m/s, "
    facts += f"stride {cycle.stride_time:.2f} s, stance {100 * stance(cycle):.0f} %"
    return paragraph(cycle.source, facts)


def _plates(axis: Any, imported: Imported) -> None:
    """Upward force of each plate; contacts of this foot, and the strides found."""
    for (name, (time, force)), colour in zip(
        imported.ground.plates.items(), itertools.cycle(COLOURS), strict=False
    ):
        axis.plot(time, force, color=colour, lw=0.9, label=f"plate {plain(name)}")
    for contact in imported.ground.contacts:
        axis.axvspan(contact.start, contact.end, color="0.92", lw=0.0, zorder=0)
    top = max(force.max() for _, force in imported.ground.plates.values())
    for number, stride in enumerate(imported.strides, start=1):
        chosen = number - 1 == imported.chosen
        look = {"color": "black" if chosen else GREY, "lw": 2.0 if chosen else 1.0}
        axis.plot([stride.start, stride.end], [1.08 * top] * 2, "|-", ms=6.0, **look)
        middle = 0.5 * (stride.start + stride.end)
        text = f"stride {number}" + (", taken" if chosen else "")
        axis.text(middle, 1.12 * top, text, ha="center", va="bottom", fontsize=8.0, color=look["color"])
    axis.set_ylim(top=1.3 * top)
    axis.set_ylabel("upward force [N]\ngrey: this foot")
    axis.set_xlabel("time in the trial [s]")
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.0)


def _leg(axis: Any, cycle: GaitCycle) -> None:
    """Shank and foot through the stride, with the ground's force where it presses."""
    phases = np.linspace(0.0, 1.0, POSES)
    shank, ankle, x, z = (
        cycle.signal(n, phases) for n in ("shank_angle", "ankle_angle", "ankle_x", "ankle_z")
    )
    force_x, force_z, cop = cycle.ground(phases)
    off = stance(cycle)
    for k, phase in enumerate(phases):
        colour = "black" if phase <= off else GREY
        knee = x[k] + SHANK * np.sin(shank[k]), z[k] + SHANK * np.cos(shank[k])
        along = np.array([np.cos(ankle[k] - shank[k]), np.sin(ankle[k] - shank[k])])
        under = np.array([x[k], z[k]]) + cycle.ankle_height * np.array([along[1], -along[0]])
        foot = np.array([(x[k], z[k]), *(under + end * along for end in FOOT), (x[k], z[k])])
        axis.plot([knee[0], x[k]], [knee[1], z[k]], color=colour, lw=0.8)
        axis.plot(*foot.T, color=colour, lw=0.6)
        if phase <= off and force_z[k] > 0.05:
            start = x[k] + cop[k], 0.0
            tip = start[0] + FORCE * force_x[k], FORCE * force_z[k]
            look = {"arrowstyle": "-|>", "color": DORSAL, "lw": 0.8, "mutation_scale": 7.0}
            axis.annotate("", tip, start, arrowprops={**look, "shrinkA": 0.0, "shrinkB": 0.0}, zorder=3)
    axis.axhline(0.0, color="0.3", lw=0.8, zorder=0)
    axis.set_aspect("equal")
    axis.margins(0.03)
    axis.set_xlabel("forward [m]; black: stance, with ground force; grey: swing; foot drawn 25 cm long")
    axis.set_ylabel("up [m]")


def _angles(axes: dict[str, Any], cycle: GaitCycle) -> None:
    percent = 100.0 * cycle.phase
    fine = np.linspace(0.0, 1.0, 401)
    norm = gait_norm.read()
    _over_stride(axes["shank"], cycle, "shank angle [deg]\nknee ahead +")
    _over_stride(axes["knee"], cycle, "knee angle [deg]\nflexion +")
    _over_stride(axes["ankle"], cycle, "ankle angle [deg]\ndorsiflexion +")
    low, high = (np.degrees(norm.at(n, fine)) for n in ("ankle_low", "ankle_high"))
    axes["ankle"].fill_between(100 * fine, low, high, color=NORM, lw=0.0, label="published means")
    axes["knee"].plot(
        100 * fine, np.degrees(norm.at("knee_angle", fine)), color="0.75", lw=3.0, label="a published mean"
    )
    closing = closing_errors(cycle)
    for name in ("shank", "knee", "ankle"):
        field = f"{name}_angle"
        axes[name].plot(percent, np.degrees(getattr(cycle, field)), color=PLANTAR, label="recorded")
        series = np.degrees(cycle.signal(field, fine))
        axes[name].plot(100 * fine, series, color="black", lw=0.8, ls="--", label="Fourier series")
        error = round(closing[f"{field}_deg"], 2) + 0.0  # no "-0.00"
        axes[name].set_title(f"closing error {error:+.2f} deg", loc="right", fontsize=8.0)
    axes["ankle"].legend(loc="lower left")
    axes["knee"].legend(loc="upper left")


def _moment(axis: Any, cycle: GaitCycle) -> None:
    _over_stride(axis, cycle, "ankle moment [N·m/kg]\ninternal, dorsiflexion +")
    axis.plot(100.0 * cycle.phase, cycle.ankle_moment, color=PLANTAR, label="of the file")
    axis.plot(100.0 * cycle.phase, cycle.ground_moment(), color="black", lw=0.8, ls="--", label="from force")
    axis.legend(loc="lower left")


def _force(axis: Any, cycle: GaitCycle) -> None:
    _over_stride(axis, cycle, "ground on foot\n[body weights]")
    axis.plot(100.0 * cycle.phase, cycle.grf_z, color=PLANTAR, label="up")
    axis.plot(100.0 * cycle.phase, cycle.grf_x, color=DORSAL, label="forward")
    axis.legend(loc="upper right")


def _pressure(axis: Any, cycle: GaitCycle) -> None:
    _over_stride(axis, cycle, "[cm]")
    axis.plot(100.0 * cycle.phase, 100.0 * cycle.cop_x, color=DORSAL, label="pressure ahead of ankle")
    axis.plot(100.0 * cycle.phase, 100.0 * cycle.ankle_z, color=PLANTAR, label="ankle above floor")
    axis.set_ylim(top=1.5 * axis.get_ylim()[1])
    axis.legend(loc="upper left")


def _over_stride(axis: Any, cycle: GaitCycle, label: str) -> None:
    axis.axhline(0.0, color=ZERO, lw=0.6, zorder=1)
    axis.axvline(100.0 * stance(cycle), color="0.75", lw=0.6, ls=":", zorder=1)
    axis.axvspan(100.0 * FLAT[0], 100.0 * FLAT[1], color="0.96", lw=0.0, zorder=0)
    axis.set_xlim(0.0, 100.0)
    axis.set_xlabel("stride [%]")
    axis.set_ylabel(label)
