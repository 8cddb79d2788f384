"""Figure of a torque fit: measured over fitted torque by pressure, what is left over, what goes with what."""

import pathlib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from afo_sim.common import Foreign
from afo_sim.lab import Group, Profile, Readings, TorqueFit, profile, refused
from afo_sim.lab.solution import FitParameter
from afo_sim.lab.torque_problem import predict
from afo_sim.show.style import BLUE, RED, ZERO, Axes, Figure, legend_on_top, on_scale, plain, write_pair

_MOST_GROUPS = 6  # panels of measured torque
_GRID = 61  # angles of a line
_RIGID = 2.5  # times the largest measured torque: as far as a panel goes


def write_torque_figure(fit: TorqueFit, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write fit_torque.png and fit_torque.pdf, and return the files."""
    profiled = profile(fit.solution)
    shown = min(len(fit.problem.groups), _MOST_GROUPS)
    count = shown + 1 + (profiled is not None) + bool(fit.laws)
    columns = min(count, 4)
    rows = -(-count // columns)
    size = (3.5 * columns, 3.1 * rows + 0.3)
    return write_pair(folder / "fit_torque", size, lambda f: _fill(f, fit, profiled, columns, rows))


def _fill(figure: Figure, fit: TorqueFit, profiled: Profile | None, columns: int, rows: int) -> None:
    axes = iter(np.ravel(figure.subplots(rows, columns)))
    level, of_group = fit.problem.levels, fit.problem.of_group
    for k, group in enumerate(fit.problem.groups[:_MOST_GROUPS]):
        _draw_torque(next(axes), fit, group, level[of_group == k])
    _draw_residuals(next(axes), fit, level)
    if profiled is not None:
        _draw_profile(next(axes), fit, profiled)
    if fit.laws:
        _draw_laws(next(axes), fit)
    for unused in axes:
        unused.set_axis_off()
    lacking = sorted(refused(fit.verdict))
    told = f"; not determined by these readings: {', '.join(lacking)}" if lacking else ""
    values = ", ".join(f"{p.name} {p.text(fit.parameters[p.name])}" for p in fit.problem.free)
    figure.suptitle(plain(f"{values}{told}", None))


def _colour(pressure: float, fit: TorqueFit) -> Foreign:
    every = fit.problem.column("pressure")
    return on_scale(min(max((pressure - every.min()) / max(float(np.ptp(every)), 1e4), 0.0), 1.0))


def _draw_torque(axis: Axes, fit: TorqueFit, group: Group, level: np.ndarray) -> None:
    """Readings, the fit through them, and the same muscles on rigid anchors."""
    readings = group.readings
    reach = (readings.angle.min(), readings.angle.max())
    grid = np.linspace(*reach, _GRID) if reach[1] > reach[0] else np.array(reach)
    rigid = {"offset": 0.0, "series_stiffness": np.inf, "cuff_stiffness": np.inf, "plate_stiffness": np.inf}
    axis.axhline(0.0, color=ZERO, lw=0.8)
    most = _RIGID * float(np.abs(readings.torque).max())  # rigid anchors on a locked braid pull without end
    for k in np.unique(level):
        own = readings.take(level == k)
        pressure = float(own.pressure.mean())
        colour = _colour(pressure, fit)
        line = Group(_at(readings, grid, pressure), group.orthosis)
        fitted = predict(fit.problem, fit.parameters, [line])["torque"]
        stiff = predict(fit.problem, fit.parameters | rigid, [line])["torque"]
        axis.plot(np.degrees(grid), np.where(np.abs(stiff) < most, stiff, np.nan), ":", color=colour, lw=1.0)
        axis.plot(np.degrees(grid), fitted, color=colour)
        label = f"{pressure * 1e-5:.3g} bar"
        axis.plot(np.degrees(own.angle), own.torque, "o", ms=3, color=colour, label=label)
    axis.plot([], [], color="0.3", label="fitted")
    axis.plot([], [], ":", color="0.3", label="nothing gives way")
    axis.margins(x=0.03)
    axis.set(xlabel=f"angle [deg], {group.orthosis.words.directions[0]} positive", ylabel="torque [N·m]")
    axis.set_title(plain(readings.group if len(fit.problem.groups) > 1 else readings.file.stem))
    legend_on_top(axis, 2)


def _at(readings: Readings, angle: np.ndarray, pressure: float) -> Readings:
    order = np.argsort(readings.angle)
    path = {
        name: np.array([np.interp(angle, readings.angle[order], row[order]) for row in rows])
        for name, rows in readings.path.items()
    }
    like = readings.take(np.zeros(len(angle), int))
    return replace(like, angle=angle, pressure=np.full(len(angle), pressure), path=path)


def _draw_residuals(axis: Axes, fit: TorqueFit, level: np.ndarray) -> None:
    """Errors over angle: seen by the fit, and when left out."""
    angle, pressure = np.degrees(fit.problem.column("angle")), fit.problem.column("pressure")
    axis.axhline(0.0, color=ZERO, lw=0.8)
    colours = [_colour(float(pressure[level == k].mean()), fit) for k in level]
    axis.scatter(angle, fit.residuals, s=9, color=colours, label="fitted")
    kind = fit.judged_by or next((k for k in fit.held_out if k != "file"), "")
    if kind:
        missed = fit.held_out[kind]
        for k, name in enumerate(missed.errors):
            mask = fit.problem.parts(kind)[name]
            label = "left out" if k == 0 else None
            axis.plot(angle[mask], missed.errors[name], "x", ms=4, color=RED, label=label)
    axis.margins(x=0.03)
    axis.set(xlabel="angle [deg]", ylabel="predicted − measured [N·m]")
    left = f", {fit.held_out[kind].rms:.3g} with {kind} left out" if kind else ""
    axis.set_title(f"{fit.rms:.3g} N·m RMS{left}")
    legend_on_top(axis, 2)


def _scale(parameter: FitParameter, scale: Foreign, side: Foreign) -> None:
    from matplotlib.ticker import LogFormatter

    if parameter.logarithmic:
        scale("log")
        for format_ in (side.set_major_formatter, side.set_minor_formatter):
            format_(LogFormatter(minor_thresholds=(1.2, 0.5)))


def _draw_laws(axis: Axes, fit: TorqueFit) -> None:
    """The first parameter by each law, with its interval; hollow where it fits worse than comparably."""
    p = fit.problem.free[0]
    shown = [each for each in reversed(fit.laws) if each.ends(p.name)]
    hull = fit.intervals[p.name]
    if hull is not None:
        axis.axvspan(*map(p.number, hull), color=ZERO, alpha=0.3, lw=0)
    for k, each in enumerate(shown):
        colour = RED if each is fit.laws[0] else "0.4"
        axis.plot(list(map(p.number, each.ends(p.name) or ())), [k, k], color=colour)
        face = colour if each.comparable else "white"
        axis.plot(p.number(each.solution.values[p.name]), k, "o", ms=4, color=colour, mfc=face)
    axis.set_yticks(range(len(shown)), [each.law for each in shown], fontsize=7)
    _scale(p, axis.set_xscale, axis.xaxis)
    axis.margins(x=0.08)
    axis.set_xlabel(f"{p.name} [{p.shown}]")
    axis.set_title("by each law (hollow: fits worse)" + ("\ngrey: 95 % interval" if hull else ""))


def _draw_profile(axis: Axes, fit: TorqueFit, profiled: Profile) -> None:
    """Which pairs of two parameters fit as well, and what each group alone says."""
    first, second = profiled.parameters
    x = np.array([first.number(v) for v in profiled.first])
    y = np.array([second.number(v) for v in profiled.second])
    worse = profiled.rms / profiled.rms.min() - 1.0
    levels = [0, 1, 2, 5, 10, 20, 50, 100]
    bands = axis.contourf(x, y, 100.0 * worse.T, levels, cmap="Greys", extend="max", alpha=0.7)
    axis.figure.colorbar(bands, ax=axis, label="torque RMS above the least [%]")
    _scale(first, axis.set_xscale, axis.xaxis)
    _scale(second, axis.set_yscale, axis.yaxis)

    def at(values: Mapping[str, float]) -> tuple[float, float]:
        return first.number(values[first.name]), second.number(values[second.name])

    axis.plot(*at(fit.parameters), "o", color=RED, label="fitted")
    others = {g: at(values) for g, values in (fit.apart.values if fit.apart else {}).items()}
    (left, right), (low, high) = (x.min(), x.max()), (y.min(), y.max())
    within = {g: (a, b) for g, (a, b) in others.items() if left <= a <= right and low <= b <= high}
    for group, place in within.items():
        axis.annotate(plain(group), place, xytext=(4, 3), textcoords="offset points", fontsize=7)
    if others:
        beyond = ", ".join(group for group in others if group not in within)
        label = "each group alone" + (f" (beyond: {plain(beyond)})" if beyond else "")
        axis.plot(*np.reshape([*within.values()], (-1, 2)).T, "+", ms=7, color=BLUE, label=label)
    axis.set(xlim=(left, right), ylim=(low, high), xlabel=f"{first.name} [{first.shown}]")
    axis.set_ylabel(f"{second.name} [{second.shown}]" if second.shown else second.name)
    axis.legend(loc="upper right", frameon=True, framealpha=0.8, edgecolor="none")
