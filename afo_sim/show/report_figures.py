"""The figures of a report: panels arranged for one run or several, as SVG text that stands in a page."""

import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from afo_sim.show import muscle_panels, panels, walk_panels
from afo_sim.show.run_view import Over, RunView
from afo_sim.show.style import STYLE, plain

WIDTH = 7.6  # [inch]
ACROSS = 3  # panels side by side, at most

MusclePanel = Callable[[Any, Sequence[RunView], Over], None]


@dataclass(frozen=True)
class Drawing:
    """One figure of a report, with its caption."""

    svg: str
    title: str
    text: str


def svg(name: str, size: tuple[float, float], fill: Callable[[Any], None]) -> str:
    """Draw a figure as an SVG element that needs nothing outside itself.

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


def draw_ankle(figure: Any, runs: Sequence[RunView]) -> None:
    """Ankle angle and internal moment over the gait cycle, each with the norm's band."""
    angle, moment = figure.subplots(1, 2)
    panels.angle(angle, runs, "cycle")
    walk_panels.over_cycle(angle, runs[0].toe_off, angle.get_ylabel())
    walk_panels.internal_moment(moment, runs)
    angle.set_title("ankle angle", loc="left")
    moment.set_title("ankle moment", loc="left")
    panels.legend(figure, (angle, moment))


def draw_clearance(figure: Any, runs: Sequence[RunView]) -> None:
    """Height of the outsole and of its ball above the floor in swing."""
    axes = figure.subplots(1, 2, sharey=True)
    for axis, point in zip(axes, ("toe", "ball"), strict=True):
        walk_panels.clearance(axis, runs, point)
    walk_panels.share_floor(axes, min(run.toe_off for run in runs))
    panels.legend(figure, axes)


def draw_pressures(figure: Any, runs: Sequence[RunView], over: Over = "cycle") -> None:
    """Pressures and, below, valves of each run: over the gait cycle or over time."""
    across = min(len(runs), ACROSS)
    down = -(-len(runs) // across)
    axes = figure.subplots(2 * down, across, squeeze=False, height_ratios=[2.2, 1.0] * down)
    upper, lower = list(axes[::2].flat), list(axes[1::2].flat)
    for axis in (*upper[len(runs) :], *lower[len(runs) :]):
        axis.set_axis_off()
    for k, (pressure, lanes, run) in enumerate(zip(upper, lower, runs, strict=False)):
        panels.pressures(pressure, [run], over)
        panels.valves(lanes, [run], over)
        x, _ = run.curves("supply/pressure", over)
        for axis in (pressure, lanes):
            axis.set_xlim(x[0], x[-1])
            if over == "cycle":
                walk_panels.mark_toe_off(axis, run.toe_off)
        pressure.tick_params(labelbottom=False)
        pressure.set_title(plain(run.label), loc="left", color=run.colour)
        lanes.set_xlabel("time [s]" if over == "time" else "gait cycle [%]")
        lanes.set_ylabel("")
        if k % across:
            pressure.set_ylabel("")
    panels.legend(figure, upper)


def draw_muscles(figure: Any, runs: Sequence[RunView], over: Over = "cycle") -> None:
    """Of each run, a column: contraction and force of its muscles, and how far cuff and plate give."""
    across = min(len(runs), ACROSS)
    down = -(-len(runs) // across)
    rows = muscle_rows(runs)
    axes = figure.subplots(len(rows) * down, across, squeeze=False, sharex="col" if down == 1 else False)
    for axis in axes.flat:
        axis.set_axis_off()
    for k, run in enumerate(runs):
        column = axes[len(rows) * (k // across) : len(rows) * (k // across + 1), k % across]
        _draw_muscles(column, run, over)
        if k % across:
            for axis in column:
                axis.set_ylabel("")
    figure.align_ylabels(axes)
    panels.legend(figure, axes.flat)


def muscle_rows(runs: Sequence[RunView]) -> list[MusclePanel]:
    """The panels of muscles that any of some runs has."""
    rows: list[MusclePanel] = [muscle_panels.contractions, panels.forces]
    if any(run.anchors for run in runs):
        rows += [muscle_panels.displacements, muscle_panels.pulls]
    return rows


def _draw_muscles(axes: Sequence[Any], run: RunView, over: Over) -> None:
    """The panels of one run, from the top; those that it has not are left empty."""
    for axis, draw in zip(axes, muscle_rows([run]), strict=False):
        axis.set_axis_on()
        draw(axis, [run], over)
        x, _ = run.curves("supply/pressure", over)
        axis.set_xlim(x[0], x[-1])
        if over == "cycle":
            walk_panels.mark_toe_off(axis, run.toe_off)
        last = axis
        axis.tick_params(labelbottom=False)
    axes[0].set_title(plain(run.label), loc="left", color=run.colour)
    last.tick_params(labelbottom=True)
    last.set_xlabel("time [s]" if over == "time" else "gait cycle [%]")


def draw_torque(figure: Any, runs: Sequence[RunView]) -> None:
    """Torque that the patient lacks, and torque of the orthosis; one panel for each run."""
    across = min(len(runs), ACROSS)
    axes = figure.subplots(-(-len(runs) // across), across, sharey=True, squeeze=False)
    for axis in list(axes.flat)[len(runs) :]:
        axis.set_axis_off()
    for axis, run in zip(axes.flat, runs, strict=False):
        walk_panels.torque(axis, run)
    for axis in axes[:, 1:].flat:
        axis.set_ylabel("")
    panels.legend(figure, axes.flat)


def draw_work(figure: Any, runs: Sequence[RunView]) -> None:
    """Power of the orthosis over the cycle, and its work per stride."""
    power, work = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    walk_panels.power(power, runs)
    walk_panels.work(work, runs)
    panels.legend(figure, (power,))


def draw_over_time(figure: Any, runs: Sequence[RunView]) -> None:
    """The joint's angle over time, and of one run all moments about it, of several the orthosis'."""
    axes = angle, moment = figure.subplots(2, 1, sharex=True)
    panels.angle(angle, runs)
    panels.moments(moment, runs)
    moment.set_xlabel("time [s]")
    figure.align_ylabels(axes)
    panels.legend(figure, axes)


ANKLE = (
    "Ankle angle and whole internal ankle moment",
    "Grey: the spread of published means (of laboratories, not of people): four of the angle, two of the "
    "moment, children's among them. Dashed: the recorded healthy walker. The moment is the sum of muscles, "
    "tissue and orthosis.",
)
CLEARANCE = (
    "Height of the outsole above the floor in swing",
    "Left the lowest of heel, ball, pulp and tip, right the ball alone, from toe-off to heel strike, above "
    "the floor on which the same outsole stands flat. The dot is the clearance: the minimum while the foot's "
    "forward speed is in its upper quartile. The band is that of the toes' extension in swing, which is "
    "assumed. Dashed: the same foot moved as the healthy walker's.",
)
PRESSURES = (
    "Pressures and valves",
    "Pressure in each chamber above the surrounding air, and the opening of its valves.",
)
MUSCLES = (
    "Muscles, cuff and plate",
    "Contraction: solid the muscle's own, dotted where it is slack; thin that which its path would give on "
    "a rigid cable, cuff and plate. Where a muscle is shorter than its path asks, they give; where it is "
    "longer, its cable hangs slack. The mounting gives along the pull of all muscles on it.",
)
TORQUE = (
    "Torque needed and torque available",
    "Needed: the torque of a healthy ankle's muscles in this walking, less the torque that the patient's own "
    "muscles still give. Orthosis torque outside the grey area is not needed there.",
)
WORK = (
    "Power and work of the orthosis",
    "Torque times ankle velocity, per kilogram of body mass: given to the ankle, or taken from it as by a "
    "brake.",
)
TIME = ("Angle and moments over time", "Of several runs, the moment is the orthosis'.")


def figures_over_cycle(runs: Sequence[RunView]) -> Iterator[Drawing]:
    """The figures of runs that walk at least one whole stride."""
    worn = [run for run in runs if run.has_orthosis]
    yield _figure("ankle", 3.3, draw_ankle, runs, ANKLE)
    yield _figure("clearance", 3.3, draw_clearance, runs, CLEARANCE)
    if worn:
        yield _figure("pressures", _tall(worn, 3.6), draw_pressures, worn, PRESSURES)
        yield _figure("muscles", _muscles_tall(worn), draw_muscles, worn, MUSCLES)
    yield _figure("torque", _tall(runs, 3.0), draw_torque, runs, TORQUE)
    if worn:
        yield _figure("work", 2.8, draw_work, worn, WORK)


def figures_over_time(runs: Sequence[RunView]) -> Iterator[Drawing]:
    """The figures of all other runs."""
    worn = [run for run in runs if run.has_orthosis]
    yield _figure("time", 4.0, draw_over_time, runs, TIME)
    if worn:
        yield _figure("air", _tall(worn, 3.6), partial(draw_pressures, over="time"), worn, PRESSURES)
        yield _figure("muscles", _muscles_tall(worn), partial(draw_muscles, over="time"), worn, MUSCLES)


def _muscles_tall(runs: Sequence[RunView]) -> float:
    return _tall(runs, 0.8 + 1.2 * len(muscle_rows(runs)))


def _tall(runs: Sequence[RunView], height: float) -> float:
    """Height of a figure with a block for each run [inch]."""
    return height * -(-len(runs) // ACROSS)


def _figure(
    name: str,
    height: float,
    draw: Callable[[Any, Sequence[RunView]], None],
    runs: Sequence[RunView],
    caption: tuple[str, str],
) -> Drawing:
    title, text = caption
    drawn = svg(name, (WIDTH, height), lambda figure: draw(figure, runs))
    return Drawing(drawn.replace("<svg ", f'<svg role="img" aria-label="{title}" ', 1), title, text)
