"""Recording → figures for print: a run over time, and force over contraction."""

import dataclasses
import itertools
import pathlib
from collections.abc import Callable, Sequence

import numpy as np

from afo_sim.common import Foreign, InputError, together
from afo_sim.control import CONTROLLER_COLUMNS
from afo_sim.show import panels, walk_panels
from afo_sim.show import style as theme
from afo_sim.show.panels import shade_stance
from afo_sim.show.run_view import RunView, alone
from afo_sim.show.style import Axes
from afo_sim.simulation import SENSOR, Recording

_PLAIN = tuple(f"controller/{name}" for name, (unit, _) in CONTROLLER_COLUMNS.items() if unit == "")
_LEAST_SPAN = 1.0  # that an axis of contractions shows [%]
_LOOP_POINTS = 600  # of a force-contraction curve, evenly spaced on the page
_SMALL = (3.6, 2.5)  # of a figure of one panel [inch]

_Panel = Callable[[Axes, list[RunView]], None]  # draws on an axis


def plain_numbers(recording: Recording) -> list[str]:
    """Columns of a controller, and of sensors, that are plain numbers."""
    read = (name for name in recording.columns if name.startswith(SENSOR))
    sensors = [name for name in read if recording.describe(name)[0] == ""]
    return [name for name in _PLAIN if name in recording.columns] + sensors


def electronics(axis: Axes, runs: Sequence[RunView]) -> None:
    """Numbers from the electronics of a run: state, phase, output, activation, switches."""
    run = runs[0]
    styles = itertools.cycle(zip(theme.COLOURS, itertools.cycle(theme.LINE_STYLES)))
    for name, (colour, style) in zip(plain_numbers(run.recording), styles, strict=False):
        values = run.recording[name]
        if np.isfinite(values).any():
            label = theme.plain(name.removeprefix("controller/"))
            look = {"where": "post", "color": colour, "ls": style, "lw": 0.9, "label": label}
            axis.step(run.recording["time"], values, **look)
    axis.set_ylabel("electronics\n[1]")
    shade_stance(axis, run)


def draw_run(recording: Recording, *paths: pathlib.Path) -> None:
    """Draw a run on one page over time, as far as it has them, into one file or several."""
    run = alone(recording)
    rows: list[_Panel] = [panels.angle, panels.moments]
    rows += [panels.sole] if run.walks else []
    if run.groups:
        rows += [panels.pressures, *flows(run), panels.valves, panels.forces, panels.contractions]
    rows += [panels.displacements] if run.anchors else []
    rows += [electronics] if plain_numbers(recording) else []
    _stack(run, paths, (7.1, 2.0 + 1.6 * len(rows) - (2.4 if run.groups else 0.0)), rows, title=True)


def _draw_panels(recording: Recording, paths: Sequence[pathlib.Path], *rows: _Panel) -> None:
    _stack(alone(recording), paths, (_SMALL[0], 0.9 + (_SMALL[1] - 0.9) * len(rows)), rows)


def draw_in_short(recording: Recording, path: pathlib.Path) -> None:
    """Draw angle and clearance of a walk over one gait cycle, angle and moments of another run over time."""
    run = alone(recording)
    _refuse_empty(recording)
    if not (run.walks and run.strides):
        _draw_panels(recording, [path], panels.angle, panels.moments)
        return
    run = dataclasses.replace(run, label=str(recording.described["name"]))
    with theme.new_figure(path, (7.1, 3.2)) as figure:
        angle, toe = figure.subplots(1, 2)
        panels.angle(angle, [run], "cycle")
        walk_panels.over_cycle(angle, run.toe_off, angle.get_ylabel())
        walk_panels.clearance(toe, [run], "toe")
        walk_panels.share_floor(toe, run.toe_off)
        panels.legend(figure, [angle, toe], columns=2)


def draw_pressure(recording: Recording, *paths: pathlib.Path) -> None:
    """Draw pressures and valve openings over time; parameters and errors as in `draw_run`."""
    run = alone(recording)
    rows = [panels.pressures, *flows(run), panels.valves]
    _stack(run, paths, (4.7, 0.8 + 1.2 * len(rows)), rows)


def draw_muscles(recording: Recording, *paths: pathlib.Path) -> None:
    """Draw contraction and force of the muscles over time, what cuff and plate give, and under which pull."""
    run = alone(recording)
    rows: list[_Panel] = [panels.contractions, panels.forces]
    rows += [panels.displacements, panels.pulls] if run.anchors else []
    _stack(run, paths, (7.1, 0.8 + 1.6 * len(rows)), rows, title=True)


def draw_force_contraction(recording: Recording, *paths: pathlib.Path) -> None:
    """Draw each group's force over its muscles' own contraction; parameters and errors as in `draw_run`."""
    run = alone(recording)
    _refuse_empty(recording)
    with theme.new_figure(paths[0], (1.1 + 3.0 * len(run.groups), 2.9), *paths[1:]) as figure:
        _force_contraction(figure, run)


def flows(run: RunView) -> list[_Panel]:
    """The panel of the air's flow, where a run has an air path."""
    return [_air_flow] if panels.has_flow(run) else []


def _air_flow(axis: Axes, runs: list[RunView]) -> None:
    panels.air_flow(axis, runs)
    panels.shade_stance(axis, runs[0])


FIGURES: dict[str, Callable[..., None]] = {  # of a recording, and the files to write
    "overview": draw_run,
    "angle": lambda recording, *paths: _draw_panels(recording, paths, panels.angle),
    "torque": lambda recording, *paths: _draw_panels(recording, paths, panels.moments),
    "clearance": lambda recording, *paths: _draw_panels(recording, paths, panels.sole),
    "pressure": draw_pressure,
    "muscles": draw_muscles,
    "force_contraction": draw_force_contraction,
}


def figures_of(recording: Recording) -> list[str]:
    """The names in FIGURES that have something to show of a run."""
    run = alone(recording)
    absent = set() if run.walks else {"clearance"}
    absent |= set() if run.groups else {"pressure", "muscles", "force_contraction"}
    return [name for name in FIGURES if name not in absent]


def write_figures(recording: Recording, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write every figure that a run has as PNG and as PDF, and return the files."""
    _refuse_empty(recording)
    pairs = {name: [f"{name}.{suffix}" for suffix in theme.FORMATS[:2]] for name in FIGURES}
    there = figures_of(recording)
    with together(folder, [*itertools.chain(*pairs.values())]) as scratch:
        for name in there:
            FIGURES[name](recording, *(scratch / file for file in pairs[name]))
    return [folder / file for name in there for file in pairs[name]]


def _refuse_empty(recording: Recording) -> None:
    if not len(recording["time"]):
        raise InputError(f"there is nothing to draw: the recording has no rows ({recording.status})")


def _stack(
    run: RunView, paths: Sequence[pathlib.Path], size: tuple[float, float], rows: Sequence[_Panel], *,
    title: bool = False,
) -> None:  # fmt: skip
    """Draw panels under one another on one time axis."""
    recording = run.recording
    _refuse_empty(recording)
    with theme.new_figure(paths[0], size, *paths[1:]) as figure:
        heights = [0.14 * len(run.lanes) if panel is panels.valves else 1.0 for panel in rows]
        axes = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for axis, panel in zip(axes, rows, strict=True):
            panel(axis, [run])
            if panel is panels.valves:
                axis.tick_params(axis="y", labelleft=False, labelright=True)
            if axis.get_legend_handles_labels()[1] and title:
                axis.legend(**theme.BESIDE)
        time = recording["time"]
        if len(time) > 1:
            axes[-1].set_xlim(time[0], 2.0 * time[-1] - time[-2])  # the end of the last step
        axes[-1].set_xlabel("time [s]")
        figure.align_ylabels(axes)
        if not title:
            panels.legend(figure, axes)
            return
        texts = [str(recording.described["name"]), str(recording.described.get("description", ""))]
        texts += [] if recording.ok else [recording.status]
        figure.suptitle(theme.paragraph(*texts), x=0.01, ha="left", fontsize=9.0)


def _force_contraction(figure: Foreign, run: RunView) -> None:
    """A panel per group, the curves coloured by the pressure in their chamber."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    recording = run.recording
    pressures = {g: recording[f"chamber/{c}/pressure"] * 1e-5 for g, c in run.groups.items()}
    top = max(np.ceil(10.0 * max(p.max() for p in pressures.values())) / 10.0, 0.1)
    palette = ListedColormap(theme.on_scale(np.linspace(0.0, 1.0, 256)))  # nothing pale on white
    colour = ScalarMappable(Normalize(0.0, top), palette)
    axes = figure.subplots(1, len(pressures), sharey=True, squeeze=False)[0]
    for axis, (group, pressure) in zip(axes, pressures.items(), strict=True):
        curves = panels.group_curves(run, group, "force", "contraction")
        for _, muscle, _ in curves:
            contraction = 100.0 * recording[f"muscle/{muscle}/contraction"]
            _loop(axis, contraction, recording[f"muscle/{muscle}/force"], pressure, colour, run.first_solved)
        axis.margins(0.06)
        low, high = axis.get_xlim()
        if high - low < _LEAST_SPAN:  # a muscle that never leaves its rest
            axis.set_xlim(0.5 * (low + high - _LEAST_SPAN), 0.5 * (low + high + _LEAST_SPAN))
        axis.set_title(", ".join(label for label, _, _ in curves), loc="left")
        axis.set_xlabel("contraction [%]")
    axes[0].set_ylabel("muscle force [N]")
    figure.colorbar(colour, ax=axes, label="gauge pressure [bar]", aspect=30.0)


def _loop(
    axis: Axes, x: np.ndarray, y: np.ndarray, pressure: np.ndarray, colour: Foreign, gap: int | None
) -> None:
    """A curve with a dot at its start, arrows in time's direction where it pulls, a gap before a row."""
    from matplotlib.collections import LineCollection

    steps = np.hypot(np.diff(x) / (np.ptp(x) or 1.0), np.diff(y) / (np.ptp(y) or 1.0))
    way = np.r_[0.0, np.cumsum(steps)]
    even = np.searchsorted(way, np.linspace(0.0, way[-1], _LOOP_POINTS))
    rows = np.unique(np.r_[even, x.argmin(), x.argmax(), y.argmin(), y.argmax()])
    points = np.column_stack([x, y])[rows]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    shades = colour.to_rgba(pressure[rows])
    whole = np.full(len(segments), True) if gap is None else (rows[:-1] >= gap) | (rows[1:] < gap)
    parts, colours = list(segments[whole]), shades[:-1][whole]
    axis.add_collection(LineCollection(parts, colors=colours, lw=1.6, capstyle="round"))
    axis.plot(*points[0], "o", ms=3.5, color=shades[0])
    pulling = np.flatnonzero(points[4:, 1] > 0.1 * max(y.max(), 1e-9))
    for k in pulling[[len(pulling) * part // 10 for part in (1, 3, 5, 7, 9)]] if len(pulling) else ():
        look = {"arrowstyle": "-|>", "color": shades[k], "mutation_scale": 11.0}
        axis.annotate("", points[k + 4], points[k], arrowprops=look | {"shrinkA": 0.0, "shrinkB": 0.0})
