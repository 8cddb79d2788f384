"""The panels of walking over the gait cycle: moment, clearance in swing, torque, power and work."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.walking import ORTHOSIS, dip
from afo_sim.show.panels import NORM_LABEL, RECORDED, mean_and_spread
from afo_sim.show.run_view import PERCENT, PHASE, RunView
from afo_sim.show.style import NORM, ZERO, plain

INTERNAL = ("ankle/moment/passive", "ankle/moment/biological", ORTHOSIS)
FLEXION = "plantarflexion –  |  + dorsiflexion"
TRIP = "below the floor: a trip, where the dashed line is not"
WORK = ("orthosis_positive_work", "orthosis_negative_work")


def over_cycle(axis: Any, toe_off: float | None, label: str, start: float = 0.0) -> None:
    """An axis over the gait cycle.

    Parameters
    ----------
    axis : to set up
    toe_off : marked where told, gait phase [-]
    label : of the ordinate
    start : first gait phase shown [-]
    """
    axis.axhline(0.0, color=ZERO, lw=0.6, zorder=1)
    if toe_off is not None:
        mark_toe_off(axis, toe_off)
        look = {"fontsize": 7.0, "color": "0.45", "ha": "center", "va": "bottom"}
        axis.annotate("toe-off", (100.0 * toe_off, 1.01), xycoords=("data", "axes fraction"), **look)
    axis.set_xlim(100.0 * start, 100.0)
    axis.set_xlabel("gait cycle [%]")
    axis.set_ylabel(label)


def mark_toe_off(axis: Any, toe_off: float) -> None:
    """A dotted line at toe-off, gait phase [-]."""
    axis.axvline(100.0 * toe_off, color="0.6", lw=0.6, ls=":", zorder=1)


def internal_moment(axis: Any, runs: Sequence[RunView]) -> None:
    """Whole internal moment per body mass: tissue, muscles and orthosis together, with the norm's band."""
    low, high = (gait_norm.read().at(f"moment_{end}", PHASE) for end in ("low", "high"))
    axis.fill_between(PERCENT, low, high, color=NORM, lw=0.0, zorder=0, label=NORM_LABEL)
    for run in runs:
        total = np.sum([run.cycles(name) for name in INTERNAL], axis=0) / run.body_mass
        mean_and_spread(axis, total, run.colour, run.name, PERCENT)
    first = runs[0]
    axis.plot(PERCENT, first.cycles("gait/ankle_moment").mean(axis=0) / first.body_mass, **RECORDED)
    over_cycle(axis, first.toe_off, f"internal ankle moment [N·m/kg]\n{FLEXION}")


def clearance(axis: Any, runs: Sequence[RunView], point: str) -> None:
    """Height of toe or ball above the floor in swing, with a dot at the minimum that counts."""
    start = min(run.toe_off for run in runs)
    dots: list[tuple[float, float, str]] = []
    for run in runs:
        height = 1e3 * run.cycles(f"{point}/height")
        mean_and_spread(axis, height, run.colour, run.name, PERCENT)
        rows = np.flatnonzero(run.toe_off <= PHASE)
        lowest = rows[dip(1e-3 * height.mean(axis=0)[rows])[0]]
        dots.append((PERCENT[lowest], height.mean(axis=0)[lowest], run.colour))
    _dots(axis, dots)
    recorded = 1e3 * runs[0].cycles(f"gait/{point}_height").mean(axis=0)
    axis.plot(PERCENT, recorded, **RECORDED | {"label": "this foot, ankle as in the healthy trial"})
    over_cycle(axis, None, f"{point} above the floor [mm]", start)
    axis.set_title(f"{point} clearance in swing", loc="left")


def share_floor(axes: Sequence[Any], start: float) -> None:
    """One scale for panels of clearance from a phase on, with room for words below a shaded floor."""
    seen = [
        line.get_ydata()[start <= PHASE]
        for axis in axes
        for line in axis.lines
        if len(line.get_ydata()) == len(PHASE)
    ]
    low, high = min(y.min() for y in seen), max(y.max() for y in seen)
    axes[0].set_ylim(min(low, 0.0) - 0.24 * (high - low), high + 8.0)
    for axis in axes:
        axis.axhspan(axis.get_ylim()[0], 0.0, color="#f3dede", lw=0.0, zorder=0)
        look = {"fontsize": 8.0, "color": "#803030"}
        axis.annotate(TRIP, (0.02, 0.02), xycoords="axes fraction", **look)
        axis.tick_params(labelleft=True)


def _dots(axis: Any, dots: list[tuple[float, float, str]]) -> None:
    """Clearances (gait cycle [%], height [mm], colour); the highest has its number above, others below."""
    highest = max(height for _, height, _ in dots)
    for x, height, colour in dots:
        axis.plot(x, height, "o", ms=5.0, color=colour, zorder=5)
        above = len(dots) > 1 and height == highest
        axis.annotate(
            f"{height:.0f} mm".replace("-", "−"),
            (x, height),
            xytext=(0.0, 5.0 if above else -5.0),
            textcoords="offset points",
            ha="center",
            va="bottom" if above else "top",
            fontsize=8.0,
            color=colour,
            zorder=6,
        )


def torque(axis: Any, run: RunView) -> None:
    """Torque that the patient lacks, and the orthosis' torque."""
    needed = run.cycles("gait/needed_moment").mean(axis=0)
    axis.fill_between(PERCENT, 0.0, needed, color="0.82", lw=0.0, label="needed: what the patient lacks")
    axis.plot(PERCENT, needed, color="0.45", lw=0.8)
    if run.has_orthosis:
        label = plain(f"available: {run.label}" if run.label else "available")
        mean_and_spread(axis, run.cycles(ORTHOSIS), run.colour, label, PERCENT)
    over_cycle(axis, run.toe_off, f"torque about the ankle [N·m]\n{FLEXION}")
    axis.set_title(plain(run.label), loc="left", color=run.colour)


def power(axis: Any, runs: Sequence[RunView]) -> None:
    """Power of the orthosis per body mass."""
    for run in runs:
        flow = run.cycles(ORTHOSIS) * run.cycles("ankle/velocity") / run.body_mass
        mean_and_spread(axis, flow, run.colour, run.name, PERCENT)
    over_cycle(axis, runs[0].toe_off, "power of the orthosis [W/kg]\ntaken –  |  + given")


def work(axis: Any, runs: Sequence[RunView]) -> None:
    """Positive and negative work of the orthosis per stride, one row of bars for each run."""
    for k, run in enumerate(runs):
        found = [run.recording.metrics[name] for name in WORK if name in run.recording.metrics]
        for value in [1e3 * metric.value for metric in found if np.isfinite(metric.value)]:
            axis.barh(k, value, color=run.colour, height=0.6)
            axis.annotate(
                f"{value:.1f}".replace("-", "−"),
                (value, k),
                xytext=(3.0 if value >= 0.0 else -3.0, 0.0),
                textcoords="offset points",
                ha="left" if value >= 0.0 else "right",
                va="center",
                fontsize=8.0,
            )
    axis.axvline(0.0, color="0.4", lw=0.6)
    axis.set_yticks([])
    axis.set_ylim(max(len(runs), 3) - 0.4, -0.6)
    axis.margins(x=0.25)
    axis.set_xlabel("work per stride [mJ/kg]\ntaken –  |  + given")
