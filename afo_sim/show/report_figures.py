"""The figures of a report: a panel for each quantity or run, as SVG text as wide as a telephone's page."""

import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from afo_sim.common import Foreign, optional
from afo_sim.metrics import NEEDED_MOMENT
from afo_sim.show import panels, walk_panels
from afo_sim.show.in_words import described, labelled, unescaped
from afo_sim.show.run_view import Over, RunView
from afo_sim.show.style import Axes, Figure, ink, plain, styled

WIDTH = 3.7  # of a panel [inch]; 355 CSS pixels
_KEY = (0.36, 0.13)  # of a legend's sample [inch]

_MusclePanel = Callable[[Axes, Sequence[RunView], Over], None]
Draw = Callable[[Sequence[Figure], Sequence[RunView]], None]  # on a figure for each panel
_TITLES = {  # of what the page explains
    "walk": "Toe clearance and ankle angle",
    "moment": "Whole internal ankle moment, and the ball of the foot in swing",
    "pressures": "Pressures and valves",
    "sources": "Source of air",
    "muscles": "Muscles, cuff and plate",
    "torque": "Torque needed and torque available",
    "work": "Power and work of the orthosis",
    "time": "Angle and moments over time",
}


@dataclass(frozen=True)
class _Drawing:
    """One figure of a report; `explained` names the parts of its caption that the page has."""

    panels: tuple[str, ...]
    keys: tuple[tuple[str, str], ...]
    explained: tuple[str, ...]

    @property
    def title(self) -> str:
        """Of what it shows."""
        return _TITLES[self.explained[0]]


def svg(name: str, title: str, figure: Figure, words: str = "") -> str:
    """A panel as an SVG element that states its title, and its curves or other words."""
    return labelled(_text(name, figure), name, title, words or described(figure))


def _text(name: str, figure: Figure) -> str:
    """A figure as an SVG element without size, whose ids begin with a name."""
    page = io.StringIO()
    figure.savefig(page, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = page.getvalue()
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{name}-", text)
    return re.sub(r'\b(width|height)="[\d.]+pt" ?', "", text, count=2)


def _sample(name: str, handle: Foreign) -> str:
    """What a legend shows of a line or an area, as SVG text."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=_KEY)
    if isinstance(handle, Line2D):
        line = Line2D([0.0, 0.5, 1.0], [0.5, 0.5, 0.5])
        line.update_from(handle)
        line.set(transform=figure.transFigure, markevery=[1], linewidth=max(handle.get_linewidth(), 1.0))
        line.set(clip_on=False, clip_path=None)
        figure.add_artist(line)
    else:
        colour = np.ravel(handle.get_facecolor())
        figure.add_artist(Rectangle((0.0, 0.1), 1.0, 0.8, color=colour, lw=0.0, transform=figure.transFigure))
    return _text(name, figure).replace("<svg ", '<svg class="key" aria-hidden="true" ', 1)


def draw_walk(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """What a reader looks at first: the outsole above the floor in swing, and the ankle angle."""
    toe, angle = (figure.subplots() for figure in figures)
    _clearance(toe, runs, "toe")
    toe.set_ylabel("above the floor [mm]")
    panels.angle(angle, runs, "cycle")
    walk_panels.over_cycle(angle, runs[0].toe_off, "dorsiflexion + [deg]")
    angle.set_title("ankle angle", loc="left")


def draw_moment(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """Internal moment over the gait cycle with the norm's band, and the ball of the foot above the floor."""
    moment, ball = (figure.subplots() for figure in figures)
    walk_panels.internal_moment(moment, runs)
    moment.set_title("ankle moment", loc="left")
    _clearance(ball, runs, "ball")


def _clearance(axis: Axes, runs: Sequence[RunView], point: str) -> None:
    walk_panels.clearance(axis, runs, point)
    walk_panels.share_floor(axis, min(run.toe_off for run in runs))


def draw_pressures(figures: Sequence[Figure], runs: Sequence[RunView], over: Over = "cycle") -> None:
    """Pressures and, below, valves of each run: over the gait cycle or over time."""
    flowing = any(panels.has_flow(run) for run in runs)
    for figure, run in zip(figures, runs, strict=True):
        heights = [2.2, 1.2, 1.0] if flowing else [2.2, 1.0]
        pressure, *between, lanes = figure.subplots(len(heights), 1, height_ratios=heights, sharex=True)
        panels.pressures(pressure, [run], over)
        panels.valves(lanes, [run], over)
        for axis in between:
            panels.air_flow(axis, [run], over) if panels.tells_flow(run) else axis.set_axis_off()
        for axis in (pressure, *between, lanes):
            _over(axis, run, over)
        pressure.set_title(plain(run.label), loc="left", color=ink(run.colour))
        lanes.set(xlabel="time [s]" if over == "time" else "gait cycle [%]", ylabel="")
    panels.share_scale([figure.axes[0] for figure in figures])
    if flowing:
        drawn = zip(figures, runs, strict=True)
        panels.share_scale([figure.axes[1] for figure, run in drawn if panels.tells_flow(run)])


def draw_sources(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """What is in the bottle, cartridge or tank of each run, over time."""
    for figure, quantity in zip(figures, panels.QUANTITIES, strict=True):
        axis = figure.subplots()
        for run in runs:
            panels.source(axis, run, quantity)
        axis.set_xlabel("time [s]")
        axis.margins(y=0.1)


def draw_muscles(figures: Sequence[Figure], runs: Sequence[RunView], over: Over = "cycle") -> None:
    """Of each run, a column: contraction and force of its muscles, and how far cuff and plate give."""
    every = [figure.subplots(len(muscle_rows(runs)), 1) for figure in figures]
    for figure, axes, run in zip(figures, every, runs, strict=True):
        drawn = muscle_rows([run])
        for axis, draw in zip(axes, drawn, strict=False):
            draw(axis, [run], over)
            _over(axis, run, over)
            axis.tick_params(labelbottom=False)
        for axis in axes[len(drawn) :]:
            axis.set_axis_off()
        axes[0].set_title(plain(run.label), loc="left", color=ink(run.colour))
        last = axes[len(drawn) - 1]
        last.tick_params(labelbottom=True)
        last.set_xlabel("time [s]" if over == "time" else "gait cycle [%]")
        figure.align_ylabels(axes)
    for row in zip(*every, strict=True):
        panels.share_scale([axis for axis in row if axis.axison])


def _over(axis: Axes, run: RunView, over: Over) -> None:
    x, _ = run.curves("supply/pressure", over)
    axis.set_xlim(x[0], x[-1])
    if over == "cycle":
        walk_panels.mark_toe_off(axis, run.toe_off)


def muscle_rows(runs: Sequence[RunView]) -> list[_MusclePanel]:
    """The panels of muscles that any of some runs has."""
    rows: list[_MusclePanel] = [panels.contractions, panels.forces]
    if any(run.anchors for run in runs):
        rows += [panels.displacements, panels.pulls]
    return rows


def draw_torque(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """Torque that the patient lacks, and torque of the orthosis; one panel for each run."""
    axes = [figure.subplots() for figure in figures]
    for axis, run in zip(axes, runs, strict=True):
        walk_panels.torque(axis, run)
    panels.share_scale(axes)


def draw_work(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """Power of the orthosis over the cycle, and its work per stride."""
    for figure, draw in zip(figures, (walk_panels.power, walk_panels.work), strict=True):
        draw(figure.subplots(), runs)


def draw_over_time(figures: Sequence[Figure], runs: Sequence[RunView]) -> None:
    """The joint's angle over time, and of one run all moments about it, of several the orthosis'."""
    angle, moment = (figure.subplots() for figure in figures)
    panels.angle(angle, runs)
    panels.moments(moment, runs)
    for axis in (angle, moment):
        axis.set_xlabel("time [s]")


def figures_over_cycle(runs: Sequence[RunView]) -> Iterator[_Drawing]:
    """The figures of runs that walk at least one whole stride."""
    worn = [run for run in runs if run.has_orthosis]
    yield _figure("walk", 2, 1.9, draw_walk, runs, "walk")
    yield _figure("moment", 2, 2.6, draw_moment, runs, "moment")
    if worn:
        yield _pressures("pressures", worn, "cycle")
        yield _figure("muscles", len(worn), _muscles_tall(worn), draw_muscles, worn, "muscles")
    known = [run for run in runs if run.has_orthosis or NEEDED_MOMENT in run.recording.columns]
    if known:
        yield _figure("torque", len(known), 2.8, draw_torque, known, "torque")
    if worn:
        yield _figure("work", 2, 2.6, draw_work, worn, "work")
    yield from _sources(runs)


def figures_over_time(runs: Sequence[RunView]) -> Iterator[_Drawing]:
    """The figures of all other runs."""
    worn = [run for run in runs if run.has_orthosis]
    yield _figure("time", 2, 2.6, draw_over_time, runs, "time")
    if worn:
        yield _pressures("air", worn, "time")
        draw = partial(draw_muscles, over="time")
        yield _figure("fibres", len(worn), _muscles_tall(worn), draw, worn, "muscles")
    yield from _sources(runs)


def _pressures(name: str, runs: Sequence[RunView], over: Over) -> _Drawing:
    """Pressures and valves, with the air's flow where any run has an air path."""
    flowing = any(panels.has_flow(run) for run in runs)
    height, explained = (4.2, ("pressures", "flow")) if flowing else (3.1, ("pressures",))
    return _figure(name, len(runs), height, partial(draw_pressures, over=over), runs, *explained)


def _sources(runs: Sequence[RunView]) -> Iterator[_Drawing]:
    with_source = [run for run in runs if run.source]
    if with_source:
        kind = "walked" if with_source[0].walks else "sat"
        yield _figure(f"sources-{kind}", 3, 2.2, draw_sources, with_source, "sources")


def _muscles_tall(runs: Sequence[RunView]) -> float:
    """Height of a column of muscles' panels [inch]."""
    return 0.7 + 1.15 * len(muscle_rows(runs))


def _figure(
    name: str, count: int, height: float, draw: Draw, runs: Sequence[RunView], *explained: str
) -> _Drawing:
    """Draw panels that need nothing outside themselves, and their common legend; units: height [inch]."""
    make = optional("matplotlib.figure").Figure  # and not pyplot: no display, nothing global
    with styled(**{"svg.fonttype": "path", "svg.hashsalt": name}):
        figures = [make(figsize=(WIDTH, height), layout="constrained") for _ in range(count)]
        draw(figures, runs)
        drawn = tuple(svg(f"{name}{k}", _TITLES[explained[0]], figure) for k, figure in enumerate(figures, 1))
        found = panels.keys(axis for figure in figures for axis in figure.axes)
        samples = [_sample(f"{name}-key{k}", handle) for k, handle in enumerate(found.values(), 1)]
    return _Drawing(drawn, tuple(zip(samples, map(unescaped, found), strict=True)), explained)
