"""A gait cycle on one page, for a look before it is used."""

import pathlib
import textwrap
from collections.abc import Sequence

import numpy as np

from afo_sim.common import find_gait, gait_names
from afo_sim.gait import GaitCycle, closing_errors, stance
from afo_sim.gait import norm as gait_norm
from afo_sim.gait.file import read
from afo_sim.gait.toe_extension import toe_extension
from afo_sim.gait_lab import Imported, taken_words
from afo_sim.show import gait_panels
from afo_sim.show import style as theme
from afo_sim.show.style import BLUE, RED, Axes

_POSES = 11  # of the leg in a stride: every 10 %
_WARNED = 3  # warnings that stand on the page
_SMALL, _SMALL_LINE = 7.5, 120  # size of a warning's letters [points], and letters of its line
_ROW = 0.16  # height of a row of the checks [in]
_LONGEST_WARNING = 230  # letters of one; the file has it whole
_FOOT = (-0.06, 0.19)  # heel and toe from the ankle, for the drawing only [m]
_HINGE = 0.70  # of the toes, from heel to tip [-]; scaled adult of the leg's toes
_EXTENSION = 11.0  # drawn of the toes in swing, over the stride the published mean [deg]
_SHANK = 0.38  # drawn [m]
_FORCE = 0.35  # drawn length of one body weight [m]
_DORSAL, _PLANTAR, GREY = RED, BLUE, "0.6"
_STRIDE = {"color": "0.55", "lw": 0.7}  # of each stride behind its mean


def draw_gait(cycle: GaitCycle, path: pathlib.Path, imported: Imported | None = None) -> None:
    """Draw a gait cycle: the leg with the ground's force, angles with the norm, force, moment."""
    cells = [] if imported is None else gait_panels.check_cells(imported.checks)
    table = _ROW * (sum(max(cell.count("\n") + 1 for cell in row) for row in cells) + 2)
    height = 9.0 if imported is None else 11.5 + table
    height += _SMALL * 1.35 / 72.0 * _warned(cycle.warnings).count("\n")
    with theme.new_figure(path, (7.1, height)) as figure:
        alone = imported is None
        rows = [["shank", "ankle"], ["knee", "moment"], ["force", "pressure"]]
        if imported is None:
            axes = figure.subplot_mosaic([["leg", "leg"], *rows], height_ratios=[1.5, 1.0, 1.0, 1.0])
            _leg(axes["leg"], cycle, _FOOT, alone)
        else:
            trial, leg, strides, checks = figure.subfigures(4, 1, height_ratios=[3.5, 2.3, 5.1, table])
            gait_panels.draw_checks(checks, imported.checks, _SMALL)
            foot = gait_panels.foot_ends(imported, _FOOT)
            gait_panels.draw_trial(trial, imported)
            points, motion = leg.subplots(1, 2, width_ratios=[1.15, 2.2])
            gait_panels.draw_points(points, imported)
            _leg(motion, cycle, foot, alone)
            axes = strides.subplot_mosaic([*rows[:2], ["force", "foot"]], height_ratios=[1.0, 1.0, 1.15])
            gait_panels.draw_strides(strides, axes, imported)
            gait_panels.draw_foot(axes["foot"], imported, foot)
        _angles(axes, cycle, alone)
        _moment(axes["moment"], cycle, imported)
        force, percent = axes["force"], 100.0 * cycle.phase
        _over_stride(force, cycle, "ground on foot\n[body weights]")
        force.plot(percent, cycle.grf_z, color=_PLANTAR, label="up")
        force.plot(percent, cycle.grf_x, color=_DORSAL, ls=theme.RUN_STYLES[1], label="forward")
        theme.legend_on_top(force, 2)
        if alone:
            pressure = axes["pressure"]
            _over_stride(pressure, cycle, "[cm]")
            pressure.plot(
                percent,
                100.0 * cycle.cop_x,
                color=_DORSAL,
                ls=theme.RUN_STYLES[1],
                label="pressure ahead of ankle",
            )
            pressure.plot(percent, 100.0 * cycle.ankle_z, color=_PLANTAR, label="ankle above floor")
            for panel in (pressure, axes["knee"], axes["ankle"]):
                theme.legend_on_top(panel, 2)
        leg = f"mean {cycle.notes['mean']}" if "mean" in cycle.notes else f"{cycle.side} leg"
        words = leg if imported is None else taken_words(imported)
        facts = f"{cycle.body_mass:.3g} kg, {cycle.walking_speed:.2f} m/s, stride {cycle.stride_time:.2f} s, "
        facts += f"stance {100 * stance(cycle):.0f} %"
        figure.suptitle(theme.paragraph(cycle.source, words, facts), x=0.01, ha="left", fontsize=9.0)
        if cycle.warnings:
            figure.supxlabel(_warned(cycle.warnings), x=0.01, ha="left", fontsize=_SMALL, color=_DORSAL)


def _warned(warnings: Sequence[str]) -> str:
    lines = [f"{len(warnings)} warning{'s' if len(warnings) > 1 else ''}:"]
    for warning in warnings[:_WARNED]:
        short = textwrap.shorten(warning, _LONGEST_WARNING, placeholder=" …")
        lines += textwrap.wrap(f"– {short}", _SMALL_LINE, subsequent_indent="   ")
    if len(warnings) > _WARNED:
        lines.append(f"– {len(warnings) - _WARNED} more in the CSV's header")
    return "\n".join(theme.plain(line, None) for line in lines)


def _leg(axis: Axes, cycle: GaitCycle, ends: tuple[float, float], alone: bool) -> None:
    """Shank and foot through the stride, with the ground's force where it presses."""
    phases = np.linspace(0.0, 1.0, _POSES)
    names = ("shank_angle", "ankle_angle", "ankle_x", "ankle_z")
    shank, ankle, x, z = (cycle.signal(name, phases) for name in names)
    extension = toe_extension(np.radians(_EXTENSION))(phases)
    force_x, force_z, cop = cycle.ground(phases)
    off = stance(cycle)
    drawn = "; foot drawn 25 cm long, toes bent as usual" if alone else ""
    for k, phase in enumerate(phases):
        colour = "black" if phase <= off else GREY
        knee = x[k] + _SHANK * np.sin(shank[k]), z[k] + _SHANK * np.cos(shank[k])
        foot = _foot((x[k], z[k]), ankle[k] - shank[k], extension[k], cycle.ankle_height, ends)
        axis.plot([knee[0], x[k]], [knee[1], z[k]], color=colour, lw=0.8)
        axis.plot(*foot.T, color=colour, lw=0.6)
        if phase <= off and force_z[k] > 0.05:
            start = x[k] + cop[k], 0.0
            tip = start[0] + _FORCE * force_x[k], _FORCE * force_z[k]
            look = {"arrowstyle": "-|>", "color": _DORSAL, "lw": 0.8, "mutation_scale": 7.0}
            axis.annotate("", tip, start, arrowprops={**look, "shrinkA": 0.0, "shrinkB": 0.0}, zorder=3)
    axis.axhline(0.0, color="0.3", lw=0.8, zorder=0)
    axis.set_aspect("equal")
    axis.margins(0.03)
    axis.set(xlabel=f"forward [m]; black: stance, with ground force; grey: swing{drawn}", ylabel="up [m]")


def _foot(
    ankle: tuple[float, float], pitch: float, extension: float, height: float, ends: tuple[float, float]
) -> np.ndarray:
    """Outline of a foot with bent toes: ankle, heel, hinge, tip and back to hinge and ankle [m] (6, 2)."""
    along = np.array([np.cos(pitch), np.sin(pitch)])
    toes = np.array([np.cos(pitch + extension), np.sin(pitch + extension)])
    under = np.asarray(ankle) + height * np.array([along[1], -along[0]])
    hinge = ends[0] + _HINGE * (ends[1] - ends[0])
    ball = under + hinge * along
    return np.array([ankle, under + ends[0] * along, ball, ball + (ends[1] - hinge) * toes, ball, ankle])


def _angles(axes: dict[str, Axes], cycle: GaitCycle, alone: bool) -> None:
    percent = 100.0 * cycle.phase
    fine = np.linspace(0.0, 1.0, 401)
    norm = gait_norm.read()
    _over_stride(axes["shank"], cycle, "shank angle [deg]\nknee ahead +")
    _over_stride(axes["knee"], cycle, "knee angle [deg]\nflexion +")
    _over_stride(axes["ankle"], cycle, "ankle angle [deg]\ndorsiflexion +")
    low, high = (np.degrees(norm.at(n, fine)) for n in ("ankle_low", "ankle_high"))
    axes["ankle"].fill_between(100 * fine, low, high, color=theme.NORM, lw=0.0, label="published means")
    knee = np.degrees(norm.at("knee_angle", fine))
    axes["knee"].plot(100 * fine, knee, color="0.75", lw=3.0, label="a published mean")
    closing, strides = closing_errors(cycle), _strides(cycle) if alone else []
    recorded = "mean" if alone and "mean" in cycle.notes else "recorded"
    for name in ("shank", "knee", "ankle"):
        field = f"{name}_angle"
        for stride in strides:
            axes[name].plot(100 * stride.phase, np.degrees(getattr(stride, field)), **_STRIDE)
        axes[name].plot(percent, np.degrees(getattr(cycle, field)), color=_PLANTAR, label=recorded)
        series = np.degrees(cycle.signal(field, fine))
        axes[name].plot(100 * fine, series, color="black", lw=0.8, ls="--", label="Fourier series")
        error = round(closing[f"{field}_deg"], 2) + 0.0  # no "-0.00"
        axes[name].set_title(f"closing error {error:+.2f} deg", loc="right", fontsize=8.0)


def _strides(cycle: GaitCycle) -> list[GaitCycle]:
    names = [name.strip() for name in cycle.notes.get("strides", "").split(",")]
    return [read(find_gait(name)) for name in names if name in gait_names()]


def _moment(axis: Axes, cycle: GaitCycle, imported: Imported | None) -> None:
    """Plantarflexor moment upward, as laboratories and the file have it; the house's sign is the other."""
    _over_stride(axis, cycle, "ankle moment [N·m/kg]\nplantarflexion +")
    percent, alone = 100.0 * cycle.phase, imported is None
    if not alone:
        axis.yaxis.label.set_size(8.0)  # its panel is lower
    norm, fine = gait_norm.read(), np.linspace(0.0, 1.0, 401)
    low, high = (-norm.at(name, fine) for name in ("moment_high", "moment_low"))
    look = {
        "color": theme.NORM,
        "lw": 1.5,
        "label": "published means" if alone else None,
    }  # two means, often alike
    axis.fill_between(100.0 * fine, low, high, **look)
    for stride in _strides(cycle) if alone else []:
        axis.plot(100.0 * stride.phase, -stride.ankle_moment, **_STRIDE)
    axis.plot(percent, -cycle.ankle_moment, color=_PLANTAR, label="of the file" if alone else "taken")
    axis.plot(percent, -cycle.ground_moment(), color="black", lw=0.8, ls="--", label="from force")
    if imported is not None and imported.reference is not None:
        look = {"color": _DORSAL, "lw": 1.6, "ls": ":", "zorder": 3}
        axis.plot(percent, -imported.reference, label="reference", **look)
    theme.legend_on_top(axis, 2)


def _over_stride(axis: Axes, cycle: GaitCycle, label: str) -> None:
    axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
    axis.axvline(100.0 * stance(cycle), color="0.75", lw=0.6, ls=":", zorder=1)
    axis.axvspan(100.0 * cycle.flat.start, 100.0 * cycle.flat.end, color="0.96", lw=0.0, zorder=0)
    axis.set(xlim=(0.0, 100.0), xlabel="stride [%]", ylabel=label)
