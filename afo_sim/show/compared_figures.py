"""Several muscle laws side by side: the files of all runs, one figure, one Rerun recording."""

import contextlib
import itertools
import pathlib
from collections.abc import Mapping

import numpy as np

from afo_sim.common import check_writable, settle, together, write_text
from afo_sim.description import Side
from afo_sim.physics import LAWS
from afo_sim.show import style as theme
from afo_sim.show.panels import marked
from afo_sim.show.style import LINE_STYLES, MARKERS, LineStyle, plain
from afo_sim.simulation import (
    ANGLE,
    MODEL,
    PARQUET,
    RERUN,
    SUMMARY,
    Both,
    Recording,
    angle_differences,
    litres_a_minute,
)

_FIGURE, _TABLE = "comparison", "differences.csv"
_COLOUR: dict[Side, str] = {"right": theme.BLUE, "left": theme.RED}
_STYLE: dict[Side, LineStyle] = {"right": "-", "left": theme.RUN_STYLES[1]}


def write(runs: Mapping[str, Recording], folder: pathlib.Path, *, rrd: bool = True) -> list[pathlib.Path]:
    """Write every run into FOLDER/LAW, the differences, the figure and the common Rerun recording."""
    check_writable(folder)
    settle(folder)
    rows = []  # of an older comparison in the folder, whose runs stand there
    with contextlib.suppress(OSError, ValueError):
        rows = (folder / _TABLE).read_text(encoding="utf-8").splitlines()[1:]
    told = {name for row in rows for name in row.split(",")[:2]}
    laws = [law for law in LAWS if law in told and (folder / law / PARQUET).is_file()]
    before = [f"{law}/{name}" for law in laws for name in (PARQUET, SUMMARY, MODEL)]
    figures = [f"{_FIGURE}.png", f"{_FIGURE}.pdf"]
    written = [_TABLE]
    with together(folder, (_TABLE, *figures, RERUN, *before)) as scratch:
        folders = [run.save(scratch / law, rrd=False) for law, run in runs.items()]
        rows = [f"{a},{b},{np.degrees(value):.6g}" for (a, b), value in angle_differences(runs).items()]
        write_text(scratch / _TABLE, "\n".join(["law,other law,RMS angle between them [deg]", *rows]) + "\n")
        if all(len(run["time"]) for run in runs.values()):
            for name in figures:
                draw(runs, scratch / name)
            written += figures
            if rrd:
                from afo_sim.show.rerun import write_comparison

                write_comparison(folders, scratch / RERUN)
                written.append(RERUN)
    return [folder / name for name in written]


def draw(runs: Mapping[str, Recording], path: pathlib.Path) -> None:
    """Draw angles, their differences, pressures and forces of all runs over time."""
    from matplotlib.lines import Line2D

    with theme.new_figure(path, (7.1, 7.4)) as figure:
        name, first = next(iter(runs.items()))
        colours = dict(zip(runs, itertools.cycle(theme.COLOURS)))
        axes = figure.subplots(4, 1, sharex=True, height_ratios=[1.3, 1.0, 1.0, 1.0])
        angle, difference = axes[:2]  # of each run, and from the first
        for axis in (angle, difference):
            axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
        for number, (law, run) in enumerate(runs.items()):
            degrees = np.degrees(run[ANGLE])
            # where they coincide, the first shows through the gaps of the others
            style = {"color": colours[law], "ls": LINE_STYLES[number % len(LINE_STYLES)], "label": plain(law)}
            style |= marked(run["time"], MARKERS[number % len(MARKERS)])
            angle.plot(run["time"], degrees, **style)
            rows = min(len(degrees), len(first["time"]))
            difference.plot(run["time"][:rows], degrees[:rows] - np.degrees(first[ANGLE][:rows]), **style)
        leg = first.described["leg"]
        angle.set_ylabel(f"{plain(leg['ankle'])} angle [deg]\n{plain(leg['directions'][0])} +")
        difference.set_title(f"angle less that of {plain(name)}", loc="left")
        difference.set_ylabel("difference\n[deg]")
        angle.legend(**theme.BESIDE, handlelength=2.2)
        # a line per run and chamber, and per run and first muscle of a group
        kinds = (("chamber", "{}/pressure", 1e-5), ("muscle", "{}_1/force", 1.0))
        for axis, (kind, column, factor) in zip(axes[2:], kinds, strict=True):
            styles = dict(zip(first.described["orthosis"][kind], itertools.cycle(LINE_STYLES)))
            for number, (law, run) in enumerate(runs.items()):
                dots = marked(run["time"], MARKERS[number % len(MARKERS)])
                for group, style in styles.items():
                    values = run[f"{kind}/{column.format(group)}"] * factor
                    axis.plot(run["time"], values, ls=style, color=colours[law], lw=1.0, **dots)
            handles = [Line2D([], [], color="0.3", ls=ls, label=plain(name)) for name, ls in styles.items()]
            axis.legend(handles=handles, **theme.BESIDE, handlelength=2.2)
        axes[2].set_ylabel("gauge pressure\n[bar]")
        axes[3].set(ylabel="muscle force\n[N]", xlabel="time [s]")
        figure.align_ylabels(axes)
        told = [run.described["description"].split("; ") for run in runs.values()]
        common = (part for part in told[0] if all(part in each for each in told))  # not what was set for one
        title = theme.paragraph(f"{first.described['name']}: {'; '.join(common)}")
        figure.suptitle(title, x=0.01, ha="left", fontsize=9.0)


def draw_both(legs: Both, path: pathlib.Path) -> None:
    """Draw what two legs take from one source, over one cycle of the right one."""
    with theme.new_figure(path, (7.1, 2.9)) as figure:
        axis = figure.subplots()
        percent, litres = 100.0 * np.append(legs.phase, 1.0), litres_a_minute(legs.legs)
        # a periodic curve has its first value again at its end
        curves = {name: litres * np.append(values, values[0]) for name, values in legs.flow.items()}
        axis.fill_between(percent, curves["both"], color="0.85", lw=0.0, label="both")
        for side in legs.legs:
            axis.plot(percent, curves[side], color=_COLOUR[side], ls=_STYLE[side], label=side)
        mean = legs.numbers["mean_flow_both"].value
        axis.axhline(mean, color="black", lw=0.8, ls="--", label=f"mean of both, {mean:.3g}")
        axis.set_ylabel("flow from the source\n[l/min ANR]")
        axis.set_ylim(bottom=0.0)
        axis.legend(**theme.BESIDE)
        walks = bool(legs.right.described.get("gait"))
        if walks and legs.apart:
            axis.axvline(100.0 * legs.apart, color=theme.GREY, lw=0.6, ls=":", zorder=0)
        what = "stride of the right leg, from its heel strike" if walks else "timer's period"
        axis.set(xlabel=f"{what} [%]; 100 % = {legs.cycle:.3g} s", xlim=(0.0, 100.0))
        title = " and ".join(
            f"{side}: {plain(str(leg.described['name']))}" for side, leg in legs.legs.items()
        )
        apart = f", {100.0 * legs.apart:g} % of a stride apart" if legs.apart else ""
        figure.suptitle(f"both legs on one supply{apart}\n{title}", x=0.01, ha="left", fontsize=9.0)
