"""Tests of the stand, drawn: characteristics, steps, releases."""

import pathlib
from collections.abc import Callable, Sequence

import numpy as np

from afo_sim.common import Foreign
from afo_sim.lab import AXES, FURTHER, SET, Comparison, Replay, Trial, set_point_text, static
from afo_sim.show.style import BESIDE, BLUE, RED, Axes, by_height, legend_on_top, new_figure, on_scale, plain

# Column → (label, factor from SI)
SHOWN = {
    "pressure": ("gauge pressure [bar]", 1e-5),
    "contraction": ("contraction [%]", 100.0),
    "force": ("force [N]", 1.0),
    "velocity": ("shortening speed [m/s]", -1.0),
    "time": ("time [s]", 1.0),
    "length": ("length [cm]", 100.0),
}
_PANEL = (3.6, 2.9)  # of one panel [inch]
_COLUMNS = 3  # panels side by side


def draw_trials(trials: Sequence[Trial], compared: Sequence[Comparison], path: pathlib.Path) -> None:
    """Draw tests of one kind on one page."""
    kind = trials[0].plan.kind
    tall = {"step": 3, "release": 2}.get(kind, 1 + (kind in FURTHER))  # panels of a trial, under one another
    across = min(len(trials), _COLUMNS)
    down = -(-len(trials) // across)
    height = _PANEL[1] * (0.72 if tall > 1 else 1.0) * tall * down
    with new_figure(path, (_PANEL[0] * across + 0.9, height + 0.4)) as figure:
        fill: Callable[..., None] = {"step": _step, "release": _release}.get(kind, _sweep)
        alike = len({trial.plan.muscle.name for trial in trials}) == 1 and kind in AXES
        rows: bool | str = alike and ("row" if tall > 1 else "all")
        axes = figure.subplots(tall * down, across, squeeze=False, sharex=alike, sharey=rows)
        same = all(np.array_equal(t.plan.set_points, trials[0].plan.set_points) for t in trials)
        for k in range(down * across):
            row, column = divmod(k, across)
            own = axes[tall * row : tall * (row + 1), column]
            if k >= len(trials):
                for axis in own:
                    axis.set_axis_off()
                continue
            fill(own, trials[k], compared[k] if compared else None)
            whose, *lines = trials[k].name.split(" · ")
            lines = [f"{plain(whose)} · {kind}{', formula' if trials[k].static else ''}", *lines]
            own[0].set_title("\n".join(lines), loc="left")
            own[0].tick_params(labelbottom=True, labelleft=True)
            if not same or k == across - 1:
                _legend(own[0], trials[k], compared)


def draw_replay(replay: Replay, path: pathlib.Path) -> None:
    """Draw each channel of a replayed log over time, measured and predicted."""
    with new_figure(path, (7.1, 0.6 + 2.0 * len(replay.errors))) as figure:
        axes = figure.subplots(len(replay.errors), 1, sharex=True, squeeze=False)[:, 0]
        for axis, (name, error) in zip(axes, replay.errors.items(), strict=True):
            label, factor = SHOWN[name]
            axis.plot(error.x, factor * error.measured, color="0.6", lw=3.0, label="measured")
            axis.plot(error.x, factor * error.predicted, color=RED, label="predicted")
            axis.set_ylabel(label)
        legend_on_top(axes[0], 2)
        axes[-1].set_xlabel(SHOWN["time"][0])


def colour(trial: Trial, curve: int) -> Foreign:
    """A curve's colour: from dark to light as the set point rises."""
    return on_scale(curve / max(len(trial.curves) - 1, 1))


def _sweep(axes: np.ndarray, trial: Trial, compared: Comparison | None) -> None:
    abscissa, _, ordinate, _ = AXES[trial.plan.kind]
    for axis, shown in zip(axes, (ordinate, *FURTHER.get(trial.plan.kind, ())[:1]), strict=True):
        (x_label, x_factor), (y_label, y_factor) = SHOWN[abscissa], SHOWN[shown]
        for k in range(len(trial.curves)):
            loop, shade = trial.loop(k), colour(trial, k)
            down = loop["branch"] % 2 == 1
            for way, style in ((~down, "-"), (down, "--")):
                label = set_point_text(trial, k) if style == "-" else None
                x, y = x_factor * loop[abscissa][way], y_factor * loop[shown][way]
                axis.plot(x, y, style, color=shade, label=label)
            if compared is not None:
                own = compared.curve == k
                x, y = x_factor * compared.x[own], y_factor * compared.measured[own]
                axis.plot(x, y, "o", ms=3.5, mfc="none", color=shade)
        for columns in () if trial.static else static(trial.plan, 120).curves:
            axis.plot(x_factor * columns[abscissa], y_factor * columns[shown], color="0.6", lw=0.8, zorder=1)
        if compared is not None:
            unit = {"force": "N", "contraction": "%"}[shown]
            rms, worst = (f"{y_factor * error:.3g} {unit}" for error in (compared.rms, compared.worst))
            text = f"{plain(compared.name, None)}\nRMS {rms}, worst {worst}"
            x, side = (0.98, "right") if trial.plan.kind == "isobaric" else (0.02, "left")
            axis.text(x, 0.98, text, transform=axis.transAxes, ha=side, va="top", fontsize=8.0)
        axis.margins(0.03)
        axis.set(xlabel=x_label, ylabel=y_label)


def _legend(axis: Axes, trial: Trial, compared: Sequence[Comparison]) -> None:
    """The curves and the meaning of the line styles."""
    from matplotlib.lines import Line2D

    handles = by_height(axis)
    if trial.plan.kind in AXES and not trial.static:
        handles += [
            Line2D([], [], color="0.2", label="up"),
            Line2D([], [], color="0.2", ls="--", label="down"),
            Line2D([], [], color="0.6", lw=0.8, label="formula"),
        ]
    if compared:
        handles.append(Line2D([], [], color="0.2", marker="o", mfc="none", ms=3.5, ls="", label="data"))
    title = SET[trial.plan.kind][0]
    axis.legend(handles=handles, title=title, title_fontsize=8.0, handlelength=2.0, **BESIDE)


def _step(axes: np.ndarray, trial: Trial, compared: Comparison | None) -> None:
    response = "force" if trial.plan.held else "contraction"
    for axis, name in zip(axes, ("pressure", response), strict=False):
        label, factor = SHOWN[name]
        for k, columns in enumerate(trial.curves):
            text = set_point_text(trial, k)
            axis.plot(columns["time"], factor * columns[name], color=colour(trial, k), label=text)
        axis.axvline(trial.plan.duration, color="0.75", lw=0.8, zorder=0)
        axis.set(xlabel="time [s]: filled, then vented", ylabel=label)
    pressure = trial.plan.set_points * 1e-5
    left, right = axes[2], axes[2].twinx()
    for word, style in (("fill", "o-"), ("vent", "o--")):
        tau = [m[f"{word}_{response}_time_constant"].value for m in trial.metrics]
        face = BLUE if word == "fill" else "white"
        left.plot(pressure, tau, style, ms=3.5, mfc=face, color=BLUE, label=f"{word}: time constant")
    label, factor = SHOWN[response]
    filled = [factor * m[f"filled_{response}"].value for m in trial.metrics]
    right.plot(pressure, filled, "s-", ms=3.5, color=RED)
    left.plot([], [], "s-", ms=3.5, color=RED, label="filled: right axis")
    left.set_ylim(bottom=0.0)
    right.set_ylim(0.0, 1.15 * max(filled))
    edge = 0.05 * np.ptp(pressure) or 0.5
    left.set(xlim=(pressure.min() - edge, pressure.max() + edge), xlabel="supply, gauge pressure [bar]")
    left.set_ylabel(f"63 % of {response} [s]", color=BLUE)
    right.set_ylabel(f"filled: {label}", color=RED)
    right.spines["right"].set_visible(True)
    left.legend(loc="upper left", bbox_to_anchor=(0.0, -0.3), ncols=2)  # below the curves of both axes


def _release(axes: np.ndarray, trial: Trial, compared: Comparison | None) -> None:
    settled = max(8.0 * max(m["time_constant"].value for m in trial.metrics), 0.05)
    for axis, name in zip(axes, ("contraction", "velocity"), strict=True):
        label, factor = SHOWN[name]
        for k, columns in enumerate(trial.curves):
            text = set_point_text(trial, k)
            axis.plot(1e3 * columns["time"], factor * columns[name], color=colour(trial, k), label=text)
        axis.set(xlim=(0.0, 1e3 * min(settled, trial.plan.duration)), xlabel="time since release [ms]")
        axis.set_ylabel(label)
