"""The panels of figures and reports: each draws one quantity of one run, or of several, on an axis."""

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from afo_sim.common import JsonDict, parse_quantity
from afo_sim.description import WORN
from afo_sim.gait import norm as gait_norm
from afo_sim.show import style as theme
from afo_sim.show.run_view import PERCENT, PHASE, SET_PRESSURE, Over, RunView
from afo_sim.show.style import Axes, Figure, LineStyle

_MARKER_EVERY = 0.13  # of the axis' diagonal, from marker to marker
_UNKNOWN = "uncertainty"
UNKNOWN_LABEL = "5–95 % of what is not known"
_UNKNOWN_DASHES = (0, (1.5, 1.5))
HEALTHY = {"color": "black", "lw": 1.0, "ls": (0, (3, 2)), "zorder": 4}  # line of who walked
NORM_LABEL = "norm: published means"
_COINCIDENCE = 1e-3  # of the largest value: curves nearer than this are drawn as one
_STILL = 1e-6  # range below which an angle is no motion [deg]
_LEAST_SPAN = 0.1  # that an axis of angles shows [deg]
_STANCE = "stance"  # of the recorded foot, told once in a figure
_SETTLED = "settled"  # beside the line at which settled strides begin
_REFERENCE = "controller/reference"
_OF_WALKING = ("biological", "ground", "frame")  # moments that are left out elsewhere, where they are zero
# The air before and behind the chambers: volumes, flow of the supply, the source.
_THIN = 0.75  # of the lines of volumes beside chambers
_VALVE_END = (0, (4, 1.5))  # of the line of a tube's other end, in its chamber's colour
_NETWORK = ("volume/", "store/", "restriction/")  # begin the columns of an air path
FLOWS = {  # of an orthosis' air: name, colour, style
    "supply/mass_flow": ("from the supply", theme.BLUE, "-"),
    "exhaust/mass_flow": ("to the ambient air", theme.ORANGE, (0, (3, 1))),
}
_ALIKE = 1e-3  # of the set pressure: a supply that stays this near to it is drawn once
PER_MINUTE = 6e4  # l/min in a m³/s
_ICE = 273.15  # [K]
QUANTITIES = ("pressure", "mass", "temperature")  # of a source
# Muscles and what they depend on: own contraction beside the path's, cuff and plate.
_PATH = {"lw": 0.7, "zorder": 2.5}  # a path beside a muscle's own line
_SLACK = ":"  # line style of a muscle that pulls on nothing


def mean_and_spread(
    axis: Axes,
    values: np.ndarray,
    colour: str,
    label: str | None,
    x: np.ndarray,
    style: LineStyle = "-",
    marker: str | None = None,
) -> None:
    """Mean of the strides as a line, lowest to highest as a band; one row is a line."""
    if len(values) > 1:
        low, high = values.min(axis=0), values.max(axis=0)
        axis.fill_between(x, low, high, color=colour, alpha=0.25, lw=0.0, zorder=2)
    axis.plot(x, values.mean(axis=0), color=colour, ls=style, label=label, zorder=3, **marked(x, marker))


def marked(x: np.ndarray, marker: str | None) -> JsonDict:
    """Markers of a line at every MARKER_EVERY of the axis' width; a dot for a single row."""
    if len(x) == 1:
        return {"marker": "."}
    return {"marker": marker, "markevery": _MARKER_EVERY, "ms": 3.2} if marker else {}


def unknown_band(
    axis: Axes, run: RunView, column: str, scale: float = 1.0, colour: str | None = None
) -> None:
    """5 to 95 % of a column over the gait cycle, light, with dotted edges; nothing where none were drawn."""
    study = run.recording.studies.get(_UNKNOWN) or {}
    curves = study.get("curves", {}).get(column)
    if curves is None:
        return
    low, _, high = (np.interp(PHASE, study["phase"], scale * np.array(quantile)) for quantile in curves)
    paint = run.colour if colour is None else colour
    axis.fill_between(PERCENT, low, high, color=paint, alpha=0.1, lw=0.0, zorder=1.5, label=UNKNOWN_LABEL)
    for edge in (low, high):
        axis.plot(PERCENT, edge, color=paint, lw=0.7, ls=_UNKNOWN_DASHES, zorder=1.6)


def angle(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Ankle angle, with the recorded one in walking, the norm's band over the cycle."""
    first = runs[0]
    axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
    if over == "cycle":
        low, high = (np.degrees(gait_norm.read().at(f"ankle_{end}", PHASE)) for end in ("low", "high"))
        axis.fill_between(PERCENT, low, high, color=theme.NORM, lw=0.0, zorder=0, label=NORM_LABEL)
    for run in runs:
        x, values = run.curves("ankle/angle", over)
        mean_and_spread(axis, np.degrees(values), run.colour, run.name or "simulated", x, run.style)
        if over == "cycle":
            unknown_band(axis, run, "ankle/angle", 180.0 / np.pi)
    if first.walks and (over == "cycle" or len(runs) == 1):
        x, values = first.curves("gait/ankle_angle", over)
        axis.plot(x, np.degrees(values.mean(axis=0)), **HEALTHY, label=first.recorded)
    if over == "time" and len(runs) == 1 and _REFERENCE in first.recording.columns:
        look = {"where": "post", "color": theme.GREY, "lw": 0.8, "ls": ":", "label": "asked for"}
        axis.step(first.recording["time"], np.degrees(first.recording[_REFERENCE]), **look)
    signs = "plantarflexion –  |  + dorsiflexion" if over == "cycle" else f"{first.positive} +"
    axis.set_ylabel(f"{first.joint} angle [deg]\n{signs}")
    if over == "time":
        # rounding errors of a joint that does not move fill no axis, and a word says that it is still
        if max(np.ptp(np.degrees(run.recording["ankle/angle"])) for run in runs) < _STILL:
            axis.annotate("does not move", (0.5, 0.08), xycoords="axes fraction", ha="center", color="0.4")
        low, high = axis.get_ylim()
        if high - low < _LEAST_SPAN:
            axis.set_ylim(0.5 * (low + high - _LEAST_SPAN), 0.5 * (low + high + _LEAST_SPAN))
        if len(runs) == 1:
            shade_stance(axis, first)
        if len(runs) == 1 and first.groups:
            limits = first.recording.described["orthosis"]["range_of_motion"]
            low, high = (np.degrees(parse_quantity(limit, "rad")) for limit in limits)
            axis.axhspan(low, high, color="0.93", lw=0.0, zorder=0, label="orthosis' range of motion")


def moments(axis: Axes, runs: Sequence[RunView]) -> None:
    """Moments about the joint over time: of one run all of them, of several the orthosis'."""
    first = runs[0]
    axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
    single = len(runs) == 1
    for run in runs:
        for name, colour in theme.MOMENTS.items() if single else [("orthosis", run.colour)]:
            absent = name == "orthosis" and not run.has_orthosis
            if absent or f"ankle/moment/{name}" not in run.recording.columns:
                continue
            time, values = run.curves(f"ankle/moment/{name}", "time")
            if name in _OF_WALKING and not run.walks and not values.any():
                continue
            style = theme.MOMENT_STYLES.get(name, "-") if single else run.style
            mean_and_spread(axis, values, colour, name if single else run.name, time, style)
    axis.set_ylabel(f"{first.joint} moment [N·m]\n{first.positive} +")
    if single:
        shade_stance(axis, first)


def sole(axis: Axes, runs: Sequence[RunView]) -> None:
    """Heights of toe and ball over time, and the same foot's at the recorded ankle angle."""
    run = runs[0]
    time = run.recording["time"]
    axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
    for (name, colour), style in zip(theme.SOLE.items(), theme.LINE_STYLES, strict=False):
        axis.plot(time, 1e3 * run.recording[f"gait/{name}_height"], color=colour, ls=":", lw=0.8)
        mean_and_spread(axis, 1e3 * run.recording[f"{name}/height"][None, :], colour, name, time, style)
    axis.plot([], [], color=theme.GREY, ls=":", lw=0.8, label=run.recorded)
    axis.set_ylabel("height of the sole\nabove the floor [mm]")
    shade_stance(axis, run)


def pressures(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Pressure of the supply and of each chamber of a run; thin, those of volumes in its air path."""
    run = runs[0]
    wanted, had = (run.recording.columns.get(name) for name in (SET_PRESSURE, "supply/pressure"))
    # what the supply is set to, where it does not hold it
    if wanted is not None and np.abs(wanted - had).max(initial=0.0) > _ALIKE * np.abs(wanted).max(initial=0):
        x, values = run.curves(SET_PRESSURE, over)
        axis.plot(x, 1e-5 * values.mean(axis=0), color=theme.GREY, lw=_THIN, ls=":", label="supply, set")
    x, supply = run.curves("supply/pressure", over)
    axis.plot(x, 1e-5 * supply.mean(axis=0), color=theme.GREY, lw=0.8, ls="--", label="supply")
    for name in run.chambers:
        x, values = run.curves(f"chamber/{name}/pressure", over)
        mean_and_spread(
            axis, 1e-5 * values, run.colours[name], theme.plain(name), x, marker=run.markers[name]
        )
        if over == "cycle":
            unknown_band(axis, run, f"chamber/{name}/pressure", 1e-5, run.colours[name])
        elif np.isfinite(target := run.recording.columns.get(f"chamber/{name}/target", np.empty(0))).any():
            time, label = run.recording["time"], f"{theme.plain(name)}, asked for"
            axis.step(time, 1e-5 * target, color=run.colours[name], lw=0.8, ls=":", where="post", label=label)
    volumes(axis, run, over)
    axis.set_ylabel("gauge pressure\n[bar]")
    shade_stance(axis, run, over)


def valves(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """One lane per valve of a run, with a bar as high as its seat is open; grey those of no chamber."""
    run = runs[0]
    lanes = run.lanes
    for lane, (valve, chamber, alpha) in enumerate(lanes):
        x, opening = run.curves(f"valve/{valve}/opening", over)
        mean = opening.mean(axis=0)
        corners = np.unique(np.r_[0, np.flatnonzero(np.diff(mean)) + 1, len(mean) - 1])
        shut, look = lane + 0.4, {"color": run.colours.get(chamber, theme.GREY), "alpha": alpha, "lw": 0.0}
        axis.fill_between(x[corners], shut, shut - 0.8 * mean[corners], step="post", **look)
    axis.set_ylim(len(lanes) - 0.5, -0.5)
    names = [f"{c} {valve.removeprefix(f'{c}_')}" if c else valve for valve, c, _ in lanes]
    axis.set_yticks(range(len(lanes)), [theme.plain(name) for name in names], fontsize=8.0)
    axis.tick_params(axis="y", length=0.0)
    axis.set_ylabel("valves\nopen")


def forces(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Force of each muscle of a run, of a group once where its muscles coincide."""
    run = runs[0]
    for group in run.groups:
        for label, muscle, style in group_curves(run, group, "force"):
            x, values = run.curves(f"muscle/{muscle}/force", over)
            mean_and_spread(axis, values, run.colours[group], label, x, style, run.markers[group])
    axis.set_ylabel("muscle force\n[N]")
    shade_stance(axis, run, over)


def group_curves(run: RunView, group: str, *quantities: str) -> list[tuple[str, str, str]]:
    """[(label, muscle, line style)] to draw: one for the whole group where its muscles coincide."""
    count, name = run.recording.described["orthosis"]["muscle"][group]["count"], theme.plain(group)
    muscles = [f"{group}_{k}" for k in range(1, count + 1)]
    for quantity in quantities:
        values = np.array([run.recording[f"muscle/{muscle}/{quantity}"] for muscle in muscles])
        if np.ptp(values, axis=0).max() > _COINCIDENCE * np.abs(values).max():
            labels = [f"{name} {k}" for k in range(1, count + 1)]
            return list(zip(labels, muscles, itertools.cycle(theme.LINE_STYLES)))
    return [(name if count == 1 else f"{name} 1–{count}", muscles[0], "-")]


def shade_stance(axis: Axes, run: RunView, over: Over = "time") -> None:
    """A background band over the recorded stance; none without walking."""
    if not run.walks or over != "time":
        return
    stands, others = np.r_[False, run.stands, False], axis.figure.axes
    label = None if _STANCE in keys(others) else _STANCE
    time = np.r_[run.recording["time"], run.recording["time"][-1]]
    for start, end in np.flatnonzero(stands[1:] != stands[:-1]).reshape(-1, 2):
        axis.axvspan(time[start], time[end], color=theme.STANCE, alpha=0.10, lw=0.0, zorder=-1, label=label)
        label = None
    if run.first_solved is None:
        return
    whole, begins = axis.get_xaxis_transform(), time[run.first_solved]
    axis.vlines(begins, 0.0, 1.0, transform=whole, color="0.4", lw=0.6, zorder=1)
    if any(text.get_text() == _SETTLED for other in others for text in other.texts):
        return
    look = {"ha": "left", "va": "bottom", "rotation": 90, "fontsize": 8.0, "color": "0.3"}
    look |= {"zorder": 6, "bbox": {"facecolor": "white", "alpha": 0.85, "lw": 0.0, "pad": 0.6}}
    axis.annotate(_SETTLED, (begins, 0.0), xycoords=whole, xytext=(1, 2), textcoords="offset points", **look)


def keys(axes: Iterable[Axes]) -> JsonDict:
    """{name: what it is drawn as} of all panels, each name once."""
    found: JsonDict = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return found


def share_scale(axes: Sequence[Axes]) -> None:
    """One ordinate scale for panels in separate figures."""
    limits = [axis.get_ylim() for axis in axes]
    for axis in axes:
        axis.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))


def legend(figure: Figure, axes: Iterable[Axes], columns: int = 3) -> None:
    """One legend above all panels, or below those of a title, in as many columns as there is room for."""
    found, side = keys(axes), "lower" if figure.get_suptitle() else "upper"
    for count in range(columns, 0, -1) if found else ():
        drawn = figure.legend(list(found.values()), list(found), loc=f"outside {side} left", ncols=count)
        if count == 1 or drawn.get_window_extent().width <= figure.bbox.width:
            return
        drawn.remove()


def volumes(axis: Axes, run: RunView, over: Over) -> None:
    """Pressure in each volume of a run's air path, in thin lines."""
    free = theme.COLOURS[len(run.colours) :] or theme.COLOURS
    looks = itertools.cycle(zip(free, itertools.cycle(theme.LINE_STYLES[1:]), strict=False))
    for name, label in run.volumes.items():
        chamber = next((each for each in run.chambers if label.startswith(f"{each}, ")), None)
        colour, style = (run.colours[chamber], _VALVE_END) if chamber else next(looks)
        x, values = run.curves(f"volume/{name}/pressure", over)
        look = {"color": colour, "ls": style, "lw": _THIN, "label": theme.plain(label), "zorder": 4}
        axis.plot(x, 1e-5 * values.mean(axis=0), **look)


def has_flow(run: RunView) -> bool:
    """Whether a run has an air path with recorded flow."""
    return tells_flow(run) and any(name.startswith(_NETWORK) for name in run.recording.columns)


def tells_flow(run: RunView) -> bool:
    """Whether a run has the flow from its supply or to the ambient air."""
    return any(name in run.recording.columns for name in FLOWS)


def air_flow(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Flow from the supply and to the ambient air, as free air (ANR)."""
    run = runs[0]
    litres = PER_MINUTE / run.gas.free_density
    for name, (label, colour, style) in FLOWS.items():
        if name in run.recording.columns:
            x, values = run.curves(name, over)
            mean_and_spread(axis, litres * values, colour, label, x, style)
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
    axis.set_ylabel("air flow\n[l/min ANR]")


def source(axis: Axes, run: RunView, quantity: str) -> None:
    """Pressure, mass or temperature of what is in a run's bottle, cartridge or tank, over time."""
    time, values = run.curves(f"{run.source}/{quantity}", "time")
    scaled, label = {
        "pressure": (1e-5 * values, "gauge pressure\n[bar]"),
        "mass": (1e3 * values, "content\n[g]"),
        "temperature": (values - _ICE, "temperature\n[°C]"),
    }[quantity]
    mean_and_spread(axis, scaled, run.colour, run.name, time, run.style)
    axis.ticklabel_format(axis="y", useOffset=False)
    axis.set_ylabel(label)


def contractions(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Own contraction of each muscle of a run, dotted where it is slack; thin, that of its path."""
    run = runs[0]
    axis.axhline(0.0, color=theme.ZERO, lw=0.6, zorder=1)
    for group in run.groups:
        colour = run.colours[group]
        for label, muscle, _ in group_curves(run, group, "contraction", "path_length"):
            x, own = run.curves(f"muscle/{muscle}/contraction", over)
            _, force = run.curves(f"muscle/{muscle}/force", over)
            look = {"color": colour, "zorder": 3, **marked(x, run.markers[group])}
            _own(axis, x, 100.0 * own, force.max(axis=0) <= 0.0, label, look)
            path = run.path_contraction(group, muscle, over)
            axis.plot(x, 100.0 * path.mean(axis=0), color=colour, **_PATH)
    axis.plot([], [], color="0.4", ls=_SLACK, label="slack")
    axis.plot([], [], color="0.4", lw=_PATH["lw"], label="of its path")
    axis.set_ylabel("contraction\n[%]")
    shade_stance(axis, run, over)


def _own(
    axis: Axes, x: np.ndarray, values: np.ndarray, slack: np.ndarray, label: str, look: JsonDict
) -> None:
    """A muscle's curves, with a dotted mean where it is slack in every one of them."""
    if len(values) > 1:
        low, high = values.min(axis=0), values.max(axis=0)
        axis.fill_between(x, low, high, color=look["color"], alpha=0.25, lw=0.0, zorder=2)
    mean = values.mean(axis=0)
    if slack.all() or len(x) == 1:
        axis.plot(x, mean, ls=_SLACK, label=label, **look)
        return
    reach = slack.copy()  # up to the first taut row, so that no gap is seen
    reach[1:] |= slack[:-1]
    reach[:-1] |= slack[1:]
    axis.plot(x, np.where(slack, np.nan, mean), label=label, **look)
    axis.plot(x, np.where(reach, mean, np.nan), color=look["color"], ls=_SLACK, zorder=3)


def displacements(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """How far the cuff and the plate of a run give along the pull of the muscles."""
    _mountings(axis, runs[0], over, "displacement", 1e3)
    axis.set_ylabel("mounting gives\n[mm]")


def pulls(axis: Axes, runs: Sequence[RunView], over: Over = "time") -> None:
    """Pull of all muscles of a run on its cuff and on its plate."""
    _mountings(axis, runs[0], over, "force", 1.0)
    axis.set_ylabel("pull on the\nmounting [N]")


def _mountings(axis: Axes, run: RunView, over: Over, quantity: str, factor: float) -> None:
    for anchor, style in zip(run.anchors, itertools.cycle(theme.LINE_STYLES)):
        x, values = run.curves(f"cuff/{anchor}/{quantity}", over)
        mean_and_spread(axis, factor * values, theme.MOUNTINGS[WORN[anchor]], WORN[anchor], x, style)
    shade_stance(axis, run, over)
