"""The panels of walking over the gait cycle: moment, clearance in swing, torque, power and work."""

from collections.abc import Sequence

import numpy as np

from afo_sim.gait import norm as gait_norm
from afo_sim.metrics import EXTENSIONS, HEIGHTS, INTERNAL, NEEDED_MOMENT, ORTHOSIS, without_floor
from afo_sim.show.panels import HEALTHY, NORM_LABEL, mean_and_spread, unknown_band
from afo_sim.show.run_view import PERCENT, PHASE, RunView
from afo_sim.show.style import GREY, NORM, ZERO, Axes, ink, plain

_FLEXION = "plantarflexion –  |  + dorsiflexion"
_TRIP = "below the floor: a trip"
_WIDE = 3.0  # of the gait cycle to each side, over which a number is written [%]
BAND = "toes less to more extended in swing (assumed)"
_WORK = ("orthosis_positive_work", "orthosis_negative_work")


def over_cycle(axis: Axes, toe_off: float | None, label: str, start: float = 0.0) -> None:
    """An axis over the gait cycle."""
    axis.axhline(0.0, color=ZERO, lw=0.6, zorder=1)
    if toe_off is not None:
        mark_toe_off(axis, toe_off)
        look = {"fontsize": 8.0, "color": "0.4", "ha": "center", "va": "bottom"}
        axis.annotate("toe-off", (100.0 * toe_off, 1.01), xycoords=("data", "axes fraction"), **look)
    axis.set(xlim=(100.0 * start, 100.0), xlabel="gait cycle [%]", ylabel=label)


def mark_toe_off(axis: Axes, toe_off: float) -> None:
    """A dotted line at toe-off, gait phase [-]."""
    axis.axvline(100.0 * toe_off, color="0.6", lw=0.6, ls=":", zorder=1)


def internal_moment(axis: Axes, runs: Sequence[RunView]) -> None:
    """Whole internal moment per body mass: tissue, muscles and orthosis together, with the norm's band."""
    low, high = (gait_norm.read().at(f"moment_{end}", PHASE) for end in ("low", "high"))
    axis.fill_between(PERCENT, low, high, color=NORM, lw=0.0, zorder=0, label=NORM_LABEL)
    for run in runs:
        total = np.sum([run.cycles(name) for name in INTERNAL], axis=0) / run.body_mass
        mean_and_spread(axis, total, run.colour, run.name, PERCENT, run.style)
    first = runs[0]
    recorded = first.cycles("gait/ankle_moment").mean(axis=0) / first.body_mass
    axis.plot(PERCENT, recorded, **HEALTHY, label=first.recorded)
    over_cycle(axis, first.toe_off, f"internal ankle moment [N·m/kg]\n{_FLEXION}")


def clearance(axis: Axes, runs: Sequence[RunView], point: str) -> None:
    """Height of the outsole or its ball above the floor in swing, with a dot at the minimum that counts."""
    start = min(run.toe_off for run in runs)
    dots: list[tuple[float, float, str]] = []  # gait cycle [%], height [mm], colour
    for run in runs:
        own, _ = _heights(run, point)
        mean_and_spread(axis, 1e3 * run.cycles(own), run.colour, run.name, PERCENT, run.style)
        unknown_band(axis, run, own, 1e3)
        ends = [f"{HEIGHTS[point][0]}_{how}" for how in EXTENSIONS]
        if all(name in run.recording.columns for name in ends):
            low, high = (1e3 * run.cycles(name).mean(axis=0) for name in ends)
            axis.fill_between(PERCENT, low, high, color=run.colour, alpha=0.2, lw=0.0, label=BAND)
        found = run.recording.metrics
        if f"{point}_clearance" in found:
            when = found[f"{point}_clearance_phase"].value
            dots.append((when, found[f"{point}_clearance"].value, run.colour))
    for x, height, colour in dots:
        axis.plot(x, height, "o", ms=5.0, color=colour, zorder=5)
    if len(dots) == 1:
        x, height, colour = dots[0]
        _number(axis, (x, height), height, colour, up=-15.0)
    elif dots:
        middle = float(np.mean([x for x, _, _ in dots]))
        near = np.abs(PERCENT - middle) < _WIDE
        lines = [line.get_ydata() for line in axis.lines]
        top = max(float(line[near].max()) for line in lines if len(line) == len(PHASE))
        for k, (_, height, colour) in enumerate(sorted(dots, key=lambda dot: dot[1])):
            _number(axis, (middle, top), height, colour, up=8.0 + 10.0 * k)
    recorded = 1e3 * runs[0].cycles(_heights(runs[0], point)[1]).mean(axis=0)
    axis.plot(PERCENT, recorded, **HEALTHY, label="this foot with the recorded ankle angle")
    what = "outsole" if point == "toe" else point
    over_cycle(axis, None, f"{what} above the floor [mm]", start)
    axis.set_title(f"{point} clearance in swing", loc="left")


def _heights(run: RunView, point: str) -> tuple[str, str]:
    """Columns of a point's height, and of the recorded one's; of a recording without outsole the toe's."""
    columns, (own, recorded) = run.recording.columns, HEIGHTS[point]
    if own not in columns:
        own, recorded = f"{point}/height", f"gait/{point}_height"
    return without_floor(columns, own), recorded


def share_floor(axis: Axes, start: float) -> None:
    """The scale of a panel of clearance from a phase on, with room for words below a shaded floor."""
    curves = (line.get_ydata() for line in axis.lines)
    seen = [y[start <= PHASE] for y in curves if len(y) == len(PHASE)]
    low, high = min(y.min() for y in seen), max(y.max() for y in seen)
    axis.set_ylim(min(low, 0.0) - 0.24 * (high - low), high + 8.0)
    axis.axhspan(axis.get_ylim()[0], 0.0, color="#f3dede", lw=0.0, zorder=0)
    axis.annotate(_TRIP, (0.02, 0.02), xycoords="axes fraction", fontsize=8.0, color="#803030")
    axis.tick_params(labelleft=True)


def _number(axis: Axes, at: tuple[float, float], height: float, colour: str, up: float) -> None:
    """A clearance [mm] in words, above or below a place by `up` [points]."""
    text = f"{height:.0f} mm".replace("-", "−")
    look = {"textcoords": "offset points", "ha": "center", "va": "bottom", "fontsize": 8.0, "zorder": 6}
    axis.annotate(text, at, xytext=(0.0, up), color=ink(colour), **look)


def torque(axis: Axes, run: RunView) -> None:
    """Torque that the patient lacks, if known, and the orthosis' torque."""
    if NEEDED_MOMENT in run.recording.columns:
        needed = run.cycles(NEEDED_MOMENT).mean(axis=0)
        axis.fill_between(PERCENT, 0.0, needed, color="0.82", lw=0.0, label="needed: what the patient lacks")
        axis.plot(PERCENT, needed, color=GREY, lw=0.8)
    if run.has_orthosis:
        label = plain(f"available: {run.label}" if run.label else "available")
        mean_and_spread(axis, run.cycles(ORTHOSIS), run.colour, label, PERCENT, run.style)
        unknown_band(axis, run, ORTHOSIS)
    over_cycle(axis, run.toe_off, f"torque about the ankle [N·m]\n{_FLEXION}")
    axis.set_title(plain(run.label), loc="left", color=ink(run.colour), pad=15.0)  # above the word toe-off


def power(axis: Axes, runs: Sequence[RunView]) -> None:
    """Power of the orthosis per body mass."""
    for run in runs:
        flow = run.cycles(ORTHOSIS) * run.cycles("ankle/velocity") / run.body_mass
        mean_and_spread(axis, flow, run.colour, run.name, PERCENT, run.style)
    over_cycle(axis, runs[0].toe_off, "power of the orthosis [W/kg]\ntaken –  |  + given")


def work(axis: Axes, runs: Sequence[RunView]) -> None:
    """Positive and negative work of the orthosis per stride, one row of bars for each run."""
    for k, run in enumerate(runs):
        found = [run.recording.metrics[name] for name in _WORK if name in run.recording.metrics]
        for value in [1e3 * metric.value for metric in found if np.isfinite(metric.value)]:
            bar = axis.barh(k, value, color=run.colour, height=0.6)
            axis.bar_label(bar, [f"{value:.1f}".replace("-", "−")], padding=3.0, fontsize=8.0)
    axis.axvline(0.0, color="0.4", lw=0.6)
    axis.set_yticks([])
    axis.set_ylim(max(len(runs), 3) - 0.4, -0.6)
    axis.margins(x=0.25)
    axis.set_xlabel("work per stride [mJ/kg]\ntaken –  |  + given")
