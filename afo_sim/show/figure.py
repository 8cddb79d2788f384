"""Recording → figures for print: a run over time, and force over contraction."""

import functools
import itertools
import pathlib
import textwrap
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import parse_quantity
from afo_sim.common.writing import replacing, together
from afo_sim.metrics.strides import stance_force
from afo_sim.model.foot import foot_of, turned
from afo_sim.model.mounting import ANKLE
from afo_sim.simulation.recording import Recording

FORMATS = ("png", "pdf", "svg")
RESOLUTION = 200  # of PNG [1/inch]
# Okabe and Ito's colours, which colour-blind readers can tell apart.
COLOURS = ("#D55E00", "#0072B2", "#E69F00", "#56B4E9", "#009E73", "#CC79A7")
MOMENTS = {"orthosis": "#000000", "passive": "#009E73", "gravity": "#CC79A7"}
WALKING_MOMENTS = {**MOMENTS, "biological": "#D55E00", "ground": "#56B4E9", "frame": "#999999"}
SOLE = {"toe": "#E69F00", "ball": "#0072B2"}  # points whose height above the floor is drawn
STANCE_FORCE = 20.0  # upward ground force from which on the foot is taken to stand [N]
LOAD = "#E69F00"
LINE_STYLES = ("-", "--", ":", "-.")  # of the muscles of a group, where they do not coincide
COINCIDENCE = 1e-3  # of the largest value: curves nearer than this are drawn as one
LOOP_POINTS = 600  # of a force-contraction curve, evenly spaced on the page
STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.xmargin": 0.0,
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "lines.linewidth": 1.3,
    "pdf.fonttype": 42,  # text stays text
}

Panel = Callable[[Any, Recording], None]  # draws on an axis


def draw_run(recording: Recording, path: pathlib.Path) -> None:
    """Draw a run on one page over time: angle, moments, pressures, valves and forces, as far as it has them.

    In walking also the height of the sole, with the time that the foot stands shaded.

    Parameters
    ----------
    recording : a finished recording
    path : file to write, whole or not at all; its suffix, one of FORMATS, is the format

    Raises
    ------
    InputError
        The recording has no rows, or the suffix is no format.
    """
    panels: list[Panel] = [_angle_panel, _moment_panel]
    panels += [_clearance_panel] if _walks(recording) else []
    panels += [_pressure_panel, _valve_panel, _force_panel] if _groups(recording) else []
    size = (7.1, 2.0 + 1.6 * len(panels) - (2.4 if _groups(recording) else 0.0))
    _draw(functools.partial(_stack, panels=tuple(panels), title=True), size, recording, path)


def draw_angle(recording: Recording, path: pathlib.Path) -> None:
    """Draw the ankle angle over time; parameters and errors as in `draw_run`."""
    _draw(functools.partial(_stack, panels=(_angle_panel,)), (3.6, 2.5), recording, path)


def draw_torque(recording: Recording, path: pathlib.Path) -> None:
    """Draw the moments about the ankle over time; parameters and errors as in `draw_run`."""
    _draw(functools.partial(_stack, panels=(_moment_panel,)), (3.6, 2.5), recording, path)


def draw_clearance(recording: Recording, path: pathlib.Path) -> None:
    """Draw the heights of toe and ball in walking; parameters and errors as in `draw_run`."""
    _draw(functools.partial(_stack, panels=(_clearance_panel,)), (3.6, 2.5), recording, path)


def draw_pressure(recording: Recording, path: pathlib.Path) -> None:
    """Draw pressures and valve openings over time; parameters and errors as in `draw_run`."""
    _draw(functools.partial(_stack, panels=(_pressure_panel, _valve_panel)), (4.7, 3.2), recording, path)


def draw_force_contraction(recording: Recording, path: pathlib.Path) -> None:
    """Draw each group's force over contraction; parameters and errors as in `draw_run`."""
    _draw(_force_contraction, (1.1 + 3.0 * len(_groups(recording)), 2.9), recording, path)


FIGURES: dict[str, Callable[[Recording, pathlib.Path], None]] = {
    "overview": draw_run,
    "angle": draw_angle,
    "torque": draw_torque,
    "clearance": draw_clearance,
    "pressure": draw_pressure,
    "force_contraction": draw_force_contraction,
}


def figures_of(recording: Recording) -> list[str]:
    """The names in FIGURES that have something to show of a run."""
    absent = set() if _walks(recording) else {"clearance"}
    absent |= set() if _groups(recording) else {"pressure", "force_contraction"}
    return [name for name in FIGURES if name not in absent]


def write_figures(recording: Recording, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write every figure that a run has as PNG and as PDF, and return the files.

    Parameters
    ----------
    recording : a finished recording
    folder : made if need be

    Raises
    ------
    InputError
        The recording has no rows.
    """
    _refuse_empty(recording)
    names = [f"{name}.{suffix}" for name, suffix in itertools.product(FIGURES, FORMATS[:2])]
    there = figures_of(recording)
    with together(folder, names) as scratch:
        for name in names:
            if pathlib.Path(name).stem in there:
                FIGURES[pathlib.Path(name).stem](recording, scratch / name)
    return [folder / name for name in names if pathlib.Path(name).stem in there]


def _refuse_empty(recording: Recording) -> None:
    if not len(recording["time"]):
        raise InputError(f"there is nothing to draw: the recording has no rows ({recording.status})")


def _draw(
    fill: Callable[[Any, Recording], None],
    size: tuple[float, float],
    recording: Recording,
    path: pathlib.Path,
) -> None:
    suffix = path.suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        raise InputError("is no format of a figure", file=path, allowed=", ".join(FORMATS))
    _refuse_empty(recording)
    import matplotlib
    from matplotlib.figure import Figure  # and not pyplot: no display, nothing global

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        fill(figure, recording)
        with replacing(path) as temporary:
            figure.savefig(temporary, format=suffix, dpi=RESOLUTION)


def _stack(
    figure: Any,
    recording: Recording,
    panels: tuple[Panel, ...],
    title: bool = False,
) -> None:
    """Panels under one another on one time axis."""
    lanes = 2 * len(recording.scenario["orthosis"]["chamber"])
    heights = [0.14 * lanes if panel is _valve_panel else 1.0 for panel in panels]
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for axis, panel in zip(axes, panels, strict=True):
        panel(axis, recording)
        if _walks(recording) and panel is not _valve_panel:
            _shade_stance(axis, recording)
        if axis.get_legend_handles_labels()[1] and title:
            axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        elif axis.get_legend_handles_labels()[1]:
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.0)
    time = recording["time"]
    if len(time) > 1:
        axes[-1].set_xlim(time[0], 2.0 * time[-1] - time[-2])  # the end of the last step
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    if title:
        texts = [str(recording.scenario["name"]), str(recording.scenario.get("description", ""))]
        texts += [] if recording.ok else [recording.status]
        lines = [line for text in texts for line in textwrap.wrap(text, 95)]
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=9.0)


def _angle_panel(axis: Any, recording: Recording) -> None:
    axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    if _walks(recording):
        recorded = np.degrees(recording["gait/ankle_angle"])
        _line(axis, recording, recorded, color="#0072B2", ls="--", lw=1.0, label="healthy, recorded")
    _line(axis, recording, np.degrees(recording["ankle/angle"]), color="black")
    axis.set_ylabel(f"{_words(recording)[0]} angle [deg]\n{_words(recording)[1]} +")
    if _groups(recording):
        _mark_range(axis, recording)


def _mark_range(axis: Any, recording: Recording) -> None:
    limits = recording.scenario["orthosis"]["range_of_motion"]
    low, high = (np.degrees(parse_quantity(limit, "rad")) for limit in limits)
    axis.axhspan(low, high, color="0.93", lw=0.0, zorder=0)
    axis.annotate(
        "orthosis' range of motion",
        (1.0, high),
        xycoords=axis.get_yaxis_transform(),
        xytext=(-4.0, -3.0),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=8.0,
        color="0.4",
    )


def _moment_panel(axis: Any, recording: Recording) -> None:
    axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    moments = WALKING_MOMENTS if _walks(recording) else MOMENTS
    moments = moments | ({"load": LOAD} if "ankle/moment/load" in recording.columns else {})
    for name, colour in moments.items():
        if name == "orthosis" and not _groups(recording):
            continue
        _line(axis, recording, recording[f"ankle/moment/{name}"], color=colour, label=name)
    axis.set_ylabel(f"{_words(recording)[0]} moment [N·m]\n{_words(recording)[1]} +")


def _clearance_panel(axis: Any, recording: Recording) -> None:
    """Heights of toe and ball, and what they would be at the recorded ankle angle."""
    axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    healthy = _healthy_heights(recording)
    for name, colour in SOLE.items():
        _line(axis, recording, 1e3 * healthy[name], color=colour, ls="--", lw=0.8)
        _line(axis, recording, 1e3 * recording[f"{name}/height"], color=colour, label=name)
    axis.plot([], [], color="0.4", ls="--", lw=0.8, label="healthy")
    axis.set_ylabel("height of the sole\nabove the floor [mm]")


def _healthy_heights(recording: Recording) -> dict[str, np.ndarray]:
    """Heights of points of the sole, were the ankle as recorded on the same shank [m]."""
    model = mujoco.MjModel.from_xml_string(recording.model_xml)
    points = foot_of(model, recording.scenario["leg"]["foot"], ANKLE).points
    pitch = recording["gait/ankle_angle"] - recording["shank/angle"]
    return {name: recording["ankle/position/z"] + turned(points[name], pitch)[1] for name in SOLE}


def _shade_stance(axis: Any, recording: Recording) -> None:
    """A band wherever the recorded foot stands, behind all else."""
    stands = np.r_[False, recording[stance_force(recording.columns)] >= STANCE_FORCE, False]
    time = np.r_[recording["time"], recording["time"][-1]]
    for start, end in np.flatnonzero(stands[1:] != stands[:-1]).reshape(-1, 2):
        axis.axvspan(time[start], time[end], color="#56B4E9", alpha=0.10, lw=0.0, zorder=-1)


def _pressure_panel(axis: Any, recording: Recording) -> None:
    supply = recording["supply/pressure"] * 1e-5
    _line(axis, recording, supply, color="0.5", lw=0.8, ls="--", label="supply")
    for name in recording.scenario["orthosis"]["chamber"]:
        pressure = recording[f"chamber/{name}/pressure"] * 1e-5
        _line(axis, recording, pressure, color=_colours(recording)[name], label=name)
    axis.set_ylabel("gauge pressure\n[bar]")


def _valve_panel(axis: Any, recording: Recording) -> None:
    """One lane per valve, with a bar as high as its seat is open."""
    chambers = list(recording.scenario["orthosis"]["chamber"])
    lanes = list(itertools.product(chambers, ("inlet", "outlet")))
    for lane, (chamber, side) in enumerate(lanes):
        opening = recording[f"valve/{chamber}_{side}/opening"]
        corners = np.unique(np.r_[0, np.flatnonzero(np.diff(opening)) + 1, len(opening) - 1])
        axis.fill_between(
            recording["time"][corners],
            lane + 0.4,
            lane + 0.4 - 0.8 * opening[corners],
            step="post",
            color=_colours(recording)[chamber],
            alpha=1.0 if side == "inlet" else 0.5,
            lw=0.0,
        )
    axis.set_ylim(len(lanes) - 0.5, -0.5)
    axis.set_yticks(range(len(lanes)), [" ".join(lane) for lane in lanes], fontsize=8.0)
    axis.tick_params(axis="y", length=0.0, labelleft=False, labelright=True)
    axis.set_ylabel("valves\nopen")


def _force_panel(axis: Any, recording: Recording) -> None:
    for group in _groups(recording):
        for label, muscle, style in _curves(recording, group, "force"):
            force = recording[f"muscle/{muscle}/force"]
            _line(axis, recording, force, color=_colours(recording)[group], ls=style, label=label)
    axis.set_ylabel("muscle force\n[N]")


def _line(axis: Any, recording: Recording, values: np.ndarray, **look: Any) -> None:
    time = recording["time"]
    axis.plot(time, values, marker="." if len(time) == 1 else None, **look)


def _force_contraction(figure: Any, recording: Recording) -> None:
    """A panel per group, the curves coloured by the pressure in their chamber."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    pressures = {g: recording[f"chamber/{c}/pressure"] * 1e-5 for g, c in _groups(recording).items()}
    top = max(np.ceil(10.0 * max(p.max() for p in pressures.values())) / 10.0, 0.1)
    palette = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.88, 256)))  # no yellow on white
    colour = ScalarMappable(Normalize(0.0, top), palette)
    axes = figure.subplots(1, len(pressures), sharey=True, squeeze=False)[0]
    for axis, (group, pressure) in zip(axes, pressures.items(), strict=True):
        curves = _curves(recording, group, "force", "contraction")
        for _, muscle, _ in curves:
            contraction = 100.0 * recording[f"muscle/{muscle}/contraction"]
            _loop(axis, contraction, recording[f"muscle/{muscle}/force"], pressure, colour)
        axis.margins(0.06)
        axis.set_title(", ".join(label for label, _, _ in curves), loc="left")
        axis.set_xlabel("contraction [%]")
    axes[0].set_ylabel("muscle force [N]")
    figure.colorbar(colour, ax=axes, label="gauge pressure [bar]", aspect=30.0)


def _loop(axis: Any, x: np.ndarray, y: np.ndarray, pressure: np.ndarray, colour: Any) -> None:
    """A curve with a dot where it starts, and arrows in the direction of time where it pulls."""
    from matplotlib.collections import LineCollection

    steps = np.hypot(np.diff(x) / (np.ptp(x) or 1.0), np.diff(y) / (np.ptp(y) or 1.0))
    way = np.r_[0.0, np.cumsum(steps)]
    even = np.searchsorted(way, np.linspace(0.0, way[-1], LOOP_POINTS))
    rows = np.unique(np.r_[even, x.argmin(), x.argmax(), y.argmin(), y.argmax()])
    points = np.column_stack([x, y])[rows]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    shades = colour.to_rgba(pressure[rows])
    axis.add_collection(LineCollection(list(segments), colors=shades[:-1], lw=1.6, capstyle="round"))
    axis.plot(*points[0], "o", ms=3.5, color=shades[0])
    pulling = np.flatnonzero(points[4:, 1] > 0.1 * max(y.max(), 1e-9))
    for k in pulling[[len(pulling) * part // 10 for part in (1, 3, 5, 7, 9)]] if len(pulling) else ():
        look = {
            "arrowstyle": "-|>",
            "color": shades[k],
            "mutation_scale": 11.0,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        }
        axis.annotate("", points[k + 4], points[k], arrowprops=look)


def _walks(recording: Recording) -> bool:
    return "gait/phase" in recording.columns


def _words(recording: Recording) -> tuple[str, str]:
    """What the joint and its positive direction are called."""
    leg = recording.scenario["leg"]
    return leg["ankle"], leg["directions"][0]


def _groups(recording: Recording) -> dict[str, str]:
    """{muscle group: its chamber}."""
    muscles = recording.scenario["orthosis"]["muscle"]
    return {name: group.get("chamber") or name for name, group in muscles.items()}


def _colours(recording: Recording) -> dict[str, str]:
    """{chamber or muscle group: its colour}; a group named as a chamber has that chamber's."""
    names = dict.fromkeys([*recording.scenario["orthosis"]["chamber"], *_groups(recording)])
    return dict(zip(names, itertools.cycle(COLOURS)))


def _curves(recording: Recording, group: str, *quantities: str) -> list[tuple[str, str, str]]:
    """[(label, muscle, line style)] to draw: one for the whole group where its muscles coincide."""
    count = recording.scenario["orthosis"]["muscle"][group]["count"]
    muscles = [f"{group}_{k}" for k in range(1, count + 1)]
    for quantity in quantities:
        values = np.array([recording[f"muscle/{muscle}/{quantity}"] for muscle in muscles])
        if np.ptp(values, axis=0).max() > COINCIDENCE * np.abs(values).max():
            labels = [f"{group} {k}" for k in range(1, count + 1)]
            return list(zip(labels, muscles, itertools.cycle(LINE_STYLES)))
    return [(group if count == 1 else f"{group} 1–{count}", muscles[0], "-")]
