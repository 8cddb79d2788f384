"""Figure of a log over its run: before and after the fit, and what is left between them."""

import pathlib
from typing import Any

from afo_sim.common.writing import replacing
from afo_sim.lab.run_fit import FitRun
from afo_sim.lab.run_problem import Channel, differences
from afo_sim.show.style import COLOURS, RESOLUTION, STYLE, plain

LOG, BEFORE, AFTER, FORECAST = "0.75", COLOURS[0], COLOURS[1], COLOURS[4]
SPARSE = 150  # samples: fewer are drawn one by one


def write_log_figure(fit: FitRun, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write fit_run.png and fit_run.pdf, and return the files.

    A row per channel: log, run before and after on the left; run less log on the right.

    Parameters
    ----------
    fit : from `fit_run`
    folder : made if need be
    """
    import matplotlib
    from matplotlib.figure import Figure

    channels, written = fit.problem.log.channels, list[pathlib.Path]()
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.1, 0.9 + 1.7 * len(channels)), layout="constrained")
        axes = figure.subplots(len(channels), 2, sharex=True, squeeze=False, width_ratios=(1.35, 1.0))
        for (left, right), channel in zip(axes, channels, strict=True):
            _overlay(left, fit, channel)
            _rest(right, fit, channel)
        axes[0, 0].set_title("log and runs", loc="left")
        axes[0, 1].set_title("run − log", loc="left")
        for axis in axes[-1]:
            axis.set_xlabel("time of the log [s]")
        figure.align_ylabels(axes[:, 0])
        figure.align_ylabels(axes[:, 1])
        found = [axis.get_legend_handles_labels() for axis in axes[0]]
        handles = {label: handle for pair in found for handle, label in zip(*pair, strict=True)}
        figure.legend(handles.values(), handles.keys(), loc="outside upper left", ncols=len(handles))
        for suffix in ("png", "pdf"):
            written.append(folder / f"fit_run.{suffix}")
            with replacing(written[-1]) as path:
                figure.savefig(path, dpi=RESOLUTION, format=suffix)
    return written


def _overlay(axis: Any, fit: FitRun, channel: Channel) -> None:
    time = fit.problem.log.time
    look: dict[str, Any] = (
        {"lw": 3.5} if len(time) > SPARSE else {"lw": 0.0, "marker": "o", "ms": 4.0, "mew": 0.0}
    )
    axis.plot(time, channel.values / channel.scale, color=LOG, label="log", zorder=1, **look)
    for label, run, values, look in _runs(fit):
        simulated = channel.simulated(run, time - values.get("time_offset", 0.0))
        axis.plot(time, simulated / channel.scale, label=label, zorder=2, **look)
    axis.set_ylabel(f"{plain(channel.title)}\n[{plain(channel.unit)}]")


def _rest(axis: Any, fit: FitRun, channel: Channel) -> None:
    time, seen = fit.problem.log.time, fit.problem.seen
    band = 2.0 * fit.problem.noise[channel.title] / channel.scale
    axis.axhspan(-band, band, color="0.88", lw=0.0, zorder=0, label="± 2 × noise")
    axis.axhline(0.0, color="0.6", lw=0.6, zorder=1)
    for _, run, values, look in _runs(fit):
        simulated = channel.simulated(run, time - values.get("time_offset", 0.0))
        axis.plot(time, (simulated - channel.values) / channel.scale, zorder=2, **look | {"lw": 0.8})
    if fit.forecast is not None:
        missed = differences(fit.problem, *fit.forecast)[channel.title][~seen] / channel.scale
        label = f"fitted to the first {100.0 * (1.0 - fit.problem.hold_out):.0f} % alone"
        axis.plot(time[~seen], missed, color=FORECAST, lw=0.8, label=label, zorder=3)
    axis.set_ylabel(f"[{plain(channel.unit)}]")


def _runs(fit: FitRun) -> list[tuple[str, Any, dict[str, float], dict[str, Any]]]:
    """(label, run, values, look) of what is drawn over the log."""
    if not fit.values:
        return [("run", fit.before, {}, {"color": AFTER, "lw": 1.0})]
    return [
        ("before", fit.before, {}, {"color": BEFORE, "ls": "--", "lw": 1.0}),
        ("after", fit.after, fit.values, {"color": AFTER, "lw": 1.0}),
    ]
