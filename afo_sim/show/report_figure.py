"""Figures of a report, as SVG text to stand in a page: over the gait cycle, or over time."""

import io
import itertools
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from afo_sim.description.words import body_mass
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.strides import Stride, settled, strides
from afo_sim.metrics.walking import ORTHOSIS, chambers, dip, has_orthosis
from afo_sim.metrics.words import plain
from afo_sim.show.figure import COLOURS, LOAD, MOMENTS, STYLE
from afo_sim.simulation.recording import Recording

PHASE = np.linspace(0.0, 1.0, 201)
PERCENT = 100.0 * PHASE
WIDTH = 7.6  # [inch]
RUNS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")  # in the order they are given
RECORDED = {"color": "black", "lw": 1.2, "ls": (0, (4, 2)), "label": "healthy trial, recorded", "zorder": 4}
LANES = {"inlet": "filling", "outlet": "venting"}
ACROSS = 3  # panels side by side, at most
TIME_POINTS = 2000  # of a curve over time


@dataclass(frozen=True, eq=False)
class Shown:
    """A run in a report: its name and its colour."""

    label: str
    colour: str
    recording: Recording

    @property
    def walks(self) -> bool:
        """Whether recorded walking drove this run."""
        return "gait/phase" in self.recording.columns

    @cached_property
    def strides(self) -> list[Stride]:
        """The strides that count; if there are none, whatever is whole."""
        columns = self.recording.columns
        time = self.recording["time"]
        step = float(time[1] - time[0]) if len(time) > 1 else 1.0
        whole = strides(columns, step, body_mass(self.recording.scenario))
        return settled(columns, whole) or whole

    @property
    def has_orthosis(self) -> bool:
        """Whether the run has muscles."""
        return has_orthosis(self.recording.columns)

    def cycles(self, column: str) -> np.ndarray:
        """A column over PHASE, one row for each stride (strides, 201)."""
        return np.array([stride.at(column, PHASE) for stride in self.strides])

    @property
    def toe_off(self) -> float:
        """Mean gait phase of toe-off [-]."""
        return float(np.mean([stride.toe_off for stride in self.strides]))


def svg(name: str, size: tuple[float, float], fill: Callable[[Any], None]) -> str:
    """What `fill` draws on a figure, as an SVG element that needs nothing outside itself.

    Parameters
    ----------
    name : of the figure; all ids within begin with it, so that several figures may stand in one page
    size : width, height [inch]
    fill : called with a Matplotlib figure
    """
    import matplotlib
    from matplotlib.figure import Figure  # and not pyplot: no display, nothing global

    with matplotlib.rc_context({**STYLE, "svg.fonttype": "path", "svg.hashsalt": name}):
        figure = Figure(figsize=size, layout="constrained")
        fill(figure)
        page = io.StringIO()
        figure.savefig(page, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = page.getvalue()
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{name}-", text)
    return re.sub(r'\b(width|height)="[\d.]+pt" ?', "", text, count=2)


def _over_cycle(axis: Any, toe_off: float | None, label: str, start: float = 0.0) -> None:
    axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    if toe_off is not None:
        axis.axvline(100.0 * toe_off, color="0.6", lw=0.6, ls=":", zorder=1)
        look = {"fontsize": 7.0, "color": "0.45", "ha": "center", "va": "bottom"}
        axis.annotate("toe-off", (100.0 * toe_off, 1.01), xycoords=("data", "axes fraction"), **look)
    axis.set_xlim(100.0 * start, 100.0)
    axis.set_xlabel("gait cycle [%]")
    axis.set_ylabel(label)


def _mean_and_spread(axis: Any, values: np.ndarray, colour: str, label: str, x: np.ndarray = PERCENT) -> None:
    """Mean of the strides as a line, lowest to highest as a band."""
    if len(values) > 1:
        low, high = values.min(axis=0), values.max(axis=0)
        axis.fill_between(x, low, high, color=colour, alpha=0.25, lw=0.0, zorder=2)
    axis.plot(x, values.mean(axis=0), color=colour, label=plain(label), zorder=3)


def _legend(figure: Any, axes: Iterable[Any]) -> None:
    """One legend above all panels, each name once."""
    found: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    figure.legend(list(found.values()), list(found), loc="outside upper left", ncols=3)


def draw_ankle(figure: Any, runs: list[Shown]) -> None:
    """Ankle angle and internal moment over the gait cycle, each with the norm's band."""
    angle, moment = figure.subplots(1, 2)
    norm = gait_norm.read()
    for axis, name, unit in ((angle, "ankle", np.degrees(1.0)), (moment, "moment", 1.0)):
        low, high = (unit * norm.at(f"{name}_{end}", PHASE) for end in ("low", "high"))
        axis.fill_between(PERCENT, low, high, color="0.85", lw=0.0, zorder=0, label="norm: published means")
    for run in runs:
        _mean_and_spread(angle, np.degrees(run.cycles("ankle/angle")), run.colour, run.label)
        parts = ["ankle/moment/passive", "ankle/moment/biological", ORTHOSIS]
        total = np.sum([run.cycles(name) for name in parts], axis=0) / body_mass(run.recording.scenario)
        _mean_and_spread(moment, total, run.colour, run.label)
    first = runs[0]
    angle.plot(PERCENT, np.degrees(first.cycles("gait/ankle_angle").mean(axis=0)), **RECORDED)
    healthy = first.cycles("gait/ankle_moment").mean(axis=0) / body_mass(first.recording.scenario)
    moment.plot(PERCENT, healthy, **RECORDED)
    _over_cycle(angle, first.toe_off, "ankle angle [°]\nplantarflexion –  |  + dorsiflexion")
    _over_cycle(moment, first.toe_off, "internal ankle moment [N·m/kg]\nplantarflexion –  |  + dorsiflexion")
    angle.set_title("ankle angle", loc="left")
    moment.set_title("ankle moment", loc="left")
    _legend(figure, (angle, moment))


def draw_clearance(figure: Any, runs: list[Shown]) -> None:
    """Height of toe and ball above the floor over swing, with the minimum that counts as a dot."""
    axes = figure.subplots(1, 2, sharey=True)
    start = min(run.toe_off for run in runs)
    seen: list[np.ndarray] = []
    for axis, point in zip(axes, ("toe", "ball"), strict=True):
        dots: list[tuple[float, float, str]] = []
        for run in runs:
            height = 1e3 * run.cycles(f"{point}/height")
            _mean_and_spread(axis, height, run.colour, run.label)
            rows = np.flatnonzero(run.toe_off <= PHASE)
            lowest = rows[dip(1e-3 * height.mean(axis=0)[rows])[0]]
            dots.append((PERCENT[lowest], height.mean(axis=0)[lowest], run.colour))
        _dots(axis, dots)
        recorded = 1e3 * runs[0].cycles(f"gait/{point}_height").mean(axis=0)
        axis.plot(PERCENT, recorded, **RECORDED | {"label": "this foot, ankle as in the healthy trial"})
        _over_cycle(axis, None, f"{point} above the floor [mm]", start)
        axis.set_title(f"{point} clearance in swing", loc="left")
        seen += [
            line.get_ydata()[start <= PHASE] for line in axis.lines if len(line.get_ydata()) == len(PHASE)
        ]
    low, high = min(y.min() for y in seen), max(y.max() for y in seen)
    axes[0].set_ylim(min(low, 0.0) - 0.24 * (high - low), high + 8.0)  # with room for words
    for axis in axes:
        axis.axhspan(axis.get_ylim()[0], 0.0, color="#f3dede", lw=0.0, zorder=0)
        look = {"fontsize": 8.0, "color": "#803030"}
        told = "below the floor: a trip, where the dashed line is not"
        axis.annotate(told, (0.02, 0.02), xycoords="axes fraction", **look)
        axis.tick_params(labelleft=True)
    _legend(figure, axes)


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


def draw_pressures(figure: Any, runs: list[Shown], over_time: bool = False) -> None:
    """Pressures and, below, when each valve is open: over the gait cycle or over time, for each run."""
    across = min(len(runs), ACROSS)
    down = -(-len(runs) // across)
    axes = figure.subplots(2 * down, across, squeeze=False, height_ratios=[2.2, 1.0] * down)
    pressures, lanes = list(axes[::2].flat), list(axes[1::2].flat)
    for axis in (*pressures[len(runs) :], *lanes[len(runs) :]):
        axis.set_axis_off()
    for k, (pressure, lane, run) in enumerate(zip(pressures, lanes, runs, strict=False)):
        names = chambers(run.recording.columns)
        x, supply = _curves(run, "supply/pressure", over_time)
        pressure.plot(x, 1e-5 * supply.mean(axis=0), color="0.5", lw=0.8, ls="--", label="supply")
        for name, colour in zip(names, itertools.cycle(COLOURS), strict=False):
            x, values = _curves(run, f"chamber/{name}/pressure", over_time)
            _mean_and_spread(pressure, 1e-5 * values, colour, name, x)
        _lanes(lane, run, names, over_time)
        for axis in (pressure, lane):
            axis.set_xlim(x[0], x[-1])
            if not over_time:
                axis.axvline(100.0 * run.toe_off, color="0.6", lw=0.6, ls=":", zorder=1)
        pressure.tick_params(labelbottom=False)
        pressure.set_title(plain(run.label), loc="left", color=run.colour)
        lane.set_xlabel("time [s]" if over_time else "gait cycle [%]")
        if k % across == 0:
            pressure.set_ylabel("gauge pressure [bar]")
    _legend(figure, pressures)


def _curves(run: Shown, column: str, over_time: bool) -> tuple[np.ndarray, np.ndarray]:
    """Where to draw a column, and its curves, one in each row."""
    if not over_time:
        return PERCENT, run.cycles(column)
    time = run.recording["time"]
    rows = slice(None, None, max(1, len(time) // TIME_POINTS))
    return time[rows], run.recording[column][rows][None, :]


def _lanes(axis: Any, run: Shown, names: list[str], over_time: bool) -> None:
    """One lane for each valve, with a bar as high as its seat is open."""
    labels: list[str] = []
    for (name, (side, word)), colour in zip(
        itertools.product(names, LANES.items()), [c for c in COLOURS for _ in LANES], strict=False
    ):
        x, opening = _curves(run, f"valve/{name}_{side}/opening", over_time)
        mean = opening.mean(axis=0)
        corners = np.unique(np.r_[0, np.flatnonzero(np.diff(mean)) + 1, len(mean) - 1])
        bottom, shade = len(labels) + 0.4, 1.0 if side == "inlet" else 0.5
        top = bottom - 0.8 * mean[corners]
        axis.fill_between(x[corners], bottom, top, step="post", color=colour, alpha=shade, lw=0.0)
        labels.append(plain(f"{name} {word}"))
    axis.set_yticks(range(len(labels)), labels)
    axis.tick_params(axis="y", length=0.0)
    axis.set_ylim(len(labels) - 0.5, -0.5)


def draw_torque(figure: Any, runs: list[Shown]) -> None:
    """Torque that the patient lacks, and torque of the orthosis, over the cycle; one panel for each run."""
    across = min(len(runs), ACROSS)
    axes = figure.subplots(-(-len(runs) // across), across, sharey=True, squeeze=False)
    for axis in list(axes.flat)[len(runs) :]:
        axis.set_axis_off()
    for axis, run in zip(axes.flat, runs, strict=False):
        needed = run.cycles("gait/needed_moment").mean(axis=0)
        axis.fill_between(PERCENT, 0.0, needed, color="0.82", lw=0.0, label="needed: what the patient lacks")
        axis.plot(PERCENT, needed, color="0.45", lw=0.8)
        if run.has_orthosis:
            _mean_and_spread(axis, run.cycles(ORTHOSIS), run.colour, f"available: {run.label}")
        _over_cycle(axis, run.toe_off, "torque about the ankle [N·m]\nplantarflexion –  |  + dorsiflexion")
        axis.set_title(plain(run.label), loc="left", color=run.colour)
    for axis in axes[:, 1:].flat:
        axis.set_ylabel("")
    _legend(figure, axes.flat)


def draw_work(figure: Any, runs: list[Shown]) -> None:
    """Power of the orthosis over the cycle, and its work per stride."""
    power, work = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    for k, run in enumerate(runs):
        mass = body_mass(run.recording.scenario)
        flow = run.cycles(ORTHOSIS) * run.cycles("ankle/velocity") / mass
        _mean_and_spread(power, flow, run.colour, run.label)
        for name in ("orthosis_positive_work", "orthosis_negative_work"):
            metric = run.recording.metrics.get(name)
            if metric is None:
                continue
            value = 1e3 * metric.value
            work.barh(k, value, color=run.colour, height=0.6)
            side = "left" if value >= 0.0 else "right"
            shift = (3.0 if value >= 0.0 else -3.0, 0.0)
            work.annotate(
                f"{value:.1f}".replace("-", "−"),
                (value, k),
                xytext=shift,
                textcoords="offset points",
                ha=side,
                va="center",
                fontsize=8.0,
            )
    _over_cycle(power, runs[0].toe_off, "power of the orthosis [W/kg]\ntaken –  |  + given")
    work.axvline(0.0, color="0.4", lw=0.6)
    work.set_yticks([])
    work.set_ylim(max(len(runs), 3) - 0.4, -0.6)
    work.margins(x=0.25)
    work.set_xlabel("work per stride [mJ/kg]\ntaken –  |  + given")
    _legend(figure, (power,))


def draw_over_time(figure: Any, runs: list[Shown]) -> None:
    """The joint's angle over time, and of one run all moments about it, of several the orthosis'."""
    angle, moment = figure.subplots(2, 1, sharex=True)
    for run in runs:
        time, values = _curves(run, "ankle/angle", True)
        angle.plot(time, np.degrees(values[0]), color=run.colour, label=plain(run.label))
        every = {**MOMENTS, "load": LOAD, "biological": COLOURS[3], "ground": COLOURS[1]}
        moments = every if len(runs) == 1 else {"orthosis": run.colour}
        for name, colour in moments.items():
            if f"ankle/moment/{name}" not in run.recording.columns:
                continue
            time, values = _curves(run, f"ankle/moment/{name}", True)
            moment.plot(time, values[0], color=colour, label=name if len(runs) == 1 else plain(run.label))
    for axis in (angle, moment):
        axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    leg = runs[0].recording.scenario["leg"]
    joint, positive = map(plain, (leg["ankle"], leg.get("directions", ["dorsiflexion"])[0]))
    angle.set_ylabel(f"{joint} angle [°]\n{positive} +")
    moment.set_ylabel(f"moment about the {joint}\n[N·m], {positive} +")
    moment.set_xlabel("time [s]")
    figure.align_ylabels((angle, moment))
    _legend(figure, (angle, moment))
