"""Figure of a static fit: the best law over the points, its residuals, the laws' errors."""

import dataclasses
import functools
import pathlib
from collections.abc import Sequence

import numpy as np

from afo_sim import lab
from afo_sim.common import JsonDict
from afo_sim.lab.law_problem import predict
from afo_sim.show import style as theme
from afo_sim.show.panels import legend
from afo_sim.show.style import Axes, Figure

_LOG, _BEFORE, _AFTER, _FORECAST = "0.75", theme.RED, theme.BLUE, theme.GREEN
_SPARSE = 150  # samples: fewer are drawn one by one


def write_fit_figure(fit: lab.StaticFit, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write fit.png and fit.pdf, and return the files."""
    best, fits = fit.best, fit.fits
    count = len(best.problem.data) + 1 + (len(fits) > 1)

    def fill(figure: Figure) -> None:
        axes = figure.subplots(1, count)
        for axis, data in zip(axes, best.problem.data, strict=False):
            _draw_curves(axis, best, data)
        _draw_residuals(axes[len(best.problem.data)], best)
        if len(fits) > 1:
            _draw_ranking(axes[-1], fits)
        figure.suptitle(f"{best.problem.law.name}: {best.problem.law.formula}")

    return theme.write_pair(folder / "fit", (3.6 * count, 3.3), fill)


def _draw_curves(axis: Axes, fit: lab.LawFit, data: lab.Measured) -> None:
    """Points, and the law's line through them at each pressure."""
    factor, unit = lab.residual_unit(fit)
    levels = lab.pressure_levels(fit.problem.data)[fit.problem.data.index(data)]
    for level in np.unique(levels):
        colour = theme.on_scale((level * 1e5 - data.pressure.min()) / max(np.ptp(data.pressure), 1.0))
        points = lab.take(data, levels == level)
        label = f"{level:g} bar"
        if data.loaded:
            line = _line(points, force=np.linspace(0.7 * points.force.min(), 1.1 * points.force.max(), 60))
            measured = points.change if points.change is not None else points.contraction
            axis.plot(line.force, factor * predict(fit.problem, fit.values, line), color=colour)
            axis.plot(points.force, factor * np.asarray(measured), "o", ms=4, color=colour, label=label)
        else:
            x = np.asarray(points.contraction if points.contraction is not None else points.change)
            grid = np.linspace(0.0, float(np.max(x)) * 1.05 + 0.005, 80)
            name = "contraction" if points.contraction is not None else "change"
            line = _line(points, **{name: grid})
            axis.plot(grid, predict(fit.problem, fit.values, line), color=colour)
            slack = np.zeros(len(points), dtype=bool) if points.slack is None else points.slack
            axis.plot(x[~slack], points.force[~slack], "o", ms=4, color=colour, label=label)
            hollow = {"mfc": "white", "color": colour, "clip_on": False, "zorder": 3}
            axis.plot(x[slack], points.force[slack], "o", ms=4, **hollow)
    axis.set(title=theme.plain(data.name), xlabel="load [N]" if data.loaded else "contraction ratio κ [-]")
    axis.set_ylabel(f"change of length [{unit}]" if data.loaded else "force [N]")
    if data.loaded and data.contraction is not None:
        axis.set_ylabel("contraction ratio κ [-]")
    if not data.loaded and data.contraction is None:
        axis.set_xlabel("change of length [m]")
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]) if data.loaded else 0.0)
    axis.legend(handles=theme.by_height(axis), **theme.BESIDE)


def _line(points: lab.Measured, **columns: np.ndarray) -> lab.Measured:
    """A data set to predict a smooth curve at: the points' mean pressure, other columns replaced."""
    size = len(next(iter(columns.values())))
    blank = {"force": np.zeros(size), "curve": np.zeros(size)} | columns
    return dataclasses.replace(points, pressure=np.full(size, points.pressure.mean()), **blank)


def _draw_residuals(axis: Axes, fit: lab.LawFit) -> None:
    """Errors over pressure: seen by the fit, and when their pressure was left out."""
    factor, unit = lab.residual_unit(fit)
    pressure = np.concatenate([d.pressure for d in fit.problem.data]) * 1e-5
    axis.axhline(0.0, color="0.6", lw=0.8)
    axis.plot(pressure - 0.04, factor * fit.residuals, "o", ms=3, color=theme.BLUE, label="fitted")
    left = fit.held_out["pressure"].errors if "pressure" in fit.held_out else {}
    for k, (label, errors) in enumerate(left.items()):
        at = np.full(len(errors), float(label.split()[0]) + 0.04)
        axis.plot(at, factor * errors, "x", ms=4, color=theme.RED, label="left out" if k == 0 else None)
    axis.margins(x=0.08)
    axis.set(xlabel="gauge pressure [bar]", ylabel=f"prediction − measurement [{unit}]")
    axis.set_title(f"{factor * fit.rms:.3g} {unit} RMS")
    theme.legend_on_top(axis, 2)


def _draw_ranking(axis: Axes, fits: Sequence[lab.LawFit]) -> None:
    factor, unit = lab.residual_unit(fits[0])
    places = np.arange(len(fits))[::-1]
    axis.barh(places + 0.2, [factor * f.rms for f in fits], 0.38, color=theme.BLUE, label="fitted")
    for kind, colour in zip(lab.kinds(fits)[:1], theme.COLOURS, strict=False):
        values = [factor * f.held_out[kind].rms if kind in f.held_out else np.nan for f in fits]
        axis.barh(
            places - 0.2, values, 0.38, color=colour, hatch="////", ec="white", label=f"{kind} left out"
        )
    axis.set_yticks(places, [f.problem.law.name for f in fits])
    axis.set_xscale("log")
    axis.set_xlim(left=0.7 * factor * min(f.rms for f in fits))
    axis.set_xlabel(f"RMS error [{unit}]")
    axis.legend()


def write_log_figure(fit: lab.FitRun, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write fit_run.png and fit_run.pdf, and return the files."""
    size = (7.1, 0.9 + 1.7 * len(fit.problem.log.channels))
    return theme.write_pair(folder / "fit_run", size, functools.partial(_rows, fit=fit))


def _rows(figure: Figure, fit: lab.FitRun) -> None:
    channels, time, seen = fit.problem.log.channels, fit.problem.log.time, fit.problem.seen
    dots: JsonDict = {"lw": 0.0, "marker": "o", "ms": 4.0, "mew": 0.0}
    axes = figure.subplots(len(channels), 2, sharex=True, squeeze=False, width_ratios=(1.35, 1.0))
    first: JsonDict = {"color": _BEFORE, "ls": "--", "lw": 1.0}
    last: JsonDict = {"color": _AFTER, "lw": 1.0}
    runs = [("before", fit.before, {}, first), ("after", fit.after, fit.values, last)]
    for (left, right), channel in zip(axes, channels, strict=True):
        look = {"lw": 3.5} if len(time) > _SPARSE else dots
        left.plot(time, channel.values / channel.scale, color=_LOG, label="log", zorder=1, **look)
        band = 2.0 * fit.problem.noise[channel.title] / channel.scale
        right.axhspan(-band, band, color="0.88", lw=0.0, zorder=0, label="± 2 × noise")
        right.axhline(0.0, color="0.6", lw=0.6, zorder=1)
        for label, run, values, look in runs if fit.values else [("run", fit.before, {}, last)]:
            simulated = channel.simulated(run, time - values.get("time_offset", 0.0))
            left.plot(time, simulated / channel.scale, label=label, zorder=2, **look)
            right.plot(time, (simulated - channel.values) / channel.scale, zorder=2, **look | {"lw": 0.8})
        if fit.forecast is not None:
            missed = lab.differences(fit.problem, *fit.forecast)[channel.title][~seen] / channel.scale
            label = f"fitted to the first {100.0 * (1.0 - fit.problem.hold_out):.0f} % alone"
            right.plot(time[~seen], missed, color=_FORECAST, lw=0.8, label=label, zorder=3)
        left.set_ylabel(f"{theme.plain(channel.title)}\n[{theme.plain(channel.unit)}]")
        right.set_ylabel(f"[{theme.plain(channel.unit)}]")
    axes[0, 0].set_title("log and runs", loc="left")
    axes[0, 1].set_title("run − log", loc="left")
    for axis in axes[-1]:
        axis.set_xlabel("time of the log [s]")
    figure.align_ylabels(axes[:, 0])
    figure.align_ylabels(axes[:, 1])
    legend(figure, axes[0], columns=4)
