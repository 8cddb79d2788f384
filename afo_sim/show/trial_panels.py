"""Panels on a walking trial: its strides, its plates, and its ways from above."""

from typing import Any

import numpy as np

from afo_sim.gait_lab.trial.importing import Imported
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.understood import direction
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame
from afo_sim.show.style import COLOURS, LINE, plain

SAME = 0.005  # apart, two instants are one event [s]
ASIDE = 0.3  # shown before and after the motion [s]
BROAD = 4.0  # least length of the view from above over its height
BESIDE = 0.25  # shown beside the ways, seen from above [m]
FEW = 10  # strides or contacts of both sides that are numbered one by one
OTHER = "0.55"  # grey of what was not taken
EVENTS = (  # name, marker, whether it is filled
    ("heel strike by force", "v", True),
    ("by kinematics", "v", False),
    ("toe-off by force", "^", True),
    ("by kinematics", "^", False),
)


def draw_trial(figure: Any, imported: Imported) -> None:
    """Strides and forces over time with one legend above them, and below the ways from above."""
    from matplotlib.lines import Line2D

    events, plates, above = figure.subplots(3, 1, height_ratios=[0.3 * len(imported.legs), 1.0, 0.9])
    events.sharex(plates)
    plates.set_xlim(*_looked_at(imported))
    _events(events, imported)
    _plates(plates, imported)
    _from_above(above, imported)
    marks = [
        Line2D([], [], ls="", marker=m, ms=5.0, color="black", mfc="black" if filled else "white", label=name)
        for name, m, filled in EVENTS
    ]
    lines, _ = plates.get_legend_handles_labels()
    lines += [line for line in above.lines if line.get_label() == "pelvis"]
    figure.legend(handles=[*marks, *lines], loc="outside upper left", ncols=4)


def _looked_at(imported: Imported) -> tuple[float, float]:
    """From when to when motion or strides last [s], a little wider; plates may have been on for longer."""
    times = [time for leg in imported.legs.values() for time in (leg.time[0], leg.time[-1])]
    times += [t for s in imported.strides if s.closed is None for t in (s.start, s.end)]
    return min(times) - ASIDE, max(times) + ASIDE


def _events(axis: Any, imported: Imported) -> None:
    """Strides of both sides as bars with their events; the part that was bridged is dotted."""
    sides = [imported.cycle.side, *(s for s in imported.legs if s != imported.cycle.side)]
    numbered = len(imported.strides) <= FEW
    counts = dict.fromkeys(sides, 0)
    for index, stride in enumerate(imported.strides):
        level = -float(sides.index(stride.side))
        counts[stride.side] += 1
        taken = index in imported.chosen
        look = {"color": "black" if taken else OTHER, "lw": 2.2 if taken else 1.0, "solid_capstyle": "butt"}
        start, end = stride.start, stride.end
        if stride.closed is not None:
            start, end = stride.closed.window
            axis.plot([end, end + stride.closed.gap], [level] * 2, ls=":", **look)
        axis.plot([start, end], [level] * 2, **look)
        _mark(axis, imported, stride, level)
        if numbered or (taken and len(imported.chosen) == 1):
            words = f"{counts[stride.side]}" + ", taken" * taken
            at = _clear(start, end, [time for time, _, _ in _marks(stride)])
            box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
            axis.text(at, level, words, ha="center", va="center", fontsize=7.5, color=look["color"], bbox=box)
    axis.set_yticks([-float(k) for k in range(len(sides))], sides)
    axis.set_ylim(-len(sides) + 0.4, 0.6)
    axis.tick_params(axis="y", length=0)
    axis.tick_params(axis="x", labelbottom=False, length=0)
    for edge in ("left", "bottom"):
        axis.spines[edge].set_visible(False)


def _marks(stride: RecordedStride) -> list[tuple[float, str, bool]]:
    """Heel strikes and toe-off of a stride [s]: time, marker, whether it is a heel strike.

    Those of a closed stride stand where they were recorded, which may be a period before or after.
    """
    if stride.closed is None:
        return [(stride.start, "v", True), (stride.end, "v", True), (stride.toe_off, "^", False)]
    first = stride.closed.window[0]
    strike, off = (first + (time - first) % stride.time for time in (stride.start, stride.toe_off))
    return [(strike, "v", True), (off, "^", False)]


def _clear(start: float, end: float, times: list[float]) -> float:
    """A place for a label within a bar, far from its marks [s]."""
    places = np.linspace(start, end, 11)[2:-2]
    return float(max(places, key=lambda place: min(abs(place - time) for time in times)))


def _mark(axis: Any, imported: Imported, stride: RecordedStride, level: float) -> None:
    """Heel strikes and toe-off of a stride: filled where the force begins or ends, open by kinematics."""
    ground = imported.grounds.get(stride.side)
    contacts = () if ground is None else ground.contacts
    size = 5.0 if len(imported.strides) <= FEW else 3.0
    for time, marker, lands in _marks(stride):
        forced = any(_apart(time, c.start if lands else c.end, stride) < SAME for c in contacts)
        filling = "black" if forced else "white"
        axis.plot(time, level, marker, ms=size, color="black", mfc=filling, mew=0.16 * size, zorder=3)


def _apart(time: float, other: float, stride: RecordedStride) -> float:
    """How far two instants are apart [s]; of a closed stride in its period."""
    if stride.closed is None:
        return abs(time - other)
    return abs((time - other + 0.5 * stride.time) % stride.time - 0.5 * stride.time)


def _plates(axis: Any, imported: Imported) -> None:
    """Upward force of every plate, and over it whose foot it was."""
    shown = {name: series for ground in imported.grounds.values() for name, series in ground.plates.items()}
    contacts = [contact for ground in imported.grounds.values() for contact in ground.contacts]
    for name, (time, force) in shown.items():
        axis.plot(time, force, color="0.7", lw=0.8)
        first = next((c for c in contacts if c.plate == name), None)
        if first is not None and len(contacts) <= FEW:
            inside = (time >= first.start) & (time <= first.end)
            place = {"xytext": (0, 3), "textcoords": "offset points", "ha": "center"}
            peak = 0.5 * (first.start + first.end), force[inside].max()
            words = f"plate {name}" if len(name) < 5 else name
            axis.annotate(plain(words, 18), peak, fontsize=7.5, **place)
    for side, ground in imported.grounds.items():
        label: str | None = f"{side} foot"
        for contact in ground.contacts:
            time, force = ground.plates[contact.plate]
            on = (time >= contact.start) & (time <= contact.end)
            axis.plot(time[on], force[on], lw=1.3, label=label, **_look(imported, side))
            label = None
    axis.plot([], [], color="0.7", lw=0.8, label="not assigned")
    top = max((float(force.max()) for _, force in shown.values()), default=1.0)
    axis.set_ylim(top=1.25 * top)
    axis.set_ylabel("upward\nforce [N]")
    axis.set_xlabel("time in the trial [s]")


def _from_above(axis: Any, imported: Imported) -> None:
    """The ways of pelvis and ankles seen from above, the plates under them, and where forward is."""
    from matplotlib.ticker import MaxNLocator

    frame = imported.frame
    ways = {f"{side} ankle": leg.points["ankle"].path for side, leg in imported.legs.items()}
    pelvis = next((leg.pelvis for leg in imported.legs.values() if leg.pelvis is not None), None)
    looks: dict[str, dict[str, Any]] = {f"{side} ankle": _look(imported, side) for side in imported.legs}
    if pelvis is not None:
        ways["pelvis"], looks["pelvis"] = pelvis, {"color": OTHER, "ls": ":"}
    seen = []
    for name, path in ways.items():
        ahead, left = frame.plane(path)[:, 0], -frame.across(path)
        axis.plot(ahead, left, lw=1.0, label=name, **looks[name])
        seen.append(np.column_stack([ahead, left]))
    around = np.concatenate(seen)
    low, high = np.nanmin(around, axis=0) - BESIDE, np.nanmax(around, axis=0) + BESIDE
    axis.set_aspect("equal", adjustable="box", anchor="W")
    wider = max(0.0, BROAD * (high[1] - low[1]) - (high[0] - low[0]))  # a walk on a belt stays in place
    axis.set_xlim(low[0] - 0.5 * wider, high[0] + 0.5 * wider)
    axis.set_ylim(low[1], high[1])
    for plate in imported.trial.plates:
        if plate.corners is not None:
            _plate_from_above(axis, imported.frame, plate.name, plate.corners)
    axis.set_title(f"→ {plain(direction(frame), LINE)}", loc="left", fontsize=8.0)
    axis.yaxis.set_major_locator(MaxNLocator(2, steps=[1, 5, 10], min_n_ticks=1))
    axis.set_xlabel("forward in the laboratory, seen from above [m]", loc="left")
    axis.set_ylabel("to the\nleft [m]")


def _plate_from_above(axis: Any, frame: WalkingFrame, name: str, corners: np.ndarray) -> None:
    """A plate's outline as far as it is in view, and its name at the view's edge, where nobody walks."""
    around = corners[[0, 1, 2, 3, 0]]
    ahead, left = frame.plane(around)[:, 0], -frame.across(around)
    axis.plot(ahead, left, color="0.75", lw=0.8, zorder=1)
    middle = float(np.mean(ahead[:4]))
    low, high = axis.get_xlim()
    bottom, top = axis.get_ylim()
    if low < middle < high and left.min() < top and left.max() > bottom:
        place = {"ha": "center", "va": "bottom", "fontsize": 7.0, "color": "0.4"}
        axis.text(middle, bottom + 0.01, plain(name, 18), **place)


def _look(imported: Imported, side: str) -> dict[str, Any]:
    """The taken leg is drawn black, the other one in blue dashes."""
    if side == imported.cycle.side:
        return {"color": "black", "ls": "-"}
    return {"color": COLOURS[1], "ls": (0, (4, 1.5))}
